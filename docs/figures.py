"""Make the pictures of README and docs anew: `make figures`, `make gallery`, `make validation`, minutes on two cores.

python docs/figures.py            the pictures of README.md and docs/look.md, and the plot of docs/method.md
python docs/figures.py name ...   some of them: names of SHOTS, foam, film-obstacle
python docs/figures.py gallery    docs/gallery.md with a picture of every bundled scene
python docs/figures.py validation [case ...]
                                  validation/: a picture of every case of `wavetank validate`, or of these, and a table
"""

import dataclasses
import json
import shutil
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

import wavetank as wt
from wavetank.run.still import SHOWN_AT, USUAL_TIME
from wavetank.lab.cases import CASES
from wavetank.lab.converge import converge
from wavetank.lab.validate import bounds_text, number_text, validate
from wavetank.view.camera import Camera
from wavetank.view.extent import extent_of_water
from wavetank.view.renderer import Renderer
from wavetank.view.style import quality_options

DOCS = Path(__file__).parent
VALIDATION = DOCS.parent / "validation"
#: name -> eye of the gallery's picture, and what it looks at [m], where the usual one looks at a wall, or from afar
SEEN_FROM: dict[str, tuple[tuple[float, ...], ...]] = {
    "ducks": ((0.9, 1.5, 1.5),),
    "mountain-lake": ((3.9, 3.7, 2.6), (1.75, 0.35, 0.0)),
    "still-tank": ((1.9, 1.0, 1.5),),
    "vase": ((1.5, 1.3, 2.15), (0.08, 0.44, 0.0)),
}
LARGEST = 80_000  # bytes of a picture there
VALIDATION_HEAD = """# Validation

Computed values beside measurements and exact solutions: full runs of `wavetank validate`, default settings, on the
CPU in single precision. Values in bold are outside their bounds ([why](../docs/method.md#what-is-still-open)); all
digits are in [figures.json](figures.json). `make validation` runs the cases and writes this page.

"""
UNDER_WATER = Camera(eye=(0.12, 0.07, 0.78), target=(0.6, 0.36, 0.4), field_of_view=1.65)
#: name -> scene, time [s], options of the picture
SHOTS: dict[str, tuple[wt.Scene, float, dict[str, Any]]] = {
    "obstacle-tank": (wt.Scene.load("obstacle-tank").changed(spacing=0.02), 0.62, {}),
    "obstacle-tank-particles": (wt.Scene.load("obstacle-tank"), 0.55, {"view": "particles"}),
    "obstacle-tank-slice": (wt.Scene.load("obstacle-tank"), 0.55, {"view": "slice"}),
    "double-dam-2d": (wt.Scene.load("double-dam-2d").changed(spacing=0.008), 0.45, {}),
    "drop": (wt.Scene.load("drop").changed(spacing=0.02), 0.42, {}),
    "below": (wt.Scene.load("drop").changed(spacing=0.025), 0.9, {"camera": UNDER_WATER}),
    "still-tank": (wt.Scene.load("still-tank"), 1.0, {}),
    "oil-and-water": (wt.Scene.load("oil-and-water"), 0.9, {}),
    "lock-exchange": (wt.Scene.load("lock-exchange"), 1.2, {}),
    "honey": (wt.Scene.load("honey"), 0.5, {}),
    "weightless-drop": (wt.Scene.load("weightless-drop"), 0.5, {}),
}
WHOLE_LAYERS = {"still-tank": 0.025, "still-tank-2d": 0.01}  # m: with others there is a gap, and the water sloshes
#: samples of those whose metal, glass and honey only paths of light show
TRACED = {"honey": 32, "jug": 32, "rain": 32, "vase": 32}
#: the finest spacing of a picture of the gallery, in m per m of the tank's diagonal, and of scenes that need finer ones
GALLERY_SPACING = {2: 0.005, 3: 0.0125}
FINER = {"honey": 0.0012, "mountain-lake": 0.022}  # m
#: The report's Figure 1, without and with foam, and what the diffuse particles make of the same moment.
FOAM_LOOKS = ((0.0, "#2482d0"), (0.0, "foam"), (1.0, "#2482d0"))


def foam_figures() -> None:
    """Write the pictures of docs/foam.md."""
    pictures = []
    for amount, colors in FOAM_LOOKS:
        sim = wt.Simulation(wt.Scene.load("obstacle-tank").changed(spacing=0.02, foam=amount))
        sim.advance(0.85)
        pictures.append(Renderer(640, 480, supersample=2).render(sim.frame(), color_by=colors, legend=False))
    Image.fromarray(np.hstack(pictures)).save(DOCS / "foam-rule.jpg", quality=88, optimize=True)
    sim = wt.Simulation(wt.Scene.load("dam-break").changed(spacing=0.018))
    sim.advance(1.35)
    image = Renderer(1280, 720, supersample=2).render(sim.frame())
    Image.fromarray(image).save(DOCS / "foam.jpg", quality=88, optimize=True)


def film_figure() -> None:
    """Write the picture of docs/look.md that has one wave above as a picture of two by two samples, below as film."""
    sim = wt.Simulation(wt.Scene.load("obstacle-tank"))
    sim.advance(0.6)
    pictures = []
    for quality, samples in (("standard", None), ("film", 24)):
        supersample, chosen = quality_options(quality, samples)
        pictures.append(Renderer(640, 360, supersample).render(sim.frame(), legend=False, **chosen))
    Image.fromarray(np.vstack(pictures)).save(DOCS / "look" / "film-obstacle.jpg", quality=88, optimize=True)


def picture(sim: wt.Simulation, path: Path, width: int, height: int, quality: str = "high", **options: Any) -> None:
    """Write a JPG of a world."""
    supersample, chosen = quality_options(quality, options.pop("samples", None))
    renderer = Renderer(width, height, supersample)
    frame = sim.frame()
    camera = options.pop("camera", None) or Camera.framing_extent(extent_of_water(frame), width / height)
    image = renderer.render(frame, camera, legend="view" in options, **chosen, **options)
    Image.fromarray(image).save(path, quality=86, optimize=True, progressive=True)


def figures(names: list[str]) -> None:
    """Write the pictures of README and docs, or those of these names alone."""
    for name in names or SHOTS:
        if name in ("foam", "film-obstacle"):
            foam_figures() if name == "foam" else film_figure()
            continue
        scene, moment, options = SHOTS[name]
        sim = wt.Simulation(scene)
        sim.advance(moment)
        picture(sim, DOCS / f"{name}.jpg", 1280, 720, "standard" if options else "high", **options)
        if name == "drop":
            picture(sim, DOCS / "drop-draft.jpg", 1280, 720, "draft")
    if names:
        return
    foam_figures()
    film_figure()
    with tempfile.TemporaryDirectory() as folder:
        converge(wt.Scene.load("obstacle-tank"), Path(folder), seconds=2.0)
        shutil.copy(Path(folder) / "converge.png", DOCS / "converge.png")


def gallery(names: list[str]) -> None:
    """Write a picture of every bundled scene, or of these alone, and the page that shows all."""
    folder = DOCS / "gallery"
    folder.mkdir(exist_ok=True)
    rows = []
    for name in wt.bundled_scenes():
        scene = wt.Scene.load(name)
        size = sum(edge**2 for edge in scene.tank.size) ** 0.5 if scene.tank else 1.0
        fine = {**WHOLE_LAYERS, **FINER}.get(name, round(GALLERY_SPACING[scene.dim] * size, 4))
        scene = scene.changed(spacing=min(scene.spacing, fine))
        moment, count = SHOWN_AT.get(name, USUAL_TIME), len(scene.particles()[0])
        # What is in the way of fluids is known to a simulation.
        if name in TRACED or any(fluid.shape == "filled" for fluid in scene.fluids):
            count = wt.Simulation(scene).count
        if name in names or not names:
            sim = wt.Simulation(scene)
            sim.advance(moment)
            usual = Camera.framing_extent(extent_of_water(sim.frame()), 16 / 9)
            camera = dataclasses.replace(usual, **dict(zip(("eye", "target"), SEEN_FROM.get(name, ()), strict=False)))
            how = {"quality": "film", "samples": TRACED[name]} if name in TRACED else {}
            picture(sim, folder / f"{name}.jpg", 960, 540, camera=camera, **how)
            print(name, count, flush=True)
        seen = zip(("eye", "target"), SEEN_FROM.get(name, ()), strict=False)
        eye = "".join(f" --{key} {','.join(map(str, point))}" for key, point in seen)
        quality = f"film --samples {TRACED[name]}" if name in TRACED else "high"
        rows.append(
            f"## {scene.title}\n\n![{name}](gallery/{name}.jpg)\n\n"
            f"`wavetank render {name} --at {moment:g} --set spacing={scene.spacing:g}{eye} --quality {quality}`"
            f" ({count:,} particles)\n"
        )
    head = "# Gallery\n\nEvery bundled scene, drawn by the command below its picture; made by `make gallery`.\n\n"
    (DOCS / "gallery.md").write_text(head + "\n".join(rows), encoding="utf-8")


def validation(names: list[str]) -> None:
    """Run every case of `wavetank validate`, or these alone, and write the table of all that were ever run."""
    VALIDATION.mkdir(exist_ok=True)
    file = VALIDATION / "figures.json"
    known = json.loads(file.read_text("utf-8")) if file.exists() else {}
    for name in names or [case.name for case in CASES if not case.is_long]:
        with tempfile.TemporaryDirectory() as folder:
            known |= validate([name], out=Path(folder))["cases"]
            shrink(Path(folder) / name / f"{name}.png", VALIDATION / f"{name}.png")
        known[name].pop("seconds_of_machine")
        file.write_text(json.dumps(known, indent=1) + "\n", encoding="utf-8")
        validation_page(known)
        print(name, flush=True)


def validation_page(known: dict[str, Any]) -> None:
    """Write the figures of these results of cases, and their pictures."""
    sections = []
    for name in (case.name for case in CASES if case.name in known):
        figures = known[name]["figures"]
        sources = "; ".join(dict.fromkeys(figure["source"] for figure in figures if figure["source"]))
        picture = f"![{known[name]['title']}]({name}.png)"
        command = f"`wavetank validate {name} --out out`; compared with: {sources}"
        tables = "\n\n".join(map("\n".join, tables_of(figures)))
        sections.append(f"## {name}\n\n{picture}\n\n{command}\n\n{tables}\n")
    (VALIDATION / "README.md").write_text(VALIDATION_HEAD + "\n".join(sections), "utf-8")


def tables_of(figures: list[dict[str, Any]]) -> list[list[str]]:
    """Return the lines of the tables of a case: figures that many worlds share are columns, a world is a row."""
    shared: dict[tuple[str, str, str], dict[str, str]] = {}
    for figure in figures:
        world, _, what = figure["name"].rpartition(": ")
        if world:
            shared.setdefault((what, figure["unit"], bounds_text(figure)), {})[world] = marked(
                figure, number_text(figure["value"], "")
            )
    columns = {key: cells for key, cells in shared.items() if len(cells) >= 3}
    tables = []
    for worlds in dict.fromkeys(tuple(cells) for cells in columns.values()):
        alike = [(key, cells) for key, cells in columns.items() if tuple(cells) == worlds]
        heads = [
            " ".join(filter(None, (what, f"[{unit}]" * bool(unit), f"({limits})" * bool(limits))))
            for (what, unit, limits), _ in alike
        ]
        tables.append(table(["", *heads], [[world, *(cells[world] for _, cells in alike)] for world in worlds]))
    single = [
        [
            figure["name"],
            marked(figure, number_text(figure["value"], figure["unit"])),
            bounds_text(figure),
            figure["reference"],
        ]
        for figure in figures
        if (figure["name"].rpartition(": ")[2], figure["unit"], bounds_text(figure)) not in columns
    ]
    return tables + ([table(["figure", "value", "bounds", "reference"], single)] if single else [])


def marked(figure: dict[str, Any], text: str) -> str:
    """Return a value in bold where it is outside its bounds."""
    return f"**{text}**" if figure["pass"] is False else text


def table(heads: list[str], rows: list[list[str]]) -> list[str]:
    """Return the lines of a table in Markdown, without columns that are empty."""
    kept = [k for k in range(len(heads)) if any(row[k] for row in rows)]
    lines = [[heads[k] for k in kept], ["---"] * len(kept), *([row[k] for k in kept] for row in rows)]
    return ["|" + "|".join(cell.replace("|", "\\|") for cell in line) + "|" for line in lines]


def shrink(source: Path, target: Path) -> None:
    """Write a plot with as many colours as fit into `LARGEST` bytes."""
    image = Image.open(source).convert("RGB")
    for colors in (256, 96, 48, 24):  # fewer than that, and thin lines lose theirs
        image.quantize(colors, dither=Image.Dither.NONE).save(target, optimize=True)
        if target.stat().st_size <= LARGEST:
            return


if __name__ == "__main__":
    pages = {"gallery": gallery, "validation": validation}
    page = pages.get(sys.argv[1]) if sys.argv[1:] else None
    page(sys.argv[2:]) if page else figures(sys.argv[1:])

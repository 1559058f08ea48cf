"""A film of a scene, with its camera and its slow motion; frames that are there are kept, so that it can be stopped.

While a film is made its frames lie in a folder beside it, named after it, with the state of the water at the last of
them: a film that was stopped goes on there, to the same bits.
"""

import hashlib
import json
import math
import shutil
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from wavetank.device.compiler import start
from wavetank.formats import exporter_for
from wavetank.formats.png import write_png
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.replacing import make_folder, replacing
from wavetank.foundation.version import VERSION
from wavetank.run.signals import Asked, asked_to_end
from wavetank.scene.film import Film
from wavetank.scene.scene import Scene
from wavetank.simulation.simulation import Simulation
from wavetank.view.camera import Camera
from wavetank.view.film.samples import Watch
from wavetank.view.renderer import ROOM, Renderer, affordable
from wavetank.view.style import quality_options

FRAMES = ".frames"  # what the folder's name ends in
STATE, ABOUT = "state.npz", "film.json"
KEEP_EVERY = 8  # frames between two states of the water


def film_scene(
    scene: Scene, path: Path, *, arch: str = "cpu", console: Console | None = None, keep: bool = False, **changes: Any
) -> dict[str, Any]:
    """Simulate `scene`, write its film to `path` and return what it shows.

    `changes` take the place of what the scene's film says, or of its light; None changes nothing. With `keep` the
    frames stay beside the film. Raises `WavetankError`.
    """
    writer = exporter_for(path, "video")
    look = {name: changes.pop(name, None) for name in ("environment", "sun", "floor")}
    table = (scene.film or Film()).model_dump(exclude_unset=True)
    chosen = {name: value for name, value in changes.items() if value is not None}
    over_time = {name: plain for name, plain in table.pop("over_time", {}).items() if name not in chosen}
    table |= chosen | ({"over_time": over_time} if over_time else {})
    order: Film = Film.parse(table, "film")
    if scene.dim == 2 and (order.eye or order.target):
        raise WavetankError("film: eye and target are for worlds in space; a 2-D world is seen from the front.")
    if not path.absolute().parent.is_dir():
        raise WavetankError(f"{str(path)!r} cannot be written: there is no folder {str(path.parent)!r}.")
    supersample, style = quality_options(order.quality, order.samples)
    start(arch)
    renderer = Renderer(*order.size, affordable(*order.size, supersample))
    folder = make_folder(path.with_name(path.name + FRAMES))
    _begin(folder, scene, order, look)
    with asked_to_end(say="asked to end; what is there is being kept (once more stops at once)") as asked:
        done = _frames(scene, order, folder, renderer, {**style, **look}, (arch, asked, console))
    figures = {
        "file": str(path),
        "scene": scene.title,
        "frames": len(done),
        "of": order.frames,
        "fps": order.fps,
        "rendered": sum(done),
        "interrupted": len(done) < order.frames,
        "exit_code": asked.code,
    }
    if figures["interrupted"]:
        return figures | {"file": str(folder)}
    with writer.write(path, *order.size, order.fps) as out:
        for number in range(order.frames):
            out.write(np.asarray(Image.open(_name(folder, number)).convert("RGB")))
    if not keep:
        shutil.rmtree(folder)
    return figures


def camera_at(order: Film, scene: Scene, time: float, water: float) -> Camera:
    """Return the camera at a time of the film [s], when the water is at `water` [s]."""
    now, aspect = order.at(time), order.size[0] / order.size[1]
    usual = Camera.framing(scene, aspect)
    if scene.dim == 2:
        return usual
    camera = Camera(
        eye=now.eye or usual.eye,
        target=now.target or usual.target,
        field_of_view=math.radians(now.field_of_view),
        near=usual.near,
    )
    return camera.tilted(scene, water, 1.0 if now.eye else ROOM)


def _name(folder: Path, number: int) -> Path:
    return folder / f"frame-{number:05d}.png"


def _begin(folder: Path, scene: Scene, order: Film, look: dict[str, Any]) -> None:
    """Empty a folder that holds frames of another film."""
    plain = json.dumps([VERSION, scene.text(), order.model_dump(mode="json"), look], sort_keys=True, default=str)
    key = hashlib.sha256(plain.encode()).hexdigest()
    about = folder / ABOUT
    try:
        same = json.loads(about.read_text("utf-8"))["key"] == key
    except (OSError, ValueError, KeyError, TypeError):
        same = False
    if same:
        return
    for entry in folder.iterdir():
        if entry.name.startswith("frame-") or entry.name in (STATE, ABOUT):
            entry.unlink()
    with replacing(about) as partial:
        partial.write_text(json.dumps({"wavetank": VERSION, "key": key}) + "\n", encoding="utf-8")


def _frames(
    scene: Scene,
    order: Film,
    folder: Path,
    renderer: Renderer,
    style: dict[str, Any],
    how: tuple[str, Asked, Console | None],
) -> list[bool]:
    """Make the frames that are not there, and say for every one that is there whether it was made now."""
    arch, asked, console = how
    times, done = order.times(), []
    there = [_name(folder, number).exists() for number in range(order.frames)]
    missing = there.index(False) if False in there else order.frames
    if missing == order.frames:
        return [False] * order.frames
    sim, at = _water(scene, folder, arch, times, missing)
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.fields[frame]}"),
        TimeElapsedColumn(),
        TimeRemainingColumn(elapsed_when_finished=True),
    )
    with Progress(*columns, console=console or Console(stderr=True), transient=True) as bar:
        each = style["samples"] if style["traced"] else 1
        task = bar.add_task("film", total=each * (order.frames - sum(there)), frame="")
        made = 0
        for number in range(order.frames):
            if there[number]:
                done.append(False)
                continue
            while at < number:
                at += 1
                sim.advance(max(0.0, times[at] - (times[at - 1] if at else 0.0)))
                if at == number and number % KEEP_EVERY == 0:
                    _store(sim, folder, number)
                if asked:
                    break
            if asked:
                _store(sim, folder, at)
                break
            now = order.at(number / order.fps)
            camera = camera_at(order, scene, number / order.fps, sim.time)
            watch = Watch(path=folder / f"frame-{number:05d}.samples.npz" if style["traced"] else None)

            def tell(samples: int, of: int, before: int = made, number: int = number) -> bool:
                bar.update(task, completed=before + samples, frame=f"frame {number + 1} of {order.frames}")
                return not asked

            watch.tell = tell
            options = style | {"shutter": now.shutter * now.speed / order.fps, "edges": order.edges}
            if style["traced"]:
                options |= {"aperture": now.aperture, "focus": now.focus or camera.distance}
            image = renderer.render(sim.frame(), camera, watch=watch, legend=False, **options)
            if not watch.whole:
                _store(sim, folder, number)
                break
            write_png(_name(folder, number), image)
            made += each
            bar.update(task, completed=made, frame=f"frame {number + 1} of {order.frames}")
            done.append(True)
            if asked and number + 1 < order.frames:
                _store(sim, folder, number)
                break
    return done


def _store(sim: Simulation, folder: Path, number: int) -> None:
    """Keep the water of a frame."""
    state = folder / STATE
    sim.save(state)
    with replacing(folder / ABOUT) as partial:
        about = json.loads((folder / ABOUT).read_text("utf-8"))
        size = hashlib.sha256(state.read_bytes()).hexdigest()
        partial.write_text(json.dumps(about | {"state": number, "sha256": size}) + "\n", encoding="utf-8")


def _water(scene: Scene, folder: Path, arch: str, times: list[float], wanted: int) -> tuple[Simulation, int]:
    """Return the water at a frame not behind `wanted`, and that frame's number; -1 where it has not begun."""
    state = folder / STATE
    try:
        about = json.loads((folder / ABOUT).read_text("utf-8"))
        number, good = int(about["state"]), hashlib.sha256(state.read_bytes()).hexdigest() == about["sha256"]
        if good and 0 <= number <= wanted:
            return Simulation.restore(state, arch=arch), number
    except (OSError, ValueError, KeyError, TypeError):
        pass
    return Simulation(scene, arch=arch), -1

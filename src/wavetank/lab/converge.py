"""The report's Figures 2 and 3: largest and mean density over solver iterations and along the run.

The scene is taken into the report's own units, in which rho_0 = 3 and m = 1 and therefore d = 0.682 and h = 1.1, and is
run with the preset `paper`, at 1/60 s a step, and with the default of this package, whose frame time is stretched by
the root of the scale so that the flow keeps the pace it has at the scene's own size. The report takes two to three
times as many steps; both are shown along the time of the scene's own size.
"""

import csv
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rich.console import Console

from wavetank.foundation.atomic_write import make_folder
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.params import PAPER_SPACING
from wavetank.lab.plots import BLUE, RED, pyplot, tidy
from wavetank.scene.scene import Scene
from wavetank.simulation.simulation import Simulation

REST_DENSITY = 3.0
PRESETS = {"paper": "report, Table 1", "standard": "wavetank, default"}

Row = dict[str, float | int | str]


def converge(
    scene: Scene,
    out: Path,
    *,
    seconds: float = 2.0,
    iterations: int = 20,
    arch: str = "cpu",
    console: Console | None = None,
) -> dict[str, Any]:
    """Run the study, write `converge.csv`, `converge-steps.csv` and `converge.png` into `out`, return the last figures.

    `seconds` of water are counted at the scene's own size; a longer world of the same gravity moves slower by the root
    of the scale, and is run for that much longer.
    """
    if not 0.0 < seconds <= 60.0:
        raise WavetankError(f"--seconds = {seconds} is not allowed; it must be a number above 0, at most 60.")
    if not 1 <= iterations <= 100:
        raise WavetankError(f"--iterations = {iterations} is not allowed; it must be a whole number from 1 to 100.")
    plt = pyplot()
    make_folder(out)
    say: Callable[[str], None] = console.print if console is not None else lambda text: None
    within: list[Row] = []
    along: list[Row] = []
    for preset in PRESETS:
        world = in_report_units(scene, preset)
        say(f"{preset}: {len(world.particles()[0]):,} particles, {seconds:g} s of water")
        sim = Simulation(world, arch)
        along += over_steps(sim, seconds, scale(scene) ** 0.5, preset)
        within += over_iterations(world, 0.35 * scale(scene) ** 0.5, iterations, preset, arch)
    files = [out / "converge.csv", out / "converge-steps.csv", out / "converge.png"]
    _write(files[0], within)
    _write(files[1], along)
    _plot(plt, files[2], within, along, scene.title)
    return {
        "files": [str(path) for path in files],
        "within_a_step": {preset: [row for row in within if row["preset"] == preset][-1] for preset in PRESETS},
        "after_the_last_step": {preset: [row for row in along if row["preset"] == preset][-1] for preset in PRESETS},
    }


def scale(scene: Scene) -> float:
    """Factor from the scene's lengths to the report's."""
    return PAPER_SPACING / scene.spacing


def in_report_units(scene: Scene, preset: str) -> Scene:
    """Return the scene with d = 0.682 and rho_0 = 3; the default keeps the flow's pace per frame."""
    frame_time = 1 / 60 if preset == "paper" else min(1.0, scene.frame_time * scale(scene) ** 0.5)
    return scene.scaled(scale(scene)).changed(preset=preset, rest_density=REST_DENSITY, frame_time=frame_time)


def over_steps(sim: Simulation, seconds: float, slower: float, preset: str) -> list[Row]:
    """Measure the densities after every frame until `seconds` have passed, in a world that is so much `slower`."""
    rows, step = [_row(sim, preset, step=0, time=0.0)], 0
    while sim.time < seconds * slower:
        sim.step()
        step += sim.time_steps
        rows.append(_row(sim, preset, step=step, time=sim.time / slower))
    return rows


def over_iterations(scene: Scene, start: float, most: int, preset: str, arch: str) -> list[Row]:
    """Measure the densities after one time step with 1, 2, ... `most` iterations, each from the same moment."""
    sim = Simulation(scene, arch)
    sim.advance(start)
    dt = scene.frame_time / scene.substeps
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        moment = Path(folder) / "moment.npz"
        sim.save(moment)
        for number in range(1, most + 1):
            again = Simulation.restore(moment, arch)
            again.substeps = 1
            again.iterations = number
            again.advance(dt)
            rows.append(_row(again, preset, iteration=number))
    return rows


def _row(sim: Simulation, preset: str, **place: float) -> Row:
    stats = sim.stats()
    return {
        "preset": preset,
        **place,
        "density_max": stats["density_max"],
        "density_mean": stats["density_mean"],
        "error_mean": stats["density_error_mean"],
        "error_p99": stats["density_error_p99"],
    }


def _write(path: Path, rows: list[Row]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


def _plot(plt: Any, path: Path, within: list[Row], along: list[Row], title: str) -> None:
    figure, axes = plt.subplots(2, 2, figsize=(10, 6.2), sharex="col", layout="constrained")
    colors = {"paper": RED, "standard": BLUE}
    for column, (rows, place, label) in enumerate(
        ((within, "iteration", "iterations in one time step"), (along, "time", "time at the scene's own size [s]"))
    ):
        for line, (key, name) in enumerate((("density_max", "largest density"), ("density_mean", "mean density"))):
            axis = axes[line, column]
            axis.axhline(REST_DENSITY, color="0.3", linewidth=0.8, linestyle=(0, (4, 3)))
            for preset, legend in PRESETS.items():
                own = [row for row in rows if row["preset"] == preset]
                axis.plot([r[place] for r in own], [r[key] for r in own], color=colors[preset], label=legend, lw=1.6)
            axis.set_ylabel(name)
            axis.xaxis.get_major_locator().set_params(integer=place == "iteration")
            tidy(axis)
        axes[1, column].set_xlabel(label)
    axes[0, 0].set_title("Within one time step, in mid-fall", fontsize=10)
    axes[0, 1].set_title("Along the run", fontsize=10)
    axes[0, 1].legend(frameon=False, fontsize=9)
    figure.suptitle(f"{title}: densities for a rest density of 3 (dashed)", fontsize=12)
    figure.savefig(path, dpi=110)
    plt.close(figure)

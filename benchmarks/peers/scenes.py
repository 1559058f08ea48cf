"""Scenes of SPlisHSPlasH as they are, by it and, imported, by us: pictures side by side, and the height of the water.

Both start from one file with its own spacing and run for the same time; where bodies go and how high the water is
should agree until it breaks, which is chaotic, and again where it has settled.
"""

import dataclasses
import json
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rich.table import Table

import wavetank
from benchmarks.peers.environment import PACKAGE, splishsplash_python
from benchmarks.peers.runs import ask
from wavetank.device import compiler
from wavetank.foundation.atomic_write import atomic_write
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.rotations import inverse, product, turned
from wavetank.lab.bench.machine import cores, load, machine
from wavetank.lab.plots import BLUE, RED, pyplot, tidy
from wavetank.scene.scene import Scene
from wavetank.simulation.frame import FrameBuffer
from wavetank.simulation.instant import PlacedSolid
from wavetank.simulation.simulation import Simulation
from wavetank.simulation.state import State

#: A dam, two that meet around a light ball, two fluids, a motor, and one that buckles.
SCENES = (
    "DamBreakModel",
    "DoubleDamBreakWithSphere",
    "DoubleDamBreakMultiPhase",
    "MotorScene",
    "BucklingModel_Weiler2018",
)
SECONDS, EVERY = 2.0, 0.05  # s of water, and between two instants
SHOWN = (0.25, 0.5, 1.0)  # shares of the time at which pictures are made
SIZE = (480, 400)  # px of a picture
TOP = 95.0  # % of the particles that are lower than what is called the top

Say = Callable[[str], None]


@dataclasses.dataclass(frozen=True)
class Watched:
    """One run: an instant every `EVERY` seconds, and what it took."""

    instants: list[State]
    wall: float  # s

    @property
    def times(self) -> np.ndarray:
        """Times [s], [n]."""
        return np.array([one.time for one in self.instants])

    def heights(self, of: Callable[[np.ndarray], Any]) -> np.ndarray:
        """Return a height [m] of the water at each time, [n]; 0 where there is none."""
        return np.array([float(of(one.positions[:, 1])) if one.count else 0.0 for one in self.instants])


def compare_scenes(
    names: Sequence[str],
    pictures: Path,
    *,
    seconds: float = SECONDS,
    threads: int | None = None,
    say: Say = lambda s: None,
) -> dict[str, Any]:
    """Run their scenes with both solvers, write NAME.png for each into `pictures`, and return heights and times.

    Raises `WavetankError` where their solver is not here, and for what is not a scene of theirs or cannot be imported.
    """
    if not EVERY <= seconds <= 60.0:
        raise WavetankError(f"--seconds = {seconds} is not allowed; it must be from {EVERY} to 60.")
    pyplot()
    python, workers, busy = splishsplash_python(say), threads or cores(), load()
    compiler.start("cpu", threads=threads)
    pictures.mkdir(parents=True, exist_ok=True)
    found = []
    with tempfile.TemporaryDirectory(prefix="wavetank-peers-") as name:
        folder = Path(name)
        files = {one: Path(ask(python, folder, {"scene": one}, workers)["file"]) for one in names}
        scenes = {one: wavetank.load_splishsplash(file) for one, file in files.items()}
        for number, (one, imported) in enumerate(scenes.items(), 1):
            say(f"{one} ({number} of {len(scenes)}): ours")
            mine = watch(imported.scene, seconds)
            say(f"{one}: theirs")
            order = {"scene": one, "seconds": seconds, "every": EVERY}
            took = ask(python, folder, order, workers)
            with np.load(folder / "watched.npz") as kept:
                its = Watched(instants_of(kept, imported.scene, mine.instants[0], _numbers(files[one])), took["wall"])
            result = figures(one, mine, its)
            result["notes"] = list(imported.notes)
            draw(result, imported.scene, mine, its, pictures / f"{one}.png")
            found.append(result)
    return {
        "machine": machine("cpu", threads),
        "settings": {"peer": PACKAGE, "seconds": seconds, "load_before": busy},
        "scenes": found,
    }


def watch(scene: Scene, seconds: float) -> Watched:
    """Run our solver; kernels are loaded before."""
    sim = Simulation(scene)
    sim.step()
    sim.reset()
    instants, wall = [sim.frame().state()], 0.0
    for number in range(1, round(seconds / EVERY) + 1):
        began = time.perf_counter()
        sim.advance(number * EVERY - sim.time - sim.counters.pending_time)
        wall += time.perf_counter() - began
        instants.append(sim.frame().state())
    return Watched(instants, wall)


def instants_of(kept: Any, scene: Scene, start: State, bodies: dict[str, int]) -> list[State]:
    """Return what was kept of their run as instants of the scene that was imported.

    Its solids are moved from where they are at the `start` as theirs move; `bodies` are their numbers by our names.
    """
    numbers = {material.name: number for number, material in enumerate(scene.palette())}
    names = [str(name) for name in kept["names"]]
    kinds = np.array([numbers.get(name, 0) for name in names], np.int32)
    instants, first = [], 0
    for number, (at, counts) in enumerate(zip(kept["times"], kept["counts"], strict=True)):
        rows = slice(first, first := first + int(sum(counts)))
        arrays = {
            "ids": np.arange(rows.stop - rows.start, dtype=np.int32),
            "positions": kept["positions"][rows, : scene.dim],
            "velocities": kept["velocities"][rows, : scene.dim],
            "materials": np.repeat(kinds, counts),
        }
        before, now = kept["bodies"][0], kept["bodies"][number]
        standing = tuple(
            _moved(one, before[bodies[one.name]], now[bodies[one.name]]) if one.name in bodies else one
            for one in start.placed
        )
        instants.append(State.read(scene, number, float(at), arrays, standing))
    return instants


def _numbers(file: Path) -> dict[str, int]:
    """Return which of their bodies is which solid, by the names that `load_splishsplash` gives."""
    rows = json.loads(file.read_text(encoding="utf-8")).get("RigidBodies", [])
    return {f"body {row.get('id', number + 1)}": number for number, row in enumerate(rows)}


def _moved(standing: PlacedSolid, before: np.ndarray, now: np.ndarray) -> PlacedSolid:
    """Return a solid that was with a body of theirs `before` where this is `now`: place, quaternion (x, y, z, w)."""
    (old, old_turn), (new, new_turn) = ((pose[:3], np.roll(pose[3:], 1)) for pose in (before, now))
    turn = product(new_turn, inverse(old_turn))
    return dataclasses.replace(
        standing, position=new + turned(turn, standing.position - old), rotation=product(turn, standing.rotation)
    )


def figures(name: str, ours: Watched, theirs: Watched) -> dict[str, Any]:
    """Return heights over time and how far they are apart, over the mean height at the start above the lowest place."""
    result: dict[str, Any] = {"scene": name}
    curves: dict[str, dict[str, np.ndarray]] = {}
    for side, run in (("ours", ours), ("theirs", theirs)):
        curves[side] = {"mean": run.heights(np.mean), "top": run.heights(lambda y: np.percentile(y, TOP))}
        result[side] = {
            "particles": run.instants[-1].count,
            "wall": run.wall,
            "times": run.times.tolist(),
            **{what: values.tolist() for what, values in curves[side].items()},
        }
    floor = min(float(one.positions[:, 1].min()) for run in (ours, theirs) for one in run.instants if one.count)
    start = max(float(curves["ours"]["mean"][0]) - floor, 1e-9)
    apart = {
        what: np.abs(np.interp(ours.times, theirs.times, curves["theirs"][what]) - curves["ours"][what]) / start
        for what in ("mean", "top")
    }
    result["apart_largest"], result["apart_mean"] = float(apart["mean"].max()), float(apart["mean"].mean())
    result["apart_at_the_end"], result["top_apart_mean"] = float(apart["mean"][-1]), float(apart["top"].mean())
    return result


def draw(result: dict[str, Any], scene: Scene, ours: Watched, theirs: Watched, path: Path) -> None:
    """Write a picture: three instants of each, one above the other, and heights over time."""
    plt = pyplot()
    plot = plt.figure(figsize=(15, 6.4), layout="constrained")
    grid = plot.add_gridspec(2, len(SHOWN) + 1, width_ratios=[*[1.0] * len(SHOWN), 1.15])
    shown = FrameBuffer(scene)
    fast = max(float(np.linalg.norm(one.velocities, axis=1).max(initial=0.1)) for one in ours.instants)
    look: dict[str, Any] = {"view": "particles", "color_by": "material"}
    if len({kind for one in ours.instants for kind in np.unique(one.materials)}) == 1:
        look = {"view": "particles", "color_by": "speed", "limits": (0.0, fast)}
    for row, (title, run) in enumerate((("wavetank", ours), (PACKAGE.replace("==", " "), theirs))):
        for column, share in enumerate(SHOWN):
            at = share * ours.times[-1]
            instant = min(run.instants, key=lambda one: abs(one.time - at))
            axis = plot.add_subplot(grid[row, column])
            axis.imshow(wavetank.render(shown.frame(instant), *SIZE, **look))
            axis.set_title(f"{title}, {instant.time:.2f} s", fontsize=10, loc="left")
            axis.axis("off")
    axis = plot.add_subplot(grid[:, -1])
    for side, title, color in (("ours", "wavetank", BLUE), ("theirs", "SPlisHSPlasH", RED)):
        axis.plot(result[side]["times"], result[side]["mean"], color=color, label=f"{title}: mean")
        axis.plot(result[side]["times"], result[side]["top"], color=color, ls=":", label=f"{title}: {TOP:g} % below")
    axis.set(xlabel="time [s]", ylabel="height of particles [m]")
    axis.legend(frameon=False, fontsize=9)
    tidy(axis)
    plot.suptitle(f"{result['scene']}: {result['ours']['particles']:,} particles", fontsize=12)
    with atomic_write(path, suffixed=True) as partial:
        plot.savefig(partial, dpi=90)
    plt.close(plot)


def scenes_table(result: dict[str, Any]) -> Table:
    """Return a row for each scene."""
    table = Table(
        "scene of SPlisHSPlasH",
        "particles, ours; theirs",
        "s for the run, ours; theirs",
        "mean height apart: mean, largest, at the end",
        "top apart",
    )
    for one in result["scenes"]:
        table.add_row(
            one["scene"],
            *(
                "; ".join(form.format(one[side][what]) for side in ("ours", "theirs"))
                for what, form in (("particles", "{:,}"), ("wall", "{:.3g}"))
            ),
            ", ".join(f"{100 * one[what]:.1f} %" for what in ("apart_mean", "apart_largest", "apart_at_the_end")),
            f"{100 * one['top_apart_mean']:.1f} %",
        )
    return table

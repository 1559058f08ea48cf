"""A square column of water, H high, that falls over and runs up the wall 4 H from its back, in two dimensions.

    symbol   meaning                                                            unit
    T        t sqrt(g / H)                                                      1
    Z        front / H: 98 % of the water lie behind it                         1
    run-up   twice the mean height of the water nearer than 0.4 H to the wall   H

Both are means over the water, since single drops are chaos; so are the means over starts, whose lattices are shaken by
5 % of a spacing.
"""

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from wavetank.lab.cases.case import Figure
from wavetank.lab.plots import tidy
from wavetank.scene.fluids import Block, Points
from wavetank.scene.scene import Scene
from wavetank.scene.tank import Tank
from wavetank.simulation.simulation import Simulation

LONG, HIGH, NEAR = 4.0, 2.5, 0.4  # H: the tank's length and height; how near to the wall water runs up
END, STEP = 6.6, 0.1  # T: after the run-up; between readings
FEW = 0.01  # of the water: so much has to stand at the wall to be read


@dataclasses.dataclass
class Fall:
    """How the column falls, the mean of its starts."""

    times: np.ndarray  # T, [n]
    fronts: np.ndarray  # Z, [starts, n]
    heights: np.ndarray  # H, [starts, n]: of the run-up

    @property
    def front(self) -> np.ndarray:
        """Mean course of the front, [n]."""
        return np.asarray(self.fronts.mean(axis=0))

    @property
    def height(self) -> np.ndarray:
        """Mean course of the run-up, [n]."""
        return np.asarray(self.heights.mean(axis=0))

    @property
    def run_up(self) -> float:
        """The highest run-up [H], the mean of the starts."""
        return float(self.heights.max(axis=1).mean())


def scene(layers: int, high: float = 1.0, **parameters: Any) -> Scene:
    """Return the dam with a column `high` [m], of so many layers."""
    tank = Tank(size=(LONG * high, HIGH * high))
    column = Block(lower=(0.0, 0.0), upper=(high, high))
    return Scene(spacing=high / layers, tank=tank, fluids=[column], foam=0.0, **parameters)


def fall(dam: Scene, arch: str, starts: int, high: float = 1.0) -> Fall:
    """Let the column, `high` [m], fall from so many starts."""
    unit = math.sqrt(high / math.hypot(*dam.gravity))  # s
    fronts, heights = [], []
    for seed in range(starts):
        x = dam.particles()[0]
        x = x + np.random.default_rng(seed).uniform(-0.05, 0.05, x.shape) * dam.spacing
        sim = Simulation(dam.changed(fluids=[Points(positions=x.astype(np.float32))]), arch)
        read = [_read(frame.positions / high) for frame in sim.frames(END * unit, 1.0 / (STEP * unit))]
        fronts.append([front for front, _ in read])
        heights.append([height for _, height in read])
    return Fall(STEP * np.arange(1, len(fronts[0]) + 1), np.array(fronts), np.array(heights))


def _read(x: np.ndarray) -> tuple[float, float]:
    near = x[x[:, 0] > LONG - NEAR, 1].astype(float)
    return float(np.percentile(x[:, 0], 98)), 2.0 * float(near.mean()) if len(near) > FEW * len(x) else 0.0


def compare(name: str, falls: Mapping[str, Fall], front: float, height: float) -> list[Figure]:
    """Return by how much the falls differ, with the bounds `front` [% of Z] and `height` [% of H].

    Fronts are compared while all are past 1.5 H and before the wall.
    """
    fronts = np.array([one.front for one in falls.values()])
    running = (fronts.min(axis=0) > 1.5) & (fronts.max(axis=0) < LONG - 0.1)
    spread = 100.0 * float(np.max(np.ptp(fronts, axis=0)[running] / fronts.mean(axis=0)[running]))
    tops = [one.run_up for one in falls.values()]
    each = ", ".join(f"{key} {top:.3f}" for key, top in zip(falls, tops, strict=True))
    source = "the same water"
    figures = [
        Figure(f"{name}: largest difference of the front", spread, "%", None, front, "0", source),
        Figure(f"{name}: largest difference of the run-up", 100.0 * np.ptp(tops), "% of H", None, height, each, source),
    ]
    if all(len(one.heights) > 1 for one in falls.values()):
        chance = float(np.mean([one.heights.max(axis=1).std() / math.sqrt(len(one.heights)) for one in falls.values()]))
        figures.append(Figure(f"{name}: uncertainty of a run-up, from the starts", 100.0 * chance, "% of H"))
    return figures


def draw(plot: Any, falls: Mapping[str, Mapping[str, Fall]]) -> None:
    """Draw fronts and run-ups of each group over T."""
    axes = plot.subplots(1, 2 * len(falls), squeeze=False)[0]
    for pair, (name, group) in zip(axes.reshape(-1, 2), falls.items(), strict=True):
        for key, one in group.items():
            pair[0].plot(one.times, one.front, lw=1.0, label=key)
            pair[1].plot(one.times, one.height, lw=1.0)
        pair[0].set(title=name, xlabel="T = t sqrt(g / H)", ylabel="Z = front / H", xlim=(0, 3))
        pair[1].set(title=name, xlabel="T = t sqrt(g / H)", ylabel="run-up / H")
        pair[0].legend(frameon=False, fontsize=7)
        for axis in pair:
            tidy(axis)


def columns(falls: Mapping[str, Mapping[str, Fall]]) -> dict[str, list[float]]:
    """Return the table of all falls: T, and each one's front and run-up."""
    table: dict[str, list[float]] = {}
    for name, group in falls.items():
        for key, one in group.items():
            table.setdefault("T", one.times.tolist())
            table |= {f"Z, {name}, {key}": one.front.tolist(), f"run-up, {name}, {key}": one.height.tolist()}
    return table

"""Water runs over a sharp-crested weir, in two dimensions: how much passes under a given head.

Rehbock 1929 (in Chow, "Open-Channel Hydraulics", 1959, sec. 14-2): over a plate P high, as wide as the channel and with
air below the nappe,

    q = 2 / 3 C sqrt(2 g) h^1.5,    C = 0.602 + 0.083 h / P,    h = H + 1.2 mm

A basin runs out over the weir, so slowly that the flow is steady at each instant; C is the mean while the head, from
the level of the basin, falls from 12 to 8 cm. The plate is two spacings thick, and the water behind it falls out of the
tank. The bound is 6 %.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from wavetank.lab.cases.case import Case, Figure, Outcome, columns
from wavetank.lab.plots import BLUE, RED, tidy
from wavetank.scene.fluids import Block
from wavetank.scene.scene import Scene
from wavetank.scene.tank import Tank
from wavetank.simulation.simulation import Simulation
from wavetank.solids.shapes import Box

LONG, CREST, BEHIND, GRAVITY = 2.0, 0.3, 0.5, 9.81  # m: basin, height of the plate, room behind it; m/s^2
START, HIGHEST, LOWEST = 0.15, 0.12, 0.08  # m: heads
BELOW = 0.2  # m: from the basin's floor down to where water leaves
SOURCE = "Rehbock 1929"


def scene(spacing: float) -> Scene:
    """Return the basin, the weir at its end and room below that."""
    plate, wide = 2.0 * spacing, LONG + BEHIND
    parts = [
        Box(center=(0.5 * LONG, 0.5 * BELOW), size=(LONG, BELOW)),
        Box(center=(LONG - 0.5 * plate, BELOW + 0.5 * CREST), size=(plate, CREST)),
    ]
    water = Block(lower=(0.0, BELOW), upper=(LONG - plate, BELOW + CREST + START))
    tank = Tank(size=(wide, BELOW + CREST + 3.0 * START), open=["bottom"])
    return Scene(spacing=spacing, gravity=(0.0, -GRAVITY), tank=tank, fluids=[water], solids=parts, foam=0.0)


def follow(spacing: float, arch: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return times [s], heads [m] and volumes of the basin [m^2] until the lowest head."""
    sim, length = Simulation(scene(spacing), arch), LONG - 2.0 * spacing
    found = [(0.0, START, length * (CREST + START))]
    while found[-1][1] > LOWEST and found[-1][0] < 60.0:
        sim.advance(0.05)
        x = sim.positions
        volume = float(np.sum((x[:, 0] < LONG - spacing) & (x[:, 1] > BELOW))) * spacing**2
        calm = float(np.sum((x[:, 0] < 0.5 * LONG) & (x[:, 1] > BELOW))) * spacing**2 / (0.5 * LONG)
        found.append((sim.time, calm - CREST, volume))
    times, heads, volumes = np.array(found).T
    return times, heads, volumes


def coefficient(times: np.ndarray, heads: np.ndarray, volumes: np.ndarray) -> float:
    """Return C over Rehbock's: what left the basin between two heads, over the sum of what he has for each instant."""
    read = (heads < HIGHEST) & (heads > LOWEST)
    h = heads[read] + 0.0012
    wanted = 2.0 / 3.0 * (0.602 + 0.083 * h / CREST) * math.sqrt(2.0 * GRAVITY) * h**1.5
    passed = float(volumes[read][0] - volumes[read][-1])
    return passed / float(np.sum(0.5 * (wanted[1:] + wanted[:-1]) * np.diff(times[read])))


def run(quick: bool, arch: str) -> Outcome:
    """Let the basin run out at two spacings (quick: at the coarser)."""
    found = {spacing: follow(spacing, arch) for spacing in ((0.02,) if quick else (0.02, 0.01))}
    figures = [
        Figure(
            f"head of {0.1 / spacing:.0f} d: flow, error",
            100.0 * (coefficient(*one) - 1.0),
            "%",
            -6.0,
            6.0,
            "C = 0.602 + 0.083 h / P",
            SOURCE,
        )
        for spacing, one in found.items()
    ]

    def draw(plot: Any) -> None:
        axis = plot.subplots()
        for (spacing, (times, heads, _)), color in zip(found.items(), (BLUE, "0.5"), strict=False):
            axis.plot(times, heads, color=color, label=f"d = {1000.0 * spacing:g} mm")
        axis.axhspan(LOWEST, HIGHEST, color=RED, alpha=0.1, lw=0)
        axis.set(xlabel="time [s]", ylabel="head [m]")
        axis.legend(frameon=False)
        tidy(axis)

    series: dict[str, Sequence[float]] = {}
    for spacing, (times, heads, volumes) in found.items():
        series |= columns(spacing, time=times, head=heads, volume=volumes)
    return Outcome(figures, series, draw)


CASE = Case("weir", "Water over a sharp crest", run)

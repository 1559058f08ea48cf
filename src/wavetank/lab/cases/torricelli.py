"""Water runs out through a slot in the bottom of a tank, in two dimensions: how wide the slot acts.

Far from its walls q = C S sqrt(2 g H) through a sharp-edged slot S wide under a depth H, with C = pi / (pi + 2) = 0.611
(Kirchhoff 1869; Lamb, Hydrodynamics, art. 75). In a tank 6 S wide C is 0.614 (von Mises 1917), and the water that comes
down adds its own head, 0.5 %. The plate is two spacings thick, thin enough for the jet to spring clear; below it is
air. C is the mean while the depth falls from 4.6 to 3.8 S. Known: slots act 0.8 to 1.6 spacings narrower, since an edge
of a solid counts as a half-space.
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

SPACING, GRAVITY = 0.01, 9.81  # m, m/s^2
SLOTS = (20, 10, 5)  # d
WIDE, DEEP, UNDER = 6.0, 5.0, 2.0  # S: tank, water, air below the plate
HIGHEST, LOWEST = 4.6, 3.8  # S: depths between which it is read
CONTRACTION = 0.614
THEORY = CONTRACTION / math.sqrt(1.0 - (CONTRACTION / WIDE) ** 2)
SOURCE = "Kirchhoff 1869; von Mises 1917"


def scene(slot: int) -> Scene:
    """Return the tank with a slot so many spacings wide."""
    wide = slot * SPACING
    plate, long = 2.0 * SPACING, WIDE * wide
    top = UNDER * wide + plate
    half = 0.5 * (long - wide)
    parts = [Box(center=(x, top - 0.5 * plate), size=(half, plate)) for x in (0.5 * half, long - 0.5 * half)]
    water = Block(lower=(0.0, top), upper=(long, top + DEEP * wide))
    tank = Tank(size=(long, top + (DEEP + 1.0) * wide), open=["bottom"])
    return Scene(spacing=SPACING, tank=tank, fluids=[water], solids=parts, foam=0.0)


def follow(slot: int, arch: str) -> tuple[np.ndarray, np.ndarray]:
    """Return times [sqrt(S / g)] and depths [S] until the lowest."""
    sim = Simulation(scene(slot), arch)
    wide = slot * SPACING
    top, unit = UNDER * wide + 2.0 * SPACING, math.sqrt(wide / GRAVITY)
    times, depths = [0.0], [DEEP]
    while depths[-1] > LOWEST and times[-1] < 20.0:
        sim.advance(0.1 * unit)
        times.append(sim.time / unit)
        depths.append(float(np.sum(sim.positions[:, 1] > top)) * SPACING**2 / (WIDE * wide**2))
    return np.array(times), np.array(depths)


def coefficient(times: np.ndarray, depths: np.ndarray) -> float:
    """Return C: 2 (sqrt(H_1) - sqrt(H_2)) of the depths, over the time between them and sqrt(2) / 6."""
    read = depths <= HIGHEST
    fall = np.polyfit(times[read], 2.0 * np.sqrt(depths[read]), 1)[0]
    return float(-fall * WIDE / math.sqrt(2.0))


def run(quick: bool, arch: str) -> Outcome:
    """Let the water run out through three slots (quick: that of ten spacings)."""
    found = {slot: follow(slot, arch) for slot in ((10,) if quick else SLOTS)}
    figures = []
    for slot, (times, depths) in found.items():
        off = 100.0 * (coefficient(times, depths) / THEORY - 1.0)
        low = -6.0 if slot >= 10 else None
        figures += [
            Figure(f"slot of {slot} d: flow, error", off, "%", low, None if low is None else 6.0, "C = 0.614", SOURCE),
            Figure(f"slot of {slot} d: it acts narrower by", -0.01 * off * slot, "d", reference="0", source=SOURCE),
        ]

    def draw(plot: Any) -> None:
        axis = plot.subplots()
        for (slot, (times, depths)), color in zip(found.items(), (BLUE, "0.5", "0.1"), strict=False):
            axis.plot(times, depths, color=color, label=f"slot of {slot} d")
        t = next(iter(found.values()))[0]
        fall = (math.sqrt(DEEP) - 0.5 * THEORY * math.sqrt(2.0) / WIDE * t) ** 2
        axis.plot(t, fall, color=RED, lw=0.8, ls="--", label="C = 0.614")
        axis.set(xlabel="t sqrt(g / S)", ylabel="depth / S")
        axis.legend(frameon=False)
        tidy(axis)

    series: dict[str, Sequence[float]] = {}
    for slot, (times, depths) in found.items():
        series |= columns(slot, time=times, depth=depths)
    return Outcome(figures, series, draw)


CASE = Case("torricelli", "Water that runs out through a slot", run)

"""Water swings in a U-tube, in two dimensions: two legs and the duct that joins them, all W wide.

A column of length L swings as a pendulum of length L / 2 does (Newton, Principia, book II, prop. 44):
T = 2 pi sqrt(L / 2 g). L is the length at which a straight duct would hold the same kinetic energy. It is counted along
the middle line, but a right-angled corner counts 0.559 W, not W: potential flow cuts it short (Hall 1968, "Resistance
calculations for thin film patterns", Thin Solid Films 1, 277-295: the same equation for a sheet that conducts). Along
the middle line alone the period would be 5 % longer. A swing of W / 4 is too small for it to part there.

The level [m] is read from the mean of x: water that leaves one leg and fills the other moves by W and the gap between
them. Known: what calms slow water beside solids makes the period longer, the more the fewer particles are across.
"""

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from wavetank.lab.cases import swing
from wavetank.lab.cases.case import Case, Figure, Outcome, columns
from wavetank.lab.plots import BLUE, RED, tidy
from wavetank.scene.fluids import Block
from wavetank.scene.scene import Scene
from wavetank.scene.tank import Tank
from wavetank.simulation.simulation import Simulation
from wavetank.solids.shapes import Box

WIDTH, GAP, DEPTH, LIFT = 0.16, 0.32, 0.6, 0.04  # m: of legs and duct; between the legs; level at rest; start above it
EDGE, TOP = 2.0 * WIDTH + GAP, 0.8  # m: inner size of the tank
CORNER = 0.559  # W: length of a right-angled corner in potential flow
LENGTH = 2.0 * (DEPTH - WIDTH) + GAP + 2.0 * CORNER * WIDTH  # m
PERIOD = 2.0 * math.pi * math.sqrt(LENGTH / (2.0 * 9.81))  # s
SOURCE = "Newton, II, prop. 44; Hall 1968"
LAYERS, FINER = 16, 32  # particles across a leg
ALONE = 30.0  # s, after the swing was measured


@dataclasses.dataclass
class Swing:
    """The level of the left leg above rest."""

    times: np.ndarray  # s
    levels: np.ndarray  # m


def scene(layers: int, **parameters: Any) -> Scene:
    """Return the tube with so many particles across a leg, the left leg fuller than the right."""
    middle = Box(center=(WIDTH + 0.5 * GAP, 0.5 * (WIDTH + TOP)), size=(GAP, TOP - WIDTH))
    fluids = [
        Block(lower=(0.0, 0.0), upper=(EDGE, WIDTH)),
        Block(lower=(0.0, WIDTH), upper=(WIDTH, DEPTH + LIFT)),
        Block(lower=(WIDTH + GAP, WIDTH), upper=(EDGE, DEPTH - LIFT)),
    ]
    tank = Tank(size=(EDGE, TOP))
    return Scene(spacing=WIDTH / layers, tank=tank, fluids=fluids, solids=[middle], foam=0.0, **parameters)


def level(x: np.ndarray, spacing: float) -> float:
    """Return the level of the left leg above rest [m] of water at these places, [n, 2]."""
    moved = float(np.sum(0.5 * EDGE - x[:, 0].astype(float)))
    return spacing**2 * moved / ((WIDTH + GAP) * WIDTH)


def follow(sim: Simulation, periods: float) -> Swing:
    """Follow the level for so many periods of theory."""
    found = [(sim.time, level(frame.positions, sim.scene.spacing)) for frame in sim.frames(periods * PERIOD, 60.0)]
    times, levels = np.array(found).T
    return Swing(times, levels)


def run(quick: bool, arch: str) -> Outcome:
    """Let the water swing for three periods at two spacings, then leave it alone (quick: for half of that, at one)."""
    sims = {layers: Simulation(scene(layers), arch) for layers in ((LAYERS,) if quick else (LAYERS, FINER))}
    found = {layers: follow(sim, 1.5 if quick else 3.3) for layers, sim in sims.items()}
    figures = [figure for layers, one in found.items() for figure in compare(f"{layers} particles across", one)]
    series: dict[str, Sequence[float]] = {}
    for layers, one in found.items():
        series |= columns(layers, time=one.times, level=one.levels)
    if not quick:
        sim = sims[LAYERS]
        sim.advance(ALONE)
        speed = np.linalg.norm(sim.velocities, axis=1)
        figures += [
            Figure(f"left alone for {ALONE:.0f} s: v_max", float(speed.max()), "m/s", reference="0", source="rest"),
            Figure("the same: v_rms, the swing's included", float(np.sqrt(np.mean(speed**2))), "m/s"),
        ]

    def draw(plot: Any) -> None:
        left, right = plot.subplots(1, 2, width_ratios=(2, 1))
        for (layers, one), color in zip(found.items(), (BLUE, "0.5"), strict=False):
            left.plot(one.times, one.levels, color=color, label=f"{layers} particles across")
        t = next(iter(found.values())).times
        left.plot(t, LIFT * np.cos(2.0 * np.pi * t / PERIOD), color=RED, lw=0.8, ls="--", label="theory, no friction")
        left.set(xlabel="time [s]", ylabel="level of the left leg above rest [m]", ylim=(-1.1 * LIFT, 1.6 * LIFT))
        left.legend(frameon=False, loc="upper right", ncols=3, fontsize=8)
        x = scene(LAYERS).particles()[0]
        right.plot(x[:, 0], x[:, 1], ".", color=BLUE, ms=1)
        right.set(title="start", xlabel="x [m]", ylabel="y [m]", aspect="equal", xlim=(0, EDGE), ylim=(0, TOP))
        for axis in (left, right):
            tidy(axis)

    return Outcome(figures, series, draw)


def compare(name: str, one: Swing) -> list[Figure]:
    """Compare a swing's period with theory's."""
    off = 100.0 * (swing.period(one.times, one.levels) / PERIOD - 1.0)
    kept = 100.0 * swing.kept(one.times, one.levels)
    return [
        Figure(f"{name}: period, error", off, "%", -4.0, 4.0, f"{PERIOD:.4f} s", SOURCE),
        Figure(f"{name}: height kept a period", kept, "%", reference="100 %", source="no friction"),
    ]


CASE = Case("u-tube", "Water that swings in a U-tube", run)

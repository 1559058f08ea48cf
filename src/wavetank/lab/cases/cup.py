"""Two cups with walls one spacing thick, one square and one round, half filled and shaken: nothing goes through.

0.5 g at 2 Hz along x, x = X (1 - cos(2 pi f t)), for 20 s. The cups are open and stand in a larger tank. A particle
counts as gone through if it was inside and is outside, or the other way round, below the rim, and could not have gone
over the rim in between: the way up to the rim and down again is longer than its speed allows.
"""

import math
from typing import Any

import numpy as np

from wavetank.lab.cases.case import Case, Figure, Outcome, Series
from wavetank.lab.plots import BLUE, RED, tidy
from wavetank.scene.fluids import Block, Points
from wavetank.scene.scene import Scene
from wavetank.scene.tank import Tank
from wavetank.simulation.simulation import Simulation
from wavetank.solids.shapes import Box, Cylinder, Difference

D, WIDTH, HEIGHT, FLOOR = 0.01, 0.12, 0.18, 0.05  # m: spacing and wall, inside of a cup, its floor above the tank's
SQUARE, ROUND = np.array([0.25, FLOOR, 0.15]), np.array([0.65, FLOOR, 0.15])  # m: centres of the inner floors
FREQUENCY = 2.0  # Hz
REACH = 0.5 * 9.81 / (2.0 * math.pi * FREQUENCY) ** 2  # m: amplitude for half of gravity
RATE = 120  # samples a second


def scene() -> Scene:
    """Return both cups, their solids placed by the centres of their inner floors."""
    rim, over = HEIGHT, HEIGHT + 0.1
    square = Difference(
        name="square",
        center=tuple(SQUARE),
        parts=[
            Box(center=(0.0, 0.5 * (rim - D), 0.0), size=(WIDTH + 2 * D, rim + D, WIDTH + 2 * D)),
            Box(center=(0.0, 0.5 * over, 0.0), size=(WIDTH, over, WIDTH)),
        ],
    )
    round_ = Difference(
        name="round",
        center=tuple(ROUND),
        parts=[
            Cylinder(start=(0.0, -D, 0.0), end=(0.0, rim, 0.0), radius=0.5 * WIDTH + D),
            Cylinder(start=(0.0, 0.0, 0.0), end=(0.0, over, 0.0), radius=0.5 * WIDTH),
        ],
    )
    half = np.array([0.5 * WIDTH, 0.0, 0.5 * WIDTH])
    top = np.array([0.0, 0.5 * HEIGHT, 0.0])
    block = Block(lower=tuple(SQUARE - half), upper=tuple(SQUARE + half + top))
    lattice = Block(lower=tuple(ROUND - half), upper=tuple(ROUND + half + top)).particles(D)
    fits = np.hypot(lattice[:, 0] - ROUND[0], lattice[:, 2] - ROUND[2]) < 0.5 * (WIDTH - 0.8 * D)
    fluids = [block, Points(positions=lattice[fits])]
    return Scene(spacing=D, tank=Tank(size=(0.9, 0.5, 0.3)), fluids=fluids, solids=[square, round_])


def run(quick: bool, arch: str) -> Outcome:
    """Shake for 20 s (quick: 3 s)."""
    seconds = 3.0 if quick else 20.0
    sim = Simulation(scene(), arch)
    x, v = sim.positions.astype(float), sim.velocities.astype(float)
    inside = holds(x, 0.0)
    first = inside.any(1)
    times, in_cups, through, in_wall = [0.0], [int(first.sum())], [0], [0]
    for number in range(1, round(seconds * RATE) + 1):
        time = number / RATE
        shift = REACH * (1.0 - math.cos(2.0 * math.pi * FREQUENCY * time))
        sim.move("square", position=tuple(SQUARE + (shift, 0.0, 0.0)))
        sim.move("round", position=tuple(ROUND + (shift, 0.0, 0.0)))
        sim.advance(1.0 / RATE)
        old_x, old_v, old = x, v, inside
        x, v = sim.positions.astype(float), sim.velocities.astype(float)
        inside = holds(x, shift)
        rim = FLOOR + HEIGHT
        way = np.maximum(rim - old_x[:, 1], 0.0) + np.maximum(rim - x[:, 1], 0.0)
        speed = np.maximum(np.linalg.norm(old_v, axis=1), np.linalg.norm(v, axis=1)) + 9.81 / RATE
        crossed = (inside != old).any(1) & (x[:, 1] < rim) & (old_x[:, 1] < rim) & (way > speed / RATE)
        times.append(time)
        in_cups.append(int(inside.any(1).sum()))
        through.append(through[-1] + int(crossed.sum()))
        in_wall.append(int(within(x, shift).sum()))
    figures = [
        Figure("particles through the walls", through[-1], "", 0.0, 0.0, "0", "a wall is a wall"),
        Figure("particles inside the walls, most at once", max(in_wall), "", 0.0, 0.0, "0", "a wall is a wall"),
        Figure("in the cups at the end", in_cups[-1], "", reference=f"{int(first.sum())} filled in"),
    ]

    def draw(plot: Any) -> None:
        left, right = plot.subplots(1, 2, width_ratios=(1, 2))
        left.plot(times, in_cups, color=BLUE, label="in the cups")
        left.plot(times, through, color=RED, label="through the walls")
        left.set(xlabel="time [s]", ylabel="particles", ylim=(-0.03 * in_cups[0], None))
        left.legend(frameon=False)
        near = np.abs(x[:, 2] - 0.15) < 2.0 * D
        right.plot(x[near, 0], x[near, 1], ".", color=BLUE, ms=3)
        for foot in (SQUARE, ROUND):
            left_edge, right_edge = foot[0] + shift - 0.5 * WIDTH, foot[0] + shift + 0.5 * WIDTH
            right.plot(
                [left_edge, left_edge, right_edge, right_edge],
                [FLOOR + HEIGHT, FLOOR, FLOOR, FLOOR + HEIGHT],
                color=RED,
                lw=1,
            )
        right.set(
            title=f"slice at the end, {seconds:g} s",
            xlabel="x [m]",
            ylabel="y [m]",
            aspect="equal",
            xlim=(0, 0.9),
            ylim=(0, 0.3),
        )
        tidy(left)

    series: Series = {"time": times, "in_cups": in_cups, "through": through, "in_wall": in_wall}
    return Outcome(figures, series, draw)


def _local(x: np.ndarray, shift: float) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return for both cups the distance from the inner face of the side (positive in the wall) and the height."""
    square, round_ = (x - foot - (shift, 0.0, 0.0) for foot in (SQUARE, ROUND))
    return [
        (np.maximum(np.abs(square[:, 0]), np.abs(square[:, 2])) - 0.5 * WIDTH, square[:, 1]),
        (np.hypot(round_[:, 0], round_[:, 2]) - 0.5 * WIDTH, round_[:, 1]),
    ]


def holds(x: np.ndarray, shift: float) -> np.ndarray:
    """Say whether each particle is in the hollow of each cup, bool [n, 2]."""
    return np.stack([(side <= 0.0) & (y >= 0.0) & (y < HEIGHT) for side, y in _local(x, shift)], 1)


def within(x: np.ndarray, shift: float) -> np.ndarray:
    """Say whether each particle is deeper than a tenth of a spacing in the material of a cup, bool [n]."""
    depth = [np.minimum.reduce([D - side, HEIGHT - y, y + D, np.maximum(side, -y)]) for side, y in _local(x, shift)]
    return np.maximum(*depth) > 0.1 * D


CASE = Case("cup", "Cups with walls one spacing thick, shaken", run)

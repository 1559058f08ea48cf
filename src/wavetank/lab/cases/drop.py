"""A drop falls freely from rest into a pool and becomes part of it.

Reference: t = sqrt(2 s / g) for the fall over the gap s between the drop's lowest particle and the pool, both with half
a spacing of water around them; afterwards the volume of both, spread over the tank.
"""

import math
from typing import Any

import numpy as np

from wavetank.lab.cases.case import Case, Figure, Outcome, surface
from wavetank.lab.plots import BLUE, RED, tidy
from wavetank.scene.fluids import Ball, Block
from wavetank.scene.scene import Scene
from wavetank.scene.tank import Tank
from wavetank.simulation.simulation import Simulation

SIZE = (0.5, 0.8, 0.5)  # m
POOL, GRAVITY = 0.2, 9.81  # m, m/s^2


def run(quick: bool, arch: str) -> Outcome:
    """Drop a ball of 0.1 m radius and wait 4 s (quick: in two dimensions)."""
    dim = 2 if quick else 3
    d, size = 0.02 if quick else 0.025, SIZE[:dim]
    middle = (0.25, 0.6, 0.25)[:dim]
    pool = Block(lower=(0.0,) * dim, upper=(size[0], POOL, *size[2:]))
    sim = Simulation(Scene(spacing=d, tank=Tank(size=size), fluids=[pool, Ball(center=middle, radius=0.1)]), arch)
    x = sim.positions.astype(float)
    drop = x[:, 1] > POOL  # rows keep their order
    gap = float(x[drop, 1].min() - x[~drop, 1].max()) - d
    filled = len(x) * d**dim / math.prod(edge for axis, edge in enumerate(size) if axis != 1)
    times, gaps, levels = [], [], []
    frames = 240.0
    for frame in sim.frames(0.4, frames):
        x = frame.positions.astype(float)
        # The pool sinks and swells as it settles: what counts is the water below the drop.
        below = np.linalg.norm(x[~drop][:, [0, *range(2, dim)]] - 0.25, axis=1) < 0.1
        times.append(sim.time)
        gaps.append(float(x[drop, 1].min() - x[~drop][below, 1].max()) - d)
    start, moment = closed(gaps), x
    contact = float(np.interp(0.0, -np.array(gaps[: start + 1]), times[: start + 1]))
    fall = math.sqrt(2.0 * gap / GRAVITY)
    rest_times, finite = [], True
    for frame in sim.frames(3.6, 30.0):
        x = frame.positions.astype(float)
        rest_times.append(sim.time)
        levels.append(float(surface(x, d, size).mean()) / filled)
        finite = finite and bool(np.isfinite(x).all())
    limit = 0.02 if quick else 0.01
    figures = [
        Figure("time of contact, error", 100.0 * (contact / fall - 1.0), "%", -2.0, 2.0, f"{fall:.4f} s", "free fall"),
        Figure("level at the end / volume", levels[-1], "", 1 - limit, 1 + limit, f"{filled:.4f} m", "volume"),
        Figure("twice the mean height / volume", 2.0 * float(x[:, 1].mean()) / filled, "", reference="1"),
        Figure("positions that are not finite", 0.0 if finite else 1.0, "", 0.0, 0.0, "0"),
    ]

    def draw(plot: Any) -> None:
        left, middle, right = plot.subplots(1, 3)
        left.plot(times[: start + 1], gaps[: start + 1], color=BLUE, label="computed")
        t = np.linspace(0.0, fall, 50)
        left.plot(t, gap - 0.5 * GRAVITY * t**2, color=RED, lw=0.8, ls="--", label="free fall")
        left.set(xlabel="time [s]", ylabel="gap between drop and pool [m]")
        left.legend(frameon=False)
        for own, color in ((~drop, BLUE), (drop, RED)):
            middle.plot(moment[own, 0], moment[own, 1], ".", color=color, ms=1.5)
        middle.set(title="0.4 s", xlabel="x [m]", ylabel="y [m]", aspect="equal", xlim=(0, 0.5), ylim=(0, 0.8))
        right.plot(rest_times, levels, color=BLUE)
        right.axhspan(1 - limit, 1 + limit, color="0.9", zorder=0)
        right.set(xlabel="time [s]", ylabel="level / volume")
        for axis in (left, right):
            tidy(axis)

    return Outcome(figures, {"time": times, "gap": gaps, "time_after": rest_times, "level": levels}, draw)


def closed(gaps: list[float]) -> int:
    """Return the first sample at which the gap is closed, or the last one."""
    return next((number for number, gap in enumerate(gaps) if gap <= 0.0), len(gaps) - 1)


CASE = Case("drop", "A drop falls into a pool", run)

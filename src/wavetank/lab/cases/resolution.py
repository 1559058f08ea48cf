"""Finer particles and shorter time steps move the front of a dam by less and less: the numbers converge.

The dam of `martin-moyce` in two dimensions at T = 2.5, for d, d / 1.5, d / 2.25 and for the time step, its half and
its quarter: all that bounds a step (frame time, `courant`, `wave_courant`) shrinks together. The foremost particle
belongs to a wedge that gets thinner with d; the front is therefore the place where the water is a / 20 thick, in
columns a / 20 wide, whatever d, and the mean over T = 2.4 .. 2.6. Splashes are chaotic, and the changes that are looked
for are small: every place is the mean over a dozen starts, whose lattices are shaken by 5 % of a spacing. A first step
that is less than twice what the starts leave uncertain of it counts as that: those of the time step are.
"""

import math
from typing import Any

import numpy as np

from wavetank.lab.cases.case import Case, Figure, Outcome, Series
from wavetank.lab.cases.martin_moyce import GRAVITY, A, scene
from wavetank.lab.plots import BLUE, RED, tidy
from wavetank.scene.fluids import Points
from wavetank.scene.scene import Scene
from wavetank.simulation.simulation import Simulation

RATE = math.sqrt(2.0 * GRAVITY / A)  # T per second
STARTS = 12


def run(quick: bool, arch: str) -> Outcome:
    """Run three spacings and three time steps (quick: coarser)."""
    coarse = 12 if quick else 20
    cells = [coarse, round(1.5 * coarse), round(2.25 * coarse)]
    starts = 1 if quick else STARTS
    spaces = [late_fronts(scene(n, 2), arch, starts) for n in cells]
    frame_times = [1 / 60, 1 / 120, 1 / 240]
    times = [late_fronts(_with_steps(scene(cells[1], 2), share), arch, starts) for share in (1.0, 0.5, 0.25)]
    by_space, by_time = ([float(np.mean(fronts)) for fronts in found] for found in (spaces, times))
    space, time = np.abs(np.diff(by_space)), np.abs(np.diff(by_time))
    spread = float(np.mean([np.std(fronts) for fronts in (*spaces, *times)])) / math.sqrt(starts)
    told = 2.0 * math.sqrt(2.0) * spread  # the least step between two places that says anything
    figures = [
        Figure(
            f"{name}: second step / first", float(steps[1] / max(steps[0], told)), "", None, 1.0, "< 1", "convergence"
        )
        for name, steps in (("spacing", space), ("time step", time))
    ]
    figures += [
        Figure("spacing: last step of the front", float(by_space[2] - by_space[1]), "a", reference="0"),
        Figure("time step: last step of the front", float(by_time[2] - by_time[1]), "a", reference="0"),
        Figure("uncertainty of a place, from the starts", spread, "a"),
    ]

    def draw(plot: Any) -> None:
        left, right = plot.subplots(1, 2, sharey=True)
        left.plot([1 / n for n in cells], by_space, "o-", color=BLUE)
        left.set(xlabel="spacing d / a", ylabel="front Z at T = 2.5", xlim=(0, None))
        right.plot([1e3 * t for t in frame_times], by_time, "o-", color=RED)
        right.set(xlabel="frame time [ms]", xlim=(0, None))
        for axis in (left, right):
            tidy(axis)

    series: Series = {"cells": cells, "front_by_spacing": by_space, "frame_time": frame_times, "front_by_time": by_time}
    return Outcome(figures, series, draw)


def late_fronts(dam: Scene, arch: str, starts: int) -> list[float]:
    """Return the mean place of the front, in units of a, over T = 2.4 .. 2.6, from each start."""
    fronts = []
    for seed in range(starts):
        x = dam.particles()[0]
        x = x + np.random.default_rng(seed).uniform(-0.05, 0.05, x.shape) * dam.spacing
        sim = Simulation(dam.changed(fluids=[Points(positions=x.astype(np.float32))]), arch)
        sim.advance(2.4 / RATE)
        fronts.append(
            float(np.mean([thick_front(f.positions, dam.spacing) / A for f in sim.frames(0.2 / RATE, 960.0)]))
        )
    return fronts


def _with_steps(dam: Scene, share: float) -> Scene:
    """Return the same dam in time steps shorter by `share`."""
    return dam.changed(
        frame_time=share * dam.frame_time, courant=share * dam.courant, wave_courant=share * dam.wave_courant
    )


def thick_front(x: np.ndarray, spacing: float) -> float:
    """Return the place [m] where the thickness of the water falls below a / 20, interpolated between columns."""
    width = thin = A / 20
    thickness = np.append(np.bincount((x[:, 0] / width).astype(int)) * spacing**2 / width, 0.0)
    k = max(1, int(np.flatnonzero(thickness < thin)[0]))
    return width * float(k - 0.5 + (thickness[k - 1] - thin) / (thickness[k - 1] - thickness[k]))


CASE = Case("resolution", "Finer particles, shorter time steps", run)

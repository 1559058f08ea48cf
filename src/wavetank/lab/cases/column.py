"""A column of water two metres deep carries itself: 40 layers of particles, the depth that slow solvers press together.

Reference: an incompressible fluid keeps its density at any depth. Error: compression, max(rho / rho_0 - 1, 0).
"""

from typing import Any

import numpy as np

from wavetank.lab.cases.case import Case, Figure, Outcome
from wavetank.lab.plots import BLUE, RED, tidy
from wavetank.scene.fluids import Block
from wavetank.scene.scene import Scene
from wavetank.scene.tank import Tank
from wavetank.simulation.simulation import Simulation

DEPTH = 2.0  # m


def run(quick: bool, arch: str) -> Outcome:
    """Let the column stand for 3 s (quick: twice as coarse) and average over the last second."""
    spacing = 0.1 if quick else 0.05
    block = Block(lower=(0.0, 0.0, 0.0), upper=(0.5, DEPTH, 0.5))
    sim = Simulation(Scene(spacing=spacing, tank=Tank(size=(0.5, 2.5, 0.5)), fluids=[block]), arch)
    times, mean, p99, heights = [], [], [], []
    errors = np.empty(0)
    for frame in sim.frames(3.0, 60.0):
        errors = np.maximum(frame.densities.astype(float) / sim.scene.rest_density - 1.0, 0.0)
        times.append(sim.time)
        mean.append(100.0 * float(errors.mean()))
        p99.append(100.0 * float(np.percentile(errors, 99)))
        heights.append(2.0 * float(frame.positions[:, 1].mean(dtype=float)) / DEPTH)
    last = np.array(times) > 2.0 - 1e-6
    figures = [
        Figure("density error, mean", float(np.mean(np.array(mean)[last])), "%", None, 0.3, "0", "incompressibility"),
        Figure("density error, p99", float(np.mean(np.array(p99)[last])), "%", None, 0.8, "0", "incompressibility"),
        Figure("density error, mean, worst frame of 3 s", max(mean), "%", reference="0", source="incompressibility"),
        Figure("twice the mean height / filled", heights[-1], "", reference="1", source="hydrostatics"),
    ]
    y = sim.positions[:, 1]

    def draw(plot: Any) -> None:
        left, right = plot.subplots(1, 2)
        left.plot(times, p99, color=RED, label="99th percentile")
        left.plot(times, mean, color=BLUE, label="mean")
        left.axhline(0.8, color=RED, lw=0.8, ls=":")
        left.axhline(0.3, color=BLUE, lw=0.8, ls=":")
        left.set(xlabel="time [s]", ylabel="compression [%]", ylim=(0, None))
        left.legend(frameon=False)
        right.plot(100.0 * errors, y, ".", color=BLUE, ms=2)
        right.set(xlabel="compression at the end [%]", ylabel="height [m]", ylim=(0, None))
        for axis in (left, right):
            tidy(axis)

    series = {"time": times, "error_mean": mean, "error_p99": p99, "twice_mean_height": heights}
    return Outcome(figures, series, draw)


CASE = Case("column", "A column two metres deep", run)

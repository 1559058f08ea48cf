"""Two drops collide off centre in free space: nothing from outside, so momentum and angular momentum stay.

Reference: Newton's third law, pair by pair. Drift of the linear momentum in units of sum m |v|, of the angular momentum
(about the centre of mass) in units of its own value at the start.
"""

from typing import Any

import numpy as np

from wavetank.lab.cases.case import Case, Figure, Outcome
from wavetank.lab.plots import BLUE, RED, tidy
from wavetank.scene.fluids import Ball
from wavetank.scene.scene import Scene
from wavetank.simulation.simulation import Simulation


def run(quick: bool, arch: str) -> Outcome:
    """Follow two drops of 0.2 m for 0.5 s (quick: coarser)."""
    d = 0.04 if quick else 0.025
    balls = [
        Ball(center=(-0.25, -0.06, 0.0), radius=0.2, velocity=(2.0, 0.0, 0.0)),
        Ball(center=(0.25, 0.06, 0.0), radius=0.2, velocity=(-1.0, 0.0, 0.5)),
    ]
    sim = Simulation(Scene(spacing=d, gravity=(0.0, 0.0, 0.0), fluids=balls), arch)
    times: list[float] = []
    linear, angular, energy, places = [], [], [], []
    start_p, start_l, scale = np.zeros(3), np.zeros(3), 1.0
    for frame in sim.frames(0.5, 60.0):
        x, v = frame.positions.astype(float), frame.velocities.astype(float)
        p = v.sum(0)
        l = np.cross(x - x.mean(0), v).sum(0)  # noqa: E741
        if not times:
            start_p, start_l, scale = p, l, float(np.linalg.norm(v, axis=1).sum())
        times.append(sim.time)
        linear.append(100.0 * float(np.linalg.norm(p - start_p)) / scale)
        angular.append(100.0 * float(np.linalg.norm(l - start_l) / np.linalg.norm(start_l)))
        energy.append(float(np.sum(v**2)))
        places.append(x)
    loss = np.array(energy) / energy[0]
    rise = 100.0 * float(np.max(loss - np.minimum.accumulate(loss)))
    third = "Newton's third law"
    figures = [
        Figure("drift of momentum", max(linear), "%", None, 0.1, "0", third),
        Figure("drift of angular momentum", max(angular), "%", None, 0.4 if quick else 0.1, "0", third),
        Figure("largest rise of energy", rise, "%", None, 1.0, "0", "conservation of energy"),
        Figure("kinetic energy left", 100.0 * float(loss[-1]), "%"),
    ]

    def draw(plot: Any) -> None:
        left, right = plot.subplots(1, 2)
        left.plot(times, linear, color=BLUE, label="momentum")
        left.plot(times, angular, color=RED, label="angular momentum")
        left.set(xlabel="time [s]", ylabel="drift [%]")
        left.legend(frameon=False)
        for moment, color in ((0, "0.7"), (len(places) // 3, RED), (-1, BLUE)):
            near = places[moment][np.abs(places[moment][:, 2]) < 2 * d]
            right.plot(near[:, 0], near[:, 1], ".", color=color, ms=1.5, label=f"{times[moment]:.2f} s")
        right.set(title="slice at z = 0", xlabel="x [m]", ylabel="y [m]", aspect="equal")
        right.legend(frameon=False, markerscale=4)
        tidy(left)

    series = {"time": times, "linear_percent": linear, "angular_percent": angular, "kinetic": loss.tolist()}
    return Outcome(figures, series, draw)


CASE = Case("momentum", "Two drops collide in free space", run)

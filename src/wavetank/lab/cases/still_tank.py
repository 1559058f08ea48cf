"""Water at rest stays where it is and comes to rest: the bundled scene `still-tank`, half a metre deep.

Reference: hydrostatics. Bounds of v_rms and v_max: well below what other position-based and SPH solvers leave.
"""

from typing import Any

import numpy as np

from wavetank.lab.cases.case import Case, Figure, Outcome, surface
from wavetank.lab.plots import BLUE, RED, tidy
from wavetank.scene.scene import Scene
from wavetank.simulation.simulation import Simulation

DEPTH = 0.5  # m


def run(quick: bool, arch: str) -> Outcome:
    """Let the tank stand for 4 s (quick: twice the spacing) and look at the last second."""
    scene = Scene.load("still-tank")
    if quick:
        scene = scene.changed(spacing=0.05)
    assert scene.tank is not None
    sim = Simulation(scene, arch)
    times, rms, fastest, levels, rests = [], [], [], [], []
    for frame in sim.frames(4.0, 60.0):
        speed = np.linalg.norm(frame.velocities.astype(float), axis=1)
        x = frame.positions.astype(float)
        times.append(sim.time)
        rms.append(float(np.sqrt(np.mean(speed**2))))
        fastest.append(float(speed.max()))
        levels.append(float(surface(x, scene.spacing, scene.tank.size).mean()) / DEPTH)
        rests.append(2.0 * float(x[:, 1].mean()) / DEPTH)
    last = np.array(times) > 3.0 - 1e-6
    v_rms, v_max = (0.01, 0.1) if quick else (0.003, 0.03)
    figures = [
        Figure("level / filled", _worst(levels, last), "", 0.99, 1.01, "1", "hydrostatics"),
        Figure("twice the mean height / filled", _worst(rests, last), "", reference="1", source="hydrostatics"),
        Figure("v_rms after 3 s", float(np.array(rms)[last].max()), "m/s", None, v_rms, "0", "rest"),
        Figure("v_max after 3 s", float(np.array(fastest)[last].max()), "m/s", None, v_max, "0", "rest"),
    ]

    def draw(plot: Any) -> None:
        left, right = plot.subplots(1, 2)
        left.semilogy(times, fastest, color=RED, label="fastest particle")
        left.semilogy(times, rms, color=BLUE, label="root mean square")
        left.axhline(v_max, color=RED, lw=0.8, ls=":")
        left.axhline(v_rms, color=BLUE, lw=0.8, ls=":")
        left.set(xlabel="time [s]", ylabel="speed [m/s]")
        right.plot(times, levels, color=BLUE, label="level")
        right.plot(times, rests, color=RED, label="twice the mean height")
        right.axhspan(0.99, 1.01, color="0.9", zorder=0)
        right.set(xlabel="time [s]", ylabel="of the filled depth", ylim=(0.96, 1.04))
        for axis in (left, right):
            axis.legend(frameon=False)
            tidy(axis)

    series = {"time": times, "v_rms": rms, "v_max": fastest, "level": levels, "twice_mean_height": rests}
    return Outcome(figures, series, draw)


def _worst(values: list[float], when: np.ndarray) -> float:
    """Return the value farthest from 1."""
    chosen = np.array(values)[when]
    return float(chosen[np.argmax(np.abs(chosen - 1.0))])


CASE = Case("still-tank", "Still water", run)

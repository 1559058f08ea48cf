"""Vorticity confinement leaves calm water calm: `still-tank-2d` with and without it.

Reference: the same tank without confinement. Eq. 10 as it stands in the report (`vorticity_coherence` = 0) is shown
beside it: its direction has length one where the vorticity is noise, and stirs.
"""

from typing import Any

import numpy as np

from wavetank.lab.cases.case import Case, Figure, Outcome
from wavetank.lab.plots import BLUE, RED, tidy
from wavetank.scene.scene import Scene
from wavetank.simulation.simulation import Simulation

STRENGTH = 0.5  # m/s


def run(quick: bool, arch: str) -> Outcome:
    """Let three tanks stand for 3 s (quick: 1.5 s, coarser)."""
    seconds, d = (1.5, 0.05) if quick else (3.0, 0.025)
    settings: dict[str, dict[str, float]] = {
        "none": {},
        "ours": {"vorticity": STRENGTH},
        "Eq. 10": {"vorticity": STRENGTH, "vorticity_coherence": 0.0},
    }
    curves, end = {}, {}
    times: list[float] = []
    for name, values in settings.items():
        sim = Simulation(Scene.load("still-tank-2d").changed(spacing=d, **values), arch)
        times, rms = [], []
        for frame in sim.frames(seconds, 30.0):
            times.append(sim.time)
            rms.append(float(np.sqrt(np.mean(np.sum(frame.velocities.astype(float) ** 2, axis=1)))))
        curves[name], end[name] = rms, float(np.mean(rms[-15:]))
    figures = [
        Figure("v_rms with confinement over without", end["ours"] / end["none"], "", None, 1.2, "1", "the same tank"),
        Figure("v_rms with Eq. 10 over without", end["Eq. 10"] / end["none"], ""),
        Figure("v_rms with confinement", end["ours"], "m/s"),
    ]

    def draw(plot: Any) -> None:
        axis = plot.subplots()
        for (name, rms), color in zip(curves.items(), ("0.6", BLUE, RED), strict=True):
            axis.semilogy(times[1:], rms[1:], color=color, label=name)
        axis.set(xlabel="time [s]", ylabel="v_rms [m/s]")
        axis.legend(frameon=False, title="confinement")
        tidy(axis)

    return Outcome(figures, {"time": times, **curves}, draw)


CASE = Case("calm-vorticity", "Confinement and calm water", run)

"""A shear wave dies of viscosity: v_x = U cos(k y) in a free patch without gravity, k = 2 pi / L.

Reference: the exact solution of the diffusion of momentum, exp(-nu k^2 t); the faces y = 0 and y = L are free of
stress, so that the wave fits between them. The middle half of the patch, which its ends do not reach, is compared.
Negative pressure is off (`attraction` = 0): it would hold a patch that lacks weight together as a gel, whose
stiffness is not the subject here; docs/materials.md has the figure with it.
"""

import math
from typing import Any

import numpy as np

from wavetank.lab.cases.case import Case, Figure, Outcome
from wavetank.lab.plots import BLUE, RED, tidy
from wavetank.scene.fluids import Points
from wavetank.scene.scene import Scene
from wavetank.simulation.simulation import Simulation

HEIGHT, WIDTH, DENSITY = 0.2, 0.4, 1000.0  # m, m, kg/m^3
K = 2.0 * math.pi / HEIGHT
VISCOSITIES = {"oil, 1 Pa s": 1.0, "honey, 10 Pa s": 10.0, "tar, 1000 Pa s": 1000.0}


def run(quick: bool, arch: str) -> Outcome:
    """Follow the wave for 1.2 of its own times, at three viscosities (quick: two, coarser)."""
    d = HEIGHT / (20 if quick else 40)
    chosen = list(VISCOSITIES.items())[1 if quick else 0 :]
    figures, curves = [], {}
    for name, viscosity in chosen:
        scaled, amplitude = decay(viscosity, d, arch)
        rate = -float(np.polyfit(scaled, np.log(np.maximum(np.abs(amplitude), 1e-9)), 1)[0])
        # XSPH, the smoothing of thin water, adds what makes the thinnest fluid decay too fast.
        bound = 20.0 if viscosity < 5.0 else 6.0
        figures.append(
            Figure(f"{name}: rate, error", 100 * (rate - 1), "%", -bound, bound, "nu k^2", "momentum diffusion")
        )
        curves[name] = (scaled, amplitude)

    def draw(plot: Any) -> None:
        axis = plot.subplots()
        for (name, (scaled, amplitude)), mark in zip(curves.items(), "os^", strict=False):
            axis.semilogy(scaled, amplitude, mark, color=BLUE, mfc="none", label=name)
        axis.semilogy([0, 1.2], np.exp([0, -1.2]), color=RED, label="exp(-nu k^2 t)")
        axis.set(xlabel="nu k^2 t", ylabel="amplitude / amplitude at the start")
        axis.legend(frameon=False)
        tidy(axis)

    series = {key: values for name, (t, a) in curves.items() for key, values in ((f"time {name}", t), (name, a))}
    return Outcome(figures, series, draw)


def decay(viscosity: float, d: float, arch: str) -> tuple[list[float], list[float]]:
    """Return nu k^2 t and the amplitude over that of the start, for a dynamic `viscosity` [Pa s]."""
    x_axis, y_axis = ((np.arange(round(edge / d)) + 0.5) * d for edge in (WIDTH, HEIGHT))
    x = np.stack(np.meshgrid(x_axis, y_axis, indexing="ij"), -1).reshape(-1, 2)
    rate = viscosity / DENSITY * K**2
    start = 2.0 * d * rate  # particles end two spacings from where they started
    shape = np.cos(K * x[:, 1])
    fluid = Points(positions=x, velocities=np.stack([start * shape, np.zeros(len(x))], axis=1))
    scene = Scene(
        spacing=d,
        gravity=(0.0, 0.0),
        rest_density=DENSITY,
        dynamic_viscosity=viscosity,
        fluids=[fluid],
        frame_time=min(1 / 60, 0.05 / rate),
        attraction=0.0,
    )
    sim = Simulation(scene, arch)
    middle = np.abs(x[:, 0] - 0.5 * WIDTH) < 0.25 * WIDTH
    scaled, amplitude = [], []
    for frame in sim.frames(1.2 / rate, 20 * rate):
        along = frame.velocities[:, 0].astype(float)
        scaled.append(sim.time * rate)
        amplitude.append(float(np.sum((along * shape)[middle]) / np.sum(shape[middle] ** 2)) / start)
    return scaled, amplitude


CASE = Case("shear-wave", "A shear wave in viscous fluids", run)

"""Water rises between two plates that it wets, in two dimensions: Jurin's law.

Between plates a distance W apart, at a contact angle theta, it stands higher than outside by

    h = 2 sigma cos(theta) / (rho g W)

(Jurin 1718; Landau and Lifshitz, "Fluid Mechanics", sec. 61), measured from the area of the water between the plates,
so that the meniscus counts. The plates reach into a pool whose own level is that of the rest of the water. The bound is
15 %. Known: a film on the plates costs less than the cap that the tension draws up, and the column stays low.
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

APART, PLATE, LONG, DEPTH, LOW, HIGH = 0.004, 0.001, 0.03, 0.006, 0.003, 0.02  # m; LOW: where plates end
SIGMA, VISCOSITY, GRAVITY = 0.072, 0.005, 9.81  # N/m, Pa s, m/s^2
SECONDS, SAMPLES = 0.6, 60
SOURCE = "Jurin 1718"


def scene(spacing: float, angle: float) -> Scene:
    """Return the pool with two plates that dip into it, and water with that contact angle [deg]."""
    aside, middle = 0.5 * (APART + PLATE), 0.5 * (LOW + HIGH)
    plates = [Box(center=(0.5 * LONG + side * aside, middle), size=(PLATE, HIGH - LOW)) for side in (-1, 1)]
    return Scene(
        spacing=spacing,
        gravity=(0.0, -GRAVITY),
        tank=Tank(size=(LONG, HIGH)),
        fluids=[Block(lower=(0.0, 0.0), upper=(LONG, DEPTH))],
        solids=plates,
        surface_tension=SIGMA,
        contact_angle=angle,
        dynamic_viscosity=VISCOSITY,
        frame_time=1.0 / 240.0,
        foam=0.0,
    )


def follow(spacing: float, angle: float, arch: str) -> tuple[np.ndarray, np.ndarray]:
    """Return times [s] and by how much higher [m] the water stands between the plates than outside."""
    sim, found = Simulation(scene(spacing, angle), arch), []
    for _ in range(SAMPLES):
        sim.advance(SECONDS / SAMPLES)
        x = sim.positions.astype(float)
        aside, above = np.abs(x[:, 0] - 0.5 * LONG), x[:, 1] > LOW
        between = float(np.sum((aside < 0.5 * APART) & above)) * spacing**2 / APART
        outside = float(np.sum((aside > 0.5 * APART + PLATE) & above)) * spacing**2 / (LONG - APART - 2.0 * PLATE)
        found.append((sim.time, between - outside))
    times, rises = np.array(found).T
    return times, rises


def run(quick: bool, arch: str) -> Outcome:
    """Let water rise at two angles and two spacings (quick: once)."""
    ways = [(APART / 8, 30.0)] if quick else [(APART / n, angle) for n in (8, 16) for angle in (30.0, 60.0, 120.0)]
    found = {(d, angle): follow(d, angle, arch) for d, angle in ways}
    figures = []
    for (d, angle), (_, rises) in found.items():
        law = 2.0 * SIGMA * math.cos(math.radians(angle)) / (1000.0 * GRAVITY * APART)
        off = 100.0 * (float(rises[-SAMPLES // 4 :].mean()) / law - 1.0)
        name = f"{APART / d:.0f} d apart, {angle:g} degrees: rise, error"
        figures.append(Figure(name, off, "%", -15.0, 15.0, f"{1000.0 * law:.3g} mm", SOURCE))

    def draw(plot: Any) -> None:
        axis = plot.subplots()
        for number, ((d, angle), (times, rises)) in enumerate(found.items()):
            color = (BLUE, "0.5", "0.1")[number % 3]
            label = f"{APART / d:.0f} d, {angle:g} degrees"
            axis.plot(times, 1000.0 * rises, color=color, ls=("-", "--")[number // 3], label=label)
            law = 2.0 * SIGMA * math.cos(math.radians(angle)) / (1000.0 * GRAVITY * APART)
            axis.axhline(1000.0 * law, color=RED, lw=0.6, ls="--")
        axis.set(xlabel="time [s]", ylabel="rise [mm]")
        axis.legend(frameon=False, fontsize=8)
        tidy(axis)

    series: dict[str, Sequence[float]] = {}
    for (d, angle), (times, rises) in found.items():
        series |= columns(f"{APART / d:.0f}_{angle:g}", time=times, rise=rises)
    return Outcome(figures, series, draw)


CASE = Case("jurin", "Water that rises between plates", run)

"""A block of syrup spreads on a floor that holds it: balance of weight and viscosity, no inertia.

Huppert 1982, J. Fluid Mech. 121, 43, doi:10.1017/S0022112082001797: a fixed volume q per width spreads as
x_N = 1.411 (g q^3 / (3 nu))^(1/5) t^(1/5) in two dimensions once it is much longer than deep. It checks viscosity, the
no-slip of solids and the free surface at once: with slipping walls the front would be twice as far.
"""

from typing import Any

import numpy as np

from wavetank.lab.cases.case import Case, Figure, Outcome
from wavetank.lab.plots import BLUE, RED, tidy
from wavetank.scene.fluids import Block
from wavetank.scene.scene import Scene
from wavetank.scene.tank import Tank
from wavetank.simulation.simulation import Simulation

SIDE, VISCOSITY, LENGTH = 0.2, 20.0, 1.2  # m, Pa s, m
SOURCE = "Huppert 1982"


def run(quick: bool, arch: str) -> Outcome:
    """Let a square of 0.2 m, nu = 0.02 m^2/s, spread for 3 s (quick: 1.5 s, coarser)."""
    d, seconds = SIDE / (16 if quick else 28), 1.5 if quick else 3.0
    scene = Scene(
        spacing=d,
        tank=Tank(size=(LENGTH, 0.4)),
        dynamic_viscosity=VISCOSITY,
        fluids=[Block(lower=(0, 0), upper=(SIDE, SIDE))],
    )
    sim = Simulation(scene, arch)
    times, front = [], []
    for frame in sim.frames(seconds, 20.0):
        x = frame.positions.astype(float)
        times.append(sim.time)
        front.append(float(np.sort(x[:, 0])[-3:].mean()) + 0.5 * d)
    t = np.array(times)
    exact = 1.411 * (9.81 * SIDE**6 / (3.0 * VISCOSITY / 1000.0)) ** 0.2 * t**0.2
    late = t > 0.5 * seconds
    error = 100.0 * (np.array(front)[late] / exact[late] - 1.0)
    slope = float(np.polyfit(np.log(t[late]), np.log(np.array(front)[late]), 1)[0])
    bound = 6.0 if quick else 4.0
    figures = [
        Figure("front, largest error", float(error[np.argmax(np.abs(error))]), "%", -bound, bound, "0", SOURCE),
        Figure("exponent of time", slope, "", 0.17, 0.25, "1/5", SOURCE),
    ]

    def draw(plot: Any) -> None:
        left, right = plot.subplots(1, 2)
        left.loglog(t[1:], front[1:], color=BLUE, label="front")
        left.loglog(t[1:], exact[1:], color=RED, ls=":", label="similarity solution")
        left.set(xlabel="time [s]", ylabel="front [m]")
        left.legend(frameon=False)
        tidy(left)
        right.plot(x[:, 0], x[:, 1], ".", color=BLUE, ms=2)
        s = np.linspace(0.0, 1.0, 100)
        depth = (
            (3.0 * VISCOSITY / 1000.0 * SIDE**4 / (9.81 * t[-1])) ** 0.2
            * 1.411 ** (2 / 3)
            * (0.3 * (1 - s**2)) ** (1 / 3)
        )
        right.plot(s * exact[-1], depth, color=RED)
        right.set(xlabel="x [m]", ylabel="y [m]", title=f"t = {t[-1]:.1f} s", aspect="equal")

    return Outcome(figures, {"time": times, "front": front, "exact": exact.tolist()}, draw)


CASE = Case("gravity-current", "Syrup spreads on a floor", run)

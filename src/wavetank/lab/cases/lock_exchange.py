"""Lock exchange: a heavy and a light fluid side by side change places in two gravity currents.

Benjamin 1968, J. Fluid Mech. 31, 209, doi:10.1017/S0022112068000133: a current that fills half the depth H without
losing energy runs at U = 0.5 sqrt(g (rho_heavy - rho_light) H / rho), rho being the density of what it runs into, since
it is that which is accelerated. So the heavy current is faster, by sqrt(rho_heavy / rho_light); both were measured by
Lowe, Rottman and Linden 2005, J. Fluid Mech. 537, 101, doi:10.1017/S0022112005005069. Full-depth locks with nearly
equal densities give 0.92 to 1 of that speed: Shin, Dalziel and Linden 2004, J. Fluid Mech. 521, 1,
doi:10.1017/S002211200400165X. The light current runs under a free surface here. Speeds are fitted between 0.3 H and
1.3 H from the lock; particles are counted in the lower third for the heavy current and in the upper third for the light
one, the eighth from the front.
"""

import math
from typing import Any

import numpy as np

from wavetank.lab.cases.case import Case, Figure, Outcome
from wavetank.lab.plots import BLUE, RED, tidy
from wavetank.scene.scene import Scene
from wavetank.simulation.simulation import Simulation

DEPTH, LENGTH, RATIO, EIGHTH = 0.3, 1.4, 0.8, 8
SOURCE = "Benjamin 1968; Shin et al. 2004; Lowe et al. 2005"


def run(quick: bool, arch: str) -> Outcome:
    """Open the lock and follow both fronts (quick: coarser)."""
    d = DEPTH / (16 if quick else 32)
    reduced = 9.81 * (1.0 - RATIO)
    unit = math.sqrt(reduced * DEPTH)  # m/s, of which the Froude number is a share
    table = {
        "spacing": d,
        "tank": {"size": [LENGTH, 1.3 * DEPTH]},
        "materials": [{"name": "heavy", "density": 1000.0}, {"name": "light", "density": 1000.0 * RATIO}],
        "fluids": [
            {"lower": [0, 0], "upper": [LENGTH / 2, DEPTH], "material": "heavy"},
            {"lower": [LENGTH / 2, 0], "upper": [LENGTH, DEPTH], "material": "light"},
        ],
    }
    sim = Simulation(Scene.parse(table), arch)
    times: list[float] = []
    fronts: dict[str, list[float]] = {"heavy": [], "light": []}
    for frame in sim.frames(4.5 * DEPTH / unit, 20.0 * unit / DEPTH):
        x, kind = frame.positions.astype(float), frame.materials
        below, above = (kind == 1) & (x[:, 1] < DEPTH / 3), (kind == 2) & (x[:, 1] > 2 * DEPTH / 3)
        times.append(sim.time * unit / DEPTH)
        fronts["heavy"].append((np.sort(x[below, 0])[-EIGHTH] - LENGTH / 2) / DEPTH)
        fronts["light"].append((LENGTH / 2 - np.sort(x[above, 0])[EIGHTH - 1]) / DEPTH)
    froude = {name: speed(np.array(times), np.array(front)) for name, front in fronts.items()}
    ideal = {"heavy": 0.5 / math.sqrt(RATIO), "light": 0.5}  # of `unit`, which has the density of the heavy fluid
    low = 0.6 if quick else 0.8
    figures = [
        Figure(
            f"speed of the {name} front, over theory's", froude[name] / ideal[name], "", low, 1.1, "0.92 .. 1", SOURCE
        )
        for name in fronts
    ]
    figures.append(Figure("Froude number, mean of both fronts", 0.5 * sum(froude.values()), "", source=SOURCE))

    def draw(plot: Any) -> None:
        left, right = plot.subplots(1, 2, width_ratios=(2, 3))
        for name, color in (("heavy", BLUE), ("light", RED)):
            left.plot(times, fronts[name], color=color, label=f"{name}, Fr = {froude[name]:.2f}")
        ticks = np.array([1.0, 3.5])
        for name, line in (("heavy", "--"), ("light", ":")):
            left.plot(ticks, ideal[name] * (ticks - 0.6), "k" + line, lw=1, label=f"Benjamin, {name}")
        left.set(xlabel="t sqrt(g' / H)", ylabel="front / H")
        left.legend(frameon=False)
        tidy(left)
        for number, color in ((1, BLUE), (2, RED)):
            right.plot(x[kind == number, 0], x[kind == number, 1], ".", color=color, ms=2)
        right.set(aspect="equal", xlabel="x [m]", ylabel="y [m]")

    return Outcome(figures, {"time": times, **fronts}, draw)


def speed(times: np.ndarray, front: np.ndarray) -> float:
    """Return the slope of the front over time where it is between 0.3 and 1.3."""
    chosen = (front > 0.3) & (front < 1.3)
    return float(np.polyfit(times[chosen], front[chosen], 1)[0]) if chosen.sum() > 2 else math.nan


CASE = Case("lock-exchange", "Lock exchange", run)

"""Lock exchange: a heavy and a light fluid side by side change places in two gravity currents.

Benjamin 1968, J. Fluid Mech. 31, 209, doi:10.1017/S0022112068000133: a current that fills half the depth H without
losing energy runs at U = 0.5 sqrt(g (rho_heavy - rho_light) H / rho), rho being the density of what it runs into, since
it is that which is accelerated. So the heavy current is faster, by sqrt(rho_heavy / rho_light); both were measured by
Lowe, Rottman and Linden 2005, J. Fluid Mech. 537, 101, doi:10.1017/S0022112005005069. Full-depth locks with nearly
equal densities give 0.92 to 1 of that speed: Shin, Dalziel and Linden 2004, J. Fluid Mech. 521, 1,
doi:10.1017/S002211200400165X. The light current runs under a free surface here. Speeds are fitted between 0.3 H and
1.3 H from the lock; particles are counted in the lower third for the heavy current and in the upper third for the light
one, the eighth from the front. Billows between the currents come by chance: tanks a few spacings longer have speeds
that scatter by 2 to 3 %, so that the mean of four is compared.
"""

import dataclasses
import math
from typing import Any

import numpy as np

from wavetank.lab.cases.case import Case, Figure, Outcome
from wavetank.lab.plots import BLUE, RED, tidy
from wavetank.scene.scene import Scene
from wavetank.simulation.simulation import Simulation

DEPTH, LENGTH, RATIO, EIGHTH = 0.3, 1.4, 0.8, 8
TANKS, LONGER = 4, 2.0  # tanks of a full run, spacings by which each is longer than the one before
UNIT = math.sqrt(9.81 * (1.0 - RATIO) * DEPTH)  # m/s, of which the Froude number is a share
SOURCE = "Benjamin 1968; Shin et al. 2004; Lowe et al. 2005"


@dataclasses.dataclass(frozen=True)
class Exchange:
    """Both fronts [H] over time [H / UNIT], and the particles at the end."""

    times: np.ndarray
    fronts: dict[str, np.ndarray]
    positions: np.ndarray
    materials: np.ndarray

    def froude(self, name: str) -> float:
        """Return the speed of a front in UNIT, by least squares between 0.3 and 1.3 H from the lock."""
        chosen = (self.fronts[name] > 0.3) & (self.fronts[name] < 1.3)
        if chosen.sum() < 3:
            return math.nan
        return float(np.polyfit(self.times[chosen], self.fronts[name][chosen], 1)[0])


def follow(length: float, d: float, arch: str) -> Exchange:
    """Open the lock in the middle of a tank of a `length` [m], with the spacing `d` [m]."""
    table = {
        "spacing": d,
        "tank": {"size": [length, 1.3 * DEPTH]},
        "materials": [{"name": "heavy", "density": 1000.0}, {"name": "light", "density": 1000.0 * RATIO}],
        "fluids": [
            {"lower": [0, 0], "upper": [length / 2, DEPTH], "material": "heavy"},
            {"lower": [length / 2, 0], "upper": [length, DEPTH], "material": "light"},
        ],
    }
    sim = Simulation(Scene.parse(table), arch)
    times: list[float] = []
    fronts: dict[str, list[float]] = {"heavy": [], "light": []}
    for frame in sim.frames(4.5 * DEPTH / UNIT, 20.0 * UNIT / DEPTH):
        x, kind = frame.positions.astype(float), frame.materials
        below, above = (kind == 1) & (x[:, 1] < DEPTH / 3), (kind == 2) & (x[:, 1] > 2 * DEPTH / 3)
        times.append(sim.time * UNIT / DEPTH)
        fronts["heavy"].append((np.sort(x[below, 0])[-EIGHTH] - length / 2) / DEPTH)
        fronts["light"].append((length / 2 - np.sort(x[above, 0])[EIGHTH - 1]) / DEPTH)
    return Exchange(np.array(times), {name: np.array(front) for name, front in fronts.items()}, x, kind)


def run(quick: bool, arch: str) -> Outcome:
    """Open the lock and follow both fronts (quick: coarser, in one tank)."""
    d = DEPTH / (16 if quick else 32)
    tanks = [follow(LENGTH + number * LONGER * d, d, arch) for number in range(1 if quick else TANKS)]
    shown = tanks[0]
    froude = {name: float(np.mean([tank.froude(name) for tank in tanks])) for name in shown.fronts}
    ideal = {"heavy": 0.5 / math.sqrt(RATIO), "light": 0.5}  # of UNIT, which has the density of the heavy fluid
    low = 0.6 if quick else 0.8
    figures = [
        Figure(
            f"speed of the {name} front, over theory's", froude[name] / ideal[name], "", low, 1.1, "0.92 .. 1", SOURCE
        )
        for name in shown.fronts
    ]
    figures.append(Figure("Froude number, mean of both fronts", 0.5 * sum(froude.values()), "", source=SOURCE))

    def draw(plot: Any) -> None:
        left, right = plot.subplots(1, 2, width_ratios=(2, 3))
        for name, color in (("heavy", BLUE), ("light", RED)):
            for tank in tanks:
                label = f"{name}, Fr = {froude[name]:.2f}" if tank is shown else None
                left.plot(tank.times, tank.fronts[name], color=color, lw=1, alpha=0.6, label=label)
        ticks = np.array([1.0, 3.5])
        for name, line in (("heavy", "--"), ("light", ":")):
            left.plot(ticks, ideal[name] * (ticks - 0.6), "k" + line, lw=1, label=f"Benjamin, {name}")
        left.set(xlabel="t sqrt(g' / H)", ylabel="front / H")
        left.legend(frameon=False)
        tidy(left)
        for number, color in ((1, BLUE), (2, RED)):
            right.plot(*shown.positions[shown.materials == number].T, ".", color=color, ms=2)
        right.set(aspect="equal", xlabel="x [m]", ylabel="y [m]")

    return Outcome(figures, {"time": shown.times.tolist(), **{k: v.tolist() for k, v in shown.fronts.items()}}, draw)


CASE = Case("lock-exchange", "Lock exchange", run)

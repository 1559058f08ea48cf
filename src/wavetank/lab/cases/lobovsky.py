"""Two columns of water released by a fast gate: fronts on the floor, arrival at the far wall, levels at four probes.

Lobovsky, Botia-Vera, Castellana, Mas-Soler and Souto-Iglesias 2014, J. Fluids Struct. 48, 407-434,
doi:10.1016/j.jfluidstructs.2014.03.009: a reservoir 600 mm long in a tank of 1610 x 150 mm, filled 300 or 600 mm high.
A weight lifts the gate within tens of milliseconds (median 3.46 and 4.53 m/s); time counts from when it first moves.
The gate is part of the case: a plate two spacings thick that rises at that speed. Water shoots out below it, and what
leads is thinner and slower than what a column free from the first moment on would send ahead; that is shown as well.

    symbol   meaning                                      unit
    T        t sqrt(g / H)                                1
    X        (front - gate) / H                           1

Front: as in `martin_moyce.py`. Level at a probe: the volume of water in a column four spacings wide, over its area. The
water is at the far wall when its front is a spacing away. The records differ in that: the pressure at the foot of the
wall rises at T = 2.445, the front's own curve, which ends at 2.42, would be there at 2.61.
"""

import dataclasses
import math
from typing import Any

import numpy as np

from wavetank.lab.cases.case import Case, Figure, Outcome, measured
from wavetank.lab.cases.martin_moyce import front
from wavetank.lab.plots import BLUE, RED, tidy
from wavetank.scene.fluids import Block
from wavetank.scene.scene import Scene
from wavetank.scene.tank import Tank
from wavetank.simulation.simulation import Simulation
from wavetank.solids.shapes import Box

RESERVOIR, LENGTH, TOP, DEPTH = 0.6, 1.61, 0.9, 0.15  # m
LIFT = {0.3: 3.46, 0.6: 4.53}  # m/s, of the gate for each height [m]
PROBES = {"H1": 0.3, "H2": 0.865, "H3": 1.114, "H4": 1.3625}  # m from the back wall
GRAVITY = 9.81  # m/s^2
STANDS = 0.25  # s, behind the gate, before it rises
FAST, SLOW = 240.0, 60.0  # frames a second until the water is at the wall, and afterwards
ARRIVED = 2.8  # T when it surely is
SHIFTS = np.linspace(-0.1, 0.1, 81)  # T
RETURNS = 5.0  # T until which nothing has come back from the far wall to the last probe
SOURCE = "Lobovsky et al. 2014"


@dataclasses.dataclass(frozen=True)
class Run:
    """What is followed of a column: T, X, and the levels over H at the probes, each as long as T."""

    height: float  # m
    T: np.ndarray
    X: np.ndarray
    levels: dict[str, np.ndarray]

    def slope(self, past: float, until: float) -> float:
        """Return the speed of the front in sqrt(g H) between two T, by least squares."""
        chosen = (past <= self.T) & (until >= self.T)
        return float(np.polyfit(self.T[chosen], self.X[chosen], 1)[0])

    def error(self, table: dict[str, np.ndarray], late: float = 0.0) -> float:
        """Root mean square of the error of X, in % of the front's distance from the back wall over H.

        What was computed counts as `late` [T].
        """
        error = np.interp(table["T"] + late, self.T, self.X) - table["X"]
        return 100.0 * float(np.sqrt(np.mean((error / (RESERVOIR / self.height + table["X"])) ** 2)))

    def best_shift(self, table: dict[str, np.ndarray]) -> tuple[float, float]:
        """Return by how much [ms] what was computed is late for the least error, and that error [%]."""
        errors = [self.error(table, late) for late in SHIFTS]
        best = int(np.argmin(errors))
        return 1e3 * float(SHIFTS[best]) * math.sqrt(self.height / GRAVITY), errors[best]

    def arrival(self, spacing: float) -> float:
        """Return T when the front is a `spacing` [m] from the far wall."""
        there = (LENGTH - RESERVOIR - spacing) / self.height
        return float(np.interp(there, np.maximum.accumulate(self.X), self.T))


def scene(height: float, d: float, dim: int, *, gate: bool) -> Scene:
    """Return the column, `height` [m] high, behind its gate or free, with the spacing `d` [m]."""
    deep = (DEPTH,) * (dim - 2)
    plate = Box(
        name="gate",
        center=(RESERVOIR + d, 0.5 * TOP, *(0.5 * z for z in deep)),
        size=(2 * d, TOP, *(2 * z for z in deep)),
    )
    return Scene(
        spacing=d,
        tank=Tank(size=(LENGTH, TOP, *deep)),
        fluids=[Block(lower=(0.0,) * dim, upper=(RESERVOIR, height, *deep))],
        solids=[plate] if gate else [],
    )


def follow(height: float, d: float, dim: int, until: float, arch: str, *, gate: bool) -> Run:
    """Let the column stand for `STANDS`, if it has a gate, and then go until T = `until`."""
    sim, rate = Simulation(scene(height, d, dim, gate=gate), arch), math.sqrt(GRAVITY / height)
    across, area = round(DEPTH / d) if dim == 3 else 1, 4 * d * DEPTH ** (dim - 2)
    T: list[float] = []
    X: list[float] = []
    levels: dict[str, list[float]] = {name: [] for name in PROBES}
    while gate and sim.time < STANDS - 0.5 / FAST:
        sim.advance(1.0 / FAST)
    begins = sim.time
    while not T or T[-1] < until:
        x, time = sim.positions, sim.time - begins
        T.append(time * rate)
        X.append((front(x, d, across) - RESERVOIR) / height)
        for name, place in PROBES.items():
            inside = np.count_nonzero(np.abs(x[:, 0] - place) < 2 * d)
            levels[name].append(inside * d**dim / area / height)
        frame = 1.0 / (FAST if T[-1] < ARRIVED else SLOW)
        if "gate" in sim.solids.names:
            lifted = LIFT[height] * (time + frame)
            if lifted > height + 2 * d:
                sim.remove_solid("gate")
            else:
                sim.move("gate", position=(RESERVOIR + d, 0.5 * TOP + lifted, *(0.5 * DEPTH,) * (dim - 2)))
        sim.advance(frame)
    return Run(height, np.array(T), np.array(X), {name: np.array(level) for name, level in levels.items()})


def run(quick: bool, arch: str) -> Outcome:
    """Follow both columns behind their gates, and the lower one without (quick: in two dimensions, coarser)."""
    d, dim = (0.015, 2) if quick else (0.01, 3)
    low, high, free = measured("lobovsky_h300_front_fig12.csv"), measured("lobovsky_h600_front_fig12.csv"), "no gate"
    table = measured("lobovsky_h300_levels_fig16.csv")
    gated = follow(0.3, d, dim, table["T"][-1], arch, gate=True)
    tall = follow(0.6, d, dim, 1.7, arch, gate=True)
    freed = follow(0.3, d, dim, ARRIVED, arch, gate=False)
    early = table["T"] <= RETURNS
    errors = {
        name: float(np.sqrt(np.mean((np.interp(table["T"], gated.T, gated.levels[name]) - table[name])[early] ** 2)))
        for name in PROBES
    }
    wide = 1.5 if quick else 1.0
    late, shifted = tall.best_shift(high)
    figures = [
        Figure("300 mm: front, rms error", gated.error(low), "%", None, 3.0 * wide, "Fig. 12", SOURCE),
        Figure("600 mm: front, rms error", tall.error(high), "%", None, 3.0 * wide, "Fig. 12", SOURCE),
        Figure("600 mm: the same, best time shift", shifted, "%", reference="Fig. 12", source=SOURCE),
        Figure("that shift, computed minus measured", late, "ms", reference="0", source=SOURCE),
        Figure(
            "300 mm: speed of the front, 1 < T < 2.4", gated.slope(1.0, 2.4), "sqrt(g H)", 1.45, 1.65, "1.56", SOURCE
        ),
        Figure("300 mm: at the far wall", gated.arrival(d), "T", 2.4, 2.65, "2.46; 2.61", SOURCE),
        *(
            Figure(f"level at {name} until T = {RETURNS:g}, rms error", error, "H", None, 0.05, "Fig. 16", SOURCE)
            for name, error in errors.items()
        ),
        Figure(f"{free}: front, rms error", freed.error(low), "%", reference="Fig. 12", source=SOURCE),
        Figure(f"{free}: speed of the front", freed.slope(1.0, 2.2), "sqrt(g H)", reference="1.56", source=SOURCE),
        Figure(f"{free}: at the far wall", freed.arrival(d), "T", reference="2.46; 2.61", source=SOURCE),
    ]

    def draw(plot: Any) -> None:
        left, right = plot.subplots(1, 2)
        left.plot(gated.T, gated.X, color=BLUE, label="300 mm")
        left.plot(freed.T, freed.X, color=BLUE, ls=":", label=f"300 mm, {free}")
        left.plot(tall.T, tall.X, color=BLUE, ls="--", label="600 mm")
        for points in (low, high):
            left.plot(points["T"], points["X"], "o", color=RED, ms=3)
        left.set(xlabel="T = t sqrt(g / H)", ylabel="X = (front - gate) / H", xlim=(0, 2.7), ylim=(0, 3.4))
        left.legend(frameon=False)
        for name, level in gated.levels.items():
            right.plot(gated.T, level, color=BLUE, lw=1)
            right.plot(table["T"], table[name], "o", color=RED, ms=2)
            late = int(np.searchsorted(table["T"], 4.6))
            right.annotate(name, (table["T"][late], table[name][late] + 0.03))
        right.set(xlabel="T", ylabel="level / H", ylim=(0, 1.1))
        for axis in (left, right):
            tidy(axis)

    series = {"T": gated.T.tolist(), "X": gated.X.tolist(), **{k: v.tolist() for k, v in gated.levels.items()}}
    return Outcome(figures, series, draw)


CASE = Case("lobovsky", "Columns released by a fast gate, Lobovsky et al.", run)

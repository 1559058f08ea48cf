"""A sheet of viscous fluid poured onto a floor buckles and folds; a thinner one does not.

Cruickshank and Munson 1981, J. Fluid Mech. 113, 221, and Cruickshank 1988, J. Fluid Mech. 193, 111: a plane jet of
width w buckles where Re = U w / nu < 0.56 and the fall is longer than about ten widths. Figure: the largest sideways
offset of the sheet's centre line, in widths.
"""

from typing import Any

import numpy as np

from wavetank.lab.cases.case import Case, Figure, Outcome
from wavetank.lab.plots import BLUE, RED, tidy
from wavetank.scene.fluids import Block
from wavetank.scene.scene import Scene
from wavetank.scene.tank import Tank
from wavetank.simulation.simulation import Simulation

WIDTH, FALL, SPEED, ROOM = 0.01, 0.12, 0.3, 0.12  # m, m, m/s, m
SHEETS = {"Re = 0.06": 0.05, "Re = 3": 0.001}  # nu [m^2/s]
SOURCE = "Cruickshank and Munson 1981"


def run(quick: bool, arch: str) -> Outcome:
    """Pour both sheets for 0.5 s, with a hundredth of their speed sideways; quick or not.

    With five particles across it is chance how far a sheet gets: 0.3 to 1.4 widths at tolerances from 0.05 to 0.0005.
    """
    d = WIDTH / 8
    offsets: dict[str, list[float]] = {}
    moments: dict[str, list[tuple[float, np.ndarray]]] = {}
    times: list[float] = []
    for name, nu in SHEETS.items():
        sheet = Block(
            lower=(0.5 * (ROOM - WIDTH), 0), upper=(0.5 * (ROOM + WIDTH), FALL), velocity=(0.01 * SPEED, -SPEED)
        )
        scene = Scene(
            spacing=d,
            tank=Tank(size=(ROOM, 1.3 * FALL)),
            rest_density=1400.0,
            dynamic_viscosity=1400.0 * nu,
            fluids=[sheet],
        )
        sim = Simulation(scene, arch)
        times, largest, shots = [], [], []
        for number, frame in enumerate(sim.frames(0.5, 60.0)):
            x = frame.positions.astype(float)
            times.append(sim.time)
            largest.append(offset(x))
            if number in (0, 15, 24, 30):
                shots.append((sim.time, x))
        offsets[name], moments[name] = largest, shots
    thick, thin = (max(offsets[name]) for name in SHEETS)
    figures = [
        Figure("Re = 0.06: sideways offset", thick, "w", 0.8, None, "buckles below Re = 0.56", SOURCE),
        Figure("Re = 3: sideways offset", thin, "w", None, 0.5, "does not buckle", SOURCE),
    ]

    def draw(plot: Any) -> None:
        panels = plot.subplots(1, 5, width_ratios=(1, 1, 1, 1, 2))
        for panel, (moment, x) in zip(panels[:4], moments["Re = 0.06"], strict=True):
            panel.plot(x[:, 0], x[:, 1], ".", color=BLUE, ms=1.5)
            panel.set(title=f"{moment:.2f} s", aspect="equal", xlim=(0.02, 0.1), ylim=(0, FALL), xticks=[], yticks=[])
        for name, color in zip(SHEETS, (BLUE, RED), strict=True):
            panels[4].plot(times, offsets[name], color=color, label=name)
        panels[4].set(xlabel="time [s]", ylabel="sideways offset / w")
        panels[4].legend(frameon=False)
        tidy(panels[4])

    return Outcome(figures, {"time": times, **offsets}, draw)


def offset(x: np.ndarray) -> float:
    """Return how far the centre line is from the middle of the room at most [w], above the first width of height."""
    levels = np.arange(WIDTH, float(x[:, 1].max()), 0.5 * WIDTH)
    slices = [x[np.abs(x[:, 1] - level) < 0.25 * WIDTH, 0] for level in levels]
    # A puddle spreads on its own; a sheet is at most twice as wide as it was.
    centres = [float(row.mean()) for row in slices if len(row) and np.ptp(row) < 3.0 * WIDTH]
    return max((abs(centre - 0.5 * ROOM) for centre in centres), default=0.0) / WIDTH


CASE = Case("buckling", "A viscous sheet folds", run)

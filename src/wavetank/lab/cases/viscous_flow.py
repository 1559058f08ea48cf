"""Steady flows of a thick fluid between walls and down a plate: what `plates`, `pipe` and `nusselt-film` share.

A fluid of kinematic viscosity nu that an acceleration a drives along x has the mean speed a H^2 / (12 nu) between walls
a distance H apart (Poiseuille), and a H^2 / (3 nu) as a film H thick on one of them (Nusselt 1916). It comes near to it
as exp(-t / T), T = H^2 / (pi^2 nu) and four times that; what it has after `TIMES` of T is taken for steady. All
worlds repeat along x, and along z in space. The bound is 6 % at 16 layers.
"""

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from wavetank.lab.cases.case import Figure, Outcome, columns
from wavetank.lab.plots import BLUE, RED, tidy
from wavetank.scene.fluids import Block
from wavetank.scene.scene import Scene
from wavetank.scene.tank import Tank
from wavetank.simulation.simulation import Simulation

HIGH, DENSITY, VISCOSITY, GRAVITY = 0.2, 1000.0, 20.0, 9.81  # m, kg/m^3, Pa s, m/s^2
LONG = 24  # d, along x
TIMES, SAMPLES = 6.0, 60
BOUND = 6.0  # %, at 16 layers and more
DRIVES = (1.0, 0.1, 0.02)  # m/s^2

MakeScene = Callable[[int, int, float], Scene]  # of dimension, layers and drive [m/s^2]


@dataclasses.dataclass(frozen=True)
class Theory:
    """A flow that is known: its mean speed is `share` H^2 / nu times the drive, and it is near that after `decay` T."""

    source: str
    share: float
    decay: float


POISEUILLE = Theory("Poiseuille", 1.0 / 12.0, 1.0)
NUSSELT = Theory("Nusselt 1916", 1.0 / 3.0, 4.0)


def layers_in(dim: int, layers: int, room: float, **fields: Any) -> Scene:
    """Return so many layers on the floor of a tank `room` times as high as they are, with other `fields` of a scene."""
    d = HIGH / layers
    size = (LONG * d, HIGH, 12 * d)[:dim]
    tank = Tank(size=(size[0], room * HIGH, *size[2:]), periodic=["x", "z"][: dim - 1])
    block = Block(lower=(0.0,) * dim, upper=size)
    return Scene(spacing=d, tank=tank, fluids=[block], dynamic_viscosity=VISCOSITY, foam=0.0, **fields)


def follow(scene: Scene, theory: Theory, drive: float, arch: str) -> tuple[np.ndarray, np.ndarray]:
    """Return times [s] and mean speeds along x over those of the `theory`, driven by so much [m/s^2]."""
    nu = VISCOSITY / DENSITY
    end = TIMES * theory.decay * HIGH**2 / (math.pi**2 * nu)
    wanted, sim, found = theory.share * drive * HIGH**2 / nu, Simulation(scene, arch), []
    for _ in range(SAMPLES):
        sim.advance(end / SAMPLES)
        found.append((sim.time, float(sim.velocities[:, 0].mean()) / wanted))
    times, speeds = np.array(found).T
    return times, speeds


def compared(make: MakeScene, theory: Theory, runs: Sequence[tuple[int, int, float]], arch: str) -> Outcome:
    """Run flows of these (dimension, layers, drive [m/s^2]) and compare their steady mean speeds with theory."""
    found: Mapping[tuple[int, int, float], tuple[np.ndarray, np.ndarray]] = {
        run: follow(make(*run), theory, run[2], arch) for run in runs
    }
    figures = []
    for (dim, layers, drive), (_, speeds) in found.items():
        off = 100.0 * (float(speeds[-SAMPLES // 10 :].mean()) - 1.0)
        name = f"{dim}-D, {layers} layers, {drive:g} m/s^2: mean speed, error"
        figures.append(Figure(name, off, "%", -BOUND, BOUND, f"a H^2 / ({1.0 / theory.share:.0f} nu)", theory.source))

    def draw(plot: Any) -> None:
        axis = plot.subplots()
        for number, ((dim, layers, drive), (times, speeds)) in enumerate(found.items()):
            color, style = (BLUE, "0.5", "0.1")[number % 3], ("-", "--", ":")[number // 3 % 3]
            axis.plot(times, speeds, color=color, ls=style, lw=1.2, label=f"{dim}-D, {layers}, {drive:g} m/s^2")
        axis.axhline(1.0, color=RED, lw=0.8, ls="--", label=theory.source)
        axis.set(xlabel="time [s]", ylabel="mean speed, over theory's", ylim=(0, None))
        axis.legend(frameon=False, fontsize=8)
        tidy(axis)

    series: dict[str, Sequence[float]] = {}
    for (dim, layers, drive), (times, speeds) in found.items():
        series |= columns(f"{dim}D_{layers}_{drive:g}", time=times, speed=speeds)
    return Outcome(figures, series, draw)

"""A source below the surface of a pool, in two dimensions: the pool holds no more energy than was brought.

Water comes in at U through a mouth near the bed, level with it. Each volume brings U^2 / 2 of kinetic energy; the work
against the pressure at the mouth lifts the level and makes no motion. What is in the pool is therefore at most what was
brought (conservation of energy), but for the level's slow rise: the bound is 1.2. Known: the pressure grid knows no
source, so that what comes in is an error of density, which it pushes away.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from wavetank.lab.cases.case import Case, Figure, Outcome, columns
from wavetank.lab.plots import BLUE, RED, tidy
from wavetank.physics.measure import kinetic_energy
from wavetank.scene.emitters import Emitter
from wavetank.scene.fluids import Block
from wavetank.scene.scene import Scene
from wavetank.scene.tank import Tank
from wavetank.simulation.simulation import Simulation

LONG, HIGH, DEPTH = 2.0, 0.8, 0.4  # m: tank and pool
MOUTH, SPEED = 0.1, 0.185  # m, m/s
SECONDS = 4.0


def follow(spacing: float, seconds: float, arch: str) -> tuple[np.ndarray, ...]:
    """Return times [s], kinetic energies in the pool, those that were brought [J/m], and greatest speeds [m/s]."""
    tap = Emitter(name="in", position=(0.0, MOUTH), direction=(1.0, 0.0), width=MOUTH, speed=SPEED)
    water = Block(lower=(0.0, 0.0), upper=(LONG, DEPTH))
    scene = Scene(spacing=spacing, tank=Tank(size=(LONG, HIGH)), fluids=[water], emitters=[tap], foam=0.0)
    sim = Simulation(scene, arch)
    began, mass = sim.count, scene.particle_mass
    found = []
    for frame in sim.frames(seconds, 20.0):
        brought = 0.5 * mass * (sim.count - began) * SPEED**2
        speed = float(np.linalg.norm(frame.velocities, axis=1).max())
        found.append((sim.time, kinetic_energy(frame.velocities, mass), brought, speed))
    return tuple(np.array(found).T)


def run(quick: bool, arch: str) -> Outcome:
    """Let water come in for four seconds at two spacings (quick: for one, at the coarser)."""
    seconds = 1.0 if quick else SECONDS
    found = {spacing: follow(spacing, seconds, arch) for spacing in ((0.02,) if quick else (0.02, 0.01))}
    figures = []
    for spacing, (_, held, brought, speed) in found.items():
        name = f"mouth of {MOUTH / spacing:.0f} d"
        ratio = float(held[-1] / brought[-1])
        figures += [
            Figure(
                f"{name}: energy in the pool, of what was brought",
                ratio,
                "",
                None,
                1.2,
                "<= 1",
                "conservation of energy",
            ),
            Figure(f"{name}: greatest speed, over the inlet's", float(speed.max()) / SPEED, "", reference="1"),
        ]

    def draw(plot: Any) -> None:
        axis = plot.subplots()
        for (spacing, (t, held, _, _)), color in zip(found.items(), (BLUE, "0.5"), strict=False):
            axis.plot(t, held, color=color, label=f"in the pool, mouth of {MOUTH / spacing:.0f} d")
        t, _, brought, _ = next(iter(found.values()))
        axis.plot(t, brought, color=RED, lw=0.8, ls="--", label="brought")
        axis.set(xlabel="time [s]", ylabel="kinetic energy [J/m]", ylim=(0, None))
        axis.legend(frameon=False)
        tidy(axis)

    series: dict[str, Sequence[float]] = {}
    for spacing, (t, held, brought, _) in found.items():
        series |= columns(spacing, time=t, held=held, brought=brought)
    return Outcome(figures, series, draw)


CASE = Case("submerged-inlet", "A source below the surface of a pool", run)

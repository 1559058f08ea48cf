"""Water without input only loses energy: a dam that meets an obstacle, and a block that runs into a lower pool.

Reference: conservation of energy; viscosity, impact and the solver take energy away, nothing may bring any. Kinetic
plus potential energy, the latter zero on the floor; the rise is that above the least value so far. The dam is the
bundled scene `obstacle-tank`. The block draws its own rows and those of the pool apart, which is what lattices are
worst at (notebook/grid-pressure.md, "Rows that are drawn apart").
"""

from typing import Any

import numpy as np

from wavetank.lab.cases.case import Case, Figure, Outcome
from wavetank.lab.plots import BLUE, RED, tidy
from wavetank.physics.measure import kinetic_energy, potential_energy
from wavetank.scene.fluids import Block
from wavetank.scene.scene import Scene
from wavetank.scene.tank import Tank
from wavetank.simulation.simulation import Simulation


def block_and_pool(dim: int) -> Scene:
    """Return a block of water next to a pool of about half its height, in a tank 1.2 m long."""
    across, spacing = ((), 0.025) if dim == 2 else ((0.4,), 0.04)
    return Scene(
        spacing=spacing,
        gravity=(0.0, -9.81, 0.0)[:dim],
        tank=Tank(size=(1.2, 0.8, *across)),
        fluids=[
            Block(lower=(0.0,) * dim, upper=(0.4, 0.6, *across)),
            Block(lower=(0.4, 0.0, 0.0)[:dim], upper=(1.2, 0.28, *across)),
        ],
    )


def energies(scene: Scene, arch: str, seconds: float) -> tuple[list[float], np.ndarray, np.ndarray]:
    """Return times [s], kinetic and potential energies [J; J/m in 2-D] after each frame of `seconds`."""
    sim = Simulation(scene, arch)
    mass = scene.particle_mass
    times, kinetic, potential = [], [], []
    for frame in sim.frames(seconds, 60.0):
        times.append(sim.time)
        kinetic.append(kinetic_energy(frame.velocities, mass))
        potential.append(potential_energy(frame.positions, mass, scene.gravity))
    return times, np.array(kinetic), np.array(potential)


def run(quick: bool, arch: str) -> Outcome:
    """Follow the dam for 2 s and the block for 1 s (quick: both in two dimensions)."""
    scene = Scene.load("obstacle-tank-2d" if quick else "obstacle-tank")
    times, kinetic, potential = energies(scene, arch, 2.0)
    total = kinetic + potential
    gained = 100.0 * float(np.max(total - np.minimum.accumulate(total)))
    block_times, moving, lifted = energies(block_and_pool(2 if quick else 3), arch, 1.0)
    block = moving + lifted
    # Settling lets the total fall by much more than waves still hold, so the rise is also told in what is left.
    rise, left_over = gained / float(total[0]), gained / float(total[0] - total[-1])
    figures = [
        Figure("largest rise of energy, of the start's", rise, "%", None, 1.0, "0", "conservation of energy"),
        Figure("the same, of all that was lost", left_over, "%", reference="0", source="conservation of energy"),
        Figure("energy after 2 s, of the start's", 100.0 * float(total[-1] / total[0]), "%"),
        Figure(
            "block and pool: most energy, over the start's",
            100.0 * float(block.max() / block[0] - 1.0),
            "%",
            None,
            3.0,
            "0",
            "conservation of energy",
        ),
    ]

    def draw(plot: Any) -> None:
        both = (("obstacle", times, kinetic, potential), ("block and pool", block_times, moving, lifted))
        for axis, (title, when, motion, height) in zip(plot.subplots(1, 2), both, strict=True):
            axis.plot(when, motion + height, color="0.2", label="total")
            axis.plot(when, height, color=BLUE, label="potential")
            axis.plot(when, motion, color=RED, label="kinetic")
            unit = "J/m" if scene.dim == 2 else "J"
            axis.set(xlabel="time [s]", ylabel=f"energy [{unit}]", ylim=(0, None), title=title)
            axis.legend(frameon=False)
            tidy(axis)

    return Outcome(figures, {"time": times, "kinetic": kinetic.tolist(), "potential": potential.tolist()}, draw)


CASE = Case("energy", "Energy of a dam that meets an obstacle, and of a block and a pool", run)

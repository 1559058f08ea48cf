"""Water without input only loses energy: the bundled scene `obstacle-tank`, a dam that meets an obstacle.

Reference: conservation of energy; viscosity, impact and the solver take energy away, nothing may bring any. Kinetic
plus potential energy, the latter zero on the floor; the rise is that above the least value so far.
"""

from typing import Any

import numpy as np

from wavetank.lab.cases.case import Case, Figure, Outcome
from wavetank.lab.plots import BLUE, RED, tidy
from wavetank.scene import Scene
from wavetank.simulation import Simulation


def run(quick: bool, arch: str) -> Outcome:
    """Follow the dam for 2 s (quick: the two-dimensional scene)."""
    scene = Scene.load("obstacle-tank-2d" if quick else "obstacle-tank")
    sim = Simulation(scene, arch)
    mass = scene.particle_mass
    times, kinetic, potential = [], [], []
    for frame in sim.frames(2.0, 60.0):
        times.append(sim.time)
        kinetic.append(0.5 * mass * float(np.sum(frame.velocities.astype(float) ** 2)))
        potential.append(-mass * float(np.sum(frame.positions.astype(float) @ np.array(scene.gravity))))
    total = np.array(kinetic) + np.array(potential)
    rise = 100.0 * float(np.max(total - np.minimum.accumulate(total))) / total[0]
    # Settling lets the total fall by much more than waves still hold, so the rise is also told in what is left.
    left_over = 100.0 * float(np.max(total - np.minimum.accumulate(total))) / float(total[0] - total[-1])
    figures = [
        Figure("largest rise of energy, of the start's", rise, "%", None, 1.0, "0", "conservation of energy"),
        Figure("the same, of all that was lost", left_over, "%", reference="0", source="conservation of energy"),
        Figure("energy after 2 s, of the start's", 100.0 * float(total[-1] / total[0]), "%"),
    ]

    def draw(plot: Any) -> None:
        axis = plot.subplots()
        axis.plot(times, total, color="0.2", label="total")
        axis.plot(times, potential, color=BLUE, label="potential")
        axis.plot(times, kinetic, color=RED, label="kinetic")
        axis.set(xlabel="time [s]", ylabel="energy [J/m]" if scene.dim == 2 else "energy [J]", ylim=(0, None))
        axis.legend(frameon=False)
        tidy(axis)

    return Outcome(figures, {"time": times, "kinetic": kinetic, "potential": potential}, draw)


CASE = Case("energy", "Energy of a dam that meets an obstacle", run)

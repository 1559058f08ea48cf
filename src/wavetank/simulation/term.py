"""A term of the time step that a script adds: see `tests/simulation/test_terms.py` for one."""

from abc import ABC, abstractmethod

from wavetank.physics.world import World
from wavetank.scene.scene import Scene


class Term(ABC):
    """Something besides forces that changes the velocities of particles in every time step, in `sim.terms`.

    Forces act before positions are predicted, and the pressure answers them; terms act at the end of a step, on its
    velocities, as XSPH viscosity does. `world.grid` still has the neighbors of the step.
    """

    @abstractmethod
    def apply(self, world: World, scene: Scene, dt: float) -> None:
        """Change `world.particles.v` [m/s] of `world.count` particles at the end of a step of `dt` [s]."""

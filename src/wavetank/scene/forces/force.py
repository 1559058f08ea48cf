"""What every force has. A force of your own is a subclass with `apply`: see `examples/04_a_force_of_your_own.py`."""

from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from wavetank.foundation.model import FARTHEST, METRES
from wavetank.foundation.timed import Timed

if TYPE_CHECKING:
    from wavetank.device.state import Particles

# Bounds within which speeds, their squares, and what a radius divides are numbers in single precision.
Speed = Annotated[float, Field(ge=-1e5, le=1e5, allow_inf_nan=False)]  # m/s
Strength = Annotated[float, Field(ge=-1e6, le=1e6, allow_inf_nan=False)]  # m/s^2
Speeds = tuple[Speed, Speed] | tuple[Speed, Speed, Speed]
Strengths = tuple[Strength, Strength] | tuple[Strength, Strength, Strength]
Radius = Annotated[float, Field(ge=1e-6, le=FARTHEST, allow_inf_nan=False), METRES]


class Force(Timed):
    """Something beside gravity that accelerates particles."""

    def apply(self, particles: "Particles", count: int, dt: float, time: float) -> None:
        """Change the velocities of `count` particles for a substep of `dt` [s] that begins at `time` [s] of water.

        The bundled forces leave this to their kernels in `physics/forces`.
        """
        raise NotImplementedError

    def largest_acceleration(self) -> float:
        """Return a bound of the acceleration [m/s^2]: time steps are chosen by it."""
        return 0.0

    def largest_speed(self) -> float:
        """Return the speed [m/s] that this force can give to water; the world's speed limit makes room for it."""
        return 0.0

    def vectors(self) -> list[tuple[str, tuple[float, ...]]]:
        """Name every vector of this force, to check that all live in one dimension."""
        return []

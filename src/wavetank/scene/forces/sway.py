"""The tank sways: in its own frame all water feels the opposite acceleration, a sin(2 pi f t + phase).

code      symbol   meaning                                           unit
acceleration  a    largest acceleration of the tank                  m/s^2
frequency     f    0: constant                                       Hz
"""

import math
from typing import Annotated, Literal

import numpy as np
from pydantic import Field
from typing_extensions import override

from wavetank.device.compiler import qd
from wavetank.device.state import Particles
from wavetank.foundation.model import Number
from wavetank.scene.forces.force import Force, Strengths, in_space
from wavetank.scene.forces.regions import add_to
from wavetank.solids.distance import vec3


@qd.kernel(fastcache=True)
def accelerate(particles: Particles, dv: vec3, count: qd.i32):
    """Add the same to every velocity."""
    for i in range(count):
        particles.v[i] = add_to(particles.v[i], dv)


class Sway(Force):
    """A tank on the move."""

    kind: Literal["sway"] = "sway"
    acceleration: Strengths  # m/s^2
    frequency: Annotated[Number, Field(ge=0, le=1e3)] = 0.0  # Hz
    phase: Number = 0.0  # rad

    @override
    def apply(self, particles: Particles, count: int, dt: float, time: float) -> None:
        turn = math.sin(2.0 * math.pi * self.frequency * (time + 0.5 * dt) + self.phase) if self.frequency else 1.0
        accelerate(particles, (-turn * dt * in_space(self.acceleration)).astype(np.float32), count)

    @override
    def largest_acceleration(self) -> float:
        return math.hypot(*self.acceleration)

    @override
    def largest_speed(self) -> float:
        slowest = max(2.0 * math.pi * self.frequency, 1.0)
        return 2.0 * math.hypot(*self.acceleration) / slowest

    @override
    def vectors(self) -> list[tuple[str, tuple[float, ...]]]:
        return [("acceleration", self.acceleration)]

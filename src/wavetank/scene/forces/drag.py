"""Drag along: water in a ball follows a velocity, as if a hand went through it.

code      symbol   meaning                                           unit
u                  velocity of the hand                              m/s
drag      k        rate at which water follows                       1/s
radius    R        radius of the ball                                m
"""

import math
from typing import Annotated, Literal

from pydantic import Field
from typing_extensions import override

from wavetank.device.compiler import qd
from wavetank.device.state import Particles
from wavetank.foundation.model import Number, Place
from wavetank.scene.forces.force import Force, Radius, Speeds, in_space
from wavetank.scene.forces.regions import add_to, soft_share
from wavetank.solids.distance import lift, vec3


@qd.kernel(fastcache=True)
def follow_hand(particles: Particles, u: vec3, center: vec3, radius: qd.f32, drag: qd.f32, dt: qd.f32, count: qd.i32):
    """Pull the velocities towards that of the hand."""
    for i in range(count):
        v = particles.v[i]
        share = soft_share((lift(particles.x[i]) - center).norm(), radius)
        particles.v[i] = add_to(v, (u - lift(v)) * (1.0 - qd.exp(-share * drag * dt)))


class Drag(Force):
    """A hand that takes water along."""

    kind: Literal["drag"] = "drag"
    center: Place
    radius: Radius
    velocity: Speeds  # m/s
    drag: Annotated[Number, Field(ge=0, le=1e4)] = 20.0  # 1/s

    @override
    def apply(self, particles: Particles, count: int, dt: float, time: float) -> None:
        follow_hand(particles, in_space(self.velocity), in_space(self.center), self.radius, self.drag, dt, count)

    @override
    def largest_acceleration(self) -> float:
        return self.drag * math.hypot(*self.velocity)

    @override
    def largest_speed(self) -> float:
        return math.hypot(*self.velocity)

    @override
    def vectors(self) -> list[tuple[str, tuple[float, ...]]]:
        return [("center", self.center), ("velocity", self.velocity)]

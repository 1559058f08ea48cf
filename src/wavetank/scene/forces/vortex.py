"""A vortex: water within a tube is dragged along a rotation about the tube's axis.

code      symbol   meaning                                           unit
speed     w R      speed of the rotation at the rim                  m/s
axis      n        unit vector; z in a 2-D world                     1
drag      k        rate at which water follows                       1/s
"""

from typing import Annotated, Literal

import numpy as np
from pydantic import Field
from typing_extensions import override

from wavetank.device.compiler import qd
from wavetank.device.state import Particles
from wavetank.foundation.model import Number, Place
from wavetank.scene.forces.force import Force, Radius, Speed, in_space
from wavetank.scene.forces.regions import add_to, away_from_line, soft_share
from wavetank.solids.distance import lift, vec3


@qd.kernel(fastcache=True)
def stir(
    particles: Particles,
    center: vec3,
    axis: vec3,
    radius: qd.f32,
    speed: qd.f32,
    drag: qd.f32,
    dt: qd.f32,
    count: qd.i32,
):
    """Pull the velocities towards those of a body that turns; what flows along the axis is left alone."""
    for i in range(count):
        arm = away_from_line(lift(particles.x[i]), center, axis)
        share = soft_share(arm.norm(), radius)
        v = lift(particles.v[i])
        lag = axis.cross(arm) * (speed / radius) - (v - axis * v.dot(axis))
        particles.v[i] = add_to(particles.v[i], lag * (1.0 - qd.exp(-share * drag * dt)))


class Vortex(Force):
    """A rotation that carries the water along."""

    kind: Literal["vortex"] = "vortex"
    center: Place
    radius: Radius
    speed: Speed  # m/s at the rim; negative turns the other way
    axis: tuple[Number, Number, Number] = (0.0, 1.0, 0.0)  # in a 2-D world give (0, 0, 1)
    drag: Annotated[Number, Field(ge=0, le=1e4)] = 8.0  # 1/s

    @override
    def apply(self, particles: Particles, count: int, dt: float, time: float) -> None:
        axis = in_space(self.axis)
        axis = (axis / max(float(np.linalg.norm(axis)), 1e-12)).astype(np.float32)
        stir(particles, in_space(self.center), axis, self.radius, self.speed, self.drag, dt, count)

    @override
    def largest_acceleration(self) -> float:
        return self.drag * abs(self.speed) + self.speed**2 / self.radius

    @override
    def largest_speed(self) -> float:
        return abs(self.speed)

    @override
    def vectors(self) -> list[tuple[str, tuple[float, ...]]]:
        return [("center", self.center)]

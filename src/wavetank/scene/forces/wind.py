"""Wind: drag towards the velocity of the air, in the open or in a tube.

The exact solution of dv/dt = k (u - v) over a substep, so that no drag is too strong.

    code      symbol   meaning                                           unit
    u                  velocity of the air                               m/s
    drag      k        rate at which water follows it                    1/s
    radius    R        radius of the tube along the wind; 0: everywhere  m
"""

import math
from typing import Annotated, Literal

import numpy as np
from pydantic import Field
from typing_extensions import override

from wavetank.device.compiler import qd
from wavetank.device.state import Particles
from wavetank.foundation.model import METRES, Number, Place
from wavetank.scene.forces.force import Force, Speeds, in_space
from wavetank.scene.forces.regions import add_to, away_from_line, soft_share
from wavetank.solids.distance import lift, vec3


@qd.kernel(fastcache=True)
def blow(
    particles: Particles, u: vec3, center: vec3, axis: vec3, radius: qd.f32, drag: qd.f32, dt: qd.f32, count: qd.i32
):
    """Pull the velocities towards the wind's."""
    for i in range(count):
        share = soft_share(away_from_line(lift(particles.x[i]), center, axis).norm(), radius)
        v = particles.v[i]
        particles.v[i] = add_to(v, (u - lift(v)) * (1.0 - qd.exp(-share * drag * dt)))


class Wind(Force):
    """Moving air. With a radius it blows in a tube through `center`, without one everywhere."""

    kind: Literal["wind"] = "wind"
    velocity: Speeds  # m/s
    drag: Annotated[Number, Field(ge=0, le=1e4)] = 1.0  # 1/s
    center: Place | None = None
    radius: Annotated[Number, Field(ge=0), METRES] = 0.0

    @override
    def apply(self, particles: Particles, count: int, dt: float, time: float) -> None:
        u = in_space(self.velocity)
        axis = u / max(float(np.linalg.norm(u)), 1e-12)
        center = in_space(self.center or (0.0, 0.0))
        blow(particles, u, center, axis.astype(np.float32), self.radius, self.drag, dt, count)

    @override
    def largest_acceleration(self) -> float:
        return self.drag * math.hypot(*self.velocity)

    @override
    def largest_speed(self) -> float:
        return math.hypot(*self.velocity)

    @override
    def vectors(self) -> list[tuple[str, tuple[float, ...]]]:
        return [("velocity", self.velocity), *([("center", self.center)] if self.center else [])]

"""A burst: water is thrown away from a point, within a short time.

code      symbol   meaning                                           unit
speed              speed that the burst gives in the middle          m/s
duration  T        time it takes                                     s
radius    R        where it ends                                     m
"""

from typing import Annotated, Literal

from pydantic import Field
from typing_extensions import override

from wavetank.device.compiler import qd
from wavetank.device.state import Particles
from wavetank.foundation.model import Place, Positive
from wavetank.scene.forces.force import Force, Radius, Speed, in_space
from wavetank.scene.forces.regions import add_to, soft_share
from wavetank.solids.distance import lift, vec3


@qd.kernel(fastcache=True)
def throw(particles: Particles, center: vec3, radius: qd.f32, gain: qd.f32, count: qd.i32):
    """Add `gain` [m/s] away from the centre."""
    for i in range(count):
        way = lift(particles.x[i]) - center
        distance = way.norm()
        # What sits in the very middle has no way out but up.
        direction = vec3(0.0, 1.0, 0.0)
        if distance > 1e-6 * radius:
            direction = way / distance
        particles.v[i] = add_to(particles.v[i], direction * (gain * soft_share(distance, radius)))


class Burst(Force):
    """An explosion."""

    kind: Literal["burst"] = "burst"
    center: Place
    radius: Radius
    speed: Speed  # m/s
    duration: Annotated[Positive, Field(ge=1e-6)] = 1 / 60  # s

    @override
    def apply(self, particles: Particles, count: int, dt: float, time: float) -> None:
        throw(particles, in_space(self.center), self.radius, self.speed * dt / self.duration, count)

    @override
    def largest_acceleration(self) -> float:
        return abs(self.speed) / self.duration

    @override
    def largest_speed(self) -> float:
        return abs(self.speed)

    @override
    def vectors(self) -> list[tuple[str, tuple[float, ...]]]:
        return [("center", self.center)]

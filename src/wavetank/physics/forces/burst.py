"""A burst: water is thrown away from a point, within a short time.

code      symbol   meaning                                           unit
speed              speed that the burst gives in the middle          m/s
duration  T        time it takes                                     s
radius    R        where it ends                                     m
"""

from typing import Any

from wavetank.device.compiler import qd
from wavetank.device.state import Particles
from wavetank.physics.forces.regions import add_to, in_space, soft_share
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


def apply_burst(force: Any, particles: Particles, count: int, dt: float, time: float) -> None:
    """Apply a `scene.forces.Burst` as `Force.apply` does."""
    throw(particles, in_space(force.center), force.radius, force.speed * dt / force.duration, count)

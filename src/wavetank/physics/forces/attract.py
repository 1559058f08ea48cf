"""A point that attracts, or repels where the strength is negative.

Within the radius the acceleration points at the centre and falls off softly; a little drag there keeps water from
orbiting for ever.

    code      symbol   meaning                                           unit
    strength  a        acceleration in the middle of the region          m/s^2
    radius    R        where it ends                                     m
    drag      k        rate at which water comes to rest there           1/s
"""

from typing import Any

from wavetank.device.compiler import qd
from wavetank.device.state import Particles
from wavetank.physics.forces.regions import add_to, in_space, soft_share
from wavetank.solids.distance import lift, vec3


@qd.kernel(fastcache=True)
def pull(particles: Particles, center: vec3, radius: qd.f32, strength: qd.f32, drag: qd.f32, dt: qd.f32, count: qd.i32):
    """Accelerate towards the centre."""
    for i in range(count):
        way = center - lift(particles.x[i])
        distance = way.norm()
        share = soft_share(distance, radius)
        # The pull fades within a tenth of the radius: a force that jumps in the middle would shake what it holds.
        pull_ = strength * share * way / qd.max(distance, 0.1 * radius)
        v = particles.v[i]
        particles.v[i] = add_to(v, dt * pull_ - lift(v) * (1.0 - qd.exp(-share * drag * dt)))


def apply_attract(force: Any, particles: Particles, count: int, dt: float, time: float) -> None:
    """Apply a `scene.forces.Attract` as `Force.apply` does."""
    pull(particles, in_space(force.center), force.radius, force.strength, force.drag, dt, count)

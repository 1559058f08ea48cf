"""Drag along: water in a ball follows a velocity, as if a hand went through it.

code      symbol   meaning                                           unit
u                  velocity of the hand                              m/s
drag      k        rate at which water follows                       1/s
radius    R        radius of the ball                                m
"""

from typing import Any

from wavetank.device.compiler import qd
from wavetank.device.state import Particles
from wavetank.physics.forces.regions import add_to, in_space, soft_share
from wavetank.solids.distance import lift, vec3


@qd.kernel(fastcache=True)
def follow_hand(particles: Particles, u: vec3, center: vec3, radius: qd.f32, drag: qd.f32, dt: qd.f32, count: qd.i32):
    """Pull the velocities towards that of the hand."""
    for i in range(count):
        v = particles.v[i]
        share = soft_share((lift(particles.x[i]) - center).norm(), radius)
        particles.v[i] = add_to(v, (u - lift(v)) * (1.0 - qd.exp(-share * drag * dt)))


def apply_drag(force: Any, particles: Particles, count: int, dt: float, time: float) -> None:
    """Apply a `scene.forces.Drag` as `Force.apply` does."""
    follow_hand(particles, in_space(force.velocity), in_space(force.center), force.radius, force.drag, dt, count)

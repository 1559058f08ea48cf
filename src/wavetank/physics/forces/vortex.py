"""A vortex: water within a tube is dragged along a rotation about the tube's axis.

code      symbol   meaning                                           unit
speed     w R      speed of the rotation at the rim                  m/s
axis      n        unit vector; z in a 2-D world                     1
drag      k        rate at which water follows                       1/s
"""

from typing import Any

import numpy as np

from wavetank.device.compiler import qd
from wavetank.device.state import Particles
from wavetank.physics.forces.regions import add_to, away_from_line, in_space, soft_share
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


def apply_vortex(force: Any, particles: Particles, count: int, dt: float, time: float) -> None:
    """Apply a `scene.forces.Vortex` as `Force.apply` does."""
    axis = in_space(force.axis)
    axis = (axis / max(float(np.linalg.norm(axis)), 1e-12)).astype(np.float32)
    stir(particles, in_space(force.center), axis, force.radius, force.speed, force.drag, dt, count)

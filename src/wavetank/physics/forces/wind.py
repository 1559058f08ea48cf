"""Wind: drag towards the velocity of the air, in the open or in a tube.

The exact solution of dv/dt = k (u - v) over a substep, so that no drag is too strong.

    code      symbol   meaning                                           unit
    u                  velocity of the air                               m/s
    drag      k        rate at which water follows it                    1/s
    radius    R        radius of the tube along the wind; 0: everywhere  m
"""

from typing import Any

import numpy as np

from wavetank.device.compiler import qd
from wavetank.device.state import Particles
from wavetank.physics.forces.regions import add_to, away_from_line, in_space, soft_share
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


def apply_wind(force: Any, particles: Particles, count: int, dt: float, time: float) -> None:
    """Apply a `scene.forces.Wind` as `Force.apply` does."""
    u = in_space(force.velocity)
    axis = u / max(float(np.linalg.norm(u)), 1e-12)
    center = in_space(force.center or (0.0, 0.0))
    blow(particles, u, center, axis.astype(np.float32), force.radius, force.drag, dt, count)

"""The tank sways: in its own frame all water feels the opposite acceleration, a sin(2 pi f t + phase).

code      symbol   meaning                                           unit
acceleration  a    largest acceleration of the tank                  m/s^2
frequency     f    0: constant                                       Hz
"""

import math
from typing import Any

import numpy as np

from wavetank.device.compiler import qd
from wavetank.device.state import Particles
from wavetank.physics.forces.regions import add_to, in_space
from wavetank.solids.distance import vec3


@qd.kernel(fastcache=True)
def accelerate(particles: Particles, dv: vec3, count: qd.i32):
    """Add the same to every velocity."""
    for i in range(count):
        particles.v[i] = add_to(particles.v[i], dv)


def apply_sway(force: Any, particles: Particles, count: int, dt: float, time: float) -> None:
    """Apply a `scene.forces.Sway` as `Force.apply` does."""
    turn = math.sin(2.0 * math.pi * force.frequency * (time + 0.5 * dt) + force.phase) if force.frequency else 1.0
    accelerate(particles, (-turn * dt * in_space(force.acceleration)).astype(np.float32), count)

"""What stands in the mouth of an emitter goes with the jet: the water of the pipe behind it is not there to push it.

Without this the last row of a jet has a free surface behind it. It is pushed back a little by the rows before it, the
next row comes too near, and the error grows; and water that stands before the mouth would block it.

    code     symbol   meaning                                                       unit
    ahead             axis of the mouth                                             1
    depth    s        way from the mouth along it                                   m
    target            speed along it there: that of the jet after a fall of s       m/s
    fall              gravity along the axis                                        m/s^2
"""

import dataclasses
from typing import Any

import numpy as np

from wavetank.device.compiler import qd
from wavetank.device.state import Particles
from wavetank.physics.forces.regions import add_to
from wavetank.solids.distance import lift, vec3


@dataclasses.dataclass(frozen=True)
class Opening:
    """Where a mouth is, and what leaves it."""

    middle: vec3  # m
    across: vec3  # unit vectors
    up: vec3
    ahead: vec3
    half_across: qd.f32  # m
    half_up: qd.f32
    is_round: qd.i32
    length: qd.f32  # m: how far the jet is held
    speed: qd.f32  # m/s along the axis
    fall: qd.f32  # m/s^2


@qd.kernel(fastcache=True)
def keep_going(particles: Particles, opening: Opening, dt: qd.f32, count: qd.i32):
    """Give what lags behind the jet its speed."""
    for i in range(count):
        way = lift(particles.x[i]) - opening.middle
        depth = way.dot(opening.ahead)
        if depth > -0.25 * opening.length and depth < opening.length:
            a = way.dot(opening.across) / opening.half_across
            b = way.dot(opening.up) / opening.half_up
            inside = a * a <= 1.0 and b * b <= 1.0
            if opening.is_round == 1:
                inside = a * a + b * b <= 1.0
            if inside:
                target = opening.speed + opening.fall * (qd.max(depth, 0.0) / opening.speed - 0.5 * dt)
                lag = target - lift(particles.v[i]).dot(opening.ahead)
                if lag > 0.0:
                    particles.v[i] = add_to(particles.v[i], lag * opening.ahead)


def apply_jet(force: Any, particles: Particles, count: int, dt: float, time: float) -> None:
    """Apply a `scene.forces.jet.Jet` as `Force.apply` does."""
    keep_going(particles, force.opening, dt, count)


def opening_of(middle: np.ndarray, axes: np.ndarray, half: tuple[float, float], **numbers: Any) -> Opening:
    """Return a mouth at `middle` [m] with the rows of `axes` across, up and ahead and `half` its edges [m]."""
    across, up, ahead = (np.asarray(row, np.float32) for row in axes)
    return Opening(
        middle=np.asarray(middle, np.float32),
        across=across,
        up=up,
        ahead=ahead,
        half_across=half[0],
        half_up=half[1],
        **numbers,
    )

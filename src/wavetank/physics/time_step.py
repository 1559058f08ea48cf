"""How long a time step may be: the fastest particle and the fastest wave go a share of a spacing.

The first is the usual Courant condition. The second is what keeps deep water stiff where no grid carries the pressure
(`pressure/correct.py`). A few iterations carry pressure a few spacings far: water answers a load as if sound
went at c = beta d / dt, with beta near 4 for four iterations, whatever the depth. Water of depth H then compresses by
g H / (2 c^2) on average, as in weakly compressible SPH, and where that is more than a few per cent, columns fall into
themselves, bounce and boil. With w = sqrt(g H) dt / d the compression is (w / beta)^2 / 2: w is all there is to bound
(notebook/time-steps.md). `largest_substeps` is a budget for fast scenes only, because a jet that is followed in
too long steps is merely crude.

    code     symbol    meaning                                                   unit
    speed    v         speed of the fastest particle or solid                    m/s
    depth    H         depth of a level pool that has the water's energy         m
    courant  CFL       v dt / d, at most, on a grid                              1
    wave     w         sqrt(g H) dt / d, at most                                 1
"""

import math

import numpy as np

from wavetank.device.compiler import lanes, qd
from wavetank.device.state import Particles
from wavetank.device.sums import many_threads, share_of
from wavetank.foundation.params import Parameters

ALONE = 2.0 / 3.0  # of `courant` where iterations alone carry the pressure
SHALLOWEST = 0.6  # d: way in a frame of the wave that water without a grid is taken to have, however shallow
WORTH = 1.1  # by what the steps of a frame must be shorter than they might be, so that another frame pays
SCALE = 8  # lengths of time steps in an octave, where these are free
CALMING = 4.5  # by how much farther waves may go where pressure is carried on
LEVELS = 64  # whole steps of height that are summed; their rounding cancels


def steps_needed(
    params: Parameters,
    duration: float,
    speed: float,
    depth: float,
    *,
    on_grid: bool,
    forced: bool = False,
    carried: float = 0.0,
) -> float:
    """Return how many of the longest time steps that are allowed make up `duration` [s], a fraction in general.

    Pressure that is solved `on_grid` reaches any depth. Where iterations alone carry it, the shallowest water needs two
    a frame by default; and so does water on which more than gravity acts (`forced`), because a force acts before the
    pressure answers: in one step it would be weaker. Waves of thick fluids, which carry on the share `carried` of their
    pressure, are damped, and their pressure reaches farther.
    """
    gravity = math.hypot(*params.gravity)
    usual = params.substeps * duration / params.frame_time
    courant = params.courant * (1.0 if on_grid else ALONE + (1.0 - ALONE) * carried)
    for_speed = (speed + duration * gravity) * duration / (courant * params.spacing)
    wave_courant = params.wave_courant * (1.0 + CALMING * carried)
    for_waves = 0.0 if on_grid else math.sqrt(gravity * depth) * duration / (wave_courant * params.spacing)
    alone = 0.0 if on_grid and not forced else SHALLOWEST / params.wave_courant * duration / params.frame_time
    return max(usual, min(max(for_speed, alone), params.largest_substeps), for_waves)


def whole(steps: float) -> int:
    """Return the number of time steps that are taken where so many are needed."""
    return max(1, math.ceil(steps - 1e-6))


def filled_share(steps: float) -> float:
    """Return the share of a time for which so many `steps` are needed that fewer, of full length, fill; 1 at most.

    1.4 steps are two short ones, or one of full length and 0.7 of the time. Not where that saves little: what a frame
    takes besides its steps comes more often then. Lengths are steps of a scale, because launches of a known length are
    known (`launches.py`).
    """
    length = 2.0 ** -(math.ceil(SCALE * math.log2(max(steps, 1.0)) - 1e-6) / SCALE)
    return math.floor(1.0 / length + 1e-6) * length if whole(steps) * length >= WORTH else 1.0


def largest_speed(particles: Particles, count: int) -> float:
    """Return the largest speed [m/s] of the first `count` particles, 0 without any; not finite where one is not."""
    return math.sqrt(float(np.int32(largest_square(particles, count, lanes())).view(np.float32))) if count else 0.0


def pool_depth(
    particles: Particles, count: int, gravity: tuple[float, ...], lower: np.ndarray, upper: np.ndarray
) -> float:
    """Return twice the mean height [m], against gravity, above the lowest point of the box `lower` to `upper` [m]."""
    strength = math.hypot(*gravity)
    if not (count and strength):
        return 0.0
    up = -np.array(gravity) / strength
    ends = np.stack([lower, upper]) * up
    height = float(np.abs(ends[1] - ends[0]).sum())
    if not height:
        return 0.0
    base, along = float(ends.min(axis=0).sum()), np.array([*up, 0.0][:3], np.float32)
    total = summed_levels(particles, along, base, height / LEVELS, count, lanes())
    return max(0.0, 2.0 * height / LEVELS * total / count)


@qd.func
def square_at(particles: Particles, i):
    """The bits of a squared speed: as integers, numbers of one sign stand in the same order.

    What is not a number comes after all others, but for its sign, which says nothing and is taken away.
    """
    return qd.bit_cast(particles.v[i].norm_sqr(), qd.i32) & 0x7FFFFFFF


@qd.kernel(fastcache=True)
def largest_square(particles: Particles, count: qd.i32, lanes: qd.template()) -> qd.i32:
    """Return the bits of the largest squared speed; on a graphics processor, `lanes` = 1, by few threads."""
    most = 0
    if qd.static(lanes == 1):
        for thread in range(many_threads()):
            own = 0
            for k in range(share_of(thread, count)):
                own = qd.max(own, square_at(particles, thread + many_threads() * k))
            qd.atomic_max(most, own)
    else:
        for i in range(count):
            qd.atomic_max(most, square_at(particles, i))
    return most


@qd.func
def level_at(particles: Particles, i, up, base, step):
    """The height of a particle along `up` above `base`, in whole steps of `step` [m]."""
    x = particles.x[i]
    height = -base
    for k in qd.static(range(x.n)):
        height += up[k] * x[k]
    return qd.cast(qd.round(height / step), qd.i32)


@qd.kernel(fastcache=True)
def summed_levels(
    particles: Particles,
    up: qd.types.vector(3, qd.f32),
    base: qd.f32,
    step: qd.f32,
    count: qd.i32,
    lanes: qd.template(),
) -> qd.i32:
    """Sum the heights along `up` above `base`, each in whole steps of `step` [m]: whole numbers repeat in any order."""
    levels = 0
    if qd.static(lanes == 1):
        for thread in range(many_threads()):
            own = 0
            for k in range(share_of(thread, count)):
                own += level_at(particles, thread + many_threads() * k, up, base, step)
            qd.atomic_add(levels, own)
    else:
        for i in range(count):
            qd.atomic_add(levels, level_at(particles, i, up, base, step))
    return levels

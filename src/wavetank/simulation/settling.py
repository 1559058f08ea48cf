"""The start of a world with solids in it: water that stands has the pressure of water that has always stood.

Water begins as a lattice, with gaps beside solids and everywhere some thousandths less dense than it will stand. The
first step would close that at once and take the way for a velocity: a jolt, on which a body of water's density glides
for seconds (notebook/bodies.md). So before the first step the water takes some in which solids and bodies stand
and no velocity stays, but the pressure that the grid carries on from step to step: what stands is as dense as its
weight makes it, and is borne. No particle moves by more than `FARTHEST` in each. What falls freely stays where it is
meanwhile. Where the water still moves after all steps, what moves does not stand: it begins where it was, so that the
front of a dam is a plane.

    code     meaning                                               unit
    own      velocities by id                                      m/s
    begun    places by id, before all steps                        m
    before   the same before a step                                m
    way      by which particles moved in a step, by id             m
    fall     the same of one that nothing holds                    m
"""

from collections.abc import Callable

import numpy as np

from wavetank.device.compiler import upload
from wavetank.physics.world import World
from wavetank.simulation.arrays import by_id, put_by_id

FEWEST, MOST, MOST_BESIDE_BODIES = 8, 60, 24  # steps
CALM = 0.04  # of the fall: mean way in a step of what does not fall freely; where it is less all water stands
RUNS = 0.1  # of the fall, the same: where it is more water runs
CALMER = 0.98  # mean way over that in the step before: where it falls by less, water runs and will not stand
FARTHEST = 0.1  # of a spacing, in a step
FREE = 0.1  # of the fall: particles whose way differs from it by less fall freely
STANDING = 0.3  # of the fall: water whose way in the last step is less stands; with twice that it does not
LIVELY = 0.002  # of the particles: where fewer move by more than that, steps end


def settle(
    world: World,
    step: Callable[[], None],
    fall: np.ndarray,
    spacing: float,
    *,
    near: Callable[[np.ndarray], np.ndarray] | None,
) -> bool:
    """Let a world take such steps, and say whether the water stands; `step` takes one, `fall` has shape [dim].

    What moves where not all is calm begins where it was, but for what began too near to a solid: `near` says of places
    [n, dim] which are, bool [n]. Without it, beside bodies, nothing is, and what moves always begins where it was.
    """
    count = world.count
    own, begun = by_id(world.particles, count, "v"), by_id(world.particles, count, "x")
    free_way = max(float(np.linalg.norm(fall)), 1e-30)
    length, is_free, mean = np.zeros(count), np.zeros(count, bool), np.inf
    for number in range(MOST_BESIDE_BODIES if near is None else MOST):
        upload(world.particles.v, [])  # all zero; `fill` would read a kernel for each array
        before = by_id(world.particles, count, "x")
        step()
        way = by_id(world.particles, count, "x") - before
        length = np.linalg.norm(way, axis=1)
        is_free = np.linalg.norm(way - fall, axis=1) < FREE * free_way
        way *= np.where(is_free, 0.0, np.minimum(1.0, FARTHEST * spacing / np.maximum(length, 1e-30)))[:, None]
        put_by_id(world.particles, count, "x", before + way)
        borne = length if near is None else length[~is_free]
        mean, last = float(borne.sum()) / max(len(borne), 1) / free_way, mean
        lively = near is not None and np.count_nonzero(borne > STANDING * free_way) >= LIVELY * count
        if number + 1 >= FEWEST and ((mean < CALM and not lively) or mean > CALMER * last):
            break
    if near is None or mean >= CALM:
        led = False if near is None else near(begun)
        stands = np.where(led, 1.0, np.clip(2.0 - length / (STANDING * free_way), 0.0, 1.0))[:, None]
        put_by_id(world.particles, count, "x", begun + stands * (by_id(world.particles, count, "x") - begun))
    put_by_id(world.particles, count, "v", own)
    return bool(mean < RUNS and 2 * np.count_nonzero(is_free) < count)

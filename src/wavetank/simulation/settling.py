"""The start of a world with bodies: water that stands has the pressure of water that has always stood.

Water begins as a lattice, with gaps beside solids and everywhere some thousandths less dense than it will stand. The
first step would close that at once and take the way for a velocity: a jolt, on which a body of water's density glides
for seconds (docs/notebook/bodies.md). So before the first step the water takes `STEPS` in which solids and bodies stand
and no velocity stays, but the pressure that the grid carries on from step to step: what stands is as dense as its
weight makes it, and is borne. No particle moves by more than `FARTHEST` in each, so that a dam stays a dam; what falls
freely stays where it is.

    code     meaning                                               unit
    own      velocities by id                                      m/s
    before   places by id                                          m
    way      by which particles moved in a step, by id             m
    fall     the same of one that nothing holds                    m
"""

from collections.abc import Callable

import numpy as np

from wavetank.physics.world import World
from wavetank.simulation.arrays import by_id, put_by_id

STEPS = 8
FARTHEST = 0.1  # of a spacing, in a step
FREE = 0.1  # of the fall: particles whose way differs from it by less fall freely


def settle(world: World, step: Callable[[], None], fall: np.ndarray, spacing: float) -> None:
    """Let a world take such steps; `step` takes one, `fall` has shape [dim]."""
    count = world.count
    own = by_id(world.particles, count, "v")
    for _ in range(STEPS):
        world.particles.v.fill(0.0)
        before = by_id(world.particles, count, "x")
        step()
        way = by_id(world.particles, count, "x") - before
        is_free = np.linalg.norm(way - fall, axis=1) < FREE * np.linalg.norm(fall)
        farthest = FARTHEST * spacing / np.maximum(np.linalg.norm(way, axis=1), 1e-30)
        way *= np.where(is_free, 0.0, np.minimum(1.0, farthest))[:, None]
        put_by_id(world.particles, count, "x", before + way)
    put_by_id(world.particles, count, "v", own)

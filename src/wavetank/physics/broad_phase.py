"""Broad phase of contact: which solids each particle may touch or feel in a substep, as bits of one number.

Every wall of the tank has a bit of its own, all other solids share the rest alternately. Within a substep a particle
reads only the solids whose bits are set, and most have none.

    code     meaning                                                             unit
    near     bits of the solids that a particle may touch or feel                1
    way      distance within which a solid is marked: path, support and more     m
    reach    radius around a solid's origin that holds all of it                 m
    sweep    how far a solid moves in the substep: its origin, and per metre     m, 1
"""

import enum

from wavetank.device.compiler import qd
from wavetank.device.state import Coefficients, Particles, Temporaries
from wavetank.physics.predicted_positions import predicted
from wavetank.solids.distance import SolidSet, image_near, lift, plane_distance, signed_distance, vec3

vec2i = qd.types.vector(2, qd.i32)


class Obstacles(enum.IntEnum):
    """The solids of a world besides the walls of its tank, for which kernels are compiled. Append only."""

    NONE = 0
    ONE_WAY = 1  # they move the water, and it does not move them
    TWO_WAY = 2  # some are bodies, which it moves


@qd.func
def marks():
    """Bits of `near`: one for each wall of the tank, all other solids share the rest alternately."""
    return 31


@qd.func
def bit_of(k, solids: SolidSet):
    """Bit of `near` that stands for solid `k`, and where there are more than `marks` for some others too."""
    bit = k
    if k >= marks():
        bit = solids.tank_count + (k - solids.tank_count) % (marks() - solids.tank_count)
    return bit


@qd.func
def is_marked(near, k, solids: SolidSet):
    """Say whether solid `k` is marked in the bits `near`."""
    return (near >> bit_of(k, solids)) & 1


@qd.func
def next_marked(near, k, solids: SolidSet):
    """First marked solid after number `k` in the bits `near`, or the number of solids; most have few."""
    following = k + 1
    bit = bit_of(following, solids)
    rest = near >> bit
    if rest != 0:
        following += qd.math.ffs(rest) - 1
    elif (near >> solids.tank_count) != 0:  # the bits are used again
        following += marks() - bit + qd.math.ffs(near >> solids.tank_count) - 1
    else:
        following = solids.count
    return qd.min(following, solids.count)


@qd.func
def marked_walls(near, solids: SolidSet):
    """Bits of `near` that stand for walls of the tank."""
    return near & ((1 << solids.tank_count) - 1)


@qd.func
def mark_walls(
    near: qd.template(), nearest: qd.template(), origins: qd.template(), targets: qd.template(), solids: SolidSet, h
):
    """Set bits of the tank's walls that particles on their ways may touch or feel, and a little more.

    All have a column for each particle, places three numbers in it; `nearest` is the distance [m] to the nearest wall.
    """
    for pair in range((solids.tank_count + 1) // 2):
        for lane in range(origins.m):
            p = vec3(targets[0, lane], targets[1, lane], targets[2, lane])
            way = 1.2 * h + (p - vec3(origins[0, lane], origins[1, lane], origins[2, lane])).norm()
            # Two walls at once: a shorter loop over lanes would be unrolled before it can be computed as vectors.
            for side in qd.static(range(2)):
                k = qd.min(2 * pair + side, solids.tank_count - 1)
                margin = way + solids.sweep[k][0] + solids.sweep[k][1] * (p - solids.position[k]).norm()
                distance = plane_distance(solids, k, p).w
                near[0, lane] |= qd.cast(distance < margin, qd.i32) << k
                nearest[0, lane] = qd.min(nearest[0, lane], distance)


@qd.func
def swept_length(k, length, at, solids: SolidSet):
    """Bound of the `length` [m] of a path that ends at `at`, in the frame of the moving solid `k`."""
    away = (image_near(solids, k, at) - solids.position[k]).norm() + length
    return length + solids.sweep[k][0] + solids.sweep[k][1] * away


@qd.func
def obstacles_around(origins: qd.template(), targets: qd.template(), solids: SolidSet, h):
    """Bits of the obstacles, all solids but the tank's walls, that any particle of a cluster may touch or feel.

    A column for each particle, as in `mark_walls`.
    """
    low = vec3(targets[0, 0], targets[1, 0], targets[2, 0])
    high, longest = low, 0.0
    for lane in range(origins.m):
        x = vec3(origins[0, lane], origins[1, lane], origins[2, lane])
        p = vec3(targets[0, lane], targets[1, lane], targets[2, lane])
        low, high, longest = qd.min(low, p), qd.max(high, p), qd.max(longest, (p - x).norm_sqr())
    middle = 0.5 * (low + high)
    way = 0.5 * (high - low).norm() + 1.2 * h + qd.sqrt(longest)
    bits = 0
    for k in range(solids.tank_count, solids.count):
        reach = solids.reach[k]
        farthest = reach + way + solids.sweep[k][0] + solids.sweep[k][1] * reach
        if (image_near(solids, k, middle) - solids.position[k]).norm_sqr() < farthest * farthest:
            bits |= 1 << bit_of(k, solids)
    return bits


@qd.func
def mark_obstacles(x, p, among, solids: SolidSet, c: Coefficients):
    """(bits of the obstacles that a particle on its path from `x` to `p` may touch or feel, 1 if it may touch one).

    Only obstacles `among` those marked are tested.
    """
    near, touched, length = 0, 0, (p - x).norm()
    way = 1.2 * c.h + length
    k = next_marked(among, solids.tank_count - 1, solids)
    while k < solids.count:
        reach = solids.reach[k]
        farthest = reach + way + solids.sweep[k][0] + solids.sweep[k][1] * reach
        away = (image_near(solids, k, p) - solids.position[k]).norm_sqr()
        if away < farthest * farthest:
            margin = way + solids.sweep[k][0] + solids.sweep[k][1] * qd.min(reach, qd.sqrt(away))
            distance = signed_distance(solids, k, p).w
            if distance < margin:
                near |= 1 << bit_of(k, solids)
                if distance < qd.max(c.wall_gap, swept_length(k, length, p, solids)):
                    touched = 1
        k = next_marked(among, k, solids)
    return vec2i(near, touched)


@qd.func
def obstacles_in_reach(x, p, solids: SolidSet, gap):
    """Bits of the obstacles that the path from `x` to `p` may touch, by their bounding spheres alone.

    For paths that are followed once, where a query of distances would not pay.
    """
    near = 0
    way = gap + (p - x).norm()
    for k in range(solids.tank_count, solids.count):
        away = (image_near(solids, k, p) - solids.position[k]).norm()
        if away < solids.reach[k] + way + solids.sweep[k][0] + solids.sweep[k][1] * qd.min(solids.reach[k], away):
            near |= 1 << bit_of(k, solids)
    return near


@qd.kernel(fastcache=True)
def mark_solids(
    particles: Particles,
    temporaries: Temporaries,
    solids: SolidSet,
    c: Coefficients,
    count: qd.i32,
    obstacles: qd.template(),
):
    """Mark the solids near the predicted positions, and the particles whose path may touch one."""
    for i in range(count):
        x = particles.x[i]
        p = predicted(particles, i)
        origin, target = qd.Matrix.zero(qd.f32, 3, 1), qd.Matrix.zero(qd.f32, 3, 1)
        for k in qd.static(range(x.n)):
            origin[k, 0] = x[k]
            target[k, 0] = p[k]
        walls = qd.Matrix.zero(qd.i32, 1, 1)
        nearest = qd.Matrix.zero(qd.f32, 1, 1)
        mark_walls(walls, nearest, origin, target, solids, c.h)
        near = walls[0, 0]
        if qd.static(obstacles):
            found = mark_obstacles(lift(x), lift(p), obstacles_around(origin, target, solids, c.h), solids, c)
            near |= found[0]
            temporaries.touching[i] = found[1]
        particles.near[i] = near

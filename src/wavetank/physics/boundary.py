"""Solids act on the water: by the density they add, by contact, by friction. One path for every solid.

A wall at the signed distance s adds I(s) to the relative density, the sum over half a rest lattice that ends there
(`smoothing.half_space`). Several walls leave the share prod_k (1 - I_k) of the support to the water, which is exact
for walls at right angles and a separable kernel, and never counts a corner twice.

    code       symbol       meaning                                                          unit
    s          s            signed distance to a solid, negative inside                      m
    n          grad s       its outward normal                                               1
    share      I(s)         part of rho_0 that the wall contributes                          1
    free       prod(1 - I)  part of the support that is left to the water                    1

Walls as densities: Koschier and Bender 2017, "Density Maps" (10.1145/3099564.3099565); where we differ: a flat wall is
assumed, so that a table of one variable replaces a volume grid for each solid.
Contact: conservative advancement along the path (Hart 1996, "Sphere tracing", 10.1007/s003710050084).
"""

from wavetank.device.compiler import qd
from wavetank.device.state import Coefficients, Particles, Scratch, Walls
from wavetank.physics.predicted_positions import predict_at, predicted
from wavetank.physics.reactions import push_back
from wavetank.solids.distance import (
    SolidSet,
    image_near,
    lift,
    local_distance,
    plane_distance,
    rotate,
    signed_distance,
    to_local,
    vec3,
    vec4,
)

vec2i = qd.types.vector(2, qd.i32)


@qd.func
def marks():
    """Bits of `near`: one for each wall of the tank, the others by turns for all other solids."""
    return 31


@qd.func
def bit_of(k, solids: SolidSet):
    """Bit of `near` that stands for solid `k`, and where there are more than `marks` for some others too."""
    bit = k
    if k >= marks():
        bit = solids.tank_count + (k - solids.tank_count) % (marks() - solids.tank_count)
    return bit


@qd.func
def is_near(near, k, solids: SolidSet):
    """Say whether solid `k` is marked in the bits `near`."""
    return (near >> bit_of(k, solids)) & 1


@qd.func
def next_near(near, k, solids: SolidSet):
    """First solid behind number `k` that is marked in the bits `near`, or past all: most particles have few marks."""
    following = k + 1
    bit = bit_of(following, solids)
    rest = near >> bit
    if rest != 0:
        following += qd.math.ffs(rest) - 1
    elif (near >> solids.tank_count) != 0:  # by the next turn
        following += marks() - bit + qd.math.ffs(near >> solids.tank_count) - 1
    else:
        following = solids.count
    return qd.min(following, solids.count)


@qd.func
def wall_share(walls: Walls, s, h):
    """Pair (I, A): share of rho_0 that a wall at the distance s contributes, and -h dI/ds."""
    last = walls.table.shape[0] - 1
    t = qd.min(qd.max(0.5 * (s / h + 1.0), 0.0), 1.0) * last
    k = qd.min(qd.cast(t, qd.i32), last - 1)
    f = t - k
    return walls.table[k] * (1.0 - f) + walls.table[k + 1] * f


@qd.func
def add_wall(sums: qd.template(), lane, value, walls: Walls, c: Coefficients):
    """Add a solid, (gradient, distance) as `value`, to a lane's (gradient [1/m], share of the support that is free).

    Where it is out of reach the table is zero to the last digit.
    """
    share = wall_share(walls, value.w, c.h) * c.wall_density
    push = sums[3, lane] * share[1] * c.inverse_h
    for k in qd.static(range(3)):
        sums[k, lane] = sums[k, lane] * (1.0 - share[0]) - value[k] * push
    sums[3, lane] *= 1.0 - share[0]


@qd.func
def add_solids(
    sums: qd.template(), lane, p: qd.template(), near, behind, solids: SolidSet, walls: Walls, c: Coefficients
):
    """Add the marked solids behind number `behind`, as `add_wall` does, at the place `p` of a lane."""
    k = next_near(near, behind, solids)
    while k < solids.count:
        add_wall(sums, lane, signed_distance(solids, k, lift(p)), walls, c)
        k = next_near(near, k, solids)


@qd.func
def fall(c: Coefficients):
    """Way [m] that all particles have fallen alike, which does not count."""
    return vec3(c.gravity_x, c.gravity_y, c.gravity_z) * c.fallen


@qd.func
def wall_density(x: qd.template(), near, solids: SolidSet, walls: Walls, c: Coefficients):
    """(gradient [1/m], relative density) that the marked solids add at `x`."""
    sums = qd.Matrix([[0.0], [0.0], [0.0], [1.0]])
    add_solids(sums, 0, x, near, -1, solids, walls, c)
    return vec4(sums[0, 0], sums[1, 0], sums[2, 0], 1.0 - sums[3, 0])


@qd.func
def follow(k, at, end, solids: SolidSet, gap):
    """Return where a particle on its way from `at` to `end` comes out, both in the frame of solid `k`.

    The path is followed in steps as long as the distance to the solid; where it touches, the rest of it slides on
    along the surface. Whatever the speed, nothing passes through a wall that the distance function resolves. Distances
    are asked for in one place of the code only, because what a kernel takes to compile grows with their number.
    """
    nearest = 0.1 * gap
    # 0: has the way touched the solid at all? 1: follow it, in 64 steps at most. 2 and 3: keep the gap where it ends.
    phase, steps = 0, 0
    while phase < 4:
        probe = end
        if phase == 1:
            probe = at
        value = local_distance(solids, k, probe)
        n = vec3(value.x, value.y, value.z)
        way = end - at
        length = way.norm()
        if phase == 0:
            # A way no longer than the distance at its end has not touched.
            phase = 4 if value.w >= qd.max(gap, length) else 1
        elif phase == 1:
            inward = way.dot(n)
            if value.w >= length:
                at = end
            elif value.w > nearest or inward >= 0.0:
                at += way * (qd.max(value.w, nearest) / length)
            else:
                end -= n * inward
                # What is left of a way straight into the wall is rounding.
                if (end - at).norm() < 1e-3 * length:
                    end = at
            steps += 1
            if steps == 64:
                end = at  # what is not done by now is not known to be free: it ends where it has got to
                phase = 2
        else:
            end += n * qd.max(gap - value.w, 0.0)
            phase += 1
        if phase == 1 and (end - at).norm() == 0.0:
            phase = 2
    return end


@qd.func
def kept_in_tank(target, near, solids: SolidSet, gap):
    """Return the point `target` moved back in front of the marked walls of the tank; nothing passes a half-space."""
    k = next_near(near, -1, solids)
    while k < solids.tank_count:
        value = plane_distance(solids, k, target)
        target += vec3(value.x, value.y, value.z) * qd.max(gap - value.w, 0.0)
        k = next_near(near, k, solids)
    return target


@qd.func
def image_of(point, place, image, solids: SolidSet):
    """The `point` [m] as it is beside the `image` of a `place` that it is near; that of an image beside the place."""
    moved = point
    if qd.static(solids.repeats):
        moved += image - place
    return moved


@qd.func
def stopped(origin, target, near, solids: SolidSet, gap, mass):
    """Return where the way from `origin` to `target` ends outside of the marked solids, in their motion.

    Bodies feel what they move by this way, which has that `mass`, over a particle's of the heaviest fluid.

    The tank comes last: it is convex from inside, so its word holds. Where one solid moved a particle all are asked
    once more.
    """
    turn, moved = 0, 1
    while turn < 2 and moved == 1:
        moved = 0
        last, push = -1, vec3(0.0, 0.0, 0.0)
        k = next_near(near, solids.tank_count - 1, solids)
        while k < solids.count:
            image = image_near(solids, k, target)
            away = (image - solids.position[k]).norm()
            if away < solids.reach[k] + gap + moves_by(k, (target - origin).norm(), image, solids):
                rotation = solids.rotation[k]
                end = to_local(solids.position[k], rotation, image)
                at = to_local(solids.old_position[k], solids.old_rotation[k], image_of(origin, target, image, solids))
                out = follow(k, at, end, solids, gap)
                if (out - end).norm() > 0.0:
                    before = target
                    target = image_of(solids.position[k] + rotate(rotation, out), image, before, solids)
                    moved = 1
                    if mass > 0.0:
                        last, push = k, target - before
                        push_back(solids, k, target, mass * push)
            k = next_near(near, k, solids)
        walls = near
        if moved == 1:  # perhaps farther than its marks reach
            walls |= (1 << solids.tank_count) - 1
        inside = kept_in_tank(target, walls, solids, gap)
        if (inside - target).norm_sqr() > 0.0:
            if last >= 0:  # what is held between body and tank goes nowhere, and is no push
                undone = qd.max(0.0, qd.min(1.0, (target - inside).dot(push) / push.norm_sqr()))
                push_back(solids, last, target, (-mass * undone) * push)
            target = inside
            moved = 1
        turn += 1
    return target


@qd.func
def walls_near(
    near: qd.template(), nearest: qd.template(), origins: qd.template(), targets: qd.template(), solids: SolidSet, h
):
    """Set bits of the tank's walls that particles on their ways may touch or feel, and a little beyond.

    All have a column for each particle, places three numbers in it; `nearest` is the distance [m] to the nearest wall.
    """
    for turn in range((solids.tank_count + 1) // 2):
        for lane in range(origins.m):
            p = vec3(targets[0, lane], targets[1, lane], targets[2, lane])
            way = 1.2 * h + (p - vec3(origins[0, lane], origins[1, lane], origins[2, lane])).norm()
            # Two walls a turn: a shorter loop over lanes would be unrolled before it can be computed as vectors.
            for side in qd.static(range(2)):
                k = qd.min(2 * turn + side, solids.tank_count - 1)
                margin = way + solids.sweep[k][0] + solids.sweep[k][1] * (p - solids.position[k]).norm()
                distance = plane_distance(solids, k, p).w
                near[0, lane] |= qd.cast(distance < margin, qd.i32) << k
                nearest[0, lane] = qd.min(nearest[0, lane], distance)


@qd.func
def moves_by(k, length, at, solids: SolidSet):
    """Bound of how far [m] a way of that length that ends at `at` leads in the frame of solid `k`, which moves."""
    away = (image_near(solids, k, at) - solids.position[k]).norm() + length
    return length + solids.sweep[k][0] + solids.sweep[k][1] * away


@qd.func
def bodies_around(origins: qd.template(), targets: qd.template(), solids: SolidSet, h):
    """Bits of the solids, other than the tank's walls, that any of several particles on their ways may touch or feel.

    A column for each particle, as in `walls_near`: those of a team are close together.
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
def near_bodies(x, p, among, solids: SolidSet, c: Coefficients):
    """Bits of the solids, other than the tank's walls, that a particle on its way from `x` to `p` may touch or feel.

    They are looked for `among` those marked. A second number says whether it may touch any.
    """
    near, touched, length = 0, 0, (p - x).norm()
    way = 1.2 * c.h + length
    k = next_near(among, solids.tank_count - 1, solids)
    while k < solids.count:
        reach = solids.reach[k]
        farthest = reach + way + solids.sweep[k][0] + solids.sweep[k][1] * reach
        away = (image_near(solids, k, p) - solids.position[k]).norm_sqr()
        if away < farthest * farthest:
            margin = way + solids.sweep[k][0] + solids.sweep[k][1] * qd.min(reach, qd.sqrt(away))
            distance = signed_distance(solids, k, p).w
            if distance < margin:
                near |= 1 << bit_of(k, solids)
                if distance < qd.max(c.wall_gap, moves_by(k, length, p, solids)):
                    touched = 1
        k = next_near(among, k, solids)
    return vec2i(near, touched)


@qd.func
def bodies_in_reach(x, p, solids: SolidSet, gap):
    """Bits of the solids, other than the tank's walls, that the way from `x` to `p` may touch: as `near_bodies`.

    Here their distances are not asked for: it is for ways that are followed once.
    """
    near = 0
    way = gap + (p - x).norm()
    for k in range(solids.tank_count, solids.count):
        away = (image_near(solids, k, p) - solids.position[k]).norm()
        if away < solids.reach[k] + way + solids.sweep[k][0] + solids.sweep[k][1] * qd.min(solids.reach[k], away):
            near |= 1 << bit_of(k, solids)
    return near


@qd.func
def flattened(point, x: qd.template()):
    """The point in space `point` as one of the world of `x`, 2-D or 3-D."""
    result = x
    for k in qd.static(range(x.n)):
        result[k] = point[k]
    return result


@qd.kernel(fastcache=True)
def keep_out_of_solids(particles: Particles, scratch: Scratch, solids: SolidSet, c: Coefficients, count: qd.i32):
    """Mark the solids that are near the predicted positions as they are now, and move these out of them."""
    for i in range(count):
        x = particles.x[i]
        p = predicted(particles, i)
        origin, target = qd.Matrix.zero(qd.f32, 3, 1), qd.Matrix.zero(qd.f32, 3, 1)
        for k in qd.static(range(x.n)):
            origin[k, 0] = x[k]
            target[k, 0] = p[k]
        near_tank = qd.Matrix.zero(qd.i32, 1, 1)
        nearest = qd.Matrix.zero(qd.f32, 1, 1)
        walls_near(near_tank, nearest, origin, target, solids, c.h)
        found = near_bodies(lift(x), lift(p), bodies_around(origin, target, solids, c.h), solids, c)
        near = near_tank[0, 0] | found[0]
        particles.near[i] = near
        if found[1] == 1:
            weight = scratch.weight[i]
            predict_at(particles, i, flattened(stopped(lift(x), lift(p), near, solids, c.wall_gap, 1.0 / weight), x))

"""The solids near each particle, asked for their distances once a step.

Within the iterations of a step solids rest at its end and particles hardly move: from where its distances were asked
for, a particle takes a solid for the plane that touches its level surface there,

    s(p) = s_0 + n (p - p_0),

and asks anew where it has gone farther than `FARTHEST` of a support. No distance is less than s_0 - |p - p_0|, however
the solid is bent: whoever is farther away than that from all of them touches none, and the others follow their way
exactly (`boundary.stopped`). What a body is pushed by is summed up by particle and handed over once, at the end.

The distance to a solid is that to the nearest of its surfaces, and its gradient turns round where another one becomes
the nearest. A particle between two strands of a knot was held by one of them alone, crept to the middle under what
pressed it, and was kicked by the whole of that in the step in which the other strand took over. What pushes is the
density that a solid adds, and that has a kernel's width: so where a solid may have crevices n is the mean slope around
the particle, which falls to 0 in the middle of one (notebook/calm.md, "Crevices").

A film thinner than a layer of particles bears less of a body, below 0.8 spacings nothing. What is caught between two
solids reads the density of water at rest where it is half as much, as each of them counts as water up to the particle.
It held a box that was a tenth heavier than water 0.6 d above the floor, for ever (notebook/bodies.md).

    code     symbol     meaning                                                             unit
    seen     p_0        where distances were asked for                                      m
    facing   (n, s_0)   outward normal and distance there of each solid near by             1, m
    push                way that this solid has moved the particle by, times its mass       m, heaviest particle's mass
"""

from wavetank.device.compiler import qd
from wavetank.device.state import Coefficients, Particles, Scratch, Walls
from wavetank.physics.boundary import add_wall, fall, moves_by, next_near, wall_share
from wavetank.physics.predicted_positions import predicted
from wavetank.physics.reactions import push_back
from wavetank.solids.distance import SolidSet, grids, image_near, lift, plane_distance, signed_distance, vec3, vec4

FARTHEST = 0.05  # of a support: from where on a particle asks anew


@qd.func
def places():
    """Solids that a particle knows at once: the nearest."""
    return 6


PLACES = places.fn()


@qd.func
def known(scratch: Scratch, i):
    """Number of solids that particle `i` knows."""
    return qd.min(scratch.solids[i], places())


@qd.func
def place_of(scratch: Scratch, i, slot):
    """Where what particle `i` knows of its solid number `slot` stands."""
    return slot * scratch.rho.shape[0] + i


@qd.func
def facing_at(scratch: Scratch, at, i, p):
    """(gradient, distance) at the point `p` of the solid that stands at the place `at` of particle `i`."""
    facing = scratch.facing[at]
    way = p - scratch.seen[i]
    return vec4(facing.x, facing.y, facing.z, facing.w + facing.x * way.x + facing.y * way.y + facing.z * way.z)


@qd.func
def may_be_hollow(solids: SolidSet, k):
    """Say whether solid `k` may have crevices: a grid or several shapes; a single shape is convex."""
    first = solids.first[k]
    return solids.first[k + 1] - first > 1 or solids.op[first] >= grids()


@qd.func
def smoothed():
    """How far from a particle, over the support, a hollow solid is asked for its slope along x, y and z: 0.4 d."""
    return 0.2


@qd.func
def in_crevice(slope):
    """Share of a mean `slope` that counts: none in a right angle, where its length is 0.7; all where it is 0.6."""
    return qd.min(qd.max(7.0 - 10.0 * slope.norm(), 0.0), 1.0)


@qd.func
def faced(solids: SolidSet, k, p, h):
    """(gradient, distance) of solid `k` at `p`; in the crevices of a hollow one the gradient is a mean around `p`."""
    value = signed_distance(solids, k, p)
    if qd.static(solids.has_grids or solids.has_operations):
        if may_be_hollow(solids, k) and value.w < h:
            slope = vec3(0.0, 0.0, 0.0)
            for side in range(6):
                way = (smoothed() - 2.0 * smoothed() * (side & 1)) * h
                at = p
                at[side >> 1] += way
                slope[side >> 1] += 0.5 * signed_distance(solids, k, at).w / way
            own = vec3(value.x, value.y, value.z)
            own += in_crevice(slope) * (slope - own)
            value = vec4(own.x, own.y, own.z, value.w)
    return value


@qd.func
def look(i, near, x, p, scratch: Scratch, solids: SolidSet, h):
    """Ask the marked solids for their distances at `p`; past `places`, the farthest goes."""
    number = 0
    way = 1.2 * h + (p - x).norm()
    k = next_near(near, solids.tank_count - 1, solids)
    while k < solids.count:
        reach = solids.reach[k]
        away = (image_near(solids, k, p) - solids.position[k]).norm()
        margin = way + solids.sweep[k][0] + solids.sweep[k][1] * qd.min(reach, away)
        if away < reach + margin:
            value = faced(solids, k, p, h)
            if value.w < margin:
                slot = number
                if number >= places():
                    slot = 0
                    for other in range(1, places()):
                        if scratch.facing[place_of(scratch, i, other)].w > scratch.facing[place_of(scratch, i, slot)].w:
                            slot = other
                at = place_of(scratch, i, slot)
                if number < places() or value.w < scratch.facing[at].w:
                    scratch.solid[at] = k
                    scratch.facing[at] = value
                    scratch.push[at] = vec3(0.0, 0.0, 0.0)
                number += 1
        k = next_near(near, k, solids)
    scratch.solids[i] = number
    scratch.seen[i] = p


@qd.kernel(fastcache=True)
def look_at_solids(scratch: Scratch, particles: Particles, solids: SolidSet, c: Coefficients, count: qd.i32):
    """Find the solids that are near the predicted positions, by their marks."""
    for i in range(count):
        near = particles.near[i]
        scratch.solids[i] = 0
        if near >> solids.tank_count != 0:
            look(i, near, lift(particles.x[i]), lift(predicted(particles, i)), scratch, solids, c.h)


@qd.kernel(fastcache=True)
def look_again(
    scratch: Scratch, particles: Particles, solids: SolidSet, c: Coefficients, farthest: qd.f32, count: qd.i32
):
    """Ask solids anew for their distances to particles that have gone farther than `farthest` [m]."""
    for i in range(count):
        if scratch.solids[i] > 0:
            p = lift(predicted(particles, i))
            if (p - scratch.seen[i]).norm_sqr() > farthest * farthest:
                scratch.seen[i] = p
                for slot in range(known(scratch, i)):
                    at = place_of(scratch, i, slot)
                    scratch.facing[at] = faced(solids, scratch.solid[at], p, c.h)


@qd.kernel(fastcache=True)
def hand_over_pushes(scratch: Scratch, particles: Particles, solids: SolidSet, count: qd.i32):
    """Let bodies feel what they have moved particles by."""
    for i in range(count):
        for slot in range(known(scratch, i)):
            at = place_of(scratch, i, slot)
            k = scratch.solid[at]
            push = scratch.push[at]
            if solids.unit[k] > 0.0 and push.norm_sqr() > 0.0:
                push_back(solids, k, lift(predicted(particles, i)), push)
                scratch.push[at] = vec3(0.0, 0.0, 0.0)


@qd.func
def find_walls(
    sums: qd.template(), team, particles: Particles, scratch: Scratch, solids: SolidSet, walls: Walls, c: Coefficients
):
    """Find, in a column for each particle of a team, (gradient [1/m], free share) by the solids near it.

    Returns the bits of the solids that one of them is near. All are computed in all lanes at once; a particle that
    knows fewer solids than another has one that is far away.
    """
    first = team * sums.m
    near = 0
    for lane in range(sums.m):
        near |= particles.near[first + lane]
    for lane in range(sums.m):
        sums[3, lane] = 1.0
    way = fall(c)
    k = next_near(near, -1, solids)
    while k < solids.tank_count:
        for lane in range(sums.m):
            add_wall(sums, lane, plane_distance(solids, k, lift(predicted(particles, first + lane)) - way), walls, c)
        k = next_near(near, k, solids)
    if near >> solids.tank_count != 0:
        most = 0
        for lane in range(sums.m):
            most = qd.max(most, known(scratch, first + lane))
        for slot in range(most):
            for lane in range(sums.m):
                i = first + lane
                value = facing_at(scratch, place_of(scratch, i, slot), i, lift(predicted(particles, i)) - way)
                value.w = value.w if slot < scratch.solids[i] else 2.0 * c.h
                add_wall(sums, lane, value, walls, c)
    return near


@qd.func
def is_clear(i, x, p, scratch: Scratch, solids: SolidSet, c: Coefficients):
    """Say whether the way of particle `i` from `x` to `p` touches none of the solids near it, without asking them."""
    clear = scratch.solids[i] <= places()
    length, moved = (p - x).norm(), (p - scratch.seen[i]).norm()
    for slot in range(known(scratch, i)):
        at = place_of(scratch, i, slot)
        left = scratch.facing[at].w - moved
        if left <= c.wall_gap or left <= moves_by(scratch.solid[at], length, p, solids):
            clear = False
    return clear


@qd.func
def thinnest():
    """Thickness over the support up to which a film between two solids bears nothing: 0.8 spacings."""
    return 0.33


@qd.func
def thick():
    """And from which on it bears all: a layer of particles."""
    return 0.45


@qd.func
def borne(i, p, facing, near, scratch: Scratch, solids: SolidSet, c: Coefficients):
    """Share of a push of the solid (gradient, distance) as `facing` that the film between it and another bears."""
    opposite = 2.0 * c.h
    k = next_near(near, -1, solids)
    while k < solids.tank_count:
        other = plane_distance(solids, k, p)
        opposite = nearer_opposite(opposite, facing, other)
        k = next_near(near, k, solids)
    for slot in range(known(scratch, i)):
        opposite = nearer_opposite(opposite, facing, facing_at(scratch, place_of(scratch, i, slot), i, p))
    thickness = (facing.w + opposite) * c.inverse_h
    return qd.min(qd.max((thickness - thinnest()) / (thick() - thinnest()), 0.0), 1.0)


@qd.func
def nearer_opposite(nearest, facing, other):
    """Distance of the `nearest` solid that faces another one, or of this `other` if it does and is nearer."""
    against = facing.x * other.x + facing.y * other.y + facing.z * other.z
    return qd.min(nearest, other.w if against < -0.7 else nearest)


@qd.func
def press_back(i, p, near, free, push, scratch: Scratch, solids: SolidSet, walls: Walls, c: Coefficients):
    """Sum up what the share of bodies in the density at `p` moves a particle by: `push` [m^2] times the gradient.

    `free` is the share of its support that all solids leave.
    """
    for slot in range(known(scratch, i)):
        at = place_of(scratch, i, slot)
        if solids.unit[scratch.solid[at]] > 0.0:
            value = facing_at(scratch, at, i, p)
            if value.w < c.h:
                share = wall_share(walls, value.w, c.h) * c.wall_density
                others = free / qd.max(1.0 - share[0], 1e-6)
                felt = push * borne(i, p, value, near, scratch, solids, c)
                scratch.push[at] -= vec3(value.x, value.y, value.z) * (felt * others * share[1] * c.inverse_h)

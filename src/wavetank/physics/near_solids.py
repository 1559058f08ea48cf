"""The solids near each particle: their distances are queried once a step, and extrapolated in its iterations.

Within the iterations of a step solids rest at its end and particles hardly move: near the point p_0 at which its
distances were queried a particle takes each solid for its contact plane, which touches the level surface there,

    s(p) = s_0 + n (p - p_0),

and they are queried again where it has moved farther than `FARTHEST` of a support. No distance is less than
s_0 - |p - p_0|, however the solid is bent: a particle that is farther than that from all solids touches none; the paths
of the others are followed (`contact.end_of_path`). The pushes on bodies are summed by particle and applied at the end.

The distance to a solid is that to the nearest of its surfaces, and its gradient turns where another one becomes the
nearest. Between two strands of a knot a particle was held by one of them alone, crept to the middle and was kicked out
when the other strand took over. The density that a solid adds pushes, and has the width of a kernel: where a solid may
have crevices n is therefore the mean slope around the particle, which falls to 0 in the middle of a crevice
(notebook/calm.md, "Crevices").

A film between two solids that is thinner than a layer of particles carries less of a body's load, below 0.8 spacings
none. A particle between two solids reads the density of water at rest where it is half of that, as each solid counts as
water up to the particle. That held a box a tenth heavier than water 0.6 d above the floor (notebook/bodies.md).

    code         symbol    meaning                                                          unit
    query_point  p_0       where distances were queried                                     m
    plane        (n, s_0)  outward normal and distance there of each solid near by          1, m
    push                   displacement that a solid gave the particle, times its mass      m, heaviest particle's mass
"""

from wavetank.device.compiler import qd
from wavetank.device.state import Coefficients, Particles, Temporaries, Walls
from wavetank.physics.bodies import push_back
from wavetank.physics.boundary import add_wall, fall, wall_share
from wavetank.physics.broad_phase import marked_walls, next_marked, swept_length
from wavetank.physics.predicted_positions import predicted
from wavetank.solids.distance import SolidSet, grids, image_near, lift, plane_distance, signed_distance, vec3, vec4

FARTHEST = 0.05  # of a support: way after which distances are queried again


@qd.func
def max_solids():
    """Largest number of solids that are known for a particle: the nearest."""
    return 6


MAX_SOLIDS = max_solids.fn()


@qd.func
def known_solids(temporaries: Temporaries, i):
    """Number of solids that are known for particle `i`."""
    return qd.min(temporaries.solid_count[i], max_solids())


@qd.func
def slot_index(temporaries: Temporaries, i, slot):
    """Index of the solid number `slot` of particle `i` in the arrays of solids near particles."""
    return slot * temporaries.rho.shape[0] + i


@qd.func
def contact_plane(temporaries: Temporaries, at, i, p):
    """(normal, distance [m]) at the point `p` of the solid with the index `at` of particle `i`."""
    plane = temporaries.plane[at]
    way = p - temporaries.query_point[i]
    return vec4(plane.x, plane.y, plane.z, plane.w + plane.x * way.x + plane.y * way.y + plane.z * way.z)


@qd.func
def may_be_hollow(solids: SolidSet, k):
    """Say whether solid `k` may have crevices: a grid or several shapes; a single shape is convex."""
    first = solids.first[k]
    return solids.first[k + 1] - first > 1 or solids.op[first] >= grids()


@qd.func
def smoothed():
    """Distance over the support from which the mean slope of a hollow solid is taken along x, y and z: 0.4 d."""
    return 0.2


@qd.func
def in_crevice(slope):
    """Share of a mean `slope` that counts: none in a right angle, where its length is 0.7; all where it is 0.6."""
    return qd.min(qd.max(7.0 - 10.0 * slope.norm(), 0.0), 1.0)


@qd.func
def query_plane(solids: SolidSet, k, p, h):
    """(gradient, distance) of solid `k` at `p`; in the crevices of a hollow one the gradient is a mean around `p`.

    One call of `signed_distance` serves all points, as each is inlined and compiled: first `p`, then its six sides.
    """
    if qd.static(not (solids.has_grids or solids.has_operations)):
        return signed_distance(solids, k, p)
    value = vec4(0.0, 0.0, 0.0, 0.0)
    slope = vec3(0.0, 0.0, 0.0)
    probes, probe = 1, 0
    while probe < probes:
        side = probe - 1
        way = (smoothed() - 2.0 * smoothed() * (side & 1)) * h
        at = p
        if side >= 0:
            at[side >> 1] += way
        found = signed_distance(solids, k, at)
        if side >= 0:
            slope[side >> 1] += 0.5 * found.w / way
        else:
            value = found
            if may_be_hollow(solids, k) and value.w < h:
                probes = 7
        probe += 1
    if probes > 1:
        own = vec3(value.x, value.y, value.z)
        own += in_crevice(slope) * (slope - own)
        value = vec4(own.x, own.y, own.z, value.w)
    return value


@qd.func
def query_distances(i, near, x, p, temporaries: Temporaries, solids: SolidSet, h):
    """Query the distances of the marked solids at `p`."""
    temporaries.solid_count[i] = 0
    temporaries.query_point[i] = p
    way = 1.2 * h + (p - x).norm()
    k = next_marked(near, solids.tank_count - 1, solids)
    while k < solids.count:
        reach = solids.reach[k]
        away = (image_near(solids, k, p) - solids.position[k]).norm()
        margin = way + solids.sweep[k][0] + solids.sweep[k][1] * qd.min(reach, away)
        if away < reach + margin:
            value = query_plane(solids, k, p, h)
            if value.w < margin:
                keep_contact(i, k, value, temporaries)
        k = next_marked(near, k, solids)


@qd.func
def keep_contact(i, k, value, temporaries: Temporaries):
    """Keep the (gradient, distance) `value` of solid `k` for particle `i`, in place of the farthest if full."""
    number = temporaries.solid_count[i]
    at = slot_index(temporaries, i, number)
    if number >= max_solids():
        at = slot_index(temporaries, i, 0)
        for slot in range(1, max_solids()):
            other = slot_index(temporaries, i, slot)
            if temporaries.plane[other].w > temporaries.plane[at].w:
                at = other
    if number < max_solids() or value.w < temporaries.plane[at].w:
        temporaries.solid[at] = k
        temporaries.plane[at] = value
        temporaries.push[at] = vec3(0.0, 0.0, 0.0)
    temporaries.solid_count[i] = number + 1


@qd.kernel(fastcache=True)
def query_solids(temporaries: Temporaries, particles: Particles, solids: SolidSet, c: Coefficients, count: qd.i32):
    """Query the solids that are marked near the predicted positions."""
    for i in range(count):
        near = particles.near[i]
        temporaries.solid_count[i] = 0
        if near >> solids.tank_count != 0:
            query_distances(i, near, lift(particles.x[i]), lift(predicted(particles, i)), temporaries, solids, c.h)


@qd.kernel(fastcache=True)
def requery_solids(
    temporaries: Temporaries, particles: Particles, solids: SolidSet, c: Coefficients, farthest: qd.f32, count: qd.i32
):
    """Query distances again for particles that have moved farther than `farthest` [m]."""
    for i in range(count):
        if temporaries.solid_count[i] > 0:
            p = lift(predicted(particles, i))
            if (p - temporaries.query_point[i]).norm_sqr() > farthest * farthest:
                temporaries.query_point[i] = p
                for slot in range(known_solids(temporaries, i)):
                    at = slot_index(temporaries, i, slot)
                    temporaries.plane[at] = query_plane(solids, temporaries.solid[at], p, c.h)


@qd.kernel(fastcache=True)
def apply_reactions(temporaries: Temporaries, particles: Particles, solids: SolidSet, count: qd.i32):
    """Apply to bodies the opposite of what they have moved particles by."""
    for i in range(count):
        for slot in range(known_solids(temporaries, i)):
            at = slot_index(temporaries, i, slot)
            k = temporaries.solid[at]
            push = temporaries.push[at]
            if solids.unit[k] > 0.0 and push.norm_sqr() > 0.0:
                push_back(solids, k, lift(predicted(particles, i)), push)
                temporaries.push[at] = vec3(0.0, 0.0, 0.0)


@qd.func
def find_walls(
    sums: qd.template(),
    cluster,
    particles: Particles,
    temporaries: Temporaries,
    solids: SolidSet,
    walls: Walls,
    c: Coefficients,
):
    """Find, in a column for each particle of a cluster, (gradient [1/m], free share) by the solids near it.

    Returns the bits of the solids that one of them is near. All are computed in all lanes at once; a particle that
    has fewer solids than another gets one that is far away.
    """
    first = cluster * sums.m
    near = 0
    for lane in range(sums.m):
        near |= particles.near[first + lane]
    for lane in range(sums.m):
        sums[3, lane] = 1.0
    way = fall(c)
    tank = marked_walls(near, solids)
    while tank != 0:
        k = qd.math.ffs(tank) - 1
        for lane in range(sums.m):
            add_wall(sums, lane, plane_distance(solids, k, lift(predicted(particles, first + lane)) - way), walls, c)
        tank &= tank - 1
    if near >> solids.tank_count != 0:
        most = 0
        for lane in range(sums.m):
            most = qd.max(most, known_solids(temporaries, first + lane))
        for slot in range(most):
            for lane in range(sums.m):
                i = first + lane
                value = contact_plane(
                    temporaries, slot_index(temporaries, i, slot), i, lift(predicted(particles, i)) - way
                )
                value.w = value.w if slot < temporaries.solid_count[i] else 2.0 * c.h
                add_wall(sums, lane, value, walls, c)
    return near


@qd.func
def is_clear(i, x, p, temporaries: Temporaries, solids: SolidSet, c: Coefficients):
    """Whether the path of particle `i` from `x` to `p` touches no solid, as far as the distances known say."""
    clear = temporaries.solid_count[i] <= max_solids()
    length, moved = (p - x).norm(), (p - temporaries.query_point[i]).norm()
    for slot in range(known_solids(temporaries, i)):
        at = slot_index(temporaries, i, slot)
        left = temporaries.plane[at].w - moved
        if left <= c.wall_gap or left <= swept_length(temporaries.solid[at], length, p, solids):
            clear = False
    return clear


@qd.func
def thinnest():
    """Thickness over the support up to which a film between two solids carries no load: 0.8 spacings."""
    return 0.33


@qd.func
def thickest():
    """Thickness from which on it carries the whole load: a layer of particles."""
    return 0.45


@qd.func
def load_fraction(i, p, plane, near, temporaries: Temporaries, solids: SolidSet, c: Coefficients):
    """Fraction of the load of a solid, of the contact `plane`, that the film between it and another solid carries."""
    opposite = 2.0 * c.h
    tank = marked_walls(near, solids)
    while tank != 0:
        opposite = nearer_opposite(opposite, plane, plane_distance(solids, qd.math.ffs(tank) - 1, p))
        tank &= tank - 1
    for slot in range(known_solids(temporaries, i)):
        opposite = nearer_opposite(opposite, plane, contact_plane(temporaries, slot_index(temporaries, i, slot), i, p))
    thickness = (plane.w + opposite) * c.inverse_h
    return qd.min(qd.max((thickness - thinnest()) / (thickest() - thinnest()), 0.0), 1.0)


@qd.func
def nearer_opposite(nearest, plane, other):
    """Distance [m] of the `nearest` solid opposite a contact `plane`, or of the plane `other` if that is nearer."""
    against = plane.x * other.x + plane.y * other.y + plane.z * other.z
    return qd.min(nearest, other.w if against < -0.7 else nearest)


@qd.func
def accumulate_reaction(
    i, p, near, free, push, temporaries: Temporaries, solids: SolidSet, walls: Walls, c: Coefficients
):
    """Sum the pushes of bodies on a particle, by their share of the density at `p`: `push` [m^2] times the gradient.

    `free` is the share of its support that all solids leave.
    """
    for slot in range(known_solids(temporaries, i)):
        at = slot_index(temporaries, i, slot)
        if solids.unit[temporaries.solid[at]] > 0.0:
            value = contact_plane(temporaries, at, i, p)
            if value.w < c.h:
                share = wall_share(walls, value.w, c.h) * c.wall_density
                others = free / qd.max(1.0 - share[0], 1e-6)
                felt = push * load_fraction(i, p, value, near, temporaries, solids, c)
                temporaries.push[at] -= vec3(value.x, value.y, value.z) * (felt * others * share[1] * c.inverse_h)

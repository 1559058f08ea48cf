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

from wavetank.compiler import qd
from wavetank.distance import SolidSet, lift, local_distance, rotate, signed_distance, to_local, vec3, vec4
from wavetank.state import Coefficients, Particles, Walls

# Bit 30 of `near` stands for every solid from number 30 on.


@qd.func
def is_near(near, k):
    """Say whether solid `k` is marked in the bits `near`."""
    return (near >> qd.min(k, 30)) & 1


@qd.func
def wall_share(walls: Walls, s, h):
    """Pair (I, A): share of rho_0 that a wall at the distance s contributes, and -h dI/ds."""
    last = walls.table.shape[0] - 1
    t = qd.min(qd.max(0.5 * (s / h + 1.0), 0.0), 1.0) * last
    k = qd.min(qd.cast(t, qd.i32), last - 1)
    f = t - k
    return walls.table[k] * (1.0 - f) + walls.table[k + 1] * f


@qd.func
def wall_density(x: qd.template(), near, solids: SolidSet, walls: Walls, c: Coefficients):
    """(gradient [1/m], relative density) that the marked solids add at `x`."""
    point = lift(x)
    free = 1.0
    gradient = vec3(0.0, 0.0, 0.0)
    for k in range(solids.count):
        if is_near(near, k) == 1:
            value = signed_distance(solids, k, point)
            if value.w < c.h:
                share = wall_share(walls, value.w, c.h) * c.wall_density
                n = vec3(value.x, value.y, value.z)
                gradient = gradient * (1.0 - share[0]) - n * (free * share[1] / c.h)
                free *= 1.0 - share[0]
    return vec4(gradient.x, gradient.y, gradient.z, 1.0 - free)


@qd.func
def follow(k, at, end, solids: SolidSet, gap):
    """Return where a particle on its way from `at` to `end` comes out, both in the frame of solid `k`.

    The path is followed in steps as long as the distance to the solid; where it touches, the rest of it slides on
    along the surface. Whatever the speed, nothing passes through a wall that the distance function resolves.
    """
    nearest = 0.1 * gap
    for _ in range(64):
        way = end - at
        length = way.norm()
        if length > 0.0:
            value = local_distance(solids, k, at)
            n = vec3(value.x, value.y, value.z)
            inward = way.dot(n)
            if value.w >= length:
                at = end
            elif value.w > nearest or inward >= 0.0:
                at += way * (qd.max(value.w, nearest) / length) if value.w < length else way
            else:
                end -= n * inward
                # What is left of a way straight into the wall is rounding.
                if (end - at).norm() < 1e-3 * length:
                    end = at
    # What is not done by now is not known to be free: it ends where it has got to.
    end = at
    for _ in range(2):
        value = local_distance(solids, k, end)
        if value.w < gap:
            end += vec3(value.x, value.y, value.z) * (gap - value.w)
    return end


@qd.func
def stopped(origin, target, near, solids: SolidSet, gap):
    """Return where the way from `origin` to `target` ends outside of the marked solids, in their motion.

    The tank comes last: it is convex from inside, so its word holds. Where one solid moved a particle all are asked
    once more.
    """
    turns = solids.count
    for turn in range(2 * solids.count):
        k = solids.count - 1 - turn % solids.count
        if turn < turns and is_near(near, k) == 1:
            rotation = solids.rotation[k]
            end = to_local(solids.position[k], rotation, target)
            at = to_local(solids.old_position[k], solids.old_rotation[k], origin)
            # A way no longer than the distance at its end has not touched the solid.
            if local_distance(solids, k, end).w < qd.max(gap, (end - at).norm()):
                out = follow(k, at, end, solids, gap)
                if (out - end).norm() > 0.0:
                    target = solids.position[k] + rotate(rotation, out)
                    turns = 2 * solids.count
    return target


@qd.func
def near_solids(x, p, solids: SolidSet, h):
    """Bits of the solids that a particle on its way from `x` to `p` may touch or feel, and a little beyond."""
    near = 0
    for k in range(solids.count):
        turn = (solids.rotation[k] - solids.old_rotation[k]).norm()
        margin = 1.2 * h + (p - x).norm() + (solids.position[k] - solids.old_position[k]).norm()
        margin += 2.0 * turn * qd.min(solids.reach[k], (p - solids.position[k]).norm())
        if (p - solids.position[k]).norm() < solids.reach[k] + margin:
            if signed_distance(solids, k, p).w < margin:
                near |= 1 << qd.min(k, 30)
    return near


@qd.kernel(fastcache=True)
def keep_out_of_solids(particles: Particles, solids: SolidSet, c: Coefficients, count: qd.i32):
    """Move the predicted positions out of the solids, as reached from the positions before."""
    for i in range(count):
        near = particles.near[i]
        if near != 0:
            target = stopped(lift(particles.x[i]), lift(particles.p[i]), near, solids, c.wall_gap)
            p = particles.p[i]
            for axis in qd.static(range(p.n)):
                p[axis] = target[axis]
            particles.p[i] = p


@qd.kernel(fastcache=True)
def mark_near_solids(particles: Particles, solids: SolidSet, c: Coefficients, count: qd.i32):
    """Mark for every particle the solids that it may touch or feel on its way and a little beyond."""
    for i in range(count):
        particles.near[i] = near_solids(lift(particles.x[i]), lift(particles.p[i]), solids, c.h)

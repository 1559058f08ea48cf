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
from wavetank.distance import SolidSet, conjugate, lift, local_distance, rotate, signed_distance, to_local, vec3, vec4
from wavetank.state import Coefficients, Particles, Scratch, Walls

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
def mark_near(x: qd.template(), p: qd.template(), solids: SolidSet, c: Coefficients):
    """Bits of the solids that the particle may touch or feel on its way from `x` to `p` and a little beyond."""
    near = 0
    margin = 1.2 * c.h + (p - x).norm()
    point = lift(p)
    for k in range(solids.count):
        moved = (solids.position[k] - solids.old_position[k]).norm()
        if (point - solids.position[k]).norm() < solids.reach[k] + margin + moved:
            if signed_distance(solids, k, point).w < margin + moved:
                near |= 1 << qd.min(k, 30)
    return near


@qd.func
def keep_out(x: qd.template(), p: qd.template(), near, solids: SolidSet, c: Coefficients):
    """Return `p` moved out of the marked solids, as reached from `x` without passing through any.

    Tank walls come last in effect: they are convex from inside, so the final word keeps the particle in the tank.
    """
    target = lift(p)
    origin = lift(x)
    for turn in range(2):
        for back in range(solids.count):
            k = solids.count - 1 - back
            if is_near(near, k) == 1:
                target = keep_out_of(k, origin, target, solids, c.wall_gap)
    result = p
    for axis in qd.static(range(x.n)):
        result[axis] = target[axis]
    return result


@qd.func
def keep_out_of(k, origin, target, solids: SolidSet, gap):
    """Return `target` moved out of solid `k`, as reached from `origin`; both world points, in the solid's motion."""
    q = solids.rotation[k]
    start = to_local(solids.old_position[k], solids.old_rotation[k], origin)
    end = to_local(solids.position[k], q, target)
    way = end - start
    length = way.norm()
    s_start = local_distance(solids, k, start).w
    value = local_distance(solids, k, end)
    # To enter and to leave again costs at least the distances at both ends, so a longer way alone can pass through.
    if value.w >= gap and s_start > 0.0 and s_start + value.w < length:
        step = way / length
        t = 0.0
        s = s_start
        for _ in range(32):
            if s > 0.1 * gap and t < length:
                t = qd.min(t + s, length)
                s = local_distance(solids, k, start + step * t).w
        if t < length:
            hit = local_distance(solids, k, start + step * t)
            n = vec3(hit.x, hit.y, hit.z)
            end = start + step * t + (1.0 - t / length) * (way - n * way.dot(n))
            value = local_distance(solids, k, end)
    for _ in range(2):
        if value.w < gap:
            end += vec3(value.x, value.y, value.z) * (gap - value.w)
            value = local_distance(solids, k, end)
    return solids.position[k] + rotate(q, end)


@qd.kernel(fastcache=True)
def mark_near_solids(particles: Particles, scratch: Scratch, solids: SolidSet, c: Coefficients, count: qd.i32):
    """Mark for every particle the solids to look at in this substep."""
    for i in range(count):
        scratch.near[i] = mark_near(particles.x[i], particles.p[i], solids, c)


__all__ = ["conjugate", "keep_out", "mark_near_solids", "wall_density"]

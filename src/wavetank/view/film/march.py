"""Intersections of rays with water, solids, balls and the floor.

code      symbol   meaning                                                        unit
p, ahead           origin of a ray, and its unit direction                        m, 1
t                  way along it                                                   m
wet                1 where the ray runs in the water                              1
cell               edge of a cell of the grid, two nodes                          m
"""

import dataclasses
import enum

from wavetank.device.compiler import qd
from wavetank.solids.distance import SolidSet
from wavetank.view.film.balls import Balls
from wavetank.view.film.grid import Field, Grid, outward_at, value_at
from wavetank.view.lens import vec3, vec4
from wavetank.view.optics.interface import bent, index_of_water, mirrored
from wavetank.view.optics.rays import box_interval
from wavetank.view.paints import Finish
from wavetank.view.passes.solids import Window, ball_interval, meet


class Hit(enum.IntEnum):
    """What a ray ends at. Append only: the compiler's cache does not see the numbers."""

    SKY = 0
    FLOOR = 1
    SOLID = 2
    SURFACE = 3  # of the water
    DROP = 4
    FROTH = 5
    OPAQUE = 6  # a fluid that scatters so much that it counts as a matte surface
    SCATTERING = 7  # an event in a turbid fluid


@dataclasses.dataclass(frozen=True, eq=False)
class World:
    """All that a ray may hit, on the device."""

    field: Field
    balls: Balls
    solids: SolidSet
    window: Window
    paints: qd.types.ndarray()  # vec3 [solids]: albedo, of glass what it lets through
    finish: qd.types.ndarray()  # i32 [solids]: one of `paints.Finish`


@qd.func
def first_solid(solids: SolidSet, window: Window, finish: qd.template(), p, ahead, far):
    """(normal, way) of the first solid nearer than `far`, a way of -1 where there is none; and its number."""
    best, which, last = vec4(0.0, 0.0, 0.0, -1.0), 0, qd.min(far, 1e4)
    for k in range(solids.tank_count, solids.count):
        bound = ball_interval(p, ahead, solids.position[k], 1.001 * solids.reach[k] + 1e-4)
        first, end = qd.max(2e-5, bound[0]), qd.min(last, bound[1])
        if first <= end:
            inside = box_interval(p, ahead, window.inside)
            if solids.reach[k] > 1e4:
                inside = box_interval(p, ahead, window.endless)
            first, end = qd.max(first, inside[0]), qd.min(end, inside[1])
        if first <= end:
            # A ray that begins in glass leaves it unseen.
            hit = meet(solids, k, p, ahead, first, end, qd.select(finish[k] == Finish.GLASS, -1.0, 0.0))
            if hit.w >= 0.0:
                best, which, last = hit, k, hit.w
    return best, which


@qd.func
def first_ball(balls: Balls, cell, p, ahead, far, within):
    """(way, number) of the first ball of a cell nearer than `far`; from `within` that ball is left. -1: none."""
    best, which = far, -1
    for entry in range(balls.start[cell], balls.start[cell + 1]):
        m = balls.list[entry]
        b = balls.ball[m]
        off = vec3(b.x, b.y, b.z) - p
        along = off.dot(ahead)
        half = b.w * b.w - off.dot(off) + along * along
        if half > 0.0 and m != within:
            t = along - qd.sqrt(half)
            if t > 0.0 and t < best:
                best, which = t, m
    return best, which


@qd.dataclass
class March:
    """The state of a ray on its way through the grid."""

    t: qd.f32  # m: where it is
    end: qd.f32  # m: where the search ends
    sign: qd.f32  # 1 in the water, -1 in air
    fits: qd.i32  # 1 once the field has been found to agree with `sign`
    going: qd.i32  # 1 until the end
    hit: vec4  # normal out of what it meets, and way [m]; a way of -1 where it has met nothing
    kind: qd.i32  # what it has met
    which: qd.i32  # number of a ball, else -1


@qd.func
def first_water(level: qd.template(), skip: qd.template(), grid: Grid, balls: Balls, p, ahead, far, wet, seen):
    """Follow a ray through the grid: (normal out of what it meets, way), its `Hit`, a ball's number, if it was wet.

    The way is -1 where it meets neither surface, pane nor ball nearer than `far`. A ray whose state does not agree with
    the field, by rounding, takes the field's. With `seen` of 0 balls are not looked for.
    """
    ends = box_interval(p, ahead, grid.box)
    march = begun_march(level, grid, p, ahead, ends, far, wet)
    cell = 2.0 * grid.step
    ncx, ncy, ncz = grid.nx // 2, grid.ny // 2, grid.nz // 2
    steps = 0
    while march.going == 1:
        q = (p + (march.t + 1e-5 * cell.x) * ahead - grid.lower) / cell
        c = qd.cast(qd.floor(q), qd.i32)
        x, y, z = bounded(c.x, ncx), bounded(c.y, ncy), bounded(c.z, ncz)
        number = x + ncx * (y + ncy * z)
        far_off = skip[number]
        leaves = way_out(grid, p, ahead, x, y, z, qd.max(far_off - 1, 0))
        leaves = qd.max(leaves, march.t + 1e-4 * cell.x)
        if far_off > 0:
            # Nothing but water, or nothing but air.
            x_here = p + 0.5 * (march.t + qd.min(leaves, march.end)) * ahead
            march.sign = qd.select(value_at(level, grid, x_here) > 0.0, 1.0, -1.0)
            march.fits = 1
        else:
            stop = qd.min(leaves, march.end)
            if seen == 1:
                stop = meet_ball(march, balls, number, p, ahead, stop)
            meet_surface(march, level, grid, p, ahead, stop)
        march.t = leaves
        steps += 1
        if march.t >= march.end or steps > 4096:
            march.going = 0
            if march.kind == Hit.SKY and march.sign > 0.0 and ends[1] < far and ends[1] > 0.0:
                # Through a pane out of the water.
                n = face(grid, p + ends[1] * ahead, ahead, 1.0)
                march.hit, march.kind = vec4(n.x, n.y, n.z, ends[1]), Hit.SURFACE
    return march.hit, march.kind, march.which, qd.select(march.sign > 0.0, 1, 0)


@qd.func
def begun_march(level: qd.template(), grid: Grid, p, ahead, ends, far, wet):
    """The march of a ray from where it is in the grid, or from the face through which it comes in."""
    start, end = qd.max(ends[0], 0.0), qd.min(ends[1], far)
    march = March(
        t=start,
        end=end,
        sign=qd.select(wet == 1, 1.0, -1.0),
        fits=0,
        going=qd.select(start < end, 1, 0),
        hit=vec4(0.0, 0.0, 0.0, -1.0),
        kind=0,
        which=-1,
    )
    if march.going == 1:
        before = value_at(level, grid, p + march.t * ahead)
        if ends[0] > 0.0:
            march.sign = -1.0
            if before > 0.0:
                n = face(grid, p + march.t * ahead, ahead, -1.0)
                march.hit, march.kind, march.going = vec4(n.x, n.y, n.z, march.t), Hit.SURFACE, 0
    elif ends[1] <= 0.0 or ends[0] > ends[1]:
        march.sign = -1.0
    march.fits = qd.select(value_at(level, grid, p + march.t * ahead) * march.sign > 0.0, 1, 0)
    return march


@qd.func
def way_out(grid: Grid, p, ahead, x, y, z, wide):
    """Way [m] along a ray to where it leaves a cell and those up to `wide` cells around it."""
    leaves = 1e9
    cell = 2.0 * grid.step
    for k in qd.static(range(3)):
        index = x
        if qd.static(k == 1):
            index = y
        elif qd.static(k == 2):
            index = z
        if qd.abs(ahead[k]) > 1e-9:
            bound = qd.select(ahead[k] > 0.0, index + wide + 1, index - wide)
            leaves = qd.min(leaves, (grid.lower[k] + bound * cell[k] - p[k]) / ahead[k])
    return leaves


@qd.func
def meet_ball(march: qd.template(), balls: Balls, cell, p, ahead, stop):
    """Let a march end at the first ball of a cell; return how far [m] the surface is to be looked for."""
    way, ball = first_ball(balls, cell, p, ahead, march.end, -1)
    if ball >= 0 and (march.sign < 0.0 or balls.kind[ball] == 1):
        b = balls.ball[ball]
        n = (p + way * ahead - vec3(b.x, b.y, b.z)) / b.w
        march.hit, march.which, march.end = vec4(n.x, n.y, n.z, way), ball, way
        march.kind = qd.select(balls.kind[ball] == 1, Hit.FROTH, Hit.DROP)
    return qd.min(stop, march.end)


@qd.func
def meet_surface(march: qd.template(), level: qd.template(), grid: Grid, p, ahead, stop):
    """Let a march end where the field changes its sign before `stop` [m], in steps of 0.62 nodes or less."""
    parts = qd.cast(qd.max(stop - march.t, 0.0) / (0.62 * grid.step.x), qd.i32) + 1
    pace, low = qd.max(stop - march.t, 0.0) / parts, march.t
    for part in range(parts):
        if march.going == 1:
            high = march.t + pace * (part + 1)
            value = value_at(level, grid, p + high * ahead) * march.sign
            if value <= 0.0 and march.fits == 1:
                way = zero_between(level, grid, p, ahead, march.sign, low, high)
                n = outward_at(level, grid, p + way * ahead)
                march.hit, march.kind, march.which = vec4(n.x, n.y, n.z, way), Hit.SURFACE, -1
                march.going = 0
            march.fits = qd.select(value > 0.0, 1, march.fits)
            low = high


@qd.func
def zero_between(level: qd.template(), grid: Grid, p, ahead, sign, low, high):
    """Way [m] to the zero of a field between two ways along a ray, by bisection."""
    a, b = low, high
    for _ in range(12):
        middle = 0.5 * (a + b)
        if value_at(level, grid, p + middle * ahead) * sign <= 0.0:
            b = middle
        else:
            a = middle
    return b


@qd.func
def bounded(c, count):
    """Index of a cell within the grid."""
    return qd.min(qd.max(c, 0), count - 1)


@qd.func
def face(grid: Grid, x, ahead, side):
    """Normal out of the grid of the face at a point, through which a ray goes out (`side` 1) or in (-1)."""
    lower, upper = grid.lower, grid.upper
    n, nearest = vec3(0.0, 0.0, 0.0), 1e9
    for k in qd.static(range(3)):
        off = qd.select(ahead[k] * side > 0.0, qd.abs(upper[k] - x[k]), qd.abs(x[k] - lower[k]))
        if off < nearest and qd.abs(ahead[k]) > 1e-9:
            nearest = off
            n = vec3(0.0, 0.0, 0.0)
            n[k] = qd.select(ahead[k] * side > 0.0, 1.0, -1.0)
    return n


@qd.func
def past(way, n, ahead):
    """How far [m] beyond the point where it hit a solid a ray is surely inside: `meet` stops before the surface."""
    return (2e-4 * way + 2e-5) / qd.max(qd.abs(n.dot(ahead)), 0.1)


@qd.func
def cross_water(ahead, at, n, was_wet, chance, step):
    """Reflect or refract a ray at the surface of the water by a `chance` of 0 to 1, as Fresnel's equations have it.

    Returns (direction, origin [m], 1 where it goes on in the water, normal against the incoming ray); the origin is a
    thousandth of a `step` [m] off the surface.
    """
    inward = qd.select(n.dot(ahead) > 0.0, -n, n)
    eta = index_of_water()
    if was_wet == 0:
        eta = 1.0 / eta
    through = bent(ahead, inward, eta)
    direction, p, wet = ahead, at, was_wet
    if chance < through.w:
        direction = mirrored(ahead, inward)
        p = at + 1e-3 * step * inward
    else:
        direction = vec3(through.x, through.y, through.z)
        p = at - 1e-3 * step * inward
        wet = 1 - was_wet
    return direction, p, wet, inward


@qd.func
def first_hit(world: World, p, ahead, wet, seen):
    """(normal, way [m]) of the first thing on a ray, its `Hit`, the number of the solid or ball, 1 where the ray ran in
    the water, else 0.
    """
    far, what, which = 1e9, qd.cast(Hit.SKY, qd.i32), -1
    result = vec4(0.0, 1.0, 0.0, 1e9)
    if p.y > 0.0 and ahead.y < -1e-6:
        far, what = -p.y / ahead.y, Hit.FLOOR
        result.w = far
    solid, number = first_solid(world.solids, world.window, world.finish, p, ahead, far)
    if solid.w >= 0.0:
        result, far, what, which = solid, solid.w, Hit.SOLID, number
    # A floor below a pane is met before the pane.
    surface, kind, ball, was_wet = first_water(
        world.field.level, world.field.skip, world.field.grid, world.balls, p, ahead, far * 0.99999 - 1e-6, wet, seen
    )
    if surface.w >= 0.0:
        result, what, which = surface, kind, ball
    return result, what, which, was_wet

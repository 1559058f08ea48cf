"""Where a ray meets water, solids, motes or the floor.

code      symbol   meaning                                                        unit
p, ahead           where a ray begins, and its unit direction                     m, 1
t                  way along it                                                   m
wet                1 where the ray runs in the water                              1
cell               edge of a cell of the grid, two nodes                          m
"""

import dataclasses

from wavetank.device.compiler import qd
from wavetank.solids.distance import SolidSet
from wavetank.view.film.grid import Field, Grid, outward_at, value_at
from wavetank.view.film.motes import Motes
from wavetank.view.lens import vec3, vec4
from wavetank.view.optics.rays import box_interval
from wavetank.view.passes.solids import Window, ball_interval, meet


@dataclasses.dataclass(frozen=True, eq=False)
class World:
    """All that a ray may meet, on the device."""

    field: Field
    motes: Motes
    solids: SolidSet
    window: Window
    paints: qd.types.ndarray()  # vec3 [solids]: albedo, of glass what it lets through
    finish: qd.types.ndarray()  # i32 [solids]: place in `paints.FINISHES`


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
            hit = meet(solids, k, p, ahead, first, end, qd.select(finish[k] == 2, -1.0, 0.0))
            if hit.w >= 0.0:
                best, which, last = hit, k, hit.w
    return best, which


@qd.func
def first_mote(motes: Motes, cell, p, ahead, far, within):
    """(way, number) of the first ball of a cell nearer than `far`; from `within` that ball is left. -1: none."""
    best, which = far, -1
    for entry in range(motes.start[cell], motes.start[cell + 1]):
        m = motes.list[entry]
        b = motes.ball[m]
        off = vec3(b.x, b.y, b.z) - p
        along = off.dot(ahead)
        half = b.w * b.w - off.dot(off) + along * along
        if half > 0.0 and m != within:
            t = along - qd.sqrt(half)
            if t > 0.0 and t < best:
                best, which = t, m
    return best, which


@qd.func
def first_water(level: qd.template(), skip: qd.template(), grid: Grid, motes: Motes, p, ahead, far, wet, seen):
    """Follow a ray through the grid: (normal out of what it meets, way), what it is, a ball's number, if it is wet.

    The way is -1 where it meets neither surface, pane nor mote nearer than `far`. A ray whose state does not fit the
    field, by rounding, takes the field's. With `seen` of 0 motes are not looked for.
    """
    result, what, which = vec4(0.0, 0.0, 0.0, -1.0), 0, -1
    ends = box_interval(p, ahead, grid.box)
    t, end = qd.max(ends[0], 0.0), qd.min(ends[1], far)
    cell = 2.0 * grid.step
    ncx, ncy, ncz = grid.nx // 2, grid.ny // 2, grid.nz // 2
    going = t < end
    sign = qd.select(wet == 1, 1.0, -1.0)
    if going:
        before = value_at(level, grid, p + t * ahead)
        if ends[0] > 0.0:
            sign = -1.0
            if before > 0.0:
                n = face(grid, p + t * ahead, ahead, -1.0)
                result, what, going = vec4(n.x, n.y, n.z, t), 3, False
    elif ends[1] <= 0.0 or ends[0] > ends[1]:
        sign = -1.0
    good = before_fits(level, grid, p + t * ahead, sign)
    steps = 0
    while going:
        q = (p + (t + 1e-5 * cell.x) * ahead - grid.lower) / cell
        c = qd.cast(qd.floor(q), qd.i32)
        x, y, z = bounded(c.x, ncx), bounded(c.y, ncy), bounded(c.z, ncz)
        number = x + ncx * (y + ncy * z)
        far_off = skip[number]
        wide = qd.max(far_off - 1, 0)
        leaves = 1e9
        for k in qd.static(range(3)):
            index = x
            if qd.static(k == 1):
                index = y
            elif qd.static(k == 2):
                index = z
            if qd.abs(ahead[k]) > 1e-9:
                bound = qd.select(ahead[k] > 0.0, index + wide + 1, index - wide)
                leaves = qd.min(leaves, (grid.lower[k] + bound * cell[k] - p[k]) / ahead[k])
        leaves = qd.max(leaves, t + 1e-4 * cell.x)
        if far_off > 0:
            # Nothing but water, or nothing but air.
            x_here = p + 0.5 * (t + qd.min(leaves, end)) * ahead
            sign = qd.select(value_at(level, grid, x_here) > 0.0, 1.0, -1.0)
            good = 1
        else:
            stop = qd.min(leaves, end)
            if seen == 1:
                away, ball = first_mote(motes, number, p, ahead, end, -1)
                if ball >= 0 and (sign < 0.0 or motes.kind[ball] == 1):
                    b = motes.ball[ball]
                    n = (p + away * ahead - vec3(b.x, b.y, b.z)) / b.w
                    result, which, end = vec4(n.x, n.y, n.z, away), ball, away
                    what = qd.select(motes.kind[ball] == 1, 5, 4)
                    stop = qd.min(stop, end)
            parts = qd.cast(qd.max(stop - t, 0.0) / (0.62 * grid.step.x), qd.i32) + 1
            pace, low = qd.max(stop - t, 0.0) / parts, t
            for part in range(parts):
                if going:
                    high = t + pace * (part + 1)
                    value = value_at(level, grid, p + high * ahead) * sign
                    if value <= 0.0 and good == 1:
                        # Between `low` and `high`, by halving.
                        a, b = low, high
                        for _ in range(12):
                            middle = 0.5 * (a + b)
                            if value_at(level, grid, p + middle * ahead) * sign <= 0.0:
                                b = middle
                            else:
                                a = middle
                        n = outward_at(level, grid, p + b * ahead)
                        result, what, which, going = vec4(n.x, n.y, n.z, b), 3, -1, False
                    good = qd.select(value > 0.0, 1, good)
                    low = high
        t = leaves
        steps += 1
        if t >= end or steps > 4096:
            going = False
            if what == 0 and sign > 0.0 and ends[1] < far and ends[1] > 0.0:
                # Through a pane out of the water.
                n = face(grid, p + ends[1] * ahead, ahead, 1.0)
                result, what = vec4(n.x, n.y, n.z, ends[1]), 3
    return result, what, which, qd.select(sign > 0.0, 1, 0)


@qd.func
def before_fits(level: qd.template(), grid: Grid, x, sign):
    """1 where the field at a point is on the side that a ray takes itself to be on."""
    return qd.select(value_at(level, grid, x) * sign > 0.0, 1, 0)


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
    """How far [m] behind the place where it met a solid a ray is surely in it: `meet` stops before the surface."""
    return (2e-4 * way + 2e-5) / qd.max(qd.abs(n.dot(ahead)), 0.1)


@qd.func
def first_hit(world: World, p, ahead, wet, seen):
    """(normal, way) of the first thing on a ray, what it is (0 sky, 1 floor, 2 solid, 3 water, 4 drop, 5 froth), the
    number of the solid or ball, and whether the ray was wet on its way.
    """
    far, what, which = 1e9, 0, -1
    result = vec4(0.0, 1.0, 0.0, 1e9)
    if p.y > 0.0 and ahead.y < -1e-6:
        far, what = -p.y / ahead.y, 1
        result.w = far
    solid, number = first_solid(world.solids, world.window, world.finish, p, ahead, far)
    if solid.w >= 0.0:
        result, far, what, which = solid, solid.w, 2, number
    # A floor below a pane is met before the pane.
    surface, kind, ball, was_wet = first_water(
        world.field.level, world.field.skip, world.field.grid, world.motes, p, ahead, far * 0.99999 - 1e-6, wet, seen
    )
    if surface.w >= 0.0:
        result, what, which = surface, kind, ball
    return result, what, which, was_wet

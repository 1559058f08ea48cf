"""Normals of a surface that is a map of depths, as a lens sees it."""

from wavetank.device.compiler import qd
from wavetank.view.lens import Lens, from_view, plane_position, ray_direction, ray_origin, vec2, vec3, view_ray
from wavetank.view.optics.rays import Box


@qd.func
def rise_at(row, column, z, limit, depth: qd.template()):
    """Change of depth [m] to the next column and to the next row, each taken more from the side where it is less."""
    total, weight = vec2(0.0, 0.0), vec2(1e-30, 1e-30)
    for k in range(4):
        side, down = 2 * (k % 2) - 1, k // 2
        r = qd.min(qd.max(row + side * down, 0), depth.shape[0] - 1)
        c = qd.min(qd.max(column + side * (1 - down), 0), depth.shape[1] - 1)
        rise = qd.bit_cast(depth[r, c], qd.f32) - z
        if qd.abs(rise) < limit:
            w = 1.0 / (rise * rise + 1e-4 * limit * limit)
            if down == 0:
                total.x += w * side * rise
                weight.x += w
            else:
                total.y += w * side * rise
                weight.y += w
    return total / weight


@qd.func
def normal_of(lens: Lens, row, column, z, rise):
    """Unit normal, in the world and towards the eye, of a surface at depth `z` that rises so from pixel to pixel."""
    uv = plane_position(lens, row, column) * lens.perspective
    wide = lens.pixel * (1.0 + lens.perspective * (z - 1.0))
    # Cross product of the ways along the surface: (wide + u right, v right, right), (u below, v below - wide, below).
    n = vec3(rise.x, -rise.y, -wide - uv.x * rise.x + uv.y * rise.y)
    return from_view(lens, n).normalized(1e-20)


@qd.func
def neighbour_near_depth(depth: qd.template(), row, column, z, limit):
    """(row, column, 1) of the neighbouring pixel that shows the surface nearest to the depth `z`, within `limit` [m].

    Where none does the last is 0.
    """
    best, result = limit, qd.Vector([row, column, 0])
    for k in range(4):  # right, left, below, above
        step = 1 - 2 * (k % 2)
        r = qd.min(qd.max(row + qd.select(k >= 2, step, 0), 0), depth.shape[0] - 1)
        c = qd.min(qd.max(column + qd.select(k < 2, step, 0), 0), depth.shape[1] - 1)
        off = qd.abs(qd.bit_cast(depth[r, c], qd.f32) - z)
        if off < best:
            best, result = off, qd.Vector([r, c, 1])
    return result


@qd.func
def unevenness(lens: Lens, walls: Box, row, column, z, n, direction, spacing, depth: qd.template()):
    """Standard deviation of the normals of the surface around a pixel, along an axis, within a spacing.

    Of both sides the rougher counts, and none beyond which the surface ends, or the tank; where it ends to all that
    are in the tank, it is broken. A mean of two, half of it along each axis, a third of it at the edge is that within.
    """
    total, pixel = 0.0, lens.pixel * (1.0 + lens.perspective * (z - 1.0))
    steep = qd.max(qd.abs(n.dot(direction)), 1e-3)
    for axis in range(2):
        away, ends, slope = -1.0, 0, n.dot(qd.select(axis == 0, lens.right, lens.up)) / steep
        k = qd.max(qd.cast(spacing / (pixel * qd.sqrt(1.0 + slope * slope)), qd.i32), 1)
        for side in range(2):
            step = k * (1 - 2 * side)
            r = qd.min(qd.max(row + step * axis, 0), depth.shape[0] - 1)
            c = qd.min(qd.max(column + step * (1 - axis), 0), depth.shape[1] - 1)
            there = qd.bit_cast(depth[r, c], qd.f32)
            ray = view_ray(lens, r, c)
            at = ray_origin(lens, ray) + there * ray_direction(lens, ray)
            beyond = qd.max((walls.lower - at).max(), (at - walls.upper).max())
            if qd.abs(there - z) >= 3.0 * spacing:
                ends = 1
            elif beyond < 0.1 * spacing:
                other = normal_of(lens, r, c, there, rise_at(r, c, there, 3.0 * spacing, depth)) - n
                away = qd.max(away, other.dot(other))
        total += qd.select(away < 0.0, qd.cast(ends, qd.f32), away)
    return qd.sqrt(total / 12.0)

"""Normals of a surface that is a map of depths, as a lens sees it."""

from wavetank.device.compiler import qd
from wavetank.view.lens import Lens, from_view, plane_position, vec2, vec3


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

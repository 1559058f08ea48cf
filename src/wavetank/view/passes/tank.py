"""The tank: thin lines along its edges, hidden by what is in front of them, and a breath of glass.

Every edge is walked pixel by pixel along the axis of the picture in which it is longer; each step marks the few pixels
across the line with how much of them it covers, and at what depth. Marks are integers and the largest wins, so their
order is irrelevant.

    code      symbol   meaning                                                unit
    a, b               ends of an edge in the picture                         px
    width              width of a line                                        px
    slack              depth by which a line wins against what it touches     m
"""

from typing import Any

from wavetank.device.compiler import qd
from wavetank.view.buffers import Buffers
from wavetank.view.lens import Lens, ray_direction, ray_origin, to_pixel, to_view, vec3, vector, view_ray
from wavetank.view.look import Look
from wavetank.view.passes.solids import box_interval
from wavetank.view.shot import Shot


def draw(shot: Shot, buffers: Buffers) -> None:
    """Draw the tank over the picture, if the world has one."""
    if shot.frame.scene.tank is not None:
        lower, upper = _mark_over(shot, buffers, buffers.depth)
        blend(shot.lens, shot.look, lower, upper, buffers.depth, buffers.lines, buffers.color)


def draw_lines(shot: Shot, buffers: Buffers) -> None:
    """Mark the edges for those who draw them: the backdrop, and the water those in front of it."""
    if shot.frame.scene.tank is not None:
        _mark_over(shot, buffers, buffers.depth)


def slack(shot: Shot) -> float:
    """Depth [m] by which a line wins."""
    return 2.0 * shot.radius


def _mark_over(shot: Shot, buffers: Buffers, depth: Any) -> tuple[Any, Any]:
    """Mark the edges that `depth` does not hide; returns the corners of the tank."""
    lower, upper = vector(*shot.extent.lower), vector(*shot.extent.upper)
    width = max(1.0, buffers.rows / 420.0)
    edges = 12 if shot.frame.dim == 3 else 4
    buffers.lines.fill(0)
    mark(
        shot.lens, lower, upper, edges, max(buffers.rows, buffers.columns) + 2, width, slack(shot), depth,
        buffers.lines,
    )  # fmt: skip
    return lower, upper


@qd.func
def edge_corner(lower, upper, edge, end):
    """Corner `end` (0 or 1) of edge 0 to 11 of a box; the first four lie in the plane z = upper.z."""
    axis = edge // 2 % 2
    if edge >= 4 and edge < 8:
        axis = 2
    corner = upper
    for k in qd.static(range(3)):
        side = edge % 2
        if k == axis:
            side = end
        elif k == 2:
            side = 1 - edge // 8
        elif axis == 2 and k == 1:
            side = edge // 2 % 2
        if side == 0:
            corner[k] = lower[k]
    return corner


@qd.kernel(fastcache=True)
def mark(
    lens: Lens, lower: vec3, upper: vec3, edges: qd.i32, steps: qd.i32, width: qd.f32, slack: qd.f32,
    depth: qd.types.ndarray(), lines: qd.types.ndarray(),
):  # fmt: skip
    """Mark the pixels of every edge."""
    for edge, step in qd.ndrange(edges, steps):
        a = to_view(lens, edge_corner(lower, upper, edge, 0))
        b = to_view(lens, edge_corner(lower, upper, edge, 1))
        if a.z > b.z:
            a, b = b, a
        if b.z > lens.near * 1.001:
            if a.z < lens.near:
                a = a + (b - a) * ((lens.near - a.z) / (b.z - a.z))
            mark_step(lens, a, b, step, width, slack, depth, lines)


@qd.func
def mark_step(lens: Lens, a, b, step, width, slack, depth: qd.template(), lines: qd.template()):
    """Mark the pixels across the line from `a` to `b` (view coordinates) in one row or column of the picture."""
    p, q = to_pixel(lens, a), to_pixel(lens, b)
    along = 0 if qd.abs(q.x - p.x) >= qd.abs(q.y - p.y) else 1
    if p[along] > q[along]:
        p, q = q, p
        a, b = b, a
    length = q[along] - p[along]
    sizes = qd.Vector([depth.shape[1], depth.shape[0]])
    first = qd.cast(qd.floor(qd.max(p[along], 0.0)), qd.i32)
    pixel = first + step
    if length > 1e-3 and pixel < sizes[along] and pixel < q[along]:
        share = qd.min(qd.max((pixel + 0.5 - p[along]) / length, 0.0), 1.0)
        # In perspective it is the inverse of depth that is linear in the picture.
        z = a.z + (b.z - a.z) * share
        if lens.perspective > 0.5:
            z = 1.0 / (1.0 / a.z + (1.0 / b.z - 1.0 / a.z) * share)
        across = 1 - along
        middle = p[across] + (q[across] - p[across]) * share
        slope = (q[across] - p[across]) / length
        narrow = 1.0 / qd.sqrt(1.0 + slope * slope)
        half = 0.5 * width / narrow + 1.0
        if middle + half > 0.0 and middle - half < sizes[across]:
            low = qd.max(qd.cast(qd.floor(middle - half), qd.i32), 0)
            high = qd.min(qd.cast(qd.floor(middle + half), qd.i32), sizes[across] - 1)
            for other in range(low, high + 1):
                cover = qd.min(qd.max(0.5 * width + 0.5 - qd.abs(other + 0.5 - middle) * narrow, 0.0), 1.0)
                row, column = other, pixel
                if along == 1:
                    row, column = pixel, other
                if z - slack < qd.bit_cast(depth[row, column], qd.f32):
                    place = 0x7FFFFF - (qd.bit_cast(z, qd.i32) >> 8)
                    qd.atomic_max(lines[row, column], (qd.cast(255.0 * cover + 0.5, qd.i32) << 23) | place)


@qd.func
def line_cover(line, depth, slack):
    """Share of a pixel that a line covers, unless something at `depth` hides it."""
    cover = 0.0
    if line > 0:
        z = qd.bit_cast((0x7FFFFF - (line & 0x7FFFFF)) << 8, qd.f32)
        if z - slack < depth:
            cover = (line >> 23) / 255.0
    return cover


@qd.func
def with_tank(lens: Lens, look: Look, lower, upper, origin, direction, depth, line, radiance):
    """Radiance with panes and lines laid over it."""
    result = radiance
    if look.glass > 0.0:
        panes = box_interval(origin, direction, lower, upper)
        if panes[0] <= panes[1]:
            for k in qd.static(range(2)):
                if panes[k] > lens.near and panes[k] < depth:
                    result += look.glass * (look.pane - result)
        elif look.glass == 1.0:  # a plane: particles are wider than their distance to the wall
            result = look.horizon
    cover = look.line_strength * line_cover(line, depth, 1e30)
    return result + cover * (look.line - result)


@qd.kernel(fastcache=True)
def blend(
    lens: Lens, look: Look, lower: vec3, upper: vec3, depth: qd.types.ndarray(), lines: qd.types.ndarray(),
    color: qd.types.ndarray(),
):  # fmt: skip
    """Lay panes and lines over the picture."""
    for row, column in qd.ndrange(depth.shape[0], depth.shape[1]):
        ray = view_ray(lens, row, column)
        color[row, column] = with_tank(
            lens, look, lower, upper, ray_origin(lens, ray), ray_direction(lens, ray),
            qd.bit_cast(depth[row, column], qd.f32), lines[row, column], color[row, column],
        )  # fmt: skip

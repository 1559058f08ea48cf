"""The tank: thin lines along its edges, hidden by what is in front of them, and a breath of glass.

Every edge is walked pixel by pixel along the axis of the picture in which it is longer; each step marks the few pixels
across the line with how much of them it covers, and at what depth. Marks are integers and the largest wins, so their
order is irrelevant.

    code      symbol   meaning                                                unit
    a, b               ends of an edge in the picture                         px
    width              width of a line                                        px
    slack              depth by which a line wins against what it touches     m
"""

from wavetank.device.compiler import qd
from wavetank.view.buffers import Buffers, Pixels
from wavetank.view.lens import Lens, ray_direction, ray_origin, to_pixel, to_view, view_ray
from wavetank.view.look import Look
from wavetank.view.optics.edge_coverage import line_mark
from wavetank.view.optics.glass import behind_panes, slack, with_lines
from wavetank.view.optics.rays import Box
from wavetank.view.shot import Shot


def draw(shot: Shot, buffers: Buffers) -> None:
    """Draw the tank over the picture, if the world has one."""
    draw_lines(shot, buffers)
    if shot.frame.scene.tank is not None:
        blend(buffers.pixels, shot.lens, shot.look, shot.box)


def draw_lines(shot: Shot, buffers: Buffers) -> None:
    """Mark the edges for those who draw them: the backdrop, and the water those in front of it."""
    buffers.pixels.lines.fill(0)
    if shot.frame.scene.tank is not None:
        edges, steps = 12 if shot.frame.dim == 3 else 4, max(buffers.rows, buffers.columns) + 2
        mark(buffers.pixels, shot.lens, shot.box, max(1.0, buffers.rows / 420.0), slack(shot), edges, steps)


@qd.func
def edge_corner(box: Box, edge, end):
    """Corner `end` (0 or 1) of edge 0 to 11 of a box; the first four lie in the plane z = upper.z."""
    axis = edge // 2 % 2
    if edge >= 4 and edge < 8:
        axis = 2
    corner = box.upper
    for k in qd.static(range(3)):
        side = edge % 2
        if k == axis:
            side = end
        elif k == 2:
            side = 1 - edge // 8
        elif axis == 2 and k == 1:
            side = edge // 2 % 2
        if side == 0:
            corner[k] = box.lower[k]
    return corner


@qd.kernel(fastcache=True)
def mark(pixels: Pixels, lens: Lens, box: Box, width: qd.f32, slack: qd.f32, edges: qd.i32, steps: qd.i32):
    """Mark the pixels of every edge."""
    for edge, step in qd.ndrange(edges, steps):
        a = to_view(lens, edge_corner(box, edge, 0))
        b = to_view(lens, edge_corner(box, edge, 1))
        if a.z > b.z:
            a, b = b, a
        if b.z > lens.near * 1.001:
            if a.z < lens.near:
                a = a + (b - a) * ((lens.near - a.z) / (b.z - a.z))
            mark_step(pixels, lens, a, b, step, width, slack)


@qd.func
def mark_step(pixels: Pixels, lens: Lens, a, b, step, width, slack):
    """Mark the pixels across the line from `a` to `b` (view coordinates) in one row or column of the picture."""
    p, q = to_pixel(lens, a), to_pixel(lens, b)
    along = 0 if qd.abs(q.x - p.x) >= qd.abs(q.y - p.y) else 1
    if p[along] > q[along]:
        p, q = q, p
        a, b = b, a
    length = q[along] - p[along]
    sizes = qd.Vector([pixels.depth.shape[1], pixels.depth.shape[0]])
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
                if z - slack < qd.bit_cast(pixels.depth[row, column], qd.f32):
                    qd.atomic_max(pixels.lines[row, column], line_mark(cover, z))


@qd.kernel(fastcache=True)
def blend(pixels: Pixels, lens: Lens, look: Look, box: Box):
    """Lay panes and lines over the picture."""
    for row, column in qd.ndrange(pixels.depth.shape[0], pixels.depth.shape[1]):
        ray = view_ray(lens, row, column)
        origin, direction = ray_origin(lens, ray), ray_direction(lens, ray)
        z = qd.bit_cast(pixels.depth[row, column], qd.f32)
        shown = behind_panes(lens, look, box, origin, direction, z, pixels.color[row, column])
        pixels.color[row, column] = with_lines(look, pixels.lines[row, column], shown)

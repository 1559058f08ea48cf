"""Which pixels have to be resolved: where all samples of one show the same, it is shaded once.

What changes within a pixel and is not straight has to be found for each sample: outlines, lines, the places where the
surface meets panes, what stands before it, bends of the surface, and the sun's image in it. Anything else is straight
within a pixel, so that the mean of its samples is what its middle shows.

    code        symbol   meaning                                                           unit
    low, high            least and largest depth of the surface in a pixel                 m
    rise                 change of depth from end to end of a pixel, to the right and down m
    bend                 by how much that changes from one pixel to the next               m
    reach                way between the outer samples of a pixel                          px
"""

from wavetank.device.compiler import qd
from wavetank.view.buffers import Pixels
from wavetank.view.lens import Lens, ray_direction, ray_origin, vec2, vec3, view_ray
from wavetank.view.look import Look
from wavetank.view.optics.fluid import Optics
from wavetank.view.optics.normals import normal_of
from wavetank.view.optics.panes import tank_interval
from wavetank.view.optics.rays import Box
from wavetank.view.water_buffers import WaterSurface


@qd.func
def beside_at(depth: qd.template(), row, column):
    """Depth [m] of the surface at the pixel nearest to a place that may lie off the picture."""
    r = qd.min(qd.max(row, 0), depth.shape[0] - 1)
    return qd.bit_cast(depth[r, qd.min(qd.max(column, 0), depth.shape[1] - 1)], qd.f32)


@qd.func
def even_pixel(
    pixels: Pixels,
    surface: WaterSurface,
    lens: Lens,
    look: Look,
    optics: Optics,
    walls: Box,
    row,
    column,
    world: qd.template(),
):
    """(kind, depth [m], normal) of the water that all samples of a pixel show, from the one at `row`, `column` on.

    The kind is 0 where they differ or show none, 1 where they show the surface, 2 where they show a pane.
    """
    kind, low, high, back, mean = 0, 1e30, 0.0, 1e30, 0.0
    n = vec3(0.0, 0.0, 0.0)
    if qd.bit_cast(surface.depth[row, column], qd.f32) < 1e30:
        kind = 1
        what = pixels.surface[row, column]
        for k in range(optics.samples * optics.tall):
            r, c = row + k // optics.samples, column + k % optics.samples
            z = qd.bit_cast(surface.depth[r, c], qd.f32)
            low, high = qd.min(low, z), qd.max(high, z)
            back = qd.min(back, qd.bit_cast(pixels.depth[r, c], qd.f32))
            mean += z
            if pixels.surface[r, c] != what or pixels.lines[r, c] != 0 or surface.rim[r, c] > 0:
                kind = 0
        if high > back:
            kind = 0
        mean /= optics.samples * optics.tall
    if qd.static(world >= 3):
        if kind > 0:
            reach = vec2(optics.samples - 1, optics.tall - 1)
            middle = vec2(column, row) + 0.5 * reach
            ray = view_ray(lens, middle.y, middle.x)
            direction = ray_direction(lens, ray)
            ends, _, wall = tank_interval(lens, ray_origin(lens, ray), direction, walls)
            at_pane = ends[0] > lens.near and wall.y == 0.0
            if ends[0] > ends[1] or ends[0] >= back:
                kind = 0
            elif at_pane and high < ends[0] - optics.spacing:
                kind = 2
            elif (at_pane and low < ends[0] + optics.spacing) or high > ends[1] - optics.spacing:
                kind = 0
            else:
                # Straight: no twist, as steep beside it as within to 7 degrees, and nearer than 9 no sun in it.
                right, below = column + optics.samples - 1, row + optics.tall - 1
                a, b = beside_at(surface.depth, row, column), beside_at(surface.depth, row, right)
                d, e = beside_at(surface.depth, below, column), beside_at(surface.depth, below, right)
                rise = 0.5 * vec2(b - a + e - d, d - a + e - b) / reach
                bend = qd.abs(a + e - b - d) / reach.x
                for k in qd.static(range(4)):
                    step = qd.static((-1, 1)[k % 2])
                    r, c, near, own = row, column - 1, a, rise.x
                    if qd.static(k == 1):
                        r, c, near = below, right + 1, e
                    elif qd.static(k == 2):
                        r, c, own = row - 1, column, rise.y
                    elif qd.static(k == 3):
                        r, c, near, own = below + 1, right, e, rise.y
                    bend = qd.max(bend, qd.abs(step * (beside_at(surface.depth, r, c) - near) - own))
                wide = lens.pixel * (1.0 + lens.perspective * (mean - 1.0))
                if bend * wide > 0.12 * (wide * wide + rise.dot(rise)):
                    kind = 0
                else:
                    n = normal_of(lens, middle.y, middle.x, mean, rise)
                    if look.sparkle > 0.0:
                        if n.dot((look.to_sun - direction.normalized()).normalized(1e-9)) > 0.988:
                            kind = 0
    return kind, mean, n

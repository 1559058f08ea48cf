"""Which pixels need all of their samples: where all show the same, the pixel is shaded once.

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
from wavetank.view.lens import Lens, ray_direction, ray_origin, vec2, vec3, vec4, view_ray
from wavetank.view.look import Look
from wavetank.view.optics.fluid import Optics
from wavetank.view.optics.normals import normal_of
from wavetank.view.optics.panes import tank_interval
from wavetank.view.optics.rays import Box
from wavetank.view.water_buffers import WaterSurface

#: The water that all samples of a pixel show.
UniformPixel = qd.types.struct(
    found=qd.i32,  # 1 where they show the same, 0 where they differ or show none
    at_pane=qd.i32,  # 1 where that is a pane, 0 where it is the surface
    depth=qd.f32,  # m
    normal=vec3,
)


@qd.func
def uniform_pixel(
    pixels: Pixels,
    surface: WaterSurface,
    lens: Lens,
    look: Look,
    optics: Optics,
    walls: Box,
    row,
    column,
    planar: qd.template(),
):
    """The water that all samples of a pixel show, from the one at `row`, `column` on; a plane has no panes."""
    result = UniformPixel(found=0, at_pane=0, depth=0.0, normal=vec3(0.0, 0.0, 0.0))
    if qd.bit_cast(surface.depth[row, column], qd.f32) < 1e30:
        depths = depths_of_samples(pixels, surface, optics, row, column)
        result.found, result.depth = qd.cast(depths[3] > 0.0, qd.i32), depths[2]
        if qd.static(not planar):
            if result.found > 0:
                find_pane_or_plane(result, surface.depth, depths, lens, look, optics, walls, row, column)
    return result


@qd.func
def depths_of_samples(pixels: Pixels, surface: WaterSurface, optics: Optics, row, column):
    """Least, largest and mean depth [m] of the surface in a pixel, and the least depth of what is behind it.

    The last is negative where not all samples show the surface before one and the same thing, without lines.
    """
    low, high, back, mean, same = 1e30, 0.0, 1e30, 0.0, 1
    what = pixels.surface[row, column]
    for k in range(optics.samples * optics.tall):
        r, c = row + k // optics.samples, column + k % optics.samples
        z = qd.bit_cast(surface.depth[r, c], qd.f32)
        low, high = qd.min(low, z), qd.max(high, z)
        back = qd.min(back, qd.bit_cast(pixels.depth[r, c], qd.f32))
        mean += z
        if pixels.surface[r, c] != what or pixels.lines[r, c] != 0 or surface.rim[r, c] > 0:
            same = 0
    if same == 0 or high > back:
        back = -1.0
    return vec4(low, high, mean / (optics.samples * optics.tall), back)


@qd.func
def find_pane_or_plane(
    result: qd.template(), depth: qd.template(), depths, lens: Lens, look: Look, optics: Optics, walls: Box, row, column
):
    """Complete `result` for a pixel whose samples all show water at these `depths`: at a pane, or straight."""
    low, high, back = depths[0], depths[1], depths[3]
    reach = vec2(optics.samples - 1, optics.tall - 1)
    middle = vec2(column, row) + 0.5 * reach
    ray = view_ray(lens, middle.y, middle.x)
    direction = ray_direction(lens, ray)
    ends, _, wall = tank_interval(lens, ray_origin(lens, ray), direction, walls)
    at_pane = ends[0] > lens.near and wall.y == 0.0
    if ends[0] > ends[1] or ends[0] >= back:
        result.found = 0
    elif at_pane and high < ends[0] - optics.spacing:
        result.at_pane = 1
    elif (at_pane and low < ends[0] + optics.spacing) or high > ends[1] - optics.spacing:
        result.found = 0
    else:
        rise, bend = slope_and_bend(depth, row, column, optics.samples, optics.tall, reach)
        wide = lens.pixel * (1.0 + lens.perspective * (result.depth - 1.0))
        # Straight: no twist, as steep next to it as within to 7 degrees, and nearer than 9 no sun in it.
        if bend * wide > 0.12 * (wide * wide + rise.dot(rise)):
            result.found = 0
        else:
            result.normal = normal_of(lens, middle.y, middle.x, result.depth, rise)
            if look.sparkle > 0.0:
                if result.normal.dot((look.to_sun - direction.normalized()).normalized(1e-9)) > 0.988:
                    result.found = 0


@qd.func
def slope_and_bend(depth: qd.template(), row, column, samples, tall, reach):
    """Change of depth across and down a pixel, per sample, and by how much it differs within and next to it [m]."""
    right, below = column + samples - 1, row + tall - 1
    a, b = clamped_depth(depth, row, column), clamped_depth(depth, row, right)
    d, e = clamped_depth(depth, below, column), clamped_depth(depth, below, right)
    rise = 0.5 * vec2(b - a + e - d, d - a + e - b) / reach
    bend = qd.abs(a + e - b - d) / reach.x
    for k in range(4):  # next to it on the left, right, above, below
        step, down, is_after = 2 * (k % 2) - 1, k // 2, k % 2 == 1
        r = qd.select(is_after, below, row) + step * down
        c = qd.select(is_after, right, column) + step * (1 - down)
        change = step * (clamped_depth(depth, r, c) - qd.select(is_after, e, a))
        bend = qd.max(bend, qd.abs(change - qd.select(down == 1, rise.y, rise.x)))
    return rise, bend


@qd.func
def clamped_depth(depth: qd.template(), row, column):
    """Depth [m] of the surface at the pixel nearest to a place that may lie off the picture."""
    r = qd.min(qd.max(row, 0), depth.shape[0] - 1)
    return qd.bit_cast(depth[r, qd.min(qd.max(column, 0), depth.shape[1] - 1)], qd.f32)

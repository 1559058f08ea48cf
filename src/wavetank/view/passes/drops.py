"""Lone particles: drops in front of the finished picture, which they refract.

A particle with hardly a neighbour is not part of a surface: it has no share in the depth and the thickness of the
water behind it (`ellipsoids.lone`), and is drawn over the picture when that is finished. A drop is a ball of its own:
a ray is turned twice by the same angle, so that the ball shows the world behind it upside down, and dimmed by the chord
that it takes. A lone particle that is fast stands for spray: water of so many particles' volume that flies apart, some
smaller drops beside the first, which gives them what it loses.

    code      symbol   meaning                                                        unit
    c, r               middle and radius of a drop                                    m
    cover              share of a pixel that a drop covers                            1
"""

from wavetank.device.compiler import qd
from wavetank.view.buffers import Buffers, Pixels
from wavetank.view.cells import Cells
from wavetank.view.lens import Lens, box_of_ball, pixels_per_metre, point_at, to_view, vec3, vec4
from wavetank.view.look import Look
from wavetank.view.optics.drop import drop_of, drop_radiance, motion_of, rough_of, way_of
from wavetank.view.optics.fluid import Optics, optics_of
from wavetank.view.optics.glass import line_cover
from wavetank.view.shot import Shot
from wavetank.view.water_buffers import Drops, WaterSurface, water_of
from wavetank.view.weights import under_water


def draw(shot: Shot, buffers: Buffers) -> None:
    """Lay the drops over the picture; `surface.nearest` is lowered to theirs. An eye in the water sees none.

    Those that move while the shutter is open are left to the streaks.
    """
    frame = shot.frame
    if frame.dim == 2 or frame.count == 0 or under_water(shot, buffers):
        return
    water = water_of(buffers, shot)
    if not water.may_have_drops(frame.count):
        return
    drops, optics = water.drops(frame), optics_of(shot)
    motion = motion_of(shot.shutter, buffers.supersample)
    find_nearest(buffers.pixels, water.surface, drops, water.cells, shot.lens, optics, motion, frame.count)
    shade(buffers.pixels, water.surface, drops, water.cells, shot.lens, shot.look, optics, motion, frame.count)
    composite(buffers.pixels, water.surface, drops, water.cells, shot.lens, shot.look, optics, motion, frame.count)


@qd.kernel(fastcache=True)
def find_nearest(
    pixels: Pixels,
    surface: WaterSurface,
    drops: Drops,
    cells: Cells,
    lens: Lens,
    optics: Optics,
    motion: vec4,
    count: qd.i32,
):
    """Lower `surface.nearest` to the nearest drop of each pixel; `motion` is that of `motion_of`."""
    for a in range(count):
        for k in range(balls_of(drops, cells, lens, a, motion)):
            c, wide, scale, key, box = footprint(pixels.depth, drops, cells, lens, optics, a, k, motion)
            for row in range(box[2], box[3] + 1):
                for column in range(box[0], box[1] + 1):
                    if coverage(pixels, surface, lens, c, wide, scale, key, row, column) > 0.0:
                        qd.atomic_min(surface.nearest[row, column], key)


@qd.kernel(fastcache=True)
def shade(
    pixels: Pixels,
    surface: WaterSurface,
    drops: Drops,
    cells: Cells,
    lens: Lens,
    look: Look,
    optics: Optics,
    motion: vec4,
    count: qd.i32,
):
    """Fill `pixels.normal` with the radiance of the nearest drop, which refracts the picture without drops."""
    for a in range(count):
        for k in range(balls_of(drops, cells, lens, a, motion)):
            c, wide, scale, key, box = footprint(pixels.depth, drops, cells, lens, optics, a, k, motion)
            rough = rough_of(wide * scale)
            for row in range(box[2], box[3] + 1):
                for column in range(box[0], box[1] + 1):
                    cover = coverage(pixels, surface, lens, c, wide, scale, key, row, column)
                    if cover > 0.0 and surface.nearest[row, column] == key:
                        pixels.normal[row, column] = drop_radiance(
                            pixels, surface, drops, cells, lens, look, optics, a, row, column, c, wide, rough
                        )


@qd.kernel(fastcache=True)
def composite(
    pixels: Pixels,
    surface: WaterSurface,
    drops: Drops,
    cells: Cells,
    lens: Lens,
    look: Look,
    optics: Optics,
    motion: vec4,
    count: qd.i32,
):
    """Lay the shaded drops over the picture, behind the edges of the tank that stand before them."""
    for a in range(count):
        for k in range(balls_of(drops, cells, lens, a, motion)):
            c, wide, scale, key, box = footprint(pixels.depth, drops, cells, lens, optics, a, k, motion)
            radius = drop_of(drops, cells, a, k, optics.spacing, motion[0], motion[1])[3]
            faint = (radius / wide) ** 2  # what is a pixel wide or less is as faint as it is small
            for row in range(box[2], box[3] + 1):
                for column in range(box[0], box[1] + 1):
                    cover = coverage(pixels, surface, lens, c, wide, scale, key, row, column)
                    if cover > 0.0 and surface.nearest[row, column] == key:
                        line = line_cover(pixels.lines[row, column], c.z, 1.1 * optics.spacing)
                        cover *= faint * (1.0 - look.line_strength * line)
                        before = pixels.color[row, column]
                        pixels.color[row, column] = before + cover * (pixels.normal[row, column] - before)


@qd.func
def balls_of(drops: Drops, cells: Cells, lens: Lens, a, motion):
    """How many balls are drawn for the particle at the sorted place `a`: 6 for a drop that hardly moves, else 0."""
    balls = 0
    if drops.lone[a] == 1:
        if way_of(lens, drops, cells, a, motion[2]).norm() <= motion[3]:
            balls = 6
    return balls


@qd.func
def footprint(depth: qd.template(), drops: Drops, cells: Cells, lens: Lens, optics: Optics, a, k, motion):
    """Middle (view coordinates), radius as drawn [m], pixels per metre, bits of the nearest depth, and box of pixels
    (first and last column, first and last row) of one ball of a drop; the box is empty where it is not seen.
    """
    drop = drop_of(drops, cells, a, k, optics.spacing, motion[0], motion[1])
    c, r = to_view(lens, vec3(drop[0], drop[1], drop[2])), drop[3]
    wide, scale, box = r, 1.0, qd.Vector([0, -1, 0, -1])
    if r > 0.0 and c.z > lens.near + 2.0 * r:
        scale = pixels_per_metre(lens, c.z)
        wide = qd.max(r, 0.75 / scale)
        box = box_of_ball(lens, c, wide + 0.5 / scale, depth.shape[0], depth.shape[1])
    return c, wide, scale, qd.bit_cast(c.z - r, qd.i32), box


@qd.func
def coverage(pixels: Pixels, surface: WaterSurface, lens: Lens, c, wide, scale, key, row, column):
    """Share of a pixel that a ball covers; none where the water or something else stands before it."""
    here = point_at(lens, row, column, c.z)
    away = qd.sqrt((here.x - c.x) ** 2 + (here.y - c.y) ** 2)
    cover = qd.min((wide - away) * scale + 0.5, 1.0)
    if key >= qd.min(surface.depth[row, column], pixels.depth[row, column]):
        cover = 0.0
    return cover

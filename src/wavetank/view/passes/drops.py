"""Lone particles: drops in front of the finished picture, which they refract.

A particle with hardly a neighbour is no part of any surface: it has no share in the depth and the thickness of the
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
from wavetank.view.optics.drop import drop_of, motion_of, rough_of, shine, way_of
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
    drops = water.drops(frame)
    lay(
        buffers.pixels,
        water.surface,
        drops,
        water.cells,
        shot.lens,
        shot.look,
        optics_of(shot),
        motion_of(shot.shutter, buffers.supersample),
        frame.count,
    )


@qd.kernel(fastcache=True)
def lay(
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
    """Find the nearest drop of each pixel, shade it by the picture without drops, and lay it over that.

    `motion` is that of `motion_of`; `pixels.normal` holds the shaded drops meanwhile.
    """
    for a in range(count):
        if drops.lone[a] == 1 and way_of(lens, drops, cells, a, motion[2]).norm() <= motion[3]:
            for k in range(6):
                walk(
                    pixels,
                    surface,
                    drops,
                    cells,
                    lens,
                    look,
                    optics,
                    a,
                    drop_of(drops, cells, a, k, optics.spacing, motion[0], motion[1]),
                    0,
                )
    for a in range(count):
        if drops.lone[a] == 1 and way_of(lens, drops, cells, a, motion[2]).norm() <= motion[3]:
            for k in range(6):
                walk(
                    pixels,
                    surface,
                    drops,
                    cells,
                    lens,
                    look,
                    optics,
                    a,
                    drop_of(drops, cells, a, k, optics.spacing, motion[0], motion[1]),
                    1,
                )
    for a in range(count):
        if drops.lone[a] == 1 and way_of(lens, drops, cells, a, motion[2]).norm() <= motion[3]:
            for k in range(6):
                walk(
                    pixels,
                    surface,
                    drops,
                    cells,
                    lens,
                    look,
                    optics,
                    a,
                    drop_of(drops, cells, a, k, optics.spacing, motion[0], motion[1]),
                    2,
                )


@qd.func
def walk(
    pixels: Pixels,
    surface: WaterSurface,
    drops: Drops,
    cells: Cells,
    lens: Lens,
    look: Look,
    optics: Optics,
    a,
    drop,
    part: qd.template(),
):
    """Go over the pixels of a drop: 0 to find whose they are, 1 to shade the own ones, 2 to lay them over the picture.

    What is a pixel wide or less is as faint as it is small.
    """
    c, r = to_view(lens, vec3(drop[0], drop[1], drop[2])), drop[3]
    if r > 0.0 and c.z > lens.near + 2.0 * r:
        scale = pixels_per_metre(lens, c.z)
        wide = qd.max(r, 0.75 / scale)
        faint = (r / wide) ** 2
        key = qd.bit_cast(c.z - r, qd.i32)
        box = box_of_ball(lens, c, wide + 0.5 / scale, pixels.depth.shape[0], pixels.depth.shape[1])
        for row in range(box[2], box[3] + 1):
            for column in range(box[0], box[1] + 1):
                here = point_at(lens, row, column, c.z)
                away = qd.sqrt((here.x - c.x) ** 2 + (here.y - c.y) ** 2)
                cover = qd.min((wide - away) * scale + 0.5, 1.0)
                if cover > 0.0 and key < qd.min(surface.depth[row, column], pixels.depth[row, column]):
                    if qd.static(part == 0):
                        qd.atomic_min(surface.nearest[row, column], key)
                    elif surface.nearest[row, column] == key:
                        if qd.static(part == 1):
                            pixels.normal[row, column] = shine(
                                pixels,
                                surface,
                                drops,
                                cells,
                                lens,
                                look,
                                optics,
                                a,
                                row,
                                column,
                                c,
                                wide,
                                rough_of(wide * scale),
                            )
                        else:
                            line = line_cover(pixels.lines[row, column], c.z, 1.1 * optics.spacing)
                            cover *= faint * (1.0 - look.line_strength * line)
                            before = pixels.color[row, column]
                            pixels.color[row, column] = before + cover * (pixels.normal[row, column] - before)

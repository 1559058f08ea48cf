"""Lone particles: drops in front of the finished picture, which they refract.

A particle with hardly a neighbour is no part of any surface: it has no share in the depth and the thickness of the
water behind it (`ellipsoids.lone`), and is drawn over the picture when that is finished. A drop is a ball of its own:
a ray is turned twice by the same angle, so that the ball shows the world behind it upside down, and dimmed by the chord
that it takes. A lone particle that is fast stands for spray: water of so many particles' volume that flies apart, some
smaller drops beside the first, which gives them what it loses.

    code      symbol   meaning                                                        unit
    c, r               middle and radius of a drop                                    m
    cosi               cosine of the angle of incidence                               1
    bent               direction of the ray within                                    1
    chord              its way within                                                 m
    out                its direction afterwards                                       1
    cover              share of a pixel that a drop covers                            1
    torn               how far a particle has flown apart, 0 to 1                     1
"""

from wavetank.device.compiler import qd
from wavetank.solids.distance import lift
from wavetank.view.buffers import Buffers, Pixels
from wavetank.view.cells import Cells
from wavetank.view.lens import (
    Lens,
    box_of_ball,
    pixels_per_metre,
    point_at,
    ray_direction,
    ray_origin,
    to_pixel,
    to_view,
    vec2,
    vec3,
    vec4,
    view_ray,
)
from wavetank.view.look import Look
from wavetank.view.optics.chance import bits_of, share_of_bits
from wavetank.view.optics.dyes import dyed, swallowed_by
from wavetank.view.optics.fluid import Optics, dimmed, optics_of, refracted
from wavetank.view.optics.glass import line_cover
from wavetank.view.optics.maps import margins_inside, picture_at
from wavetank.view.optics.mixture import color_of_fluid, swallow_of
from wavetank.view.optics.radiance import environment, glint, smoothstep, surface_radiance
from wavetank.view.shot import Shot
from wavetank.view.water_buffers import Drops, WaterSurface, water_of
from wavetank.view.weights import under_water

CALM, TORN = 0.7, 2.5  # m/s: speeds up to which a drop is one, and from which on it has flown apart


def draw(shot: Shot, buffers: Buffers) -> None:
    """Lay the drops over the picture; `surface.nearest` is lowered to theirs. An eye in the water sees none."""
    frame = shot.frame
    if frame.dim == 2 or frame.count == 0 or under_water(shot, buffers):
        return
    water = water_of(buffers, shot)
    drops = water.drops(frame)
    lay(
        buffers.pixels, water.surface, drops, water.cells, shot.lens, shot.look, optics_of(shot), CALM, TORN,
        frame.count,
    )  # fmt: skip


@qd.func
def drop_of(drops: Drops, cells: Cells, a, k, spacing, calm, torn_at):
    """(middle, radius) [m] of drop `k`, of six, of the particle at the sorted place `a`; the radius may be 0."""
    n = cells.order[a]
    v = lift(drops.v[n])
    torn = smoothstep((v.norm() - calm) / (torn_at - calm))
    # Of a ball of one particle's volume; five parts of 0 to 0.16 of it fly apart.
    volume, x = 1.0, cells.x[a]
    for j in range(5):
        part = 0.16 * torn * share_of_bits(bits_of(drops.id[n], j), 0)
        if k == 0:
            volume -= part
        elif j == k - 1:
            volume = part
    if k > 0:
        bits = bits_of(drops.id[n], 8 + k)
        away = 2.0 * vec3(share_of_bits(bits, 0), share_of_bits(bits, 1), share_of_bits(bits, 2)) - 1.0
        x += (0.9 * torn * spacing) * away
    return vec4(x.x, x.y, x.z, 0.58 * spacing * qd.max(volume, 0.0) ** (1.0 / 3.0))


@qd.kernel(fastcache=True)
def lay(
    pixels: Pixels, surface: WaterSurface, drops: Drops, cells: Cells, lens: Lens, look: Look, optics: Optics,
    calm: qd.f32, torn: qd.f32, count: qd.i32,
):  # fmt: skip
    """Find the nearest drop of each pixel, shade it by the picture without drops, and lay it over that.

    `pixels.normal` holds the shaded drops meanwhile.
    """
    for a in range(count):
        if drops.lone[a] == 1:
            for k in range(6):
                walk(pixels, surface, drops, cells, lens, look, optics, a, drop_of(drops, cells, a, k, optics.spacing,
                     calm, torn), 0)  # fmt: skip
    for a in range(count):
        if drops.lone[a] == 1:
            for k in range(6):
                walk(pixels, surface, drops, cells, lens, look, optics, a, drop_of(drops, cells, a, k, optics.spacing,
                     calm, torn), 1)  # fmt: skip
    for a in range(count):
        if drops.lone[a] == 1:
            for k in range(6):
                walk(pixels, surface, drops, cells, lens, look, optics, a, drop_of(drops, cells, a, k, optics.spacing,
                     calm, torn), 2)  # fmt: skip


@qd.func
def walk(
    pixels: Pixels, surface: WaterSurface, drops: Drops, cells: Cells, lens: Lens, look: Look, optics: Optics, a, drop,
    part: qd.template(),
):  # fmt: skip
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
                                pixels, surface, drops, cells, lens, look, optics, a, row, column, c, wide
                            )
                        else:
                            line = line_cover(pixels.lines[row, column], c.z, 1.1 * optics.spacing)
                            cover *= faint * (1.0 - look.line_strength * line)
                            before = pixels.color[row, column]
                            pixels.color[row, column] = before + cover * (pixels.normal[row, column] - before)


@qd.func
def shine(
    pixels: Pixels, surface: WaterSurface, drops: Drops, cells: Cells, lens: Lens, look: Look, optics: Optics, a, row,
    column, c, r,
):  # fmt: skip
    """Radiance of the ball of radius `r` at `c` (view coordinates) that a pixel shows."""
    ray = view_ray(lens, row, column)
    origin, direction = ray_origin(lens, ray), ray_direction(lens, ray)
    pace = direction.norm()
    ahead = direction / pace
    middle = lens.eye + c.x * lens.right + c.y * lens.up + c.z * lens.forward
    # The ray, moved into the ball where it only grazes it.
    along = (middle - origin).dot(ahead)
    miss = origin + along * ahead - middle
    miss *= qd.min(1.0, 0.97 * r / qd.max(miss.norm(), 1e-12))
    n = (miss - qd.sqrt(qd.max(r * r - miss.dot(miss), 0.0)) * ahead) / r
    cosi = qd.max(-n.dot(ahead), 0.05)
    bent = refracted(ahead, n, cosi)
    chord = -2.0 * r * bent.dot(n)
    out = 2.0 * bent.dot(ahead) * bent - ahead
    start = middle + r * n + chord * bent
    seen = qd.min(surface.depth[row, column], pixels.depth[row, column])
    way = qd.min(qd.bit_cast(seen, qd.f32) - c.z, 1e3)
    if out.y < -1e-3:
        way = qd.min(way, qd.max(start.y, 0.0) / -out.y)
    shown = environment(look, out)
    p = to_view(lens, start + way * out)
    if p.z > lens.near:
        there = to_pixel(lens, p)
        inside = margins_inside(pixels.depth, there, 0.1)
        if inside > 0.0:
            i, j = qd.cast(there.y, qd.i32), qd.cast(there.x, qd.i32)
            if qd.bit_cast(qd.min(surface.depth[i, j], pixels.depth[i, j]), qd.f32) > c.z:
                shown += smoothstep(inside) * (picture_at(pixels.color, there) - shown)
    swallow, murk = optics.absorption, 0.0
    own = drops.dye[cells.order[a]]
    body, kind = optics.glow, drops.material[cells.order[a]]
    if drops.fluids > 0:
        swallow, murk = swallow_of(drops.matter, optics, kind), drops.matter[kind][3]
        body = color_of_fluid(drops.matter, look, optics, kind)
    if own != 0:
        color = qd.min(qd.max(dyed(vec3(0.0, 0.0, 0.0), own | (127 << 24)), 0.02), 0.98)
        share = ((own >> 24) & 127) / 127.0
        swallow = swallowed_by(vec4(share, color.x, color.y, color.z), swallow, optics.usual)
        body += share * (color - body)
    # Light gets into a drop from all sides: it is paler than a layer of water as thick.
    result = dimmed(shown, 0.4 * chord, swallow, optics.scattering, optics.glow)
    if murk > 0.0:
        lit = (
            surface_radiance(look, body / (1.0 + 2.0 * drops.shine[kind].max()), n, -ahead, vec2(1.0, 1.0), 0.45, 0.0)
            + drops.shine[kind]
        )
        result += (1.0 - qd.exp(-murk * chord)) * (lit - result)
    mirror = 0.02 + 0.98 * (1.0 - cosi) ** 5
    result += mirror * (environment(look, ahead + 2.0 * cosi * n) - result)
    return result + glint(look, n.dot((look.to_sun - ahead).normalized(1e-9)))

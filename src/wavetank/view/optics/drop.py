"""A drop: where it is, what it is torn into, where it goes, and what it shines with.

code      symbol   meaning                                                        unit
c, r               middle and radius of a drop                                    m
cosi               cosine of the angle of incidence                               1
bent               direction of the ray within                                    1
chord              its way within                                                 m
out                its direction afterwards                                       1
torn               how far a particle has flown apart, 0 to 1                     1
"""

from typing import Any

from wavetank.device.compiler import qd
from wavetank.solids.distance import lift
from wavetank.view.buffers import Pixels
from wavetank.view.cells import Cells
from wavetank.view.lens import Lens, ray_direction, ray_origin, to_pixel, to_view, vec2, vec3, vec4, view_ray
from wavetank.view.look import Look
from wavetank.view.optics.bilinear import margins_inside, sample_picture
from wavetank.view.optics.dyes import dyed, swallowed_by
from wavetank.view.optics.fluid import Optics, dimmed, refracted
from wavetank.view.optics.hash_noise import bits_of, share_of_bits
from wavetank.view.optics.mixture import color_of_fluid, swallow_of
from wavetank.view.optics.radiance import environment, glint, smoothstep, surface_radiance
from wavetank.view.water_buffers import Drops, WaterSurface

CALM, TORN = 0.7, 2.5  # m/s: speeds up to which a drop is one, and from which on it has flown apart
LEAST = 1.0  # px: way while the shutter opens from which on a drop is a streak


def motion_of(shutter: float, samples: int) -> Any:
    """(CALM, TORN, time that the shutter opens [s], least way of a streak [computed px]): what drops move by."""
    return vec4(CALM, TORN, shutter, LEAST * samples)


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


@qd.func
def way_of(lens: Lens, drops: Drops, cells: Cells, a, open):
    """Where a drop goes in the picture [computed px] in the time `open` [s]."""
    here, later = to_view(lens, cells.x[a]), to_view(lens, cells.x[a] + open * lift(drops.v[cells.order[a]]))
    near = 1.01 * lens.near
    here.z, later.z = qd.max(here.z, near), qd.max(later.z, near)
    return to_pixel(lens, later) - to_pixel(lens, here)


@qd.func
def rough_of(wide):
    """Variance of the normals within a pixel of a ball that is so `wide` [px]."""
    return 1.0 / (12.0 * wide * wide)


@qd.func
def behind_drop(
    solid: qd.template(),
    first: qd.template(),
    picture: qd.template(),
    lens: Lens,
    look: Look,
    start,
    direction,
    row,
    column,
    z,
):
    """Radiance along a ray that has left a drop: of the floor or of what stands behind, as far as they are seen.

    That is in the `picture`, at the nearer of the depths `solid` and `first`; the drop is at the depth `z` [m].
    """
    way = qd.min(qd.bit_cast(qd.min(first[row, column], solid[row, column]), qd.f32) - z, 1e3)
    if direction.y < -1e-3:
        way = qd.min(way, qd.max(start.y, 0.0) / -direction.y)
    result = environment(look, direction)
    p = to_view(lens, start + way * direction)
    if p.z > lens.near:
        there = to_pixel(lens, p)
        inside = margins_inside(solid, there, 0.1)
        if inside > 0.0:
            i, j = qd.cast(there.y, qd.i32), qd.cast(there.x, qd.i32)
            if qd.bit_cast(qd.min(first[i, j], solid[i, j]), qd.f32) > z:
                result += smoothstep(inside) * (sample_picture(picture, there) - result)
    return result


@qd.func
def drop_radiance(
    pixels: Pixels,
    surface: WaterSurface,
    drops: Drops,
    cells: Cells,
    lens: Lens,
    look: Look,
    optics: Optics,
    a,
    row,
    column,
    c,
    r,
    rough,
):
    """Radiance of the ball of radius `r` at `c` (view coordinates) that a pixel shows.

    `rough` is the variance of its normals there, see `glint`.
    """
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
    down = qd.min(qd.max(qd.cast(row, qd.i32), 0), pixels.depth.shape[0] - 1)
    across = qd.min(qd.max(qd.cast(column, qd.i32), 0), pixels.depth.shape[1] - 1)
    shown = behind_drop(pixels.depth, surface.depth, pixels.color, lens, look, start, out, down, across, c.z)
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
    return result + glint(look, n.dot((look.to_sun - ahead).normalized(1e-9)), rough)

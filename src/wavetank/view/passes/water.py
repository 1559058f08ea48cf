"""The water itself: what it reflects, what shines through it, what it swallows and what it gives back.

B. Walter et al., "Microfacet models for refraction" (2007) for the directions; Schlick 1994 for Fresnel; Beer-Lambert
for the absorption. Refraction follows the ray into the water for as far as the water is thick (the exit point of
W. van der Laan, S. Green, M. Sainz, "Screen space fluid rendering with curvature flow", 2009, taken one step on) and
takes the finished backdrop where that point is seen.

    code      symbol   meaning                                                         unit
    n                  normal of the surface, towards the eye                          1
    cosi               cosine between it and the line of sight                         1
    mirror    F        share of light that is reflected                                1
    bent               direction of the ray within the water                           1
    travel    s        its way to the exit point                                       m
    swallow   sigma_a  absorption per colour, dye included                             1/m
"""

import dataclasses

import numpy as np

from wavetank.device.compiler import download, qd
from wavetank.device.state import remembered
from wavetank.view.buffers import Buffers
from wavetank.view.lens import (
    Lens,
    from_view,
    point_at,
    ray_direction,
    ray_origin,
    to_pixel,
    to_view,
    vec2,
    vec3,
    vector,
    view_ray,
)
from wavetank.view.look import Look
from wavetank.view.passes import cut
from wavetank.view.passes.ellipsoids import walls
from wavetank.view.passes.panes import share_behind, tank_interval
from wavetank.view.passes.shade import background, smoothstep
from wavetank.view.passes.surface import normal_of, rise_at
from wavetank.view.passes.tank import line_cover, slack
from wavetank.view.passes.thickness import DISC, coarseness, dye_in, swallowed_by, thickness_at
from wavetank.view.shot import Shot
from wavetank.view.strips import Strips, strip, strips_of
from wavetank.view.water_buffers import UNIT, water_of


def under_water(shot: Shot, buffers: Buffers) -> int:
    """1 if the eye is inside the water, else 0."""
    eye, extent = np.asarray(shot.lens.eye, float), shot.extent
    if shot.frame.dim == 2 or shot.lens.perspective < 0.5 or shot.frame.count == 0:
        return 0
    if np.any(eye < extent.lower - extent.spacing) or np.any(eye > extent.upper + extent.spacing):
        return 0
    water = water_of(buffers, shot)
    found = qd.ndarray(qd.f32, shape=(1,))
    cut.weigh(water.cells, shot.lens.eye, shot.frame.dim, found)
    return int(float(download(found)[0]) > 0.5 * cut.full_weight(water.cells.edge / extent.spacing, 3))


def draw(shot: Shot, buffers: Buffers) -> None:
    """Lay the water over the backdrop."""
    water = water_of(buffers, shot)
    lower, upper = walls(shot)
    if shot.frame.dim == 2:  # as deep as the water is drawn
        thick = vector(0.0, 0.0, 10.0 * shot.extent.spacing)
        lower, upper = vector(*(lower - thick)), vector(*(upper + thick))
    lay(
        strips_of(buffers.depth), shot.lens, shot.look, optics_of(shot), lower, upper, slack(shot),
        under_water(shot, buffers), shot.frame.dim, water.depth, water.rim, water.thickness, water.dye, water.stained,
        buffers.depth, water.behind, buffers.lines, buffers.color, water.spare,
    )  # fmt: skip


@dataclasses.dataclass(frozen=True, eq=False)
class Optics:
    """What the fluid does to light, and the scale of the maps of its thickness, on the device."""

    absorption: vec3  # 1/m
    scattering: qd.f32  # 1/m
    glow: vec3  # radiance of light that comes back out of deep water
    usual: qd.f32  # m: water that gives its colour to what is behind it
    coarse: qd.f32  # pixels per texel of the thickness
    unit: qd.f32  # m per step of it
    spacing: qd.f32  # m
    disc: qd.f32  # m: radius of a particle's disc in a plane


def optics_of(shot: Shot) -> Optics:
    """Return what the fluid of a picture does to light."""
    return remembered(Optics(
        absorption=shot.absorption, scattering=shot.scattering, glow=shot.look.glow * shot.tint, usual=shot.usual,
        coarse=float(coarseness(shot)), unit=shot.extent.spacing / UNIT, spacing=shot.extent.spacing,
        disc=DISC[2] * shot.extent.spacing,
    ))  # fmt: skip


@qd.func
def wall_share(at, lower, upper, disc):
    """Share of a disc around `at` that the walls of a plane leave; behind them nothing adds to a thickness."""
    share = 1.0
    for k in qd.static(range(2)):
        for side in qd.static(range(2)):
            gap = (at[k] - lower[k]) / disc
            if qd.static(side == 1):
                gap = (upper[k] - at[k]) / disc
            s = qd.min(qd.max(gap, 0.0), 1.0)
            share *= 0.5 + s * (15.0 - s * s * (10.0 - 3.0 * s * s)) / 16.0
    return share


@qd.func
def sheet_at(lens: Lens, optics: Optics, thickness: qd.template(), place, lower, upper):
    """Thickness of the sheet that a 2-D world is, at a place in the picture [m]."""
    c = point_at(lens, place.y - 0.5, place.x - 0.5, 1.0)
    share = wall_share(lens.eye + from_view(lens, c), lower, upper, optics.disc)
    return thickness_at(thickness, place / optics.coarse, optics.unit) / share


@qd.func
def sheet_normal(lens: Lens, optics: Optics, thickness: qd.template(), place, lower, upper):
    """Normal of the sheet: a plane has no shape in depth and gets that of a drop between two panes."""
    dx, dy = vec2(optics.coarse, 0.0), vec2(0.0, optics.coarse)
    right = sheet_at(lens, optics, thickness, place + dx, lower, upper)
    right -= sheet_at(lens, optics, thickness, place - dx, lower, upper)
    below = sheet_at(lens, optics, thickness, place + dy, lower, upper)
    below -= sheet_at(lens, optics, thickness, place - dy, lower, upper)
    bulge = optics.disc / (2.0 * optics.coarse * lens.pixel * optics.spacing)
    return from_view(lens, vec3(-bulge * right, bulge * below, -1.0).normalized())


@qd.func
def environment(look: Look, direction):
    """Radiance that the water mirrors: the studio, its ground and its lamps."""
    result = background(look, direction)
    if direction.y < 0.05:
        share = smoothstep((0.05 - direction.y) / 0.25)
        result += share * (look.floor * look.ground * 1.4 - result)
    else:
        # A wide soft lamp overhead, towards the sun: broad streaks of light on every wave.
        u = direction.x / (direction.y + 0.15)
        v = direction.z / (direction.y + 0.15)
        a = smoothstep((0.75 - qd.abs(u + 0.55)) / 0.18) * smoothstep((1.6 - qd.abs(v + 0.3)) / 0.25)
        b = smoothstep((0.22 - qd.abs(u - 0.9)) / 0.12) * smoothstep((1.8 - qd.abs(v)) / 0.3)
        result += look.lamp * (a + 0.6 * b)
    return result


@qd.func
def picture_at(behind: qd.template(), place):
    """Radiance at a place (column, row), between the four nearest pixels."""
    rows, columns = behind.shape[0], behind.shape[1]
    x = qd.min(qd.max(place.x - 0.5, 0.0), columns - 1.0)
    y = qd.min(qd.max(place.y - 0.5, 0.0), rows - 1.0)
    c, r = qd.min(qd.max(qd.cast(x, qd.i32), 0), columns - 1), qd.min(qd.max(qd.cast(y, qd.i32), 0), rows - 1)
    c1, r1 = qd.min(c + 1, columns - 1), qd.min(r + 1, rows - 1)
    u, v = x - c, y - r
    top = behind[r, c] + u * (behind[r, c1] - behind[r, c])
    low = behind[r1, c] + u * (behind[r1, c1] - behind[r1, c])
    return top + v * (low - top)


@qd.kernel(fastcache=True)
def lay(
    strips: Strips, lens: Lens, look: Look, optics: Optics, lower: vec3, upper: vec3, slack: qd.f32, under: qd.i32,
    dim: qd.template(), water_depth: qd.types.ndarray(), rim: qd.types.ndarray(), thickness: qd.types.ndarray(),
    dye: qd.types.ndarray(), stained: qd.types.ndarray(), depth: qd.types.ndarray(), behind: qd.types.ndarray(),
    lines: qd.types.ndarray(), color: qd.types.ndarray(), seen: qd.types.ndarray(),
):  # fmt: skip
    """Shade every pixel that shows water, and copy the backdrop to the others; `seen` is filled with the nearer
    of its depth and the backdrop's.
    """
    for task in range(strips.count):
        row, begin, end = strip(strips, task, depth.shape[0], depth.shape[1])
        for column in range(begin, end):
            result = behind[row, column]
            z = qd.bit_cast(water_depth[row, column], qd.f32)
            front = 1.7e38
            if under == 1:
                result = dimmed(lens, optics, row, column, qd.bit_cast(depth[row, column], qd.f32), thickness, result)
            elif z < 1e30:
                ray = view_ray(lens, row, column)
                origin, direction = ray_origin(lens, ray), ray_direction(lens, ray)
                ends, turns, wall = tank_interval(lens, origin, direction, lower, upper)
                front = qd.max(z, ends[0])
                if ends[0] <= ends[1] and front < qd.bit_cast(depth[row, column], qd.f32):
                    # Up to three surfaces share a pixel: at a pane, in the tank, and an outline before them.
                    wet, there, cover, edge, rise = 0.0, 1.0, 0.0, z, vec2(0.0, 0.0)
                    if qd.static(dim == 3):
                        at_pane = ends[0] > lens.near and wall.y == 0.0  # not through the open top
                        if at_pane and z < ends[0] - optics.spacing:
                            wet = 1.0
                        else:
                            rise = rise_at(row, column, z, 3.0 * optics.spacing, water_depth)
                            if at_pane and z < ends[0] + optics.spacing:
                                wet = 1.0 - share_behind(z, ends[0], rise, vec2(turns.x, turns.y))
                            if z > ends[1] - optics.spacing:
                                there = 1.0 - share_behind(z, ends[1], rise, vec2(turns.z, turns.w))
                    if rim[row, column] > 0:
                        edge = qd.bit_cast((0xFFFFFF - (rim[row, column] & 0xFFFFFF)) << 7, qd.f32)
                        cover = ((rim[row, column] >> 24) + 0.5) / 127.0
                        if edge + optics.spacing > z:
                            there *= qd.select(wet < 1.0, cover, 1.0)
                            cover = 0.0
                        else:
                            stands = qd.min((z - edge) / optics.spacing - 1.0, 1.0)
                            cover *= qd.select(edge > ends[0], stands, 0.0)
                    first, second = there * (1.0 - cover) * wet, there * (1.0 - cover) * (1.0 - wet)
                    result *= 1.0 - (first + second + cover)
                    for layer in range(3):
                        share, n, at = first, wall, front
                        if layer == 1:
                            share = second
                            if qd.static(dim == 3):
                                n = normal_of(lens, row, column, z, rise)
                        elif layer == 2:
                            share, at = cover, edge
                            if qd.static(dim == 3):
                                if share > 0.0:
                                    n = normal_beside(lens, row, column, edge, optics.spacing, water_depth)
                        if share > 0.0:
                            result += share * shine(
                                lens, look, optics, lower, upper, dim, row, column, at, n, origin, direction,
                                thickness, dye, stained[0], depth, behind,
                            )  # fmt: skip
                    result += (
                        look.line_strength * there * line_cover(lines[row, column], front, slack) * (look.line - result)
                    )
                    if there < 0.5:
                        front = 1.7e38
                else:
                    front = 1.7e38
            color[row, column] = result
            seen[row, column] = qd.min(
                qd.select(front < 1e30, qd.bit_cast(front, qd.i32), 0x7F000000), depth[row, column]  # FARTHEST
            )  # fmt: skip


@qd.func
def dimmed(lens: Lens, optics: Optics, row, column, back, thickness: qd.template(), radiance):
    """Radiance as seen from within the water: there is no surface, water dims and tints what is behind it."""
    tau = thickness_at(thickness, vec2(column + 0.5, row + 0.5) / optics.coarse, optics.unit)
    travel = qd.min(tau, back * ray_direction(lens, view_ray(lens, row, column)).norm())
    left = qd.exp(-travel * optics.absorption)
    return radiance * left + (1.0 - qd.exp(-travel * optics.scattering)) * optics.glow


@qd.func
def normal_beside(lens: Lens, row, column, z, limit, depth: qd.template()):
    """Normal of the surface at about the depth `z` that a neighbouring pixel shows; towards the eye where none does."""
    best, r, c = limit, row, column
    for k in qd.static(range(4)):
        i = qd.min(qd.max(row + qd.static((0, 0, 1, -1)[k]), 0), depth.shape[0] - 1)
        j = qd.min(qd.max(column + qd.static((1, -1, 0, 0)[k]), 0), depth.shape[1] - 1)
        off = qd.abs(qd.bit_cast(depth[i, j], qd.f32) - z)
        if off < best:
            best, r, c = off, i, j
    n = -lens.forward
    if best < limit:
        there = qd.bit_cast(depth[r, c], qd.f32)
        n = normal_of(lens, r, c, there, rise_at(r, c, there, 3.0 * limit, depth))
    return n


@qd.func
def behind_drop(
    lens: Lens, look: Look, start, direction, row, column, z, depth: qd.template(), behind: qd.template()
):  # fmt: skip
    """Radiance along a ray that has left a drop: of the floor or of what stands behind, as far as they are seen."""
    way = qd.min(qd.bit_cast(depth[row, column], qd.f32) - z, 1e3)
    if direction.y < -1e-3:
        way = qd.min(way, qd.max(start.y, 0.0) / -direction.y)
    result = environment(look, direction)
    c = to_view(lens, start + way * direction)
    if c.z > lens.near:
        there = to_pixel(lens, c)
        rows, columns = depth.shape[0], depth.shape[1]
        inside = qd.min(there.x, columns - there.x, there.y, rows - there.y) / (0.1 * rows)
        if inside > 0.0:
            if qd.bit_cast(depth[qd.cast(there.y, qd.i32), qd.cast(there.x, qd.i32)], qd.f32) > z:
                result += smoothstep(inside) * (picture_at(behind, there) - result)
    return result


@qd.func
def shine(
    lens: Lens, look: Look, optics: Optics, lower, upper, dim: qd.template(), row, column, z, normal, origin,
    direction, thickness: qd.template(), dye: qd.template(), stained, depth: qd.template(), behind: qd.template(),
):  # fmt: skip
    """Radiance of the water that a pixel shows at depth `z` with this normal."""
    n, pace = normal, direction.norm()
    ahead, at = direction / pace, origin + z * direction
    place = vec2(column + 0.5, row + 0.5)
    tau = 0.0
    if qd.static(dim == 2):
        tau = sheet_at(lens, optics, thickness, place, lower, upper)
        n = sheet_normal(lens, optics, thickness, place, lower, upper)
    else:
        tau = thickness_at(thickness, place / optics.coarse, optics.unit)
    cosi = qd.max(-n.dot(ahead), 0.05)
    bent = 0.7519 * ahead + (0.7519 * cosi - qd.sqrt(1.0 - 0.5653 * (1.0 - cosi * cosi))) * n
    # The least that a drop is thick; in a plane the rim keeps half of the colour.
    tau = qd.max(tau, qd.static(0.15 if dim == 3 else 0.55) * optics.spacing)
    travel = qd.min(tau, (qd.bit_cast(depth[row, column], qd.f32) - z) * pace)
    if qd.static(dim == 3):
        if bent.y < -1e-3 and at.y > 0.0:
            travel = qd.min(travel, -at.y / bent.y)
    c = to_view(lens, at + travel * bent)
    shown = behind[row, column]
    if c.z > lens.near:
        there = to_pixel(lens, c)
        r = qd.min(qd.max(qd.cast(there.y, qd.i32), 0), depth.shape[0] - 1)
        e = qd.min(qd.max(qd.cast(there.x, qd.i32), 0), depth.shape[1] - 1)
        if qd.bit_cast(depth[r, e], qd.f32) > z:  # not what stands in front of the water
            shown = picture_at(behind, there)
    glossy = 1.0
    if qd.static(dim == 3):
        # Less water than in a sheet of single particles is a drop: a ball turns a ray twice by the same angle. Against
        # the glass drops and films are flat, and mirror no more than the glass around them.
        layers, gap = tau / optics.spacing, qd.min((at - lower).min(), (upper - at).min()) / optics.spacing
        off = smoothstep((gap - 0.05) / 0.2)
        ball = smoothstep((0.75 - layers) / 0.3) * off
        glossy = 1.0 - smoothstep((1.6 - layers) / 0.8) * (1.0 - off)
        if ball > 0.0:
            out = 2.0 * bent.dot(ahead) * bent - ahead
            shown += ball * (behind_drop(lens, look, at + travel * bent, out, row, column, z, depth, behind) - shown)
    swallow, tint = optics.absorption, optics.glow
    if stained == 1:
        found = dye_in(dye, place / optics.coarse, tau / optics.unit)
        if found[0] > 0.0:
            swallow = swallowed_by(found, swallow, optics.usual)
            tint += found[0] * (look.glow * vec3(found[1], found[2], found[3]) - tint)
    result = shown * qd.exp(-travel * swallow) + (1.0 - qd.exp(-travel * optics.scattering)) * tint
    if qd.static(dim == 2):  # the rim of the sheet catches the light, and on paper there is nothing to mirror
        # Light comes from above left, and less of it reaches the bottom.
        high = (at.y - lower.y) / (upper.y - lower.y)
        result *= (0.75 + 0.3 * qd.max(n.dot(look.to_sun), 0.0)) * (0.78 + 0.4 * qd.min(high, 1.0))
        result += 0.35 * look.lamp * smoothstep((0.85 - tau / optics.spacing) / 0.3)
    else:
        mirror = glossy * (0.02 + 0.98 * (1.0 - cosi) ** 5)
        result += mirror * (environment(look, ahead + 2.0 * cosi * n) - result)
        half = (look.to_sun - ahead).normalized(1e-9)
        result += qd.min(qd.max(n.dot(half), 0.0), 1.0) ** 600 * look.sparkle * look.sun
    return result

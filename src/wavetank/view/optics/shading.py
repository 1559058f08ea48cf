"""What the water that is seen shines with: what is behind it, dimmed, what it gives back, and what it mirrors.

code      symbol   meaning                                                         unit
cosi               cosine between the normal and the line of sight                 1
mirror    F        share of light that is reflected (Schlick 1994)                 1
tau                thickness of the water                                          m
travel    s        way of the ray within the water to its exit point               m
swallow   sigma_a  absorption per colour, dye included                             1/m
"""

import dataclasses
from typing import Final

from wavetank.device.compiler import qd
from wavetank.view.buffers import Pixels
from wavetank.view.lens import Lens, ray_direction, to_pixel, to_view, vec2, vec3, view_ray
from wavetank.view.look import Look
from wavetank.view.optics.bilinear import sample_picture, thickness_at
from wavetank.view.optics.drop import behind_drop
from wavetank.view.optics.dyes import dye_in, swallowed_by
from wavetank.view.optics.fluid import Optics, above_floor, dimmed, refracted
from wavetank.view.optics.mixture import mixed, murky
from wavetank.view.optics.planar import sheet_at, sheet_normal
from wavetank.view.optics.radiance import environment, glint, smoothstep
from wavetank.view.optics.water_volume import Inside
from wavetank.view.water_buffers import Backdrop, SunlitWater, Thickness


@dataclasses.dataclass(frozen=True, eq=False)
class WaterFeatures:
    """What the water of a world has: its kernel is compiled for no more than that."""

    planar: Final[bool]  # whether the world is a plane
    volume: Final[bool]  # whether rays are traced through it: in a tank in space
    solids: Final[bool]  # whether it meets solids: as traced rays do, or a sheet in a plane
    mixed: Final[bool]  # whether there are several fluids
    dyed: Final[bool]  # whether any of it may be dyed
    supersampled: Final[bool]  # whether pixels have several samples


#: What a fluid does to light at a place.
Tint = qd.types.struct(
    swallow=vec3,  # 1/m: absorption
    glow=vec3,  # radiance of light that comes back out of deep water
    color=vec3,  # of the fluid in front
    cover=qd.f32,  # share that it hides
    shine=vec3,  # radiance of its own
    hidden=qd.f32,  # share that the fluid behind it hides
    behind=vec3,  # colour of that
)


@qd.func
def radiance_from_within(thickness: qd.template(), lens: Lens, optics: Optics, row, column, back, radiance):
    """Radiance as seen from within the water: there is no surface, water dims and tints what is behind it."""
    tau = thickness_at(thickness, vec2(column + 0.5, row + 0.5) / optics.coarse, optics.unit)
    travel = qd.min(tau, back * ray_direction(lens, view_ray(lens, row, column)).norm())
    return dimmed(radiance, travel, optics.absorption, optics.scattering, optics.glow)


@qd.func
def water_radiance(
    pixels: Pixels,
    thickness: Thickness,
    backdrop: Backdrop,
    sunlit: SunlitWater,
    lens: Lens,
    sun: Lens,
    look: Look,
    optics: Optics,
    inside: Inside,
    features: WaterFeatures,
    place,
    z,
    n,
    origin,
    direction,
    ray: qd.template(),
    rough,
):
    """Radiance of water in space that is seen at depth `z` with the normal `n`, at a place (column, row) of the
    picture, and the share in it of what is behind.

    `ray` is the one that was traced for it; its way is negative where none was. Rays that spread, because the surface
    is uneven, are as long as the straight one as far as they are not as long as that. `rough` is the variance of the
    normals around, see `glint`.
    """
    pace = direction.norm()
    ahead, at = direction / pace, origin + z * direction
    row, column = qd.cast(place.y, qd.i32), qd.cast(place.x, qd.i32)
    raw = thickness_at(thickness.water, place / optics.coarse, optics.unit)
    cosi = qd.max(-n.dot(ahead), 0.05)
    bent = refracted(ahead, n, cosi)
    tau = qd.max(raw, 0.15 * optics.spacing)  # the least that a drop is thick
    travel = qd.min(tau, (qd.bit_cast(pixels.depth[row, column], qd.f32) - z) * pace)
    travel = above_floor(travel, at, bent)
    exit = at + travel * bent
    shown = refracted_backdrop(pixels, backdrop, lens, exit, z, row, column, ray.confidence < 1.0)
    # Less water than in a sheet of single particles is a drop: a ball turns a ray twice by the same angle. Against
    # the glass drops and films are flat, and mirror no more than the glass around them.
    layers = tau / optics.spacing
    gap = qd.min((at - inside.walls.lower).min(), (inside.walls.upper - at).min()) / optics.spacing
    off = smoothstep((gap - 0.05) / 0.2)
    ball = smoothstep((0.75 - layers) / 0.3) * off
    glossy = 1.0 - smoothstep((1.6 - layers) / 0.8) * (1.0 - off)
    if qd.static(features.volume):
        if ray.seen[3] >= 0.0:
            shown += ray.confidence * (vec3(ray.seen[0], ray.seen[1], ray.seen[2]) - shown)
            travel += ray.confidence * (1.0 - qd.min(1.5 * ray.uneven, 0.6)) * (ray.seen[3] - travel)
            ball *= 1.0 - ray.confidence
    if ball > 0.0:
        out = 2.0 * bent.dot(ahead) * bent - ahead
        start = at + travel * bent
        far = behind_drop(pixels.depth, pixels.depth, backdrop.behind, lens, look, start, out, row, column, z)
        shown += ball * (far - shown)
    tint = tint_at(thickness, look, optics, features, place, tau, raw)
    result, passed = dimmed_and_tinted(
        sunlit, sun, look, optics, inside, features, tint, shown, travel, tau, at, n, ahead
    )
    mirror = glossy * (0.02 + 0.98 * (1.0 - cosi) ** 5)
    mirrored = environment(look, ahead + 2.0 * cosi * n)
    if qd.static(features.volume):
        mirrored += ray.mirrored[3] * (vec3(ray.mirrored[0], ray.mirrored[1], ray.mirrored[2]) - mirrored)
    result += mirror * (mirrored - result)
    half = (look.to_sun - ahead).normalized(1e-9)
    result += glint(look, n.dot(half), rough)
    return result, passed * (1.0 - mirror)


@qd.func
def sheet_radiance(
    pixels: Pixels,
    thickness: Thickness,
    backdrop: Backdrop,
    sunlit: SunlitWater,
    lens: Lens,
    sun: Lens,
    look: Look,
    optics: Optics,
    inside: Inside,
    features: WaterFeatures,
    place,
    z,
    origin,
    direction,
):
    """Radiance of the sheet of water that a world in a plane is, at depth `z` and a place (column, row) of the
    picture.
    """
    pace = direction.norm()
    ahead, at = direction / pace, origin + z * direction
    row, column = qd.cast(place.y, qd.i32), qd.cast(place.x, qd.i32)
    tau = sheet_at(thickness.water, lens, optics, inside, place, qd.static(features.solids))
    raw = thickness_at(thickness.water, place / optics.coarse, optics.unit)
    n = sheet_normal(thickness.water, lens, optics, inside, place, qd.static(features.solids))
    bent = refracted(ahead, n, qd.max(-n.dot(ahead), 0.05))
    tau = qd.max(tau, 0.55 * optics.spacing)  # the rim keeps half of the colour
    travel = qd.min(tau, (qd.bit_cast(pixels.depth[row, column], qd.f32) - z) * pace)
    exit = at + travel * bent
    shown = refracted_backdrop(pixels, backdrop, lens, exit, z, row, column, True)
    tint = tint_at(thickness, look, optics, features, place, tau, raw)
    result, _ = dimmed_and_tinted(sunlit, sun, look, optics, inside, features, tint, shown, travel, tau, at, n, ahead)
    # The rim of the sheet catches the light, and on paper there is nothing to mirror. Light comes from above left, and
    # less of it reaches the bottom.
    high = (at.y - inside.walls.lower.y) / (inside.walls.upper.y - inside.walls.lower.y)
    result *= (0.75 + 0.3 * qd.max(n.dot(look.to_sun), 0.0)) * (0.78 + 0.4 * qd.min(high, 1.0))
    return result + 0.35 * look.lamp * smoothstep((0.85 - tau / optics.spacing) / 0.3)


@qd.func
def refracted_backdrop(pixels: Pixels, backdrop: Backdrop, lens: Lens, exit, z, row, column, asked):
    """Radiance that the backdrop shows where a ray leaves the water, at the point `exit` [m], if it is `asked` for.

    What stands in front of the water, at a depth less than `z` [m], is not behind it.
    """
    c = to_view(lens, exit)
    shown = backdrop.behind[row, column]
    if c.z > lens.near and asked:
        there = to_pixel(lens, c)
        r = qd.min(qd.max(qd.cast(there.y, qd.i32), 0), pixels.depth.shape[0] - 1)
        e = qd.min(qd.max(qd.cast(there.x, qd.i32), 0), pixels.depth.shape[1] - 1)
        if qd.bit_cast(pixels.depth[r, e], qd.f32) > z:
            shown = sample_picture(backdrop.behind, there)
    return shown


@qd.func
def tint_at(thickness: Thickness, look: Look, optics: Optics, features: WaterFeatures, place, tau, raw):
    """What the fluids and their dye do to light at a place (column, row), where they are `tau` [m] thick.

    The dye's part is that of the thickness `raw` [m] that the map holds: a wall takes as much of the dye's discs as of
    the water's.
    """
    nothing = vec3(0.0, 0.0, 0.0)
    tint = Tint(
        swallow=optics.absorption,
        glow=optics.glow,
        color=optics.glow,
        cover=0.0,
        shine=nothing,
        hidden=0.0,
        behind=nothing,
    )
    if qd.static(features.mixed):
        tint.swallow, tint.glow, tint.color, tint.cover, tint.shine, tint.hidden, tint.behind = mixed(
            thickness, look, optics, place, tau, qd.static(features.planar)
        )
    if qd.static(features.dyed):
        if thickness.stained[0] == 1:
            found = dye_in(thickness.dye, place / optics.coarse, qd.max(raw, 0.15 * optics.spacing) / optics.unit)
            if found[0] > 0.0:
                tint.swallow = swallowed_by(found, tint.swallow, optics.usual)
                tint.glow += found[0] * (look.glow * vec3(found[1], found[2], found[3]) - tint.glow)
                tint.color += found[0] * (vec3(found[1], found[2], found[3]) - tint.color)
    return tint


@qd.func
def dimmed_and_tinted(
    sunlit: SunlitWater,
    sun: Lens,
    look: Look,
    optics: Optics,
    inside: Inside,
    features: WaterFeatures,
    tint: qd.template(),
    shown,
    travel,
    tau,
    at,
    n,
    ahead,
):
    """Radiance of what is `shown` behind so much water, with what the water gives back; and the share of it that is
    left, per colour.
    """
    passed = qd.exp(-travel * tint.swallow)
    result = passed * shown + (1.0 - qd.exp(-travel * optics.scattering)) * tint.glow
    if qd.static(features.mixed):
        if tint.hidden + tint.cover > 0.0:
            for part in range(2):  # what lies behind, then what lies in front: one copy of the code to compile
                if part == 0 or tint.cover > 0.0:
                    color = qd.select(part == 0, tint.behind, tint.color)
                    shine = qd.select(part == 0, vec3(0.0, 0.0, 0.0), tint.shine)
                    normal = qd.select(part == 0, vec3(0.0, 1.0, 0.0), n)
                    lit = murky(
                        sunlit, inside.shade, sun, look, optics, color, shine, at, normal, -ahead, features.planar
                    )
                    if part == 0:
                        result += tint.hidden * (lit * qd.exp(-0.3 * tau * tint.swallow) - result)
                        passed *= (1.0 - tint.hidden) * (1.0 - tint.cover)
                    else:
                        result += tint.cover * (lit - result)
    return result, passed

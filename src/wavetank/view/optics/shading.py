"""What the water that is seen shines with: what is behind it, dimmed, what it gives back, and what it mirrors.

code      symbol   meaning                                                         unit
cosi               cosine between the normal and the line of sight                 1
mirror    F        share of light that is reflected (Schlick 1994)                 1
travel    s        way of the ray within the water to its exit point               m
swallow   sigma_a  absorption per colour, dye included                             1/m
"""

from wavetank.device.compiler import qd
from wavetank.view.buffers import Pixels
from wavetank.view.lens import Lens, ray_direction, to_pixel, to_view, vec2, vec3, view_ray
from wavetank.view.look import Look
from wavetank.view.optics.bilinear import picture_at, thickness_at
from wavetank.view.optics.drop import behind_drop
from wavetank.view.optics.dyes import dye_in, swallowed_by
from wavetank.view.optics.fluid import Optics, above_floor, dimmed, refracted
from wavetank.view.optics.mixture import mixed, murky
from wavetank.view.optics.planar import sheet_at, sheet_normal
from wavetank.view.optics.radiance import environment, glint, smoothstep
from wavetank.view.optics.water_volume import Inside
from wavetank.view.water_buffers import Backdrop, SunlitWater, Thickness


@qd.func
def from_within(thickness: qd.template(), lens: Lens, optics: Optics, row, column, back, radiance):
    """Radiance as seen from within the water: there is no surface, water dims and tints what is behind it."""
    tau = thickness_at(thickness, vec2(column + 0.5, row + 0.5) / optics.coarse, optics.unit)
    travel = qd.min(tau, back * ray_direction(lens, view_ray(lens, row, column)).norm())
    return dimmed(radiance, travel, optics.absorption, optics.scattering, optics.glow)


@qd.func
def shine(
    pixels: Pixels,
    thickness: Thickness,
    backdrop: Backdrop,
    sunlit: SunlitWater,
    lens: Lens,
    sun: Lens,
    look: Look,
    optics: Optics,
    inside: Inside,
    place,
    z,
    normal,
    origin,
    direction,
    body,
    above,
    whole,
    uneven,
    rough,
    world: qd.template(),
    many: qd.template(),
):
    """Radiance of the water that is seen at depth `z` with this normal, at a place (column, row) of the picture, and
    the share in it of what is behind.

    `body`, `above` and `whole` are what `through_body` found for it; a negative way where it found none. Rays that
    spread, because the surface is `uneven`, are as long as the straight one as far as they are not as long as that.
    `rough` is the variance of the normals around, see `glint`.
    """
    n, pace = normal, direction.norm()
    ahead, at = direction / pace, origin + z * direction
    row, column = qd.cast(place.y, qd.i32), qd.cast(place.x, qd.i32)
    tau, raw = 0.0, 0.0
    if qd.static(world <= 2):
        tau = sheet_at(thickness.water, lens, optics, inside, place, qd.static(world == 1))
        raw = thickness_at(thickness.water, place / optics.coarse, optics.unit)
        n = sheet_normal(thickness.water, lens, optics, inside, place, qd.static(world == 1))
    else:
        tau = thickness_at(thickness.water, place / optics.coarse, optics.unit)
    cosi = qd.max(-n.dot(ahead), 0.05)
    bent = refracted(ahead, n, cosi)
    if qd.static(world >= 3):
        raw = tau
    # The least that a drop is thick; in a plane the rim keeps half of the colour.
    tau = qd.max(tau, qd.static(0.15 if world >= 3 else 0.55) * optics.spacing)
    travel = qd.min(tau, (qd.bit_cast(pixels.depth[row, column], qd.f32) - z) * pace)
    if qd.static(world >= 3):
        travel = above_floor(travel, at, bent)
    c = to_view(lens, at + travel * bent)
    shown = backdrop.behind[row, column]
    if c.z > lens.near and whole < 1.0:
        there = to_pixel(lens, c)
        r = qd.min(qd.max(qd.cast(there.y, qd.i32), 0), pixels.depth.shape[0] - 1)
        e = qd.min(qd.max(qd.cast(there.x, qd.i32), 0), pixels.depth.shape[1] - 1)
        if qd.bit_cast(pixels.depth[r, e], qd.f32) > z:  # not what stands in front of the water
            shown = picture_at(backdrop.behind, there)
    glossy = 1.0
    if qd.static(world >= 3):
        # Less water than in a sheet of single particles is a drop: a ball turns a ray twice by the same angle. Against
        # the glass drops and films are flat, and mirror no more than the glass around them.
        layers, gap = (
            tau / optics.spacing,
            qd.min((at - inside.walls.lower).min(), (inside.walls.upper - at).min()) / optics.spacing,
        )
        off = smoothstep((gap - 0.05) / 0.2)
        ball = smoothstep((0.75 - layers) / 0.3) * off
        glossy = 1.0 - smoothstep((1.6 - layers) / 0.8) * (1.0 - off)
        if body[3] >= 0.0:
            shown += whole * (vec3(body[0], body[1], body[2]) - shown)
            travel += whole * (1.0 - qd.min(1.5 * uneven, 0.6)) * (body[3] - travel)
            ball *= 1.0 - whole
        if ball > 0.0:
            out = 2.0 * bent.dot(ahead) * bent - ahead
            far = behind_drop(
                pixels.depth, pixels.depth, backdrop.behind, lens, look, at + travel * bent, out, row, column, z
            )
            shown += ball * (far - shown)
    swallow, tint, cover, hidden = optics.absorption, optics.glow, 0.0, 0.0
    color, glow, behind = optics.glow, vec3(0.0, 0.0, 0.0), vec3(0.0, 0.0, 0.0)
    if qd.static(many):
        swallow, tint, color, cover, glow, hidden, behind = mixed(
            thickness, look, optics, place, tau, qd.static(world <= 2)
        )
    if thickness.stained[0] == 1:
        # Of what the map holds: a wall takes as much of the dye's discs as of the water's.
        found = dye_in(thickness.dye, place / optics.coarse, qd.max(raw, 0.15 * optics.spacing) / optics.unit)
        if found[0] > 0.0:
            swallow = swallowed_by(found, swallow, optics.usual)
            tint += found[0] * (look.glow * vec3(found[1], found[2], found[3]) - tint)
            color += found[0] * (vec3(found[1], found[2], found[3]) - color)
    passed = qd.exp(-travel * swallow)
    result = passed * shown + (1.0 - qd.exp(-travel * optics.scattering)) * tint
    if qd.static(many):
        if hidden + cover > 0.0:
            lit = murky(
                sunlit,
                inside.shade,
                sun,
                look,
                optics,
                behind,
                vec3(0.0, 0.0, 0.0),
                at,
                vec3(0.0, 1.0, 0.0),
                -ahead,
                qd.static(world <= 2),
            )
            result += hidden * (lit * qd.exp(-0.3 * tau * swallow) - result)
            passed *= (1.0 - hidden) * (1.0 - cover)
            if cover > 0.0:
                lit = murky(sunlit, inside.shade, sun, look, optics, color, glow, at, n, -ahead, qd.static(world <= 2))
                result += cover * (lit - result)
    if qd.static(world <= 2):  # the rim of the sheet catches the light, and on paper there is nothing to mirror
        # Light comes from above left, and less of it reaches the bottom.
        high = (at.y - inside.walls.lower.y) / (inside.walls.upper.y - inside.walls.lower.y)
        result *= (0.75 + 0.3 * qd.max(n.dot(look.to_sun), 0.0)) * (0.78 + 0.4 * qd.min(high, 1.0))
        result += 0.35 * look.lamp * smoothstep((0.85 - tau / optics.spacing) / 0.3)
    else:
        mirror = glossy * (0.02 + 0.98 * (1.0 - cosi) ** 5)
        mirrored = environment(look, ahead + 2.0 * cosi * n)
        mirrored += above[3] * (vec3(above[0], above[1], above[2]) - mirrored)
        result += mirror * (mirrored - result)
        passed *= 1.0 - mirror
        half = (look.to_sun - ahead).normalized(1e-9)
        result += glint(look, n.dot(half), rough)
    return result, passed

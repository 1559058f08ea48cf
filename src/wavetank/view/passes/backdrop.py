"""What is not water, finished: floor and solids in their light, and the background; the water refracts this picture.

code       symbol   meaning                                                          unit
tau                 water along the sun's ray before it reaches a point              m
through             share of the sun that is left, per colour                        1
"""

from wavetank.device.compiler import qd
from wavetank.view.buffers import Buffers
from wavetank.view.lens import (
    Lens,
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
from wavetank.view.passes.shade import background, smoothstep, surface_radiance
from wavetank.view.passes.sunlight import LIGHT_STEP
from wavetank.view.passes.tank import with_tank
from wavetank.view.passes.thickness import dye_in, swallowed_by, thickness_at
from wavetank.view.shot import Shot
from wavetank.view.strips import Strips, strip, strips_of
from wavetank.view.water_buffers import UNIT, water_of


def prepare(shot: Shot, buffers: Buffers) -> None:
    """Fill the water's `in_sun` and `in_sky`, the radiance that either gives where there is no water."""
    water, extent = water_of(buffers, shot), shot.extent
    divide(
        strips_of(buffers.depth), shot.lens, shot.look, vector(extent.middle[0], 0.0, extent.middle[2]), extent.radius,
        LIGHT_STEP, buffers.depth, buffers.surface, buffers.normal, water.light, buffers.color, water.in_sun,
        water.in_sky,
    )  # fmt: skip


def draw(shot: Shot, buffers: Buffers) -> None:
    """Fill the water's `behind` with radiance: what was prepared, in the light that the water leaves."""
    water, extent = water_of(buffers, shot), shot.extent
    lower, upper = vector(*extent.lower), vector(*extent.upper)
    paint(
        strips_of(buffers.depth), shot.lens, shot.water_sun, shot.look, shot.absorption, lower, upper,
        extent.spacing / UNIT, shot.frame.dim, buffers.depth, water.in_sun, water.in_sky, water.sun_thickness,
        water.sun_first, water.sun_dye, water.stained, shot.usual, water.caustic, buffers.lines,
        int(shot.frame.scene.tank is not None), water.behind,
    )  # fmt: skip


@qd.func
def light_at(light: qd.template(), depth: qd.template(), row, column, step, z):
    """Light at a pixel from the four nearest samples, as far as they lie at the same depth."""
    rows, columns = light.shape[0], light.shape[1]
    r, c = row // step, column // step
    u, v = (column - c * step) * (1.0 / step), (row - r * step) * (1.0 / step)
    total, weight, per = vec2(0.0, 0.0), 0.0, 50.0 / z
    for k in qd.static(range(4)):
        rr, cc = qd.min(r + k // 2, rows - 1), qd.min(c + k % 2, columns - 1)
        share = (v if qd.static(k // 2 == 1) else 1.0 - v) * (u if qd.static(k % 2 == 1) else 1.0 - u)
        gap = qd.abs(qd.bit_cast(depth[rr * step, cc * step], qd.f32) - z) * per
        w = (share + 1e-3) * qd.max(1.0 - gap, 1e-3)
        total += w * light[rr, cc]
        weight += w
    return total / weight


@qd.func
def sun_through_water(
    sun: Lens, look: Look, absorption, at, unit, tau_map: qd.template(), first: qd.template(), dye: qd.template(),
    stained, usual, caustic: qd.template(),
):  # fmt: skip
    """Share of the sun, per colour, that reaches the point `at` through the water."""
    c = to_view(sun, at)
    place = to_pixel(sun, c)
    through = vec3(1.0, 1.0, 1.0)
    texels = tau_map.shape[0]
    if qd.min(place.x, place.y) > 2.0 and qd.max(place.x, place.y) < texels - 2.0:
        light = 1.0 + look.caustic * qd.min(thickness_at(caustic, place, 1.0 / 4096.0), 3.0)
        whole = thickness_at(tau_map, place, unit)
        tau = whole
        if tau > 0.0:
            nearest = qd.bit_cast(first[qd.cast(place.y, qd.i32), qd.cast(place.x, qd.i32)], qd.f32)
            if nearest < 1e30:  # what lies above the water is in the full sun
                within = qd.max(c.z - nearest, 0.0)
                light = 1.0 + (light - 1.0) * qd.min(within / tau, 1.0)
                tau = qd.min(tau, within)
        if tau > 0.0 or light != 1.0:
            swallow = absorption
            if stained == 1 and whole > 0.0:
                swallow = swallowed_by(dye_in(dye, place, whole / unit), absorption, usual)
            veil = look.veil * (1.0 - qd.exp(-tau * (absorption.x + absorption.y)))
            through = light * (1.0 - veil) * qd.exp(-0.6 * tau * swallow)
    return through


@qd.kernel(fastcache=True)
def divide(
    strips: Strips, lens: Lens, look: Look, middle: vec3, size: qd.f32, step: qd.i32, depth: qd.types.ndarray(),
    surface: qd.types.ndarray(), normal: qd.types.ndarray(), light: qd.types.ndarray(), color: qd.types.ndarray(),
    in_sun: qd.types.ndarray(), in_sky: qd.types.ndarray(),
):  # fmt: skip
    """Shade every pixel that is not empty, and fill the others with the background, which counts as the sky's."""
    for task in range(strips.count):
        row, first, last = strip(strips, task, depth.shape[0], depth.shape[1])
        for column in range(first, last):
            ray = view_ray(lens, row, column)
            direction = ray_direction(lens, ray)
            what = surface[row, column]
            sun, sky, far = vec3(0.0, 0.0, 0.0), vec3(0.0, 0.0, 0.0), 1.0
            if what != 0x7FFFFFFF:  # NOTHING
                z = qd.bit_cast(depth[row, column], qd.f32)
                at = ray_origin(lens, ray) + z * direction
                far = smoothstep(((at - middle).norm() * (1.0 / size) - 1.5) * 0.2)
                share = light_at(light, depth, row, column, step, z)
                albedo = color[row, column]
                if what == -1:  # SOLID
                    n, seen = normal[row, column], -direction.normalized()
                    gloss, wrap = 0.3 * look.gloss, 0.4 * look.wrap
                    for part in range(2):  # one copy of the code to compile
                        sky = surface_radiance(
                            look, albedo, n, seen, qd.select(part == 0, vec2(share.x, 0.0), vec2(0.0, share.y)), wrap,
                            gloss,
                        )  # fmt: skip
                        if part == 0:
                            sun = sky
                else:
                    sun, sky = albedo * look.sun * (look.to_sun.y * share.x), albedo * look.sky * share.y
            in_sun[row, column] = (1.0 - far) * sun
            if far > 0.0:
                sky += far * (background(look, direction.normalized()) - sky)
            in_sky[row, column] = sky


@qd.kernel(fastcache=True)
def paint(
    strips: Strips, lens: Lens, sun: Lens, look: Look, absorption: vec3, lower: vec3, upper: vec3, unit: qd.f32,
    dim: qd.template(), depth: qd.types.ndarray(), in_sun: qd.types.ndarray(), in_sky: qd.types.ndarray(),
    tau_map: qd.types.ndarray(), first_depth: qd.types.ndarray(), dye: qd.types.ndarray(), stained: qd.types.ndarray(),
    usual: qd.f32, caustic: qd.types.ndarray(), lines: qd.types.ndarray(), has_tank: qd.i32, behind: qd.types.ndarray(),
):  # fmt: skip
    """Put sun and sky together as far as the water leaves them, and lay the tank over it."""
    for task in range(strips.count):
        row, first, last = strip(strips, task, depth.shape[0], depth.shape[1])
        for column in range(first, last):
            ray = view_ray(lens, row, column)
            origin, direction = ray_origin(lens, ray), ray_direction(lens, ray)
            z = qd.bit_cast(depth[row, column], qd.f32)
            result = in_sun[row, column] + in_sky[row, column]
            if qd.static(dim == 3):
                if z < 1e30:
                    at = origin + z * direction
                    through = sun_through_water(
                        sun, look, absorption, at, unit, tau_map, first_depth, dye, stained[0], usual, caustic
                    )
                    if through.x != 1.0 or through.z != 1.0:
                        # The sky comes from everywhere; water above takes some of it.
                        dim_sky = 0.45 + 0.55 * qd.min(through, 1.0)
                        result = through * in_sun[row, column] + dim_sky * in_sky[row, column]
            if has_tank == 1:
                result = with_tank(lens, look, lower, upper, origin, direction, z, lines[row, column], result)
            behind[row, column] = result

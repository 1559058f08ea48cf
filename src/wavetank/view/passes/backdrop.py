"""What is not water, finished: floor and solids in their light, and the background; the water refracts this picture.

code       symbol   meaning                                                          unit
tau                 water along the sun's ray before it reaches a point              m
through             share of the sun that is left, per colour                        1
"""

from wavetank.device.compiler import qd
from wavetank.view.buffers import Buffers, Light, Pixels
from wavetank.view.lens import Lens, ray_direction, ray_origin, to_pixel, to_view, vec2, vec3, vector, view_ray
from wavetank.view.look import Look
from wavetank.view.optics.dyes import dye_in, swallowed_by
from wavetank.view.optics.fluid import Optics, optics_of
from wavetank.view.optics.glass import with_tank
from wavetank.view.optics.maps import share_of, thickness_at
from wavetank.view.optics.mixture import along_sun
from wavetank.view.optics.radiance import background, smoothstep, sun_disc, surface_radiance
from wavetank.view.optics.rays import Box
from wavetank.view.shot import Shot
from wavetank.view.strips import Strips, strip, strips_of
from wavetank.view.water_buffers import Backdrop, SunlitWater, Thickness, water_of


def prepare(shot: Shot, buffers: Buffers) -> None:
    """Fill the radiance that sun and sky each give where there is no water."""
    water, pixels, extent = water_of(buffers, shot), buffers.pixels, shot.extent
    divide(
        water.backdrop, pixels, water.light, strips_of(pixels.depth), shot.lens, shot.look,
        vector(extent.middle[0], 0.0, extent.middle[2]), extent.radius,
    )  # fmt: skip


def draw(shot: Shot, buffers: Buffers) -> None:
    """Fill the radiance behind the water: what was prepared, in the light that the water leaves."""
    water, pixels, frame = water_of(buffers, shot), buffers.pixels, shot.frame
    samples = buffers.supersample
    paint(
        water.backdrop, pixels, water.sunlit, water.sun_thickness, strips_of(pixels.depth, samples, samples), shot.lens,
        shot.water_sun, shot.look, optics_of(shot, 0, samples, samples), shot.box,
        int(frame.scene.tank is not None), 10 * int(samples > 1) + frame.dim,
    )  # fmt: skip


@qd.func
def light_at(light: Light, depth: qd.template(), row, column, z):
    """Light at a pixel from the four nearest samples, as far as they lie at the same depth."""
    rows, columns, step = light.share.shape[0], light.share.shape[1], light.step
    r, c = row // step, column // step
    u, v = (column - c * step) * (1.0 / step), (row - r * step) * (1.0 / step)
    total, weight, per = vec2(0.0, 0.0), 0.0, 50.0 / z
    for k in qd.static(range(4)):
        rr, cc = qd.min(r + k // 2, rows - 1), qd.min(c + k % 2, columns - 1)
        gap = qd.abs(qd.bit_cast(depth[rr * step, cc * step], qd.f32) - z) * per
        w = (share_of(k, v, u) + 1e-3) * qd.max(1.0 - gap, 1e-3)
        total += w * light.share[rr, cc]
        weight += w
    return total / weight


@qd.func
def sun_through_water(sunlit: SunlitWater, thickness: Thickness, sun: Lens, look: Look, optics: Optics, at):
    """Share of the sun, per colour, that reaches the point `at` through the water."""
    c = to_view(sun, at)
    place = to_pixel(sun, c)
    through = vec3(1.0, 1.0, 1.0)
    texels = sunlit.depth.shape[0]
    if qd.min(place.x, place.y) > 2.0 and qd.max(place.x, place.y) < texels - 2.0:
        whole = thickness_at(thickness.water, place, optics.unit)
        gathered = thickness_at(sunlit.caustic, place, 1.0 / 4096.0)
        nearest, wide = 1e30, 0.0
        if whole > 0.0:
            nearest = qd.bit_cast(sunlit.depth[qd.cast(place.y, qd.i32), qd.cast(place.x, qd.i32)], qd.f32)
            if nearest < 1e30:  # far behind the water its light is as blurred as the sun is wide
                wide = 2.0 * look.sun_size * qd.max(c.z - nearest - whole, 0.0) * sun.focal
        if wide > 0.5:
            for k in range(4):
                off = wide * vec2((k % 2) * 1.6 - 0.8, (k // 2) * 1.6 - 0.8)
                whole += thickness_at(thickness.water, place + off, optics.unit)
                gathered += thickness_at(sunlit.caustic, place + off, 1.0 / 4096.0)
            whole *= 0.2
            gathered *= 0.2
        light = 1.0 + look.caustic * qd.min(gathered, 3.0)
        tau = whole
        if tau > 0.0:
            if nearest < 1e30:  # what lies above the water is in the full sun
                within = qd.max(c.z - nearest, 0.0)
                light = 1.0 + (light - 1.0) * qd.min(within / tau, 1.0)
                tau = qd.min(tau, within)
        if tau > 0.0 or light != 1.0:
            swallow, murk = optics.absorption, 0.0
            if thickness.fluids > 0 and whole > 0.0:
                found = along_sun(thickness, optics, place)
                swallow, murk = vec3(found[0], found[1], found[2]), found[3]
            if thickness.stained[0] == 1 and whole > 0.0:
                swallow = swallowed_by(dye_in(thickness.dye, place, whole / optics.unit), swallow, optics.usual)
            veil = look.veil * (1.0 - qd.exp(-tau * (optics.absorption.x + optics.absorption.y)))
            through = light * (1.0 - veil) * qd.exp(-tau * (0.6 * swallow + murk))
    return through


@qd.kernel(fastcache=True)
def divide(
    backdrop: Backdrop, pixels: Pixels, light: Light, strips: Strips, lens: Lens, look: Look, middle: vec3,
    size: qd.f32,
):  # fmt: skip
    """Shade every pixel that is not empty, and fill the others with the background, which counts as the sky's."""
    for task in range(strips.count):
        row, first, last = strip(strips, task, pixels.depth.shape[0], pixels.depth.shape[1])
        for column in range(first, last):
            ray = view_ray(lens, row, column)
            direction = ray_direction(lens, ray)
            what = pixels.surface[row, column]
            sun, sky, far = vec3(0.0, 0.0, 0.0), vec3(0.0, 0.0, 0.0), 1.0
            if what != 0x7FFFFFFF:  # NOTHING
                z = qd.bit_cast(pixels.depth[row, column], qd.f32)
                at = ray_origin(lens, ray) + z * direction
                far = smoothstep(((at - middle).norm() * (1.0 / size) - 1.5) * 0.2)
                share = light_at(light, pixels.depth, row, column, z)
                albedo = pixels.color[row, column]
                if what == -1:  # SOLID
                    n, seen = pixels.normal[row, column], -direction.normalized()
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
            backdrop.in_sun[row, column] = (1.0 - far) * sun
            if far > 0.0:
                ahead = direction.normalized()
                sky += far * (background(look, ahead) - sky)
                if what == 0x7FFFFFFF:  # NOTHING
                    sky += sun_disc(look, ahead)
            backdrop.in_sky[row, column] = sky


@qd.kernel(fastcache=True)
def paint(
    backdrop: Backdrop, pixels: Pixels, sunlit: SunlitWater, thickness: Thickness, strips: Strips, lens: Lens,
    sun: Lens, look: Look, optics: Optics, box: Box, has_tank: qd.i32, world: qd.template(),
):  # fmt: skip
    """Put sun and sky together as far as the water leaves them, and lay the tank over it.

    Samples of a pixel that lie within a texel of the sun's view take as much of the sun as its middle does. `world` is
    2 or 3, its dimensions, ten more where pixels have several samples.
    """
    for task in range(strips.count):
        across, tall = 1, 1
        if qd.static(world >= 10):
            across, tall = optics.samples, optics.tall
        band, first, last = strip(strips, task, pixels.depth.shape[0] // tall, pixels.depth.shape[1])
        for pixel in range(first // across, last // across):
            together, middle, shared = 0, 0.0, vec3(1.0, 1.0, 1.0)
            if qd.static(world == 13):
                low, high = 1e30, 0.0
                for k in range(across * tall):
                    z = qd.bit_cast(pixels.depth[band * tall + k // across, pixel * across + k % across], qd.f32)
                    low, high = qd.min(low, z), qd.max(high, z)
                together, middle = qd.cast(high < 1e30 and high - low < 0.7 * sun.pixel, qd.i32), 0.5 * (low + high)
            for k in range(across * tall):
                row, column = band * tall + k // across, pixel * across + k % across
                ray = view_ray(lens, row, column)
                origin, direction = ray_origin(lens, ray), ray_direction(lens, ray)
                z = qd.bit_cast(pixels.depth[row, column], qd.f32)
                in_sun, in_sky = backdrop.in_sun[row, column], backdrop.in_sky[row, column]
                result = in_sun + in_sky
                if qd.static(world % 10 == 3):
                    if z < 1e30:
                        if k == 0 or together == 0:
                            at = origin + z * direction
                            if together == 1:
                                ray = view_ray(lens, row + 0.5 * (tall - 1), column + 0.5 * (across - 1))
                                at = ray_origin(lens, ray) + middle * ray_direction(lens, ray)
                            shared = sun_through_water(sunlit, thickness, sun, look, optics, at)
                        if shared.x != 1.0 or shared.z != 1.0:
                            # The sky comes from everywhere; water above takes some of it.
                            result = shared * in_sun + (0.45 + 0.55 * qd.min(shared, 1.0)) * in_sky
                if has_tank == 1:
                    line = pixels.lines[row, column]
                    result = with_tank(lens, look, box, origin, direction, z, line, result)
                backdrop.behind[row, column] = result

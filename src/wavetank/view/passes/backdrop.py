"""What is not water, finished: floor and solids in their light, and the background; the water refracts this picture.

code       symbol   meaning                                                          unit
shared              share of the sun that the water leaves, per colour               1
together            whether all samples of a pixel have that of its middle           1
"""

from wavetank.device.compiler import lanes, qd
from wavetank.view.buffers import Buffers, Light, Pixels
from wavetank.view.lens import Lens, ray_direction, ray_origin, to_view, vec2, vec3, vector, view_ray
from wavetank.view.look import Look
from wavetank.view.optics.bilinear import share_of
from wavetank.view.optics.dry_mask import cells_between, find_wet, holds_dry, is_dry, noted
from wavetank.view.optics.fluid import Optics, optics_of
from wavetank.view.optics.glass import with_tank
from wavetank.view.optics.radiance import background, smoothstep, sun_disc, surface_radiance
from wavetank.view.optics.rays import Box, box_interval
from wavetank.view.optics.sunlight import sun_through_together, sun_through_water
from wavetank.view.shot import Shot
from wavetank.view.strips import Strips, strip, strips_of
from wavetank.view.water_buffers import Backdrop, SunlitWater, Thickness, water_of


def prepare(shot: Shot, buffers: Buffers) -> None:
    """Fill the radiance that sun and sky each give where there is no water."""
    water, pixels, extent = water_of(buffers, shot), buffers.pixels, shot.extent
    water.backdrop.known.fill(0)
    divide(
        water.backdrop,
        pixels,
        water.light,
        strips_of(pixels.depth),
        shot.lens,
        shot.look,
        vector(extent.middle[0], 0.0, extent.middle[2]),
        extent.radius,
    )


def draw(shot: Shot, buffers: Buffers) -> None:
    """Fill the radiance behind the water: what was prepared, in the light that the water leaves."""
    water, pixels, frame = water_of(buffers, shot), buffers.pixels, shot.frame
    samples = buffers.supersample
    if frame.dim == 3 and lanes() > 1:
        find_wet(water.sunlit, water.sun_thickness.water)
    paint(
        water.backdrop,
        pixels,
        water.sunlit,
        water.sun_thickness,
        strips_of(pixels.depth, samples, samples),
        shot.lens,
        shot.water_sun,
        shot.look,
        optics_of(shot, 0, samples, samples),
        shot.box,
        int(frame.scene.tank is not None),
        100 * lanes() + 10 * int(samples > 1) + frame.dim,
    )


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


@qd.kernel(fastcache=True)
def divide(
    backdrop: Backdrop, pixels: Pixels, light: Light, strips: Strips, lens: Lens, look: Look, middle: vec3, size: qd.f32
):
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
                            look,
                            albedo,
                            n,
                            seen,
                            qd.select(part == 0, vec2(share.x, 0.0), vec2(0.0, share.y)),
                            wrap,
                            gloss,
                        )
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
    backdrop: Backdrop,
    pixels: Pixels,
    sunlit: SunlitWater,
    thickness: Thickness,
    strips: Strips,
    lens: Lens,
    sun: Lens,
    look: Look,
    optics: Optics,
    box: Box,
    has_tank: qd.i32,
    world: qd.template(),
):
    """Put sun and sky together as far as the water leaves them, and lay the tank over it.

    Samples of a pixel that lie within a texel of the sun's view take as much of the sun as its middle does. `world` is
    2 or 3, its dimensions, ten more where pixels have several samples, and a hundred for each of the pixels of a row
    that come together as vectors. These are left as they are where no water is in their way, nor was last time.
    """
    for task in range(strips.count):
        across, tall = 1, 1
        if qd.static(world % 100 >= 10):
            across, tall = optics.samples, optics.tall
        band, first, last = strip(strips, task, pixels.depth.shape[0] // tall, pixels.depth.shape[1])
        begin, end = first // across, last // across
        if qd.static(world >= 200 and world % 10 == 3):
            lanes = qd.static(world // 100)
            for block in range(begin // lanes, end // lanes):
                known = backdrop.known[band, block]
                dry = is_dry(sunlit.wet, known)
                if not dry or not holds_dry(known):
                    backdrop.known[band, block] = paint_together(
                        backdrop,
                        pixels,
                        sunlit,
                        thickness,
                        lens,
                        sun,
                        look,
                        optics,
                        box,
                        has_tank,
                        band,
                        block * lanes,
                        known,
                        dry,
                        qd.static(world % 100),
                        lanes,
                    )
            begin = end // lanes * lanes
        for pixel in range(begin, end):
            paint_pixel(
                backdrop,
                pixels,
                sunlit,
                thickness,
                lens,
                sun,
                look,
                optics,
                box,
                has_tank,
                band * tall,
                pixel * across,
                across,
                tall,
                qd.static(world % 100),
            )


@qd.func
def paint_pixel(
    backdrop: Backdrop,
    pixels: Pixels,
    sunlit: SunlitWater,
    thickness: Thickness,
    lens: Lens,
    sun: Lens,
    look: Look,
    optics: Optics,
    box: Box,
    has_tank,
    top,
    left,
    across,
    tall,
    world: qd.template(),
):
    """Do this for all samples of a pixel, the first of which lies at row `top` and column `left`."""
    together, middle, shared = 0, 0.0, vec3(1.0, 1.0, 1.0)
    if qd.static(world == 13):
        low, high = 1e30, 0.0
        for k in range(across * tall):
            z = qd.bit_cast(pixels.depth[top + k // across, left + k % across], qd.f32)
            low, high = qd.min(low, z), qd.max(high, z)
        together, middle = qd.cast(high < 1e30 and high - low < 0.7 * sun.pixel, qd.i32), 0.5 * (low + high)
    for k in range(across * tall):
        row, column = top + k // across, left + k % across
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


@qd.func
def paint_together(
    backdrop: Backdrop,
    pixels: Pixels,
    sunlit: SunlitWater,
    thickness: Thickness,
    lens: Lens,
    sun: Lens,
    look: Look,
    optics: Optics,
    box: Box,
    has_tank,
    band,
    begin,
    known,
    dry,
    world: qd.template(),
    lanes: qd.template(),
):
    """Do this for `lanes` pixels of a row from `begin` on, and return what is then known of them.

    Where it is known that they are `dry` the sun is all there.
    """
    across, tall = 1, 1
    # Of each pixel: depth of its middle, whether its samples lie together; of a sample: its depth, what a line covers.
    own, lines = qd.Matrix.zero(qd.f32, 3, lanes), qd.Matrix.zero(qd.i32, 1, lanes)
    shared = qd.Matrix.zero(qd.f32, 3, lanes)  # of the sun, by colour
    points = qd.Matrix.zero(qd.f32, 4, lanes)  # (column, row) in the sun's view, depth [m] there, and whether it counts
    share = qd.Matrix.zero(qd.f32, 3, lanes)
    colors = qd.Matrix.zero(qd.f32, 6, lanes)  # what the sun gives, what the sky gives
    some, others = 0.0, 1.0
    for lane in range(lanes):
        for channel in qd.static(range(3)):
            shared[channel, lane] = 1.0
    if qd.static(world >= 10):
        across, tall = optics.samples, optics.tall
        some, others = 0.0, 0.0
        if not dry:
            for lane in qd.static(range(lanes)):
                low, high = 1e30, 0.0
                for k in range(across * tall):
                    key = pixels.depth[band * tall + k // across, (begin + lane) * across + k % across]
                    z = qd.bit_cast(key, qd.f32)
                    low, high = qd.min(low, z), qd.max(high, z)
                alike = qd.cast(high < 1e30 and high - low < 0.7 * sun.pixel, qd.f32)
                own[0, lane], own[1, lane] = 0.5 * (low + high), alike
                some, others = qd.max(some, alike), qd.max(others, 1.0 - alike)
    if dry:
        others = 0.0
    lowest, highest = vec2(1e9, 1e9), vec2(-1e9, -1e9)
    for k in range(qd.static(-1 if world >= 10 else 0), across * tall):
        # The middle of a pixel comes first, as sample -1.
        row, off = band * tall + qd.max(k, 0) // across, qd.max(k, 0) % across
        middle, down, aside = qd.select(k < 0, 1.0, 0.0), 0.0, 0.0
        if k < 0:
            down, aside = 0.5 * (tall - 1), 0.5 * (across - 1)
        else:
            for lane in qd.static(range(lanes)):
                column = (begin + lane) * across + off
                own[2, lane] = qd.bit_cast(pixels.depth[row, column], qd.f32)
                lines[0, lane] = pixels.lines[row, column]
                in_sun, in_sky = backdrop.in_sun[row, column], backdrop.in_sky[row, column]
                for channel in qd.static(range(3)):
                    colors[channel, lane], colors[3 + channel, lane] = in_sun[channel], in_sky[channel]
        if qd.select(k < 0, some, others) > 0.0:
            for lane in range(lanes):
                z = middle * own[0, lane] + (1.0 - middle) * own[2, lane]
                counts = qd.select(z < 1e30, 1.0 - qd.abs(middle - own[1, lane]), 0.0)
                ray = view_ray(lens, row + down, (begin + lane) * across + off + aside)
                at = ray_origin(lens, ray) + qd.select(z < 1e30, z, 0.0) * ray_direction(lens, ray)
                c = to_view(sun, at)
                points[0, lane], points[1, lane] = sun.middle.x + sun.focal * c.x, sun.middle.y - sun.focal * c.y
                points[2, lane], points[3, lane] = c.z, counts
            sun_through_together(share, points, sunlit, thickness, sun, look, optics, lanes)
            for lane in range(lanes):
                counts = points[3, lane]
                for channel in qd.static(range(3)):
                    shared[channel, lane] = qd.select(counts > 0.0, share[channel, lane], shared[channel, lane])
            if known == 0:
                for lane in qd.static(range(lanes)):
                    if points[3, lane] > 0.0:
                        lowest = qd.min(lowest, vec2(points[0, lane], points[1, lane]))
                        highest = qd.max(highest, vec2(points[0, lane], points[1, lane]))
        if k >= 0:
            for lane in range(lanes):
                column, z = (begin + lane) * across + off, own[2, lane]
                glass, line = vec2(0.0, 0.0), 0.0
                if has_tank == 1:
                    line = look.line_strength * ((qd.max(lines[0, lane], 0) >> 23) / 255.0)
                    if look.glass > 0.0:
                        ray = view_ray(lens, row, column)
                        panes = box_interval(ray_origin(lens, ray), ray_direction(lens, ray), box)
                        seen = qd.select(panes[0] <= panes[1], look.glass, 0.0)
                        for pane in qd.static(range(2)):
                            between = qd.min(panes[pane] - lens.near, z - panes[pane])
                            glass[pane] = qd.select(between > 0.0, seen, 0.0)
                for channel in qd.static(range(3)):
                    sunny = shared[channel, lane]
                    # The sky comes from everywhere; water above takes some of it.
                    result = sunny * colors[channel, lane]
                    result += (0.45 + 0.55 * qd.min(sunny, 1.0)) * colors[3 + channel, lane]
                    for pane in qd.static(range(2)):
                        result += glass[pane] * (look.pane[channel] - result)
                    colors[channel, lane] = result + line * (look.line[channel] - result)
            for lane in qd.static(range(lanes)):
                backdrop.behind[row, (begin + lane) * across + off] = vec3(
                    colors[0, lane], colors[1, lane], colors[2, lane]
                )
    place = known
    if known == 0:
        place = cells_between(lowest, highest, sunlit.depth.shape[0], sunlit.wet.shape[0])
    return noted(place, dry)

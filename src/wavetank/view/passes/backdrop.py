"""What is not water, finished: floor and solids in their light, and the background; the water refracts this picture.

code       symbol   meaning                                                          unit
shared              share of the sun that the water leaves, per colour               1
together            whether all samples of a pixel have that of its middle           1
"""

import dataclasses
from typing import Final

from wavetank.device.compiler import lanes, qd
from wavetank.device.state import interned
from wavetank.view.buffers import Buffers, Light, Pixels
from wavetank.view.lens import Lens, ray_direction, ray_origin, to_view, vec2, vec3, vector, view_ray
from wavetank.view.look import Look
from wavetank.view.optics.bilinear import share_of
from wavetank.view.optics.dry_mask import all_cells_dry, cells_between, drawn_dry, mark_wet_cells, with_dryness
from wavetank.view.optics.fluid import Optics, optics_of
from wavetank.view.optics.glass import behind_panes, with_lines
from wavetank.view.optics.radiance import background, smoothstep, sun_disc, surface_radiance
from wavetank.view.optics.rays import Box, box_interval
from wavetank.view.optics.sunlight import sun_transmittance, transmittance_of_lanes
from wavetank.view.shot import Shot
from wavetank.view.strips import Strips, strip, strips_of
from wavetank.view.water_buffers import Backdrop, SunlitWater, Thickness, water_of


def prepare(shot: Shot, buffers: Buffers) -> None:
    """Fill the radiance that sun and sky each give where there is no water."""
    water, pixels, extent = water_of(buffers, shot), buffers.pixels, shot.extent
    water.backdrop.known.fill(0)
    separate_sun_and_sky(
        water.backdrop,
        pixels,
        water.light,
        strips_of(pixels.depth),
        shot.lens,
        shot.look,
        vector(extent.middle[0], 0.0, extent.middle[2]),
        extent.radius,
    )


@dataclasses.dataclass(frozen=True, eq=False)
class BackdropFeatures:
    """What a backdrop has: its kernel is compiled for no more than that."""

    sunlit: Final[bool]  # whether water stands in the sun's way, as it does in space
    tinted: Final[bool]  # whether several fluids or dye may tint that water
    supersampled: Final[bool]  # whether pixels have several samples
    panes: Final[bool]  # whether the panes of a tank are seen
    lanes: Final[int]  # pixels of a row that are drawn together as vectors
    rest: Final[bool]  # whether a row leaves pixels over that are drawn one by one


def draw(shot: Shot, buffers: Buffers) -> None:
    """Fill the radiance behind the water: what was prepared, in the light that the water leaves."""
    water, pixels = water_of(buffers, shot), buffers.pixels
    samples = buffers.supersample
    features = features_of(shot, buffers)
    if features.lanes > 1:
        mark_wet_cells(water.sunlit, water.sun_thickness.water)
    light_backdrop(
        water.backdrop,
        pixels,
        water.sunlit,
        water.sun_thickness,
        strips_of(pixels.depth, samples, samples),
        shot.lens,
        shot.water_sun,
        shot.look,
        optics_of(shot, samples, samples),
        shot.box,
        features,
    )


def features_of(shot: Shot, buffers: Buffers) -> BackdropFeatures:
    """Return what the backdrop of a picture has."""
    in_space, across = shot.frame.dim == 3, buffers.columns // buffers.supersample
    together = lanes() if in_space else 1
    return interned(
        BackdropFeatures(
            sunlit=in_space,
            tinted=water_of(buffers, shot).sun_thickness.fluids > 0 or shot.dyed,
            supersampled=buffers.supersample > 1,
            panes=shot.frame.scene.tank is not None and float(shot.look.glass) > 0.0,
            lanes=together,
            rest=across % together > 0 or together == 1,
        )
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
def separate_sun_and_sky(
    backdrop: Backdrop, pixels: Pixels, light: Light, strips: Strips, lens: Lens, look: Look, middle: vec3, size: qd.f32
):
    """Fill what sun and sky each give every pixel without water; the background counts as the sky's.

    What lies far from the `middle` [m] of a world of the radius `size` [m] fades into the background.
    """
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
                sun, sky = shade_in_sun_and_sky(pixels, look, direction, row, column, share)
            backdrop.in_sun[row, column] = (1.0 - far) * sun
            if far > 0.0:
                ahead = direction.normalized()
                sky += far * (background(look, ahead) - sky)
                if what == 0x7FFFFFFF:  # NOTHING
                    sky += sun_disc(look, ahead)
            backdrop.in_sky[row, column] = sky


@qd.func
def shade_in_sun_and_sky(pixels: Pixels, look: Look, direction, row, column, share):
    """Radiance that the sun, and that the sky, gives the floor or the solid of a pixel; `share` of each arrives."""
    albedo = pixels.color[row, column]
    sun, sky = albedo * look.sun * (look.to_sun.y * share.x), albedo * look.sky * share.y
    if pixels.surface[row, column] == -1:  # SOLID
        n, seen = pixels.normal[row, column], -direction.normalized()
        gloss, wrap = 0.3 * look.gloss, 0.4 * look.wrap
        for part in range(2):  # one copy of the code to compile
            arrives = qd.select(part == 0, vec2(share.x, 0.0), vec2(0.0, share.y))
            sky = surface_radiance(look, albedo, n, seen, arrives, wrap, gloss)
            if part == 0:
                sun = sky
    return sun, sky


@qd.kernel(fastcache=True)
def light_backdrop(
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
    features: BackdropFeatures,
):
    """Put sun and sky together as far as the water leaves them, and lay the tank over it.

    Samples of a pixel that lie within a texel of the sun's view take as much of the sun as its middle does. Lanes of
    pixels are left as they are where no water is in their way, nor was in the last picture.
    """
    for task in range(strips.count):
        across, tall = 1, 1
        if qd.static(features.supersampled):
            across, tall = optics.samples, optics.tall
        band, first, last = strip(strips, task, pixels.depth.shape[0] // tall, pixels.depth.shape[1])
        begin, end = first // across, last // across
        lanes = qd.static(features.lanes)
        if qd.static(features.lanes > 1):
            for block in range(begin // lanes, end // lanes):
                known = backdrop.known[band, block]
                dry = all_cells_dry(sunlit.wet, known)
                if not dry or not drawn_dry(known):
                    backdrop.known[band, block] = light_lanes(
                        backdrop,
                        pixels,
                        sunlit,
                        thickness,
                        lens,
                        sun,
                        look,
                        optics,
                        box,
                        features,
                        band,
                        block * lanes,
                        known,
                        dry,
                    )
            begin = end // lanes * lanes
        if qd.static(features.rest):
            for pixel in range(begin, end):
                light_pixel(
                    backdrop,
                    pixels,
                    sunlit,
                    thickness,
                    lens,
                    sun,
                    look,
                    optics,
                    box,
                    features,
                    band * tall,
                    pixel * across,
                )


# --- pixels one by one ---


@qd.func
def light_pixel(
    backdrop: Backdrop,
    pixels: Pixels,
    sunlit: SunlitWater,
    thickness: Thickness,
    lens: Lens,
    sun: Lens,
    look: Look,
    optics: Optics,
    box: Box,
    features: BackdropFeatures,
    top,
    left,
):
    """Do this for all samples of a pixel, the first of which lies at row `top` and column `left`."""
    across, tall, together, middle, through = 1, 1, 0, 0.0, vec3(1.0, 1.0, 1.0)
    if qd.static(features.supersampled):
        across, tall = optics.samples, optics.tall
    if qd.static(features.sunlit and features.supersampled):
        middle, together = middle_of_samples(pixels.depth, top, left, across, tall, 0.7 * sun.pixel)
    for k in range(across * tall):
        row, column = top + k // across, left + k % across
        ray = view_ray(lens, row, column)
        origin, direction = ray_origin(lens, ray), ray_direction(lens, ray)
        z = qd.bit_cast(pixels.depth[row, column], qd.f32)
        in_sun, in_sky = backdrop.in_sun[row, column], backdrop.in_sky[row, column]
        result = in_sun + in_sky
        if qd.static(features.sunlit):
            if z < 1e30:
                if k == 0 or together == 0:
                    at = origin + z * direction
                    if together == 1:
                        ray = view_ray(lens, row + 0.5 * (tall - 1), column + 0.5 * (across - 1))
                        at = ray_origin(lens, ray) + middle * ray_direction(lens, ray)
                    through = sun_transmittance(sunlit, thickness, sun, look, optics, at, qd.static(features.tinted))
                if through.x != 1.0 or through.z != 1.0:
                    # The sky comes from everywhere; water above takes some of it.
                    result = through * in_sun + (0.45 + 0.55 * qd.min(through, 1.0)) * in_sky
        if qd.static(features.panes):
            result = behind_panes(lens, look, box, origin, direction, z, result)
        backdrop.behind[row, column] = with_lines(look, pixels.lines[row, column], result)


@qd.func
def middle_of_samples(depth: qd.template(), top, left, across, tall, near):
    """Depth [m] of the middle of a pixel, and 1 where all of its samples lie within `near` [m], else 0."""
    low, high = 1e30, 0.0
    for k in range(across * tall):
        z = qd.bit_cast(depth[top + k // across, left + k % across], qd.f32)
        low, high = qd.min(low, z), qd.max(high, z)
    return 0.5 * (low + high), qd.cast(high < 1e30 and high - low < near, qd.i32)


# --- pixels together, as vectors ---


@qd.func
def light_lanes(
    backdrop: Backdrop,
    pixels: Pixels,
    sunlit: SunlitWater,
    thickness: Thickness,
    lens: Lens,
    sun: Lens,
    look: Look,
    optics: Optics,
    box: Box,
    features: BackdropFeatures,
    band,
    begin,
    known,
    dry,
):
    """Do this for `lanes` pixels of a row from `begin` on, and return what is then known of them.

    Where it is known that they are `dry` the sun is all there.
    """
    lanes = qd.static(features.lanes)
    across, tall = 1, 1
    if qd.static(features.supersampled):
        across, tall = optics.samples, optics.tall
    middle = qd.Matrix.zero(qd.f32, 2, lanes)  # depth [m] of a pixel's middle, and 1 where its samples share its light
    through = qd.Matrix.zero(qd.f32, 3, lanes)  # share of the sun that is left, by colour
    points = qd.Matrix.zero(qd.f32, 4, lanes)  # (column, row) in the sun's view, depth [m] there, and whether it counts
    found = qd.Matrix.zero(qd.f32, 3, lanes)  # `through` of those that count
    depth, line = qd.Matrix.zero(qd.f32, 1, lanes), qd.Matrix.zero(qd.i32, 1, lanes)  # of a sample
    colors = qd.Matrix.zero(qd.f32, 6, lanes)  # what the sun gives, what the sky gives
    for lane in range(lanes):
        for channel in qd.static(range(3)):
            through[channel, lane] = 1.0
    some, others = 0.0, 1.0  # whether any pixel has a shared middle, and whether any has not
    if qd.static(features.supersampled):
        others = 0.0
        if not dry:
            some, others = find_middles(middle, pixels.depth, band * tall, begin, across, tall, 0.7 * sun.pixel, lanes)
    if dry:
        others = 0.0
    lowest, highest = vec2(1e9, 1e9), vec2(-1e9, -1e9)
    for k in range(qd.static(-1 if features.supersampled else 0), across * tall):
        # The middle of a pixel comes first, as sample -1.
        row, off = band * tall + qd.max(k, 0) // across, qd.max(k, 0) % across
        if k >= 0:
            read_sample(depth, line, colors, backdrop, pixels, row, begin * across + off, across, lanes)
        if qd.select(k < 0, some, others) > 0.0:
            is_middle = qd.select(k < 0, 1.0, 0.0)
            place = vec2(off, row)  # of the sample in the picture, in pixels
            if k < 0:
                place += 0.5 * (vec2(across, tall) - 1.0)
            find_points(points, middle, depth, lens, sun, is_middle, place, begin * across, across, lanes)
            transmittance_of_lanes(
                found, points, sunlit, thickness, sun, look, optics, lanes, qd.static(features.tinted)
            )
            for lane in range(lanes):
                counts = points[3, lane]
                for channel in qd.static(range(3)):
                    through[channel, lane] = qd.select(counts > 0.0, found[channel, lane], through[channel, lane])
            if known == 0:
                for lane in range(lanes):
                    if points[3, lane] > 0.0:
                        lowest = qd.min(lowest, vec2(points[0, lane], points[1, lane]))
                        highest = qd.max(highest, vec2(points[0, lane], points[1, lane]))
        if k >= 0:
            composite_lanes(
                colors, through, depth, line, lens, look, box, features, vec2(begin * across + off, row), across
            )
            for lane in range(lanes):
                backdrop.behind[row, (begin + lane) * across + off] = vec3(
                    colors[0, lane], colors[1, lane], colors[2, lane]
                )
    cells = known
    if known == 0:
        cells = cells_between(lowest, highest, sunlit.depth.shape[0], sunlit.wet.shape[0])
    return with_dryness(cells, dry)


@qd.func
def find_middles(middle: qd.template(), depth: qd.template(), top, begin, across, tall, near, lanes: qd.template()):
    """Fill `middle` for each pixel, and return whether any shares the light of its middle, and whether any does not."""
    some, others = 0.0, 0.0
    for lane in range(lanes):
        z, shared = middle_of_samples(depth, top, (begin + lane) * across, across, tall, near)
        alike = qd.cast(shared, qd.f32)
        middle[0, lane], middle[1, lane] = z, alike
        some, others = qd.max(some, alike), qd.max(others, 1.0 - alike)
    return some, others


@qd.func
def read_sample(
    depth: qd.template(),
    line: qd.template(),
    colors: qd.template(),
    backdrop: Backdrop,
    pixels: Pixels,
    row,
    first,
    across,
    lanes: qd.template(),
):
    """Put one sample of each pixel in columns: every `across`-th of a row from the column `first` on."""
    for lane in range(lanes):
        column = first + lane * across
        depth[0, lane] = qd.bit_cast(pixels.depth[row, column], qd.f32)
        line[0, lane] = pixels.lines[row, column]
        in_sun, in_sky = backdrop.in_sun[row, column], backdrop.in_sky[row, column]
        for channel in qd.static(range(3)):
            colors[channel, lane], colors[3 + channel, lane] = in_sun[channel], in_sky[channel]


@qd.func
def find_points(
    points: qd.template(),
    middle: qd.template(),
    depth: qd.template(),
    lens: Lens,
    sun: Lens,
    is_middle,
    place,
    first,
    across,
    lanes: qd.template(),
):
    """Fill `points` with where a sample of each pixel lies in the sun's view; it counts where its pixel asks for it.

    A pixel that shares the light of its middle asks for the middle (`is_middle` 1), any other for its samples (0).
    """
    for lane in range(lanes):
        z = is_middle * middle[0, lane] + (1.0 - is_middle) * depth[0, lane]
        counts = qd.select(z < 1e30, 1.0 - qd.abs(is_middle - middle[1, lane]), 0.0)
        ray = view_ray(lens, place.y, first + lane * across + place.x)
        at = ray_origin(lens, ray) + qd.select(z < 1e30, z, 0.0) * ray_direction(lens, ray)
        c = to_view(sun, at)
        points[0, lane], points[1, lane] = sun.middle.x + sun.focal * c.x, sun.middle.y - sun.focal * c.y
        points[2, lane], points[3, lane] = c.z, counts


@qd.func
def composite_lanes(
    colors: qd.template(),
    through: qd.template(),
    depth: qd.template(),
    line: qd.template(),
    lens: Lens,
    look: Look,
    box: Box,
    features: BackdropFeatures,
    place,
    across,
):
    """Replace what sun and sky give by the radiance of a sample of each pixel, panes and lines laid over it."""
    for lane in range(qd.static(features.lanes)):
        glass = vec2(0.0, 0.0)
        if qd.static(features.panes):
            ray = view_ray(lens, place.y, place.x + lane * across)
            ends = box_interval(ray_origin(lens, ray), ray_direction(lens, ray), box)
            seen = qd.select(ends[0] <= ends[1], look.glass, 0.0)
            for pane in qd.static(range(2)):
                between = qd.min(ends[pane] - lens.near, depth[0, lane] - ends[pane])
                glass[pane] = qd.select(between > 0.0, seen, 0.0)
        cover = look.line_strength * ((qd.max(line[0, lane], 0) >> 23) / 255.0)
        for channel in qd.static(range(3)):
            sunny = through[channel, lane]
            # The sky comes from everywhere; water above takes some of it.
            result = sunny * colors[channel, lane]
            result += (0.45 + 0.55 * qd.min(sunny, 1.0)) * colors[3 + channel, lane]
            if qd.static(features.panes):
                for pane in qd.static(range(2)):
                    result += glass[pane] * (look.pane[channel] - result)
            colors[channel, lane] = result + cover * (look.line[channel] - result)

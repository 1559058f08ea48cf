"""Spray, foam and bubbles: clouds of fine droplets over the picture, thicker where there are more of them.

What the simulation moves is a few thousand points; what they stand for is a froth of far smaller things. Each point
becomes a handful of discs, spread about a spacing and along the way that it goes in half a frame, or while the shutter
is open, as a camera sees it. A cloud has its own fixed places, so that nothing flickers, and near the eye it has more
and smaller discs: none is ever large in the picture, and together they cover the same. Every disc adds its optical
depth to the pixels it covers, and the part of it that the sun reaches. Sums of whole numbers do not depend on the order
of threads, and no sorting by depth is needed: what is added is all of one white stuff. The sums are kept per pixel of
the picture, not per sample, which is enough for soft things. The same depths on a grid as coarse as the spacing give
the froth a shape (`light_relief`): it is thick where it is dense, and lit as such a relief is.

    code      symbol   meaning                                                              unit
    tau                optical depth of what lies over a pixel, in 1/4096                   1
    lit                tau weighted with the share of the sun that arrives                  1
    deep               tau weighted with the way through the water above it                 d / 4
    r, wide            radius of a disc, and as drawn: no smaller than the pixel grid       px
    behind             how far a particle is behind the surface that the pixel shows        m
    parts              discs of a cloud, a number with a fraction: the last one is fainter  1

The pass reads depth, camera and sun and knows nothing of how the water was drawn: what is a little behind the surface
shows through it, in the colour of so much water, and what is `DEEPEST` behind does not. In a 2-D world everything lies
in one plane: foam lies on the water, in full light, and what flies over white paper is a pale blue.
"""

import dataclasses
from typing import Any

import numpy as np

from wavetank.device.compiler import qd
from wavetank.device.state import Diffuse, interned
from wavetank.solids.distance import lift
from wavetank.view.buffers import Buffers, FoamMaps, Pixels
from wavetank.view.colormaps import rgb_of, to_linear
from wavetank.view.lens import Lens, from_view, pixels_per_metre, to_pixel, to_view, vec2, vec3, vector
from wavetank.view.look import Look
from wavetank.view.optics.bilinear import corners, gap_at
from wavetank.view.optics.fluid import grain_of
from wavetank.view.optics.glass import line_cover, slack
from wavetank.view.optics.hash_noise import bits_of, scrambled
from wavetank.view.optics.rays import Box
from wavetank.view.shot import Shot
from wavetank.view.strips import Strips, strip, strips_of
from wavetank.view.water_buffers import SunlitWater, water_of

DEEPEST = 5.0  # d: depth below the surface at which foam is no longer seen
SIZE = {2: 1.7, 3: 1.0}  # of the drawn particles: a plane has fewer of them
IN_FRONT = 1e9  # m: what shows through everything
PARTS, MOST_PARTS = 10.0, 60.0  # discs of a cloud far from the eye, and next to it
FINE = 0.0022  # of the picture's height: radius that a disc has before a cloud gets more of them
LARGEST = 0.02  # of the picture's height: radius up to which a disc is drawn at its size
SHUTTER = 0.5  # of a frame: time for which it is open in a still
OPEN = 1.4  # of the time that an open shutter lets in: it opens and closes gradually, as even light of so long does
SHARP, SOFT = 1.1, 1.7  # px: least radius of a disc in a still, and while the shutter is open
ALBEDO = 1.15  # of froth: what it scatters on within adds to what a matte surface would give
PALE = vector(*to_linear(np.array(rgb_of("#6fa8d2"))))


@dataclasses.dataclass(frozen=True, eq=False)
class Froth:
    """How spray, foam and bubbles look, on the device."""

    size: qd.f32  # m: about that of a particle
    deepest: qd.f32  # m: depth below the surface at which foam is no longer seen
    sunk: qd.f32  # m: how far behind a solid it is still seen
    fine: qd.f32  # px: radius of a disc from which on a cloud has more of them
    largest: qd.f32  # px: radius up to which a disc is drawn at its size
    least: qd.f32  # px: radius below which a disc is drawn fainter instead
    shutter: qd.f32  # s: time for which it is open
    in_sun: vec3  # radiance that the sun gives
    in_sky: vec3  # radiance that everything else gives
    in_air: vec3  # what both are over nothing in a plane
    swallow: vec3  # per d / 4: what light loses in the water, both ways
    parts: qd.f32  # discs of a cloud far from the eye
    most_parts: qd.f32  # and next to it
    flat: qd.i32  # 1 in a plane
    line_strength: qd.f32  # share of what is behind an edge of the tank that the edge hides
    slack: qd.f32  # m: depth by which an edge wins
    samples: qd.i32  # computed pixels per pixel of the picture, in each direction
    grain: qd.i32  # px: texel of the relief


def draw(shot: Shot, buffers: Buffers) -> None:
    """Lay spray, foam and bubbles over the radiance in `color`, by the depth that the picture shows."""
    composite_foam(shot, buffers, buffers.pixels.depth, IN_FRONT, 0.0)


def draw_over_water(shot: Shot, buffers: Buffers) -> None:
    """Do the same where the water is not part of the picture's depth but lies in front of it."""
    if shot.frame.foam_count > 0:
        composite_foam(shot, buffers, water_of(buffers, shot).surface.nearest, 0.25 * shot.extent.spacing, shot.shutter)


def draw_from_sun(shot: Shot, buffers: Buffers) -> None:
    """Take from the sun's light below the water what foam keeps."""
    frame, strength = shot.frame, float(shot.look.caustic)
    if frame.dim == 3 and frame.diffuse is not None and frame.foam_count > 0 and strength > 0.0:
        sunlit, d = water_of(buffers, shot).sunlit, shot.extent.spacing
        dim_sunlight(sunlit, frame.diffuse, shot.water_sun, SIZE[3] * d, strength, frame.foam_count)


def composite_foam(shot: Shot, buffers: Buffers, depth: Any, sunk: float, shutter: float) -> None:
    """Lay spray, foam and bubbles over whatever lies at `depth`; solids hide what is `sunk` [m] behind them.

    What moves is smeared as by a `shutter` that is open for so long [s], or by half a frame where that is closed.
    """
    frame, pixels, maps = shot.frame, buffers.pixels, buffers.foam
    if frame.diffuse is None or frame.foam_count == 0:
        return
    froth = froth_of(shot, buffers, sunk, shutter)
    rows, columns = (int(size) // int(froth.grain) + 2 for size in maps.sums.shape[:2])
    maps.sums.fill(0)
    maps.relief.fill(0)
    splat(
        maps,
        frame.diffuse,
        depth,
        pixels.depth,
        buffers.sun_depth,
        shot.lens,
        shot.sun,
        shot.walls,
        froth,
        frame.dim,
        frame.foam_count,
    )
    light_relief(maps, shot.lens, shot.look, rows, columns, frame.dim)
    blend(pixels, maps, depth, strips_of(maps.sums), froth)


def froth_of(shot: Shot, buffers: Buffers, sunk: float, shutter: float) -> Froth:
    """Return how spray, foam and bubbles look in a picture."""
    frame, look, d, flat = shot.frame, shot.look, shot.extent.spacing, shot.frame.dim == 2
    height = buffers.rows / buffers.supersample
    in_sun, in_sky = vector(*(ALBEDO * look.sun)), vector(*(ALBEDO * look.sky))
    return interned(
        Froth(
            size=SIZE[frame.dim] * d,
            deepest=IN_FRONT if flat else DEEPEST * d,
            sunk=sunk,
            fine=max(FINE * height, 0.8),
            largest=max(LARGEST * height, 1.0),
            shutter=OPEN * shutter or SHUTTER * frame.scene.frame_time,
            least=SOFT if shutter else SHARP,
            in_sun=in_sun,
            in_sky=in_sky,
            in_air=PALE,
            swallow=vector(*(0.5 * d * shot.absorption * (not flat))),
            line_strength=look.line_strength if frame.scene.tank else 0.0,
            slack=slack(shot),
            samples=buffers.supersample,
            grain=grain_of(shot, buffers.supersample),
            parts=PARTS,
            most_parts=MOST_PARTS,
            flat=int(flat),
        )
    )


@qd.func
def size_and_strength(kind, share, number):
    """Radius [d] and optical depth of a particle that has lived the `share` of its life."""
    radius, strength = 0.10, 0.9  # spray
    if kind == 2:
        radius, strength = 0.22, 0.75
    elif kind == 3:
        radius, strength = 0.13, 0.5
    # A spread of sizes that stays with the particle.
    radius *= 0.6 + 0.8 * qd.cast((number * 40503) & 0xFFFF, qd.f32) / 65536.0
    return radius, strength * qd.min(1.0, 0.4 + 12.0 * share) * (1.0 - share * share)


@qd.kernel(fastcache=True)
def dim_sunlight(sunlit: SunlitWater, diffuse: Diffuse, sun: Lens, size: qd.f32, caustic: qd.f32, count: qd.i32):
    """Spread every particle's optical depth over the texels of the sun's view around it, as smooth as a spline, and
    take from the light that gathers there, as it is shown with the strength `caustic`, what so much froth keeps.

    What scatters alone, none of it forward more than backward, lets 1 / (1 + tau / 2) through (two streams).
    """
    texels = sunlit.spare.shape[0]
    for row, column in qd.ndrange(texels, texels):
        sunlit.spare[row, column] = 0
    for i in range(count):
        place = to_pixel(sun, to_view(sun, lift(diffuse.x[i])))
        radius, strength = size_and_strength(diffuse.kind[i], diffuse.age[i] / diffuse.life[i], diffuse.id[i])
        # Of a disc that is thinner towards its rim, in texels.
        full = 4096.0 * strength * 1.5708 * (radius * size * sun.focal) ** 2
        if qd.min(place.x, place.y) > 1.0 and qd.max(place.x, place.y) < texels - 1.0:
            row, column = qd.cast(place.y, qd.i32), qd.cast(place.x, qd.i32)
            v, u = place.y - row - 0.5, place.x - column - 0.5
            for n in qd.static(range(9)):
                down, across = spline(v, qd.static(n // 3 - 1)), spline(u, qd.static(n % 3 - 1))
                r, c = row + qd.static(n // 3 - 1), column + qd.static(n % 3 - 1)
                qd.atomic_add(sunlit.spare[r, c], qd.cast(full * down * across + 0.5, qd.i32))
    for row, column in qd.ndrange(texels, texels):
        tau = sunlit.spare[row, column] / 4096.0
        if tau > 0.0:
            light = 1.0 + caustic * qd.min(sunlit.caustic[row, column] / 4096.0, 3.0)
            sunlit.caustic[row, column] = qd.cast(4096.0 * (light / (1.0 + 0.5 * tau) - 1.0) / caustic, qd.i32)


@qd.func
def spline(off, k: qd.template()):
    """Share of texel `k`, -1 to 1, of what lies `off` from the middle of texel 0 (a quadratic B-spline)."""
    share = 0.75 - off * off
    if qd.static(k != 0):
        share = 0.5 * (0.5 + k * off) ** 2
    return share


@qd.func
def place_in_cloud(number, k, kind, dim: qd.template()):
    """(place of disc `k` of a cloud [d], its instant from -0.5 to 0.5 of the shutter's time, its size about 1).

    Foam lies on the water; a cloud is denser in its middle.
    """
    bits = bits_of(number, k)
    more = scrambled(bits)
    per = 1.0 / 2048.0
    a, b = qd.cast(bits & qd.u32(2047), qd.f32) * per, qd.cast((bits >> 11) & qd.u32(1023), qd.f32) * (2.0 * per)
    c, e = qd.cast(bits >> 21, qd.f32) * per, qd.cast(more & qd.u32(2047), qd.f32) * per
    f, g = qd.cast((more >> 11) & qd.u32(1023), qd.f32) * (2.0 * per), qd.cast(more >> 21, qd.f32) * per
    tall = 0.35 if kind == 2 else 1.0
    away = vec3(a + b - 1.0, tall * (c + e - 1.0), f + g - 1.0)
    if qd.static(dim == 2):
        away = vec3(a + b - 1.0, c + e - 1.0, 0.0)
    return away, qd.cast((bits ^ more) & qd.u32(1023), qd.f32) / 1024.0 - 0.5, 0.7 + 0.6 * b


@qd.func
def sunlit(sun: Lens, sun_depth: qd.template(), x, slack):
    """1 where the sun sees the point `x`, 0 where something is in the way."""
    c = to_view(sun, x)
    return qd.select(gap_at(sun_depth, to_pixel(sun, c), c.z - slack) > 0.0, 0.0, 1.0)


@qd.func
def share_seen(behind, deepest):
    """Share of what lies so far behind a surface that is seen through it."""
    rest = qd.max(1.0 - qd.max(behind, 0.0) / deepest, 0.0)
    return rest * rest * rest


@qd.func
def add_disc(
    maps: FoamMaps, c, middle, wide, strength, light, depth: qd.template(), solid_depth: qd.template(), froth: Froth
):
    """Add a disc to the pixels it covers, and return what a pixel in its middle would get of it, in 1/4096."""
    rows, columns, samples = maps.sums.shape[0], maps.sums.shape[1], froth.samples
    low_row = qd.max(qd.cast(qd.ceil(qd.max(middle.y - wide - 0.5, -1.0)), qd.i32), 0)
    low_column = qd.max(qd.cast(qd.ceil(qd.max(middle.x - wide - 0.5, -1.0)), qd.i32), 0)
    end_row = qd.cast(qd.min(qd.max(middle.y + wide + 0.5, 0.0), rows * 1.0), qd.i32)
    end_column = qd.cast(qd.min(qd.max(middle.x + wide + 0.5, 0.0), columns * 1.0), qd.i32)
    added = 0
    for row in range(low_row, end_row):
        for column in range(low_column, end_column):
            away = (row + 0.5 - middle.y) ** 2 + (column + 0.5 - middle.x) ** 2
            rest = 1.0 - away / (wide * wide)
            if rest > 0.0:
                down, across = row * samples + samples // 2, column * samples + samples // 2
                behind = c.z - qd.bit_cast(depth[down, across], qd.f32) - 0.15 * froth.size
                wall = qd.bit_cast(solid_depth[down, across], qd.f32)
                if behind < froth.deepest and c.z - 0.15 * froth.size < wall + froth.sunk:
                    tau = qd.cast(strength * rest * share_seen(behind, froth.deepest) + 0.5, qd.i32)
                    added += add_to_pixel(maps.sums, row, column, tau, light, behind, froth.size)
    return added


@qd.func
def add_to_pixel(sums: qd.template(), row, column, tau, light, behind, size):
    """Add an optical depth [1/4096] that lies `behind` [m] the surface to the sums of a pixel, and return it."""
    if tau > 0:
        qd.atomic_add(sums[row, column, 0], tau)
        if light > 0.5:
            qd.atomic_add(sums[row, column, 1], tau)
        if behind > 0.0 and behind < 1e3:
            deep = tau * qd.min(behind * 4.0 / size, 20.0)
            qd.atomic_add(sums[row, column, 2], qd.cast(deep + 0.5, qd.i32))
    return qd.max(tau, 0)


@qd.kernel(fastcache=True)
def splat(
    maps: FoamMaps,
    diffuse: Diffuse,
    depth: qd.types.ndarray(),
    solid_depth: qd.types.ndarray(),
    sun_depth: qd.types.ndarray(),
    lens: Lens,
    sun: Lens,
    walls: Box,
    froth: Froth,
    dim: qd.template(),
    count: qd.i32,
):
    """Add the optical depth of every particle to the pixels it covers, and to the relief."""
    for i in range(count):
        x = lift(diffuse.x[i])
        c = to_view(lens, x)
        if c.z > lens.near:
            scale = froth.size * pixels_per_metre(lens, c.z) / froth.samples  # px of a spacing
            middle, reach = to_pixel(lens, c) / froth.samples, 1.5 * scale + 2.0
            inside = qd.min(middle.x, middle.y) > -reach
            if inside and middle.x < maps.sums.shape[1] + reach and middle.y < maps.sums.shape[0] + reach:
                light = sunlit(sun, sun_depth, x, 2.0 * froth.size)
                added = add_cloud(maps, diffuse, i, x, scale, light, depth, solid_depth, lens, walls, froth, dim)
                if added > 0:
                    add_to_relief(maps, middle, added, froth.grain)


@qd.func
def add_cloud(
    maps: FoamMaps,
    diffuse: Diffuse,
    i,
    x,
    scale,
    light,
    depth: qd.template(),
    solid_depth: qd.template(),
    lens: Lens,
    walls: Box,
    froth: Froth,
    dim: qd.template(),
):
    """Add the discs of particle `i` at `x`, where a spacing is `scale` [px]; return what was added, in 1/4096."""
    radius, strength = size_and_strength(diffuse.kind[i], diffuse.age[i] / diffuse.life[i], diffuse.id[i])
    # As many discs as keep each of them small; all together cover what one of that radius would.
    parts = qd.min(qd.max((radius * scale / froth.fine) ** 2, froth.parts), froth.most_parts)
    each = radius * scale * qd.sqrt(1.0 / parts)
    way = lift(diffuse.v[i]) * froth.shutter
    added = 0
    for k in range(qd.cast(qd.ceil(parts), qd.i32)):
        away, instant, own = place_in_cloud(diffuse.id[i], k, diffuse.kind[i], dim)
        at = x + froth.size * away + instant * way
        for axis in qd.static(range(dim)):  # not outside of the glass
            at[axis] = qd.min(qd.max(at[axis], walls.lower[axis]), walls.upper[axis])
        p = to_view(lens, at)
        if p.z > lens.near:
            r = qd.min(each * own, froth.largest)
            wide = qd.max(r, froth.least)
            # What is smaller than a pixel is as faint as it is small.
            full = 4096.0 * strength * (r / wide) ** 2 * qd.min(parts - k, 1.0)
            added += add_disc(maps, p, to_pixel(lens, p) / froth.samples, wide, full, light, depth, solid_depth, froth)
    return added


@qd.func
def add_to_relief(maps: FoamMaps, middle, added, grain):
    """Spread what was added around a place in the picture over the four nearest texels of the relief."""
    texel = middle / grain - 0.5
    row, column = qd.cast(qd.floor(texel.y), qd.i32), qd.cast(qd.floor(texel.x), qd.i32)
    per = added / qd.cast(grain * grain, qd.f32)
    for n in range(4):
        down, across = row + n // 2, column + n % 2
        share = (1.0 - qd.abs(texel.y - down)) * (1.0 - qd.abs(texel.x - across))
        inside = down * grain < maps.sums.shape[0] and across * grain < maps.sums.shape[1]
        if qd.min(down, across) >= 0 and inside:
            qd.atomic_add(maps.relief[down, across], qd.cast(qd.min(share * per, 1e6) + 0.5, qd.i32))


@qd.func
def height_at(maps: FoamMaps, row, column, rows, columns):
    """Height of the relief [texels], smoothed over 3 x 3 texels; froth that is deep in the picture is a flat heap."""
    total = 0
    for n in qd.static(range(9)):
        r = qd.min(qd.max(row + qd.static(n // 3 - 1), 0), rows - 1)
        c = qd.min(qd.max(column + qd.static(n % 3 - 1), 0), columns - 1)
        total += qd.static((1, 2, 1, 2, 4, 2, 1, 2, 1)[n]) * maps.relief[r, c]
    return 0.7 * qd.log(1.0 + total * (1.0 / (16.0 * 4096.0)))


@qd.kernel(fastcache=True)
def light_relief(maps: FoamMaps, lens: Lens, look: Look, rows: qd.i32, columns: qd.i32, dim: qd.template()):
    """Find what share of sun and sky each texel of the relief gets: more where it faces them, less in its dells."""
    for row, column in qd.ndrange(rows, columns):
        sun, sky = 1.0, 1.0
        if qd.static(dim == 3):
            heights = qd.Matrix.zero(qd.f32, 1, 5)  # here, left, right, above, below
            for k in range(5):  # one copy of the code to compile
                down, across = qd.select(k > 2, 2 * k - 7, 0), qd.select(k == 1, -1, qd.select(k == 2, 1, 0))
                heights[0, k] = height_at(maps, row + down, column + across, rows, columns)
            here, left, right, above, below = heights[0, 0], heights[0, 1], heights[0, 2], heights[0, 3], heights[0, 4]
            # Foam lies on water: its plain faces up as much as the eye.
            n = from_view(lens, vec3(left - right, below - above, -0.35)) + vec3(0.0, 0.35, 0.0)
            n = n.normalized(1e-6)
            dell = left + right + above + below - 4.0 * here
            sun = qd.max((n.dot(look.to_sun) + 0.2) / 1.2, 0.0)
            sky = (0.65 + 0.35 * n.y) * (1.0 - qd.min(qd.max(0.8 * dell, 0.0), 0.5))
        maps.light[row, column] = vec2(sun, sky)


@qd.kernel(fastcache=True)
def blend(pixels: Pixels, maps: FoamMaps, depth: qd.types.ndarray(), strips: Strips, froth: Froth):
    """Lay the sums over the picture: what sun and sky give them or, over nothing, what it is in air."""
    for task in range(strips.count):
        row, first, last = strip(strips, task, maps.sums.shape[0], maps.sums.shape[1])
        for column in range(first, last):
            tau = maps.sums[row, column, 0]
            if tau > 0:
                white, cover = froth_radiance(maps, froth, row, column, tau), 1.0 - qd.exp(-tau / 4096.0)
                for k in range(froth.samples * froth.samples):
                    r, c = row * froth.samples + k // froth.samples, column * froth.samples + k % froth.samples
                    blend_sample(pixels, depth, froth, white, cover, r, c)


@qd.func
def froth_radiance(maps: FoamMaps, froth: Froth, row, column, tau):
    """Radiance of the froth over a pixel of the picture, in the light that its relief and the water above it leave."""
    per = 1.0 / qd.cast(tau, qd.f32)
    place = vec2(column + 0.5, row + 0.5) / qd.cast(froth.grain, qd.f32)
    r, c, r1, c1, v, u = corners(place, maps.light.shape[0], maps.light.shape[1], 1.001)
    top = maps.light[r, c] + u * (maps.light[r, c1] - maps.light[r, c])
    low = maps.light[r1, c] + u * (maps.light[r1, c1] - maps.light[r1, c])
    share = top + v * (low - top)
    # Froth scatters: a fifth of the sun comes around whatever is in the way.
    sun = share.x * (0.2 + 0.8 * maps.sums[row, column, 1] * per)
    under = qd.exp(-maps.sums[row, column, 2] * per * froth.swallow)
    return under * (sun * froth.in_sun + share.y * froth.in_sky)


@qd.func
def blend_sample(pixels: Pixels, depth: qd.template(), froth: Froth, white, cover, row, column):
    """Lay froth over one sample; the edges of the tank stay in front."""
    light, share = white, cover
    if froth.flat == 1 and depth[row, column] == 0x7F000000:  # FARTHEST
        light = froth.in_air
    if froth.line_strength > 0.0:
        here = qd.bit_cast(depth[row, column], qd.f32)
        share *= 1.0 - froth.line_strength * line_cover(pixels.lines[row, column], here, froth.slack)
    before = pixels.color[row, column]
    pixels.color[row, column] = before + share * (light - before)  # += would be atomic

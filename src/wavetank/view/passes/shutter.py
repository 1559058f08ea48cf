"""What moves while the shutter is open is smeared along its way, as a camera sees it.

A picture of an instant shows what flies past a pixel in one picture and not in the next: broken water boils. A camera
does not, because its shutter is open for a part of the time between two pictures. After M. McGuire, P. Hennessy,
M. Bukowski, B. Osman, "A reconstruction filter for plausible motion blur" (2012): every pixel becomes the mean of
those along the way that is dominant around it. Here that way comes from what is there, the velocities of the particles
that the eye sees, as means over texels of about a spacing: nothing of the picture before is used, so that a picture
belongs to its frame.

    code      symbol   meaning                                                        unit
    way                where what a texel shows goes while the shutter is open        px
    cuts               pixels that are averaged for one                               1
    wet                whether a pixel shows water                                    1

Where they differ from the paper: ways are means, not the largest ones, because particles tell them more evenly than
pixels; instead of two depths per pixel, what stands still takes light only from water before it, and edges of the tank
neither give nor take. Drops have streaks of their own (`streaks.py`), foam its own ways (`foam.py`).
"""

import dataclasses

from wavetank.device.compiler import qd
from wavetank.device.state import interned
from wavetank.solids.distance import lift
from wavetank.view.buffers import Buffers, Motion, Pixels
from wavetank.view.cells import Cells
from wavetank.view.lens import Lens, ray_direction, ray_origin, to_pixel, to_view, vec2, vec3, view_ray
from wavetank.view.look import Look
from wavetank.view.optics.bilinear import map_at
from wavetank.view.optics.fluid import grain_of
from wavetank.view.optics.glass import line_cover, slack
from wavetank.view.optics.rays import Box
from wavetank.view.shot import Shot
from wavetank.view.water_buffers import Drops, WaterSurface, water_of
from wavetank.view.weights import under_water

VISIBLE = 1.5  # d: how far behind the surface a particle still counts as what is seen
LONGEST = 0.08  # of the picture's height: way that is not exceeded
LEAST = 1.0  # px: ways that are not worth it
CUTS = 16  # at most
WHITE = 1.1  # radiance that counts at most
UNIT = 64.0  # steps of a pixel


@dataclasses.dataclass(frozen=True, eq=False)
class Shutter:
    """How long the shutter is open, on the device."""

    open: qd.f32  # s
    visible: qd.f32  # m
    longest: qd.f32  # px
    least: qd.f32  # px
    grain: qd.i32  # px of a texel
    samples: qd.i32  # computed pixels per pixel of the picture, in each direction
    cuts: qd.i32
    unit: qd.f32
    white: qd.f32  # radiance that counts at most: a film is not whiter than white
    slack: qd.f32  # m: depth by which an edge of the tank wins


def draw(shot: Shot, buffers: Buffers) -> None:
    """Smear `color` along the ways of what it shows; an eye in the water sees no motion."""
    frame, open_for = shot.frame, shot.shutter
    if frame.dim == 2 or open_for <= 0.0 or frame.count == 0 or under_water(shot, buffers):
        return
    water, motion = water_of(buffers, shot), buffers.motion
    surface = water.surface
    grain, samples = max(4, grain_of(shot, buffers.supersample)), buffers.supersample
    shutter = interned(
        Shutter(
            open=float(open_for),
            visible=VISIBLE * shot.extent.spacing,
            longest=LONGEST * buffers.rows / samples,
            least=LEAST,
            grain=grain,
            samples=samples,
            cuts=CUTS,
            unit=UNIT,
            white=WHITE,
            slack=slack(shot),
        )
    )
    rows, columns = (size // samples // grain + 2 for size in (buffers.rows, buffers.columns))
    begin(motion, rows, columns)
    gather(motion, surface.nearest, water.drops(frame), water.cells, shot.lens, shutter, frame.count)
    settle(motion, shutter, rows, columns)
    smear(buffers.pixels, surface, motion, shot.lens, shot.look, shot.walls, shutter, rows, columns, samples)


@qd.kernel(fastcache=True)
def begin(motion: Motion, rows: qd.i32, columns: qd.i32):
    """Nothing moves."""
    for row, column in qd.ndrange(rows, columns):
        for k in qd.static(range(3)):
            motion.sums[row, column, k] = 0


@qd.kernel(fastcache=True)
def gather(
    motion: Motion, nearest: qd.types.ndarray(), drops: Drops, cells: Cells, lens: Lens, shutter: Shutter, count: qd.i32
):
    """Add up the ways of all particles that the eye sees, but for drops, which have their own."""
    for a in range(count):
        c = to_view(lens, cells.x[a])
        if c.z > lens.near and drops.lone[a] == 0:
            here = to_pixel(lens, c)
            if here.x > 0.0 and here.y > 0.0 and here.x < nearest.shape[1] and here.y < nearest.shape[0]:
                seen = qd.bit_cast(nearest[qd.cast(here.y, qd.i32), qd.cast(here.x, qd.i32)], qd.f32)
                later = to_view(lens, cells.x[a] + shutter.open * lift(drops.v[cells.order[a]]))
                if c.z < seen + shutter.visible and later.z > lens.near:
                    way = (to_pixel(lens, later) - here) / shutter.samples
                    way *= qd.min(1.0, shutter.longest / qd.max(way.norm(), 1e-6))
                    wide = shutter.grain * shutter.samples
                    row, column = qd.cast(here.y, qd.i32) // wide, qd.cast(here.x, qd.i32) // wide
                    qd.atomic_add(motion.sums[row, column, 0], 1)
                    for k in qd.static(range(2)):
                        qd.atomic_add(motion.sums[row, column, k + 1], qd.cast(qd.round(way[k] * shutter.unit), qd.i32))


@qd.kernel(fastcache=True)
def settle(motion: Motion, shutter: Shutter, rows: qd.i32, columns: qd.i32):
    """Find the mean way around every texel."""
    for row, column in qd.ndrange(rows, columns):
        total, weight = vec2(0.0, 0.0), 0.0
        for n in qd.static(range(9)):
            r = qd.min(qd.max(row + qd.static(n // 3 - 1), 0), rows - 1)
            c = qd.min(qd.max(column + qd.static(n % 3 - 1), 0), columns - 1)
            share = qd.static((1.0, 2.0, 1.0, 2.0, 4.0, 2.0, 1.0, 2.0, 1.0)[n])
            weight += share * motion.sums[r, c, 0]
            total += share * vec2(motion.sums[r, c, 1], motion.sums[r, c, 2])
        motion.way[row, column] = total / (qd.max(weight, 1.0) * shutter.unit)


@qd.func
def pixel_along(row, column, way, high, wide):
    """Row and column of the pixel that lies so far from another, within the picture."""
    r = qd.min(qd.max(qd.cast(row + 0.5 + way.y, qd.i32), 0), high - 1)
    return r, qd.min(qd.max(qd.cast(column + 0.5 + way.x, qd.i32), 0), wide - 1)


@qd.func
def at_pane(lens: Lens, walls: Box, row, column, here, slack):
    """Whether a pixel shows water through a pane: what is seen there is what stands behind, however the water moves."""
    ray, z = view_ray(lens, row, column), qd.bit_cast(here, qd.f32)
    at = ray_origin(lens, ray) + z * ray_direction(lens, ray)
    gap = qd.min(at.x - walls.lower.x, walls.upper.x - at.x, at.z - walls.lower.z, walls.upper.z - at.z)
    return z < 1e30 and qd.abs(gap) < 0.1 * slack


@qd.func
def moves(way: qd.template(), row, column, rows, columns, least):
    """Whether anything in a texel goes farther than `least` [px]."""
    most = 0.0
    for n in qd.static(range(9)):
        r = qd.min(qd.max(row + qd.static(n // 3 - 1), 0), rows - 1)
        c = qd.min(qd.max(column + qd.static(n % 3 - 1), 0), columns - 1)
        most = qd.max(most, way[r, c].dot(way[r, c]))
    return most > least * least


@qd.kernel(fastcache=True)
def smear(
    pixels: Pixels,
    surface: WaterSurface,
    motion: Motion,
    lens: Lens,
    look: Look,
    walls: Box,
    shutter: Shutter,
    rows: qd.i32,
    columns: qd.i32,
    samples: qd.template(),
):
    """Average along the ways; `pixels.normal` and `surface.rim` hold what is new meanwhile."""
    grain = shutter.grain
    high, wide = pixels.depth.shape[0] // samples, pixels.depth.shape[1] // samples
    for texel_row, texel_column in qd.ndrange(rows, columns):
        if moves(motion.way, texel_row, texel_column, rows, columns, shutter.least):
            for row in range(texel_row * grain, qd.min((texel_row + 1) * grain, high)):
                for column in range(texel_column * grain, qd.min((texel_column + 1) * grain, wide)):
                    smear_pixel(pixels, surface, motion, lens, look, walls, shutter, row, column, high, wide, samples)
    for texel_row, texel_column in qd.ndrange(rows, columns):
        if moves(motion.way, texel_row, texel_column, rows, columns, shutter.least):
            for row in range(texel_row * grain, qd.min((texel_row + 1) * grain, high)):
                for column in range(texel_column * grain, qd.min((texel_column + 1) * grain, wide)):
                    copy_smeared(pixels, surface.rim, row * samples, column * samples, samples)


@qd.func
def copy_smeared(pixels: Pixels, mark: qd.template(), top, left, samples: qd.template()):
    """Give all samples of a pixel what was written for it, if anything was; its first lies at `top`, `left`."""
    if mark[top, left] == 1:
        for k in range(qd.static(samples * samples)):
            pixels.color[top + k // samples, left + k % samples] = pixels.normal[top, left]


@qd.func
def smear_pixel(
    pixels: Pixels,
    surface: WaterSurface,
    motion: Motion,
    lens: Lens,
    look: Look,
    walls: Box,
    shutter: Shutter,
    row,
    column,
    high,
    wide,
    samples: qd.template(),
):
    """Write the mean along the way of a pixel to `pixels.normal`, and 1 to `surface.rim`; 0 where it stands still."""
    way, mark = 2.0 * map_at(motion.way, vec2(column + 0.5, row + 0.5) / shutter.grain, vec2(0.0, 0.0)), 0
    down, across = row * samples, column * samples
    length = way.norm()
    if length > 2.0 * shutter.least:
        if not stands_at_pane(surface, lens, walls, shutter, row, column, way, high, wide, samples):
            total, weight, cover = mean_along(pixels, surface, shutter, row, column, way, length, high, wide, samples)
            if weight > 0.0:
                mark = 1
                total /= weight
                pixels.normal[down, across] = total + look.line_strength * cover * (look.line - total)
    surface.rim[down, across] = mark


@qd.func
def stands_at_pane(
    surface: WaterSurface,
    lens: Lens,
    walls: Box,
    shutter: Shutter,
    row,
    column,
    way,
    high,
    wide,
    samples: qd.template(),
):
    """Whether a pixel shows water through a pane, and so does the picture at both ends of its way."""
    stands = True
    for k in range(3):  # the pixel, then both ends
        r, c = row, column
        if k > 0:
            r, c = pixel_along(row, column, (k - 1.5) * way, high, wide)
        if stands:
            r, c = r * samples, c * samples
            stands = at_pane(lens, walls, r, c, surface.nearest[r, c], shutter.visible)
    return stands


@qd.func
def mean_along(
    pixels: Pixels,
    surface: WaterSurface,
    shutter: Shutter,
    row,
    column,
    way,
    length,
    high,
    wide,
    samples: qd.template(),
):
    """(weighted sum of radiance along the way of a pixel, sum of the weights, share that edges of the tank cover).

    The shutter opens and closes gradually: what is seen in the middle of the way counts most.
    """
    total, weight, cover = vec3(0.0, 0.0, 0.0), 0.0, 0.0
    here, line, wet, own, edge = 0, 0, False, vec3(0.0, 0.0, 0.0), 0.0
    cuts = qd.min(qd.max(qd.cast(0.4 * length, qd.i32) + 3, samples * samples), shutter.cuts)
    for k in range(cuts):
        # The samples of a pixel take turns.
        i, j = k // qd.static(samples) % qd.static(samples), k % qd.static(samples)
        if qd.static(samples > 1) or k == 0:
            own_r, own_c = row * samples + i, column * samples + j
            here, line = surface.nearest[own_r, own_c], pixels.lines[own_r, own_c]
            wet, own = here < pixels.depth[own_r, own_c], pixels.color[own_r, own_c]
            if line != 0:
                edge = line_cover(line, qd.bit_cast(here, qd.f32), shutter.slack)
        share = (k + 0.5) / cuts - 0.5
        r, c = pixel_along(row, column, share * way, high, wide)
        r, c = r * samples + i, c * samples + j
        open = 0.5 - qd.abs(share)
        if gives_light(surface.nearest[r, c], pixels.depth[r, c], here, wet):
            if pixels.lines[r, c] == 0:
                total += open * qd.min(pixels.color[r, c], shutter.white)
                weight += open
        elif line == 0:
            total += open * own
            weight += open
        if line != 0:
            cover += edge / cuts
    return total, weight, cover


@qd.func
def gives_light(there, solid, here, wet):
    """Whether a pixel shows what another does, at the depth `there` before a solid, as it moves past; bits of depths.

    Of what stands still, and of what hides the water, a pixel next to them shows nothing.
    """
    gives = there < solid
    if wet:
        gives = gives or there > here
    elif gives:
        gives = there < here
    return gives

"""Takes the bumps of single particles out of the water's depth without touching its outline.

N. Truong, C. Yuksel, "A narrow-range filter for screen-space fluid rendering", Proceedings of the ACM on Computer
Graphics and Interactive Techniques 1 (2018), doi:10.1145/3203201: a separable blur that takes only what lies in a
narrow range of depth, followed by a clean-up with a small window.

    code      symbol   meaning                                                             unit
    q                  what is linear along a plane in the picture: 1 / depth, or - depth  1/m or m
    grain              metres of depth per unit of q at a pixel                            m^2 or 1
    sigma     sigma    standard deviation of the blur                                      px
    narrow    delta    half range: how far two sides may bend off the straight line        m
    slope              how far their depths may lie apart                                  m

Where we differ: the taps of both sides are taken in pairs, and their mean is compared with the depth in the middle.
A plane passes that test at any slant and comes out as the plane it was (inverse depth is what is linear in a picture
in perspective, so that is what is averaged); a pair with a side beyond an edge is left out as a whole, so an edge
pulls nothing towards itself and leaves no halo. What lies well before a pane will not be seen and stays as it is; in
between the filter fades, in eighths that the last three bits count, because what comes and goes there at once can be
seen to flicker beside it. Large windows are sampled at up to `TAPS` pairs.
"""

import dataclasses
from typing import Any

from wavetank.device.compiler import lanes, qd
from wavetank.device.state import interned
from wavetank.view.buffers import Buffers
from wavetank.view.lens import Lens, ray_direction, ray_origin, view_ray
from wavetank.view.optics.rays import Box, box_interval
from wavetank.view.shot import Shot
from wavetank.view.strips import Strips, strip, strips_of
from wavetank.view.water_buffers import water_of

SIGMA = 1.4  # d
CAUSTIC_SIGMA = 1.8  # d: in the sun's view finer ripples are the particles', not the water's
NARROW, SLOPE = 1.0, 5.0  # d
TAPS = 6  # pairs of taps at most


@dataclasses.dataclass(frozen=True, eq=False)
class Window:
    """How far and how much pair_weight what is averaged may be, on the device."""

    sigma: qd.f32  # m
    per_narrow: qd.f32  # 1/m
    per_slope: qd.f32  # 1/m
    taps: qd.i32


def draw(shot: Shot, buffers: Buffers) -> None:
    """Smooth the water's depth in place; in a plane nothing looks at its shape."""
    if shot.frame.dim == 3:
        surface, d = water_of(buffers, shot).surface, shot.extent.spacing
        smooth_depth(surface.depth, surface.nearest, shot.lens, shot.walls, SIGMA * d, d)


def draw_from_sun(shot: Shot, buffers: Buffers) -> None:
    """Smooth the water's depth in the sun's view, likewise."""
    if shot.frame.dim == 3:
        sunlit, d = water_of(buffers, shot).sunlit, shot.extent.spacing
        smooth_depth(sunlit.depth, sunlit.spare, shot.water_sun, shot.walls, CAUSTIC_SIGMA * d, d)


def smooth_depth(depth: Any, spare: Any, lens: Lens, walls: Box, sigma: float, d: float) -> None:
    """Smooth `depth` as `lens` sees it, in place; the second round closes the gaps between the first one's taps."""
    strips = strips_of(depth)
    window = interned(Window(sigma=sigma, per_narrow=1.0 / (NARROW * d), per_slope=1.0 / (SLOPE * d), taps=TAPS))
    straighten(depth, strips, lens, walls, d, lanes())
    for clean in (0, 1):
        blur(spare, depth, strips, lens, window, 0, 1, clean, 0, lanes())
        blur(depth, spare, strips, lens, window, 1, 0, clean, clean, lanes())


@qd.kernel(fastcache=True)
def straighten(depth: qd.types.ndarray(), strips: Strips, lens: Lens, walls: Box, margin: qd.f32, lanes: qd.template()):
    """Put q in the place of depth; 0 (or far below any other) where there is no water.

    The last three bits say how far the surface lies before the tank: 0 up to `margin` / 2 [m], 7 from 3/2 of it on.
    """
    for task in range(strips.count):
        row, first, last = strip(strips, task, depth.shape[0], depth.shape[1])
        for block in range(first // lanes, (last + lanes - 1) // lanes):
            begin = block * lanes
            if begin + lanes <= depth.shape[1]:
                keys, least = qd.Matrix.zero(qd.i32, 1, lanes), 0x7F000000  # FARTHEST
                for lane in qd.static(range(lanes)):
                    keys[0, lane] = depth[row, begin + lane]
                    least = qd.min(least, keys[0, lane])
                if least == 0x7F000000:
                    dry = straight(least, lens, walls, margin, row, begin)
                    for lane in range(lanes):
                        keys[0, lane] = dry
                else:
                    for lane in range(lanes):
                        keys[0, lane] = straight(keys[0, lane], lens, walls, margin, row, begin + lane)
                for lane in range(qd.max(first - begin, 0), qd.min(last - begin, lanes)):
                    depth[row, begin + lane] = keys[0, lane]
            else:
                for column in range(qd.max(begin, first), last):
                    depth[row, column] = straight(depth[row, column], lens, walls, margin, row, column)


@qd.func
def straight(key, lens: Lens, walls: Box, margin, row, column):
    """The bits of q, and how far before the tank it lies, of a pixel with these bits of depth."""
    z = qd.bit_cast(key, qd.f32)
    q = qd.select(lens.perspective > 0.5, qd.select(z < 1e30, 1.0 / z, 0.0), -qd.min(z, 1e9))
    ray = view_ray(lens, row, column)
    origin, direction = ray_origin(lens, ray), ray_direction(lens, ray)
    there = box_interval(origin, direction, walls)
    away = (there[0] - qd.min(z, 1e9)) * direction.norm() / margin - 0.5
    outside = qd.cast(7.0 * qd.min(qd.max(away, 0.0), 1.0) + 0.5, qd.i32)
    return (qd.bit_cast(q, qd.i32) & ~7) | outside


@qd.func
def depth_of(q, perspective):
    """Bits of the depth that q stands for."""
    key = 0x7F000000  # FARTHEST
    if perspective > 0.5:
        if q > 0.0:
            key = qd.bit_cast(1.0 / q, qd.i32)
    elif q > -1e8:
        key = qd.bit_cast(-q, qd.i32)
    return key


@qd.func
def reach_of(q, lens: Lens, window: Window, clean):
    """Grain of a pixel, standard deviation [px] of the blur, step and reach of its taps [px], in whole numbers."""
    grain, spread = 1.0, window.sigma * lens.focal
    if lens.perspective > 0.5:
        grain = 1.0 / (q * q)
        spread *= q
    # Two standard deviations in whole steps; no step where a pixel is larger than the window.
    step = qd.max(qd.floor(2.0 * spread / window.taps + 0.5), 1.0)
    if clean == 1:
        spread = qd.max(0.5 * step, 0.25 * spread)
        step = 1.0
    return grain, spread, step, qd.floor(2.0 * spread)


@qd.func
def ratio_of(spread, step):
    """exp(-t), t = step^2 / (2 spread^2), to 1e-4 where t <= 2: it is asked for where a step is two spreads at most.

    From one k to the next exp(-k^2 t) grows by this, then by this times its square, and so on.
    """
    t = -0.125 * step * step / qd.max(spread * spread, 1e-6)
    root = 1.0 + t * (1.0 + t * (1.0 / 2 + t * (1.0 / 6 + t * (1.0 / 24 + t / 120))))
    root *= root
    return root * root


@qd.func
def pair_weight(bend, apart, grain, window: Window):
    """How much a pair of taps counts whose mean is off by `bend`, and which are that far `apart`, in q.

    It fades to nothing at the ends of both ranges: what moves across one must not flicker.
    """
    off, away = bend * grain * window.per_narrow, apart * grain * window.per_slope
    return qd.max(1.0 - off * off, 0.0) * qd.max(1.0 - away * away, 0.0)


@qd.kernel(fastcache=True)
def blur(
    result: qd.types.ndarray(),
    depth: qd.types.ndarray(),
    strips: Strips,
    lens: Lens,
    window: Window,
    down: qd.i32,
    across: qd.i32,
    clean: qd.i32,
    final: qd.i32,
    lanes: qd.template(),
):
    """Blur q along rows or columns; the `final` round puts depth in its place.

    Pixels of a row come `lanes` at a time as vectors where all of them take the same steps, none of which leaves the
    picture.
    """
    rows, columns = depth.shape[0], depth.shape[1]
    for task in range(strips.count):
        row, first, end = strip(strips, task, rows, columns)
        for block in range(first // lanes, (end + lanes - 1) // lanes):
            begin, together = block * lanes, 0
            left_end, right_end = qd.max(begin, first), qd.min(begin + lanes, end)
            if qd.static(lanes > 1):
                if begin + lanes <= columns:
                    together = blur_together(
                        result, depth, lens, window, row, begin, left_end, right_end, down, across, clean, final, lanes
                    )
            if together == 0:
                for column in range(left_end, right_end):
                    key = blur_pixel(depth, lens, window, row, column, down, across, clean)
                    if final == 1:
                        key = depth_of(qd.bit_cast(key, qd.f32), lens.perspective)
                    result[row, column] = key


@qd.func
def blur_pixel(depth: qd.template(), lens: Lens, window: Window, row, column, down, across, clean):
    """The bits of q of a pixel, blurred along its row or column, and of how far before the tank it lies."""
    key = depth[row, column]
    q = qd.bit_cast(key, qd.f32)
    kept = key & 7
    if kept < 7 and q != 0.0 and q > -1e8:
        grain, spread, step, reach = reach_of(q, lens, window, clean)
        room = qd.min(row, depth.shape[0] - 1 - row) * down + qd.min(column, depth.shape[1] - 1 - column) * across
        last = qd.min(qd.cast(qd.min(reach, qd.cast(room, qd.f32)) / step + 1e-3, qd.i32), window.taps)
        ratio = ratio_of(spread, step)
        decay, gauss = ratio * ratio, 1.0
        total, weight = 0.0, 1.0
        for k in range(1, last + 1):
            gauss *= ratio
            ratio *= decay
            off = k * qd.cast(step, qd.i32)
            left = qd.bit_cast(depth[row - off * down, column - off * across], qd.f32)
            right = qd.bit_cast(depth[row + off * down, column + off * across], qd.f32)
            bend = 0.5 * (left + right) - q
            w = gauss * pair_weight(bend, left - right, grain, window)
            total += w * bend
            weight += w
        q += (1.0 - kept / 7.0) * total / weight
        key = (qd.bit_cast(q, qd.i32) & ~7) | kept
    return key


@qd.func
def blur_together(
    result: qd.template(),
    depth: qd.template(),
    lens: Lens,
    window: Window,
    row,
    begin,
    first,
    end,
    down,
    across,
    clean,
    final,
    lanes: qd.template(),
):
    """Blur the pixels of a row from `begin` on, `lanes` of them, and return 1; 0 where they do not go together.

    Those from `first` to `end` are written: what others are in a strip, or in none, does not change them.
    """
    keys = qd.Matrix.zero(qd.i32, 1, lanes)
    low, high = 1e30, -1e30
    for lane in qd.static(range(lanes)):
        key = depth[row, begin + lane]
        keys[0, lane] = key
        q = qd.bit_cast(key, qd.f32)
        if (key & 7) < 7 and q != 0.0 and q > -1e8:
            low, high = qd.min(low, q), qd.max(high, q)
    last, step, together = 0, 1, 1
    if low <= high:
        _, _, least, _ = reach_of(low, lens, window, clean)
        _, _, most, reach = reach_of(high, lens, window, clean)
        step, last = qd.cast(most, qd.i32), qd.min(qd.cast(reach / most + 1e-3, qd.i32), window.taps)
        off = (last + 1) // 2 * 2 * step
        room = qd.min(row, depth.shape[0] - 1 - row) * down
        room += qd.min(begin, depth.shape[1] - lanes - begin) * across
        together = qd.cast(least == most and room >= off, qd.i32)
    if together == 1:
        # Of each pixel: q, grain, sum of bends, weight; gauss, its ratio to the next, that ratio's; reach in steps.
        own = qd.Matrix.zero(qd.f32, 8, lanes)
        if last > 0:
            for lane in range(lanes):
                q = qd.bit_cast(keys[0, lane], qd.f32)
                grain, spread, _, reach = reach_of(q, lens, window, clean)
                ratio = ratio_of(spread, qd.cast(step, qd.f32))
                own[0, lane], own[1, lane], own[2, lane], own[3, lane] = q, grain, 0.0, 1.0
                own[4, lane], own[5, lane], own[6, lane] = 1.0, ratio, ratio * ratio
                own[7, lane] = reach / step + 1e-3
            for turn in range((last + 1) // 2):
                # What is read is put in columns first, two taps at a time: else the loop over lanes is not vectorised.
                taps = qd.Matrix.zero(qd.f32, 4, lanes)
                for k in qd.static(range(2)):
                    off = (2 * turn + k + 1) * step
                    for lane in qd.static(range(lanes)):
                        left = depth[row - off * down, begin + lane - off * across]
                        right = depth[row + off * down, begin + lane + off * across]
                        taps[2 * k, lane], taps[2 * k + 1, lane] = qd.bit_cast(left, qd.f32), qd.bit_cast(right, qd.f32)
                for lane in range(lanes):
                    gauss, ratio, total, weight = own[4, lane], own[5, lane], own[2, lane], own[3, lane]
                    for k in qd.static(range(2)):
                        left, right = taps[2 * k, lane], taps[2 * k + 1, lane]
                        gauss *= ratio
                        ratio *= own[6, lane]
                        bend = 0.5 * (left + right) - own[0, lane]
                        w = gauss * pair_weight(bend, left - right, own[1, lane], window)
                        w = qd.select(qd.cast(2 * turn + k + 1, qd.f32) <= own[7, lane], w, 0.0)
                        total += w * bend
                        weight += w
                    own[4, lane], own[5, lane], own[2, lane], own[3, lane] = gauss, ratio, total, weight
            for lane in range(lanes):
                key, q = keys[0, lane], own[0, lane]
                kept = key & 7
                q += (1.0 - kept / 7.0) * own[2, lane] / own[3, lane]
                key = qd.select(
                    kept < 7 and own[0, lane] != 0.0 and own[0, lane] > -1e8, (qd.bit_cast(q, qd.i32) & ~7) | kept, key
                )
                keys[0, lane] = key
        for column in range(first, end):
            key = keys[0, column - begin]
            if final == 1:
                key = depth_of(qd.bit_cast(key, qd.f32), lens.perspective)
            result[row, column] = key
    return together

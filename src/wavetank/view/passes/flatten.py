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

from wavetank.device.compiler import qd
from wavetank.device.state import remembered
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
    """How far and how much alike what is averaged may be, on the device."""

    sigma: qd.f32  # m
    per_narrow: qd.f32  # 1/m
    per_slope: qd.f32  # 1/m
    taps: qd.i32


def draw(shot: Shot, buffers: Buffers) -> None:
    """Smooth the water's depth in place; in a plane nothing looks at its shape."""
    if shot.frame.dim == 3:
        surface, d = water_of(buffers, shot).surface, shot.extent.spacing
        even(surface.depth, surface.nearest, shot.lens, shot.walls, SIGMA * d, d)


def draw_from_sun(shot: Shot, buffers: Buffers) -> None:
    """Smooth the water's depth in the sun's view, likewise."""
    if shot.frame.dim == 3:
        sunlit, d = water_of(buffers, shot).sunlit, shot.extent.spacing
        even(sunlit.depth, sunlit.spare, shot.water_sun, shot.walls, CAUSTIC_SIGMA * d, d)


def even(depth: Any, spare: Any, lens: Lens, walls: Box, sigma: float, d: float) -> None:
    """Smooth `depth` as `lens` sees it, in place; the second round closes the gaps between the first one's taps."""
    strips = strips_of(depth)
    window = remembered(Window(sigma=sigma, per_narrow=1.0 / (NARROW * d), per_slope=1.0 / (SLOPE * d), taps=TAPS))
    straighten(depth, strips, lens, walls, d)
    for clean in (0, 1):
        blur(spare, depth, strips, lens, window, 0, 1, clean, 0)
        blur(depth, spare, strips, lens, window, 1, 0, clean, clean)


@qd.kernel(fastcache=True)
def straighten(depth: qd.types.ndarray(), strips: Strips, lens: Lens, walls: Box, margin: qd.f32):
    """Put q in the place of depth; 0 (or far below any other) where there is no water.

    The last three bits say how far the surface lies before the tank: 0 up to `margin` / 2 [m], 7 from 3/2 of it on.
    """
    for task in range(strips.count):
        row, first, last = strip(strips, task, depth.shape[0], depth.shape[1])
        for column in range(first, last):
            z = qd.bit_cast(depth[row, column], qd.f32)
            q, outside = -qd.min(z, 1e9), 0
            if lens.perspective > 0.5:
                q = qd.select(z < 1e30, 1.0 / z, 0.0)
            if z < 1e30:
                ray = view_ray(lens, row, column)
                origin, direction = ray_origin(lens, ray), ray_direction(lens, ray)
                there = box_interval(origin, direction, walls)
                away = (there[0] - z) * direction.norm() / margin - 0.5
                outside = qd.cast(7.0 * qd.min(qd.max(away, 0.0), 1.0) + 0.5, qd.i32)
            depth[row, column] = (qd.bit_cast(q, qd.i32) & ~7) | outside


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


@qd.kernel(fastcache=True)
def blur(
    result: qd.types.ndarray(), depth: qd.types.ndarray(), strips: Strips, lens: Lens, window: Window,
    down: qd.i32, across: qd.i32, clean: qd.i32, final: qd.i32,
):  # fmt: skip
    """Blur q along rows or columns; the `final` round puts depth in its place."""
    rows, columns = depth.shape[0], depth.shape[1]
    for task in range(strips.count):
        row, first, end = strip(strips, task, rows, columns)
        for column in range(first, end):
            key = depth[row, column]
            q = qd.bit_cast(key, qd.f32)
            kept = key & 7
            if kept < 7 and q != 0.0 and q > -1e8:
                grain, spread = 1.0, window.sigma * lens.focal
                if lens.perspective > 0.5:
                    grain = 1.0 / (q * q)
                    spread *= q
                # Two standard deviations in whole steps; no step where a pixel is larger than the window.
                step = qd.max(qd.cast(2.0 * spread / window.taps + 0.5, qd.i32), 1)
                if clean == 1:
                    spread = qd.max(0.5 * step, 0.25 * spread)
                    step = 1
                room = qd.min(row, rows - 1 - row) * down + qd.min(column, columns - 1 - column) * across
                last = qd.min(qd.cast(2.0 * spread, qd.i32), room) // step
                last = qd.min(last, window.taps)
                # exp(-k^2 / (2 spread^2)) from one k to the next: w, then w ratio, then w ratio (ratio decay), ...
                ratio = qd.exp(-0.5 * step * step / qd.max(spread * spread, 1e-6))
                decay = ratio * ratio
                gauss = 1.0
                bend_scale, apart_scale = grain * window.per_narrow, grain * window.per_slope
                total, weight = q, 1.0
                for k in range(1, last + 1):
                    gauss *= ratio
                    ratio *= decay
                    off = k * step
                    left = qd.bit_cast(depth[row - off * down, column - off * across], qd.f32)
                    right = qd.bit_cast(depth[row + off * down, column + off * across], qd.f32)
                    pair = 0.5 * (left + right)
                    bend, apart = (pair - q) * bend_scale, (left - right) * apart_scale
                    # Both fade to nothing at the end of their range: what moves across it must not flicker.
                    w = gauss * qd.max(1.0 - bend * bend, 0.0) * qd.max(1.0 - apart * apart, 0.0)
                    total += w * pair
                    weight += w
                q += (1.0 - kept / 7.0) * (total / weight - q)
                key = (qd.bit_cast(q, qd.i32) & ~7) | kept
            if final == 1:
                key = depth_of(q, lens.perspective)
            result[row, column] = key

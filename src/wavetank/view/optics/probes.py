"""Probe points that many pixels share: a spiral, turned from pixel to pixel in a 4 x 4 pattern.

Few probes a pixel and an average over 4 x 4 pixels are worth sixteen times as many, and the pattern, unlike noise,
averages out without a rest.

Shadows soften with the distance between what casts and what receives them (R. Fernando, "Percentage-closer soft
shadows", 2005): a few probes find the mean distance of what is in the way, a few more, spread as wide as the sun then
looks, count what is hidden.
"""

import math

from wavetank.device.compiler import qd
from wavetank.view.lens import vec2
from wavetank.view.optics.bilinear import gap_at


@qd.func
def spiral(k: qd.template(), count: qd.template()):
    """Point `k` of `count` evenly spread over the unit disc.

    H. Vogel, "A better way to construct the sunflower head" (1979). A constant of the kernel, worked out here rather
    than in a table, because the compiler's cache sees functions but no tables.
    """
    return vec2(
        qd.static(math.sqrt((k + 0.5) / count) * math.cos(2.3999632297 * k)),
        qd.static(math.sqrt((k + 0.5) / count) * math.sin(2.3999632297 * k)),
    )


@qd.func
def pattern_turn(row, column):
    """(cos, sin) of one of 16 angles, all of which occur in every 4 x 4 pixels (a Bayer matrix)."""
    a, b = row % 4, column % 4
    quarter = 2 * ((a % 2) ^ (b % 2)) + a % 2
    step = 2 * ((a // 2) ^ (b // 2)) + a // 2
    turn = vec2(1.0, 0.0)  # steps of 22.5 degrees
    if step == 1:
        turn = vec2(0.92387953, 0.38268343)
    elif step == 2:
        turn = vec2(0.70710678, 0.70710678)
    elif step == 3:
        turn = vec2(0.38268343, 0.92387953)
    if quarter % 2 == 1:
        turn = vec2(-turn.y, turn.x)
    if quarter >= 2:
        turn = -turn
    return turn


@qd.func
def turned(turn, point):
    """Point (x, y) turned by (cos, sin)."""
    return vec2(turn.x * point.x - turn.y * point.y, turn.y * point.x + turn.x * point.y)


@qd.func
def sun_reach(sun_depth: qd.template(), sun_size):
    """Radius [texels] of the cone in which something as high as a few tenths of the map could stand in the way."""
    return 0.25 * sun_size * sun_depth.shape[0]


@qd.func
def sun_share(sun_depth: qd.template(), place, depth, tilt, focal, sun_size, turn, probes: qd.template()):
    """Share 0 to 1 of the sun that is seen from a point at `depth` that the map, of `focal` texels a metre, shows at
    `place`.

    The surface that the point lies on is deeper by `tilt` [m] for each texel across and down the map: it does not
    stand in its own way (J. Isidoro, "Shadow mapping: GPU-based tips and techniques", 2006).
    """
    below, casters, wide = 0.0, 0, sun_reach(sun_depth, sun_size)
    for k in qd.static(range(5)):
        offset = wide * turned(turn, spiral(k, 5))
        gap = gap_at(sun_depth, place + offset, depth + tilt.dot(offset))
        if gap > 0.0:
            below += gap
            casters += 1
    share = 1.0
    if casters == 5:
        share = 0.0
    elif casters > 0:
        spread = qd.min(qd.max(sun_size * below / casters * focal, 1.0), wide)
        for k in qd.static(range(probes)):
            offset = spread * turned(turn, spiral(k, probes))
            if gap_at(sun_depth, place + offset, depth + tilt.dot(offset)) > 0.0:
                share -= 1.0 / probes
    return qd.max(share, 0.0)

"""Probe points that many pixels share: a spiral, turned from pixel to pixel in a 4 x 4 pattern.

Few probes a pixel and an average over 4 x 4 pixels are worth sixteen times as many, and the pattern, unlike noise,
averages out without a rest.
"""

import math

from wavetank.device.compiler import qd
from wavetank.view.lens import vec2


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

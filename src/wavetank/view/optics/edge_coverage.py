"""Marks of a pixel: how much of it an edge covers, and how deep, in one whole number; the largest mark wins.

A mark of the tank's lines is `share << 23 | 2^23 - 1 - (depth >> 8)` with 255 steps of a share, one of the water's
outlines `share << 24 | 2^24 - 1 - (depth >> 7)` with 127; depths are bits of floats.
"""

from wavetank.device.compiler import qd


@qd.func
def line_mark(cover, depth):
    """Mark of a line at a depth [m]."""
    return (qd.cast(255.0 * cover + 0.5, qd.i32) << 23) | (0x7FFFFF - (qd.bit_cast(depth, qd.i32) >> 8))


@qd.func
def line_depth(line):
    """Depth [m] of a line."""
    return qd.bit_cast((0x7FFFFF - (line & 0x7FFFFF)) << 8, qd.f32)


@qd.func
def rim_mark(cover, key):
    """Mark of an outline at a depth, given as bits."""
    return (qd.cast(127.0 * cover, qd.i32) << 24) | (0xFFFFFF - (key >> 7))


@qd.func
def rim_key(rim):
    """Bits of the depth of an outline."""
    return (0xFFFFFF - (rim & 0xFFFFFF)) << 7


@qd.func
def rim_cover(rim):
    """Share of the pixel that an outline covers."""
    return ((rim >> 24) + 0.5) / 127.0

"""Axes along which a world repeats: the nearest image of a place, and the one within the world.

Everything that measures from one place to another asks here. Two places that are no farther apart than a world is long
have one difference that is shorter than half of its length along each axis that repeats: that of nearest images.
What kernels are compiled for says which axes these are, so that a world that does not repeat pays nothing.

    code       symbol    meaning                                    unit
    axes                 bit k is set where axis k repeats          1
    x, y, z    L         length of the world along the axis         m
    x0, ...              where it begins                            m
"""

import dataclasses
from collections.abc import Iterable
from typing import Final

from wavetank.device.compiler import qd


@dataclasses.dataclass(frozen=True)
class Periods:
    """How a world repeats."""

    axes: Final[int]  # bits, 0 for a world that does not
    x: qd.f32 = 0.0  # m
    y: qd.f32 = 0.0
    z: qd.f32 = 0.0
    x0: qd.f32 = 0.0  # m
    y0: qd.f32 = 0.0
    z0: qd.f32 = 0.0


#: Of a world that does not repeat.
NONE = Periods(0)


def periods_of(axes: Iterable[int], lower: Iterable[float], size: Iterable[float]) -> Periods:
    """Return how a world between the corner `lower` and `size` beyond it [m] repeats along some `axes`."""
    bits = sum(1 << axis for axis in axes)
    if not bits:
        return NONE
    lengths, corner = ([*map(float, values), 1.0][:3] for values in (size, lower))
    return Periods(bits, *lengths, *corner)


@qd.func
def image_shift(difference, period):
    """What leads from a `difference` [m] along an axis to that of nearest images: 0, or a `period` [m] to a side.

    A single period: what is nowhere, see `state.nowhere`, stays there.
    """
    return period * (qd.cast(difference < -0.5 * period, qd.f32) - qd.cast(difference > 0.5 * period, qd.f32))


@qd.func
def nearest_along(difference, axis: qd.template(), periods: Periods):
    """The `difference` [m] of two places along an axis, of their nearest images where it repeats."""
    found = difference
    if qd.static(periods.axes >> axis & 1):
        found += image_shift(difference, qd.Vector([periods.x, periods.y, periods.z])[axis])
    return found


@qd.func
def nearest_image(difference, periods: Periods):
    """The vector `difference` [m] of two places, of their nearest images along the axes that repeat."""
    found = difference
    if qd.static(periods.axes):
        for axis in qd.static(range(difference.n)):
            found[axis] = nearest_along(difference[axis], axis, periods)
    return found


@qd.func
def within_along(place, axis: qd.template(), periods: Periods):
    """The coordinate `place` [m], of its image within the world where the axis repeats; what is not a number stays."""
    found = place
    if qd.static(periods.axes >> axis & 1):
        lower = qd.Vector([periods.x0, periods.y0, periods.z0])[axis]
        period = qd.Vector([periods.x, periods.y, periods.z])[axis]
        if place < lower or place >= lower + period:
            found = place - qd.floor((place - lower) / period) * period
            if found < lower or found >= lower + period:  # by rounding
                found = lower
    return found


@qd.func
def within(place, periods: Periods):
    """The image of a `place` [m] within the world."""
    found = place
    if qd.static(periods.axes):
        for axis in qd.static(range(place.n)):
            found[axis] = within_along(place[axis], axis, periods)
    return found

"""Rays and the boxes that they meet."""

import dataclasses
from typing import Any

from wavetank.device.compiler import qd
from wavetank.device.state import interned
from wavetank.view.lens import vec2, vec3, vector


@dataclasses.dataclass(frozen=True, eq=False)
class Box:
    """A box of the world, on the device."""

    lower: vec3  # m
    upper: vec3  # m


def box(lower: Any, upper: Any) -> Box:
    """Return the box between two corners [m]."""
    return interned(Box(lower=vector(*lower), upper=vector(*upper)))


OPEN = box((-1e6,) * 3, (1e6,) * 3)  # m: walls of no tank


@qd.func
def box_interval(origin, direction, box: Box):
    """Depths at which a ray enters and leaves a box; enters after leaving where it misses."""
    first, last = -1e9, 1e9
    for k in qd.static(range(3)):
        slope = direction[k]
        if qd.abs(slope) < 1e-9:
            slope = 1e-9
        a, b = (box.lower[k] - origin[k]) / slope, (box.upper[k] - origin[k]) / slope
        first, last = qd.max(first, qd.min(a, b)), qd.min(last, qd.max(a, b))
    return vec2(first, last)

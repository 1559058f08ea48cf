"""Where a force acts, shared by all of them: a soft ball or tube around a place.

code     symbol              meaning                                       unit
share    (1 - q^2)^2         1 in the middle, 0 with zero slope at q = 1   1
q        r / R               distance over the radius                      1
"""

from collections.abc import Sequence

import numpy as np

from wavetank.device.compiler import qd


@qd.func
def soft_share(distance, radius):
    """Strength at that distance from the middle of a region; without a radius it is the same everywhere."""
    share = 1.0
    if radius > 0.0:
        q = qd.min(distance / radius, 1.0)
        share = (1.0 - q * q) ** 2
    return share


@qd.func
def away_from_line(point, center, axis):
    """Vector [m] to `point` from the line through `center` along `axis`, from `center` if that is zero."""
    offset = point - center
    return offset - axis * offset.dot(axis)


@qd.func
def add_to(v: qd.template(), dv):
    """The velocity `v` of a 2-D or 3-D world plus the vector in space `dv`."""
    result = v
    for k in qd.static(range(v.n)):
        result[k] += dv[k]
    return result


def in_space(vector: Sequence[float]) -> np.ndarray:
    """Return a vector of a 2-D or 3-D world as one in space, float32 [3]."""
    point = np.zeros(3, np.float32)
    point[: len(vector)] = vector
    return point

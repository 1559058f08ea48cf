"""The water that a body takes along when it is accelerated, by the ellipsoid with its inertia.

Lamb 1932, "Hydrodynamics", Sec. 71 and 114 (and 71 for an ellipse): potential flow, far from walls.

    code     symbol             meaning
    axes     a, b, c            semi-axes of the ellipsoid                                       m
    alpha    alpha, beta, ...   abc int_0^oo dl / ((a^2 + l) sqrt((a^2 + l)(b^2 + l)(c^2 + l)))  1
"""

import functools

import numpy as np

from wavetank.solids.mass import Inertia

THINNEST = 0.05  # of the longest axis: what is flatter is taken for this
ALONG = 0.7  # of that of an immersed body: the water that goes along with one that floats is 0.4 to 1 of it


@functools.lru_cache(maxsize=64)
def added_mass(axes: tuple[float, ...]) -> tuple[float, float]:
    """Return the largest added mass over the displaced, and the largest added inertia over mass times square of reach.

    `axes` [m] are three, or two in a 2-D world.
    """
    a = np.maximum(np.array(axes, float), THINNEST * max(axes))
    if len(a) == 2:
        short, long = sorted(a)
        return float(long / short), float((long**2 - short**2) ** 2 / (8.0 * long * short) / long**2)
    t = (np.arange(2000) + 0.5) / 2000  # l = a_max^2 (t / (1 - t))^2
    scale = max(a) ** 2
    length = scale * (t / (1.0 - t)) ** 2
    step = scale * 2.0 * t / (1.0 - t) ** 3 / 2000
    root = np.sqrt(np.prod(a[:, None] ** 2 + length, axis=0))
    alpha = np.array([np.prod(a) * np.sum(step / ((edge**2 + length) * root)) for edge in a])
    turning = []
    for i in range(3):
        b, c = a[(i + 1) % 3] ** 2, a[(i + 2) % 3] ** 2
        beta, gamma = alpha[(i + 1) % 3], alpha[(i + 2) % 3]
        lower = 2.0 * (b - c) + (b + c) * (beta - gamma)
        turning.append(0.2 * (b - c) ** 2 * (gamma - beta) / lower if abs(b - c) > 1e-9 * scale else 0.0)
    return float(np.max(alpha / (2.0 - alpha))), float(max(turning) / scale)


def grip(dim: int, dry: Inertia, wet: Inertia, along: np.ndarray, far: float) -> float:
    """Return the share of sliding after which a body and the water up to `far` [m] from it are equally fast.

    What goes `along` [2] [kg, kg m^2] counts as part of the body. Friction slows all of that water: where it is
    heavier, what a body gets by more than this share turns it back and forth from step to step.
    """
    axes = wet.axes[3 - dim :]
    larger, outside = float(np.prod((axes + far) / axes)), float(np.sum((axes + far) ** 2))
    around = wet.mass * np.array([larger - 1.0, (larger * outside - float(np.sum(axes**2))) / (dim + 2)])
    own = along + np.array([dry.mass, 0.5 * np.trace(dry.tensor) if dim == 3 else dry.tensor[2, 2]])
    return float((own / (own + around)).min())

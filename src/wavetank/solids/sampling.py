"""Signed distances to solids, computed for the host."""

import numpy as np

from wavetank.device.compiler import borrowed, download, qd, upload
from wavetank.device.state import integers, scalars, vectors
from wavetank.solids.build import build
from wavetank.solids.distance import SolidSet, lift, signed_distance, vec3, vec4
from wavetank.solids.solid import Solid

_AT_ONCE = 1 << 22  # points


@qd.func
def nearest_at(solids: SolidSet, first, at):
    """Number of the solid nearest to the point `at`, from number `first` on, and its (gradient, distance [m]).

    The number is -1 where there is none.
    """
    found, nearest = -1, vec4(0.0, 1.0, 0.0, 1e9)
    for k in range(first, solids.count):
        value = signed_distance(solids, k, at)
        if value.w < nearest.w:
            found, nearest = k, value
    return found, nearest


@qd.kernel(fastcache=True)
def measure_nearest(
    distances: qd.types.ndarray(),
    numbers: qd.types.ndarray(),
    points: qd.types.ndarray(),
    solids: SolidSet,
    first: qd.i32,
    touch: qd.f32,
    count: qd.i32,
):
    """Write which of the solids from number `first` on is nearest to each point, and how far: negative inside.

    A point at a surface that another solid touches, up to `touch` [m], is as deep inside as can be.
    """
    for i in range(count):
        at, s, number = lift(points[i]), 0.0, -1
        for look in range(2):
            k, value = nearest_at(solids, first, at)
            if look == 0:
                s, number = value.w, k
                at -= vec3(value.x, value.y, value.z) * (s - touch)
            elif touch > 0.0 and s > -1e8 and value.w < 0.0:
                s = -1e9
        distances[i], numbers[i] = s, number


def nearest_of(solids: SolidSet, first: int, points: np.ndarray, touch: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Return how far the points [n, dim] are from the nearest of the solids from number `first` on, and its number.

    Distances [m] are float32 [n], negative inside, 1e9 where there is no solid; numbers int32 [n], -1 there. Seams
    between solids, up to `touch` [m] wide, do not count as surfaces: the distance is -1e9 there.
    """
    parts, whose = [np.zeros(0, np.float32)], [np.zeros(0, np.int32)]
    for begin in range(0, len(points), _AT_ONCE):
        part = points[begin : begin + _AT_ONCE]
        places, found, numbers = vectors(points.shape[1], len(part)), scalars(len(part)), integers(len(part))
        upload(places, part.astype(np.float32))
        measure_nearest(found, numbers, places, solids, first, touch, len(part))
        parts.append(download(found)[: len(part)])
        whose.append(download(numbers)[: len(part)])
    return np.concatenate(parts), np.concatenate(whose)


def nearest_distances(solids: list[Solid], points: np.ndarray, spacing: float) -> np.ndarray:
    """Return the distance [m] from the points [n, dim] to the nearest of `solids`, float32 [n]; negative inside.

    Meshes are as fine as for particles of that `spacing` [m]. Without solids everything is 1e9 m away.
    """
    with borrowed():
        return nearest_of(build(solids, 0, 0.0, spacing), 0, points)[0]

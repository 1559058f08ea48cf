"""Signed distances to a solid, asked for from the host."""

import numpy as np

from wavetank.device.compiler import current_backend, download, qd, start, upload
from wavetank.device.state import integers, scalars, vectors
from wavetank.solids.distance import SolidSet, lift, signed_distance
from wavetank.solids.shapes import build
from wavetank.solids.solid import Solid

_AT_ONCE = 1 << 22  # points


@qd.kernel(fastcache=True)
def measure_nearest(
    distances: qd.types.ndarray(), numbers: qd.types.ndarray(), points: qd.types.ndarray(), solids: SolidSet,
    first: qd.i32, count: qd.i32,
):  # fmt: skip
    """Write which of the solids from number `first` on is nearest to each point, and how far: negative inside."""
    for i in range(count):
        nearest, number = 1e9, -1
        for k in range(first, solids.count):
            s = signed_distance(solids, k, lift(points[i])).w
            if s < nearest:
                nearest, number = s, k
        distances[i], numbers[i] = nearest, number


def nearest_of(solids: SolidSet, first: int, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return how far the points [n, dim] are from the nearest of the solids from number `first` on, and its number.

    Distances [m] are float32 [n], negative inside, 1e9 where there is no solid; numbers int32 [n], -1 there.
    """
    parts, whose = [np.zeros(0, np.float32)], [np.zeros(0, np.int32)]
    for begin in range(0, len(points), _AT_ONCE):
        part = points[begin : begin + _AT_ONCE]
        places, found, numbers = vectors(points.shape[1], len(part)), scalars(len(part)), integers(len(part))
        upload(places, part.astype(np.float32))
        measure_nearest(found, numbers, places, solids, first, len(part))
        parts.append(download(found)[: len(part)])
        whose.append(download(numbers)[: len(part)])
    return np.concatenate(parts), np.concatenate(whose)


def nearest_distances(solids: list[Solid], points: np.ndarray, spacing: float) -> np.ndarray:
    """Return the distance [m] from the points [n, dim] to the nearest of `solids`, float32 [n]; negative inside.

    Meshes are as fine as for particles of that `spacing` [m]. Without solids everything is 1e9 m away.
    """
    if current_backend() is None:
        start("cpu")
    return nearest_of(build(solids, 0, 0.0, spacing), 0, points)[0]

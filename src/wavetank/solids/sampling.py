"""Signed distances to a solid, asked for from the host."""

import numpy as np

from wavetank.device.compiler import current_backend, download, qd, start, upload
from wavetank.device.state import scalars, vectors
from wavetank.solids.distance import SolidSet, lift, signed_distance
from wavetank.solids.shapes import build
from wavetank.solids.solid import Solid

_AT_ONCE = 1 << 22  # points


@qd.kernel(fastcache=True)
def measure_nearest(distances: qd.types.ndarray(), points: qd.types.ndarray(), solids: SolidSet, count: qd.i32):
    """Write the distance from each point to the nearest of the solids, negative inside of any."""
    for i in range(count):
        nearest = 1e9
        for k in range(solids.count):
            nearest = qd.min(nearest, signed_distance(solids, k, lift(points[i])).w)
        distances[i] = nearest


def nearest_distances(solids: list[Solid], points: np.ndarray, spacing: float) -> np.ndarray:
    """Return the distance [m] from the points [n, dim] to the nearest of `solids`, float32 [n]; negative inside.

    Meshes are as fine as for particles of that `spacing` [m]. Without solids everything is 1e9 m away.
    """
    if current_backend() is None:
        start("cpu")
    device = build(solids, 0, 0.0, spacing)
    parts = [np.zeros(0, np.float32)]
    for first in range(0, len(points), _AT_ONCE):
        part = points[first : first + _AT_ONCE]
        places, found = vectors(points.shape[1], len(part)), scalars(len(part))
        upload(places, part.astype(np.float32))
        measure_nearest(found, places, device, len(part))
        parts.append(download(found)[: len(part)])
    return np.concatenate(parts)

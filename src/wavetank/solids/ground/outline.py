"""Signed distances to an outline in the plane, on a grid as those of meshes (`meshes/grid.py`), exact at its nodes.

The distance at a node is that to the nearest edge, its sign that of the crossings of a ray (even-odd rule). A plane is
two equal layers of nodes, between which the world lies.
"""

import numpy as np

from wavetank.device.compiler import download, qd, upload
from wavetank.device.state import scalars, vectors
from wavetank.foundation.errors import WavetankError
from wavetank.solids.distance import vec2
from wavetank.solids.meshes.grid import REACH
from wavetank.solids.meshes.store import DistanceGrid

CELLS = (4, 3, 2)  # per particle spacing: the first that makes a grid of at most MOST_NODES
MOST_NODES = 4_000_000


@qd.kernel(fastcache=True)
def measure_nodes(distances: qd.types.ndarray(), corners: qd.types.ndarray(), nx: qd.i32, ny: qd.i32, count: qd.i32):
    """Write the distance [cells] from every node to the closed line through `corners`, negative inside."""
    for n in range(nx * ny):
        p = vec2(qd.cast(n % nx, qd.f32), qd.cast(n // nx, qd.f32))
        square, inside = 1e20, 0
        for k in range(count):
            a, b = corners[k], corners[(k + 1) % count]
            way, to = b - a, p - a
            off = to - qd.min(qd.max(to.dot(way) / qd.max(way.dot(way), 1e-20), 0.0), 1.0) * way
            square = qd.min(square, off.dot(off))
            if (a.y > p.y) != (b.y > p.y):
                if p.x < a.x + (p.y - a.y) * way.x / way.y:
                    inside = 1 - inside
        distances[n] = qd.sqrt(square) * (1.0 - 2.0 * inside)


def measure_outline(points: np.ndarray, spacing: float, name: str) -> DistanceGrid:
    """Return the distances to the polygon with the corners `points` [n, 2], m, around the middle of its box.

    Raises `WavetankError` where the grid would be too large for particles of that `spacing` [m].
    """
    edges = np.ptp(points, axis=0)
    for cells in CELLS:
        cell = spacing / cells
        counts = np.ceil(edges / cell) + 2.0 * np.ceil(cells * REACH + 1.0) + 1.0
        if counts.prod() <= MOST_NODES:
            break
    else:
        raise WavetankError(
            f"{name} of {edges[0]:.3g} x {edges[1]:.3g} m at spacing = {spacing:g} m needs a grid of "
            f"{counts.prod():.2g} nodes; at most {MOST_NODES:.2g} are allowed: use a larger spacing."
        )
    nx, ny = map(int, counts)
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    corners, distances = vectors(2, len(points)), scalars(nx * ny)
    upload(corners, ((points - middle) / cell + 0.5 * (counts - 1)).astype(np.float32))
    measure_nodes(distances, corners, nx, ny, len(points))
    layer = (download(distances)[: nx * ny] * np.float32(cell)).reshape(1, ny, nx)
    return DistanceGrid(np.concatenate([layer, layer]), cell)

"""The grids of all meshes of a world, concatenated on the device."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from wavetank.device.compiler import qd, upload
from wavetank.solids.meshes.store import DistanceGrid
from wavetank.solids.solid import GRIDS, Node


def put_grids(nodes: Sequence[Node], spacing: float) -> tuple[list[int], Any, Any]:
    """Return the codes of `nodes`, and `grid` and `samples` of a `SolidSet`; equal meshes share their grid."""
    grids: list[DistanceGrid] = []
    codes = []
    for node in nodes:
        if node.mesh is None:
            codes.append(node.op)
            continue
        grid = node.mesh.grid(spacing)
        if not any(grid is other for other in grids):
            grids.append(grid)
        codes.append(GRIDS + next(k for k, other in enumerate(grids) if grid is other))
    sizes = [1 + grid.distances.size for grid in grids]
    places = qd.ndarray(qd.types.vector(4, qd.i32), shape=(max(len(grids), 1),))
    samples = qd.ndarray(qd.f32, shape=(max(sum(sizes), 1),))
    if grids:
        first = np.cumsum([0, *sizes[:-1]])
        rows = [[at, *grid.distances.shape[::-1]] for at, grid in zip(first, grids, strict=True)]
        upload(places, rows)
        flat = [part for grid in grids for part in ([grid.cell], grid.distances.reshape(-1))]
        upload(samples, np.concatenate(flat))
    return codes, places, samples

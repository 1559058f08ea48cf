"""Grids that were measured before: in this process, and in the user's cache folder."""

import contextlib
import hashlib
import os

import numpy as np

from wavetank.foundation.folders import cache_folder
from wavetank.solids.meshes.grid import DistanceGrid, measure

FORMAT = 1  # counts up when the same mesh would give other distances
_KEPT = 8  # grids in memory
_grids: dict[str, DistanceGrid] = {}


def grid_of(
    points: np.ndarray, faces: np.ndarray, spacing: float, thickness: float | None, key: str, name: str
) -> DistanceGrid:
    """Return the grid of `measure`, from memory or disk where it was made before; `key` names points and faces.

    Where nothing can be kept on disk, nothing is; the folder may be deleted at any time.
    """
    key = hashlib.sha256(f"{FORMAT} {key} {spacing}".encode()).hexdigest()
    if key not in _grids:
        path = cache_folder() / "meshes" / f"{key}.npz"
        grid = None
        with contextlib.suppress(Exception), np.load(path, allow_pickle=False) as file:
            grid = DistanceGrid(file["distances"], float(file["cell"]))
        if grid is None:
            grid = measure(points, faces, spacing, thickness, name)
            partial = path.with_name(f"{key}.{os.getpid()}.partial")
            with contextlib.suppress(OSError):
                path.parent.mkdir(parents=True, exist_ok=True)
                with partial.open("wb") as file:
                    np.savez(file, distances=grid.distances, cell=grid.cell)
                partial.replace(path)
        while len(_grids) >= _KEPT:
            del _grids[next(iter(_grids))]
        _grids[key] = grid
    return _grids[key]

"""Grids that were measured before: in this process, and in the user's cache folder."""

import contextlib
import hashlib
import os
from collections.abc import Callable

import numpy as np

from wavetank.foundation.folders import cache_folder
from wavetank.solids.meshes.grid import DistanceGrid

FORMAT = 1  # counts up when the same mesh would give other distances
_KEPT = 8  # grids in memory
_grids: dict[str, DistanceGrid] = {}


def grid_of(key: str, make: Callable[[], DistanceGrid]) -> DistanceGrid:
    """Return the grid that `make` makes, from memory or disk where it was made before; `key` says all it depends on.

    Where nothing can be kept on disk, nothing is; the folder may be deleted at any time.
    """
    key = hashlib.sha256(f"{FORMAT} {key}".encode()).hexdigest()
    if key not in _grids:
        path = cache_folder() / "meshes" / f"{key}.npz"
        grid = None
        with contextlib.suppress(Exception), np.load(path, allow_pickle=False) as file:
            grid = DistanceGrid(file["distances"], float(file["cell"]))
        if grid is None:
            grid = make()
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

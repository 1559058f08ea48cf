"""Cache of distance grids: in this process, and in the user's cache folder."""

import contextlib
import dataclasses
import hashlib
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np

from wavetank.foundation.atomic_write import atomic_write
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.folders import cache_folder
from wavetank.foundation.input_limits import read_arrays

FORMAT = 2  # counts up when the same mesh would give other distances
_KEPT = 8  # grids in memory


@dataclasses.dataclass(frozen=True)
class DistanceGrid:
    """Signed distances at the nodes of a grid around the origin, negative inside."""

    distances: np.ndarray  # float32 [nz, ny, nx], m
    cell: float  # m


_grids: dict[str, DistanceGrid] = {}


def grid_of(key: str, make: Callable[[], DistanceGrid]) -> DistanceGrid:
    """Return the grid that `make` makes, from memory or disk where it is cached; `key` names all it depends on.

    A folder that cannot be written to is not an error, and it may be deleted at any time.
    """
    key = hashlib.sha256(f"{FORMAT} {key}".encode()).hexdigest()
    if key not in _grids:
        path = cache_folder() / "meshes" / f"{key}.npz"
        grid = _read(path)
        if grid is None:
            grid = make()
            with contextlib.suppress(OSError, WavetankError):
                path.parent.mkdir(parents=True, exist_ok=True)
                with atomic_write(path) as partial, partial.open("wb") as file:
                    np.savez(file, distances=grid.distances, cell=grid.cell)
        while len(_grids) >= _KEPT:
            del _grids[next(iter(_grids))]
        _grids[key] = grid
    return _grids[key]


def _read(path: Path) -> DistanceGrid | None:
    """Return the grid in a file; None where the file is missing, damaged or not a grid."""
    with contextlib.suppress(Exception):
        arrays = read_arrays(path, "grid of distances")
        distances, cell = arrays["distances"], float(arrays["cell"])
        sound = distances.dtype == np.float32 and distances.ndim in (2, 3) and bool(np.isfinite(distances).all())
        if sound and 0.0 < cell < math.inf:
            return DistanceGrid(distances, cell)
    return None

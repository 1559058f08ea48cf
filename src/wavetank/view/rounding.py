"""Solids as pictures have them: edges of meshes and of ground are round over a cell of their grids of distances.

Between the nodes of a grid distances are trilinear, and a sharp edge that runs aslant to the grid is cut by each cell
at another height: it has teeth. A grid whose nodes are the means of those around them has none, and its faces lie where
they lay. The water keeps the distances as they were measured.
"""

import dataclasses
from typing import Any

from wavetank.device.compiler import download, qd
from wavetank.solids.distance import SolidSet
from wavetank.solids.solid import GRIDS


class Rounding:
    """The solids of the last picture, and how they are seen; nothing is computed anew while they are the same."""

    def __init__(self) -> None:
        self._of: SolidSet | None = None
        self._seen: SolidSet | None = None

    def seen(self, solids: SolidSet) -> SolidSet:
        """Return `solids` with rounded grids, or themselves where they have none."""
        if self._seen is None or self._of is not solids:
            ops, grid = download(solids.op), download(solids.grid)
            places = [list(map(int, grid[number])) for number in sorted({*ops[ops >= GRIDS] - GRIDS})]
            self._seen = dataclasses.replace(solids, samples=rounded(solids.samples, places)) if places else solids
            self._of = solids
        return self._seen


def rounded(samples: Any, places: list[list[int]]) -> Any:
    """Return samples as in `SolidSet`, of the grids at these `places`, each averaged along x, y and z."""
    a, b = (qd.ndarray(qd.f32, shape=samples.shape) for _ in range(2))
    a.copy_from(samples)
    for axis in range(3):
        b.copy_from(a)
        for first, nx, ny, nz in places:
            along = (1, nx, nx * ny)[axis]
            average(a, b, first + 1, along, (nx, ny, nz)[axis], nx * ny * nz)
        a, b = b, a
    return a


@qd.kernel(fastcache=True)
def average(a: qd.types.ndarray(), b: qd.types.ndarray(), first: qd.i32, along: qd.i32, nodes: qd.i32, count: qd.i32):
    """Write to `b` the means of `count` nodes of `a` from `first` on and their two neighbours, `along` apart."""
    for k in range(count):
        at = first + k
        place = (k // along) % nodes
        before, after = at, at
        if place > 0:
            before = at - along
        if place < nodes - 1:
            after = at + along
        b[at] = 0.5 * a[at] + 0.25 * (a[before] + a[after])

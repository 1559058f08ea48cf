"""Poses of solids, written to the device in every time step.

Where the host shares its memory each array is written as it is. Elsewhere a copy costs a tenth of a millisecond however
little it is, so that all are copied as one table, which a kernel distributes: notebook/performance.md.
"""

import numpy as np

from wavetank.device.compiler import Mirror, qd, shares_memory
from wavetank.device.state import scalars
from wavetank.solids.distance import SolidSet, vec2, vec3, vec4

#: of `SolidSet`, with the numbers that each solid has
PLACED = {"old_position": 3, "old_rotation": 4, "position": 3, "rotation": 4, "center": 3, "plane": 4, "sweep": 2}


class Placing:
    """The arrays of `PLACED` of one set of solids."""

    def __init__(self, device: SolidSet, count: int) -> None:
        self._device, self._count = device, count
        self._table = None if shares_memory() else scalars(count, sum(PLACED.values()))
        arrays = [getattr(device, name) for name in PLACED] if self._table is None else [self._table]
        self._mirrors = [Mirror(array) for array in arrays]

    def write(self, *values: np.ndarray) -> None:
        """Write one array [solids or fewer, numbers] for each of `PLACED`; the caller has waited for the device."""
        if self._table is None:
            for mirror, rows in zip(self._mirrors, values, strict=True):
                mirror.write(rows)
            return
        table = np.zeros((self._count, sum(PLACED.values())), np.float32)
        column = 0
        for width, rows in zip(PLACED.values(), values, strict=True):
            table[: len(rows), column : column + width] = rows
            column += width
        self._mirrors[0].write(table)
        distribute(self._device, self._table, self._count)


@qd.kernel(fastcache=True)
def distribute(solids: SolidSet, table: qd.types.ndarray(), count: qd.i32):
    """Write the columns of the table to the arrays of `PLACED`, in that order."""
    for s in range(count):
        solids.old_position[s] = vec3(table[s, 0], table[s, 1], table[s, 2])
        solids.old_rotation[s] = vec4(table[s, 3], table[s, 4], table[s, 5], table[s, 6])
        solids.position[s] = vec3(table[s, 7], table[s, 8], table[s, 9])
        solids.rotation[s] = vec4(table[s, 10], table[s, 11], table[s, 12], table[s, 13])
        solids.center[s] = vec3(table[s, 14], table[s, 15], table[s, 16])
        solids.plane[s] = vec4(table[s, 17], table[s, 18], table[s, 19], table[s, 20])
        solids.sweep[s] = vec2(table[s, 21], table[s, 22])

"""Grids over the tank of about a support an edge, each half as fine as the one before.

Nodes are the centres of cells, which divide the tank without remainder; a node's number is x + nx (y + ny z). What is
known at particles goes to the nodes around them, and back, with the weights of linear interpolation, "tents", and at a
wall to the nearest node alone: that is what particle-in-cell methods do (Harlow 1964). How full a cell is, is told with
larger ones (`parcels.py`).
"""

import dataclasses
import math
from typing import Final

import numpy as np

from wavetank.device.compiler import LANES, lanes, qd, threads, worth_sharing
from wavetank.device.state import CoarseGrid, Grid, integers, scalars
from wavetank.solids.distance import lift, vec3

EDGE = 1.0  # of a cell, over the support
PARTS = 4  # of the particles that have sums of their own, where nodes are few
MOST_PARTS = 16  # where they are many: one for each thread, but not more
OPEN_CELLS = 2.0  # beyond an open side of the tank, for the air there
SMALLEST = 8  # cells along an axis that is not halved any more


@qd.func
def coordinates(grid: CoarseGrid, n):
    """Whole coordinates of node `n`."""
    return qd.Vector([n % grid.nx, n // grid.nx % grid.ny, n // (grid.nx * grid.ny)])


@qd.func
def center_of(grid: CoarseGrid, n):
    """Place of node `n` [m], the centre of its cell; on z = 0 in a plane."""
    c = coordinates(grid, n)
    center = vec3((c[0] + 0.5) * grid.dx, (c[1] + 0.5) * grid.dy, (c[2] + 0.5) * grid.dz)
    center += vec3(grid.x0, grid.y0, grid.z0)
    if grid.nz == 1:
        center.z = 0.0
    return center


@qd.func
def in_cells(grid: CoarseGrid, p: qd.template()):
    """The place `p` [m] in cells, whole at nodes; 0 along an axis that the world does not have."""
    point = lift(p) - vec3(grid.x0, grid.y0, grid.z0)
    return vec3(
        point.x / grid.dx - 0.5, point.y / grid.dy - 0.5, point.z / grid.dz - (0.5 if qd.static(p.n == 3) else 0.0)
    )


@qd.func
def ramp(value, first, last):
    """Share from 0, up to `first`, to 1, from `last` on."""
    return qd.min(qd.max((value - first) / (last - first), 0.0), 1.0)


@qd.func
def tents(share, dim: qd.template()):
    """Weights of the corners of a cell, in the order of `corners`, for a place with the coordinates `share` in it."""
    x = qd.Vector([1.0 - share.x, share.x])
    y = qd.Vector([1.0 - share.y, share.y])
    z = qd.Vector([1.0 - share.z, share.z])
    return qd.Vector([x[k & 1] * y[k >> 1 & 1] * z[k >> 2] for k in qd.static(range(2**dim))])


@qd.func
def sizes(grid: CoarseGrid):
    """Numbers of nodes along x, y and z."""
    return qd.Vector([grid.nx, grid.ny, grid.nz])


@qd.func
def on_axis(grid: CoarseGrid, number, axis: qd.template()):
    """A whole coordinate along an axis as that of a node: of the nearest, or of its image where the world repeats."""
    size = sizes(grid)[axis]
    node = number
    if qd.static(grid.repeats >> axis & 1):
        node += qd.select(number < 0, size, qd.select(number >= size, -size, 0))
    return qd.min(qd.max(node, 0), size - 1)


@qd.func
def stride(grid: CoarseGrid, axis: qd.template()):
    """By how much the numbers of neighbours along an axis differ, but across the seam of an axis that repeats."""
    return qd.Vector([1, grid.nx, grid.nx * grid.ny])[axis]


@qd.func
def beside_on(grid: CoarseGrid, n, axis: qd.template(), side: qd.template()):
    """Number of the next node on a `side`, -1 or 1, of node `n` along an axis.

    Beyond the tank it is no node; along an axis that repeats the last one's next is the first.
    """
    following = n + side * stride(grid, axis)
    if qd.static(grid.repeats >> axis & 1):
        last = sizes(grid)[axis] - 1
        if coordinates(grid, n)[axis] == (last if qd.static(side > 0) else 0):
            following = n - side * last * stride(grid, axis)
    return following


@qd.func
def corners(grid: CoarseGrid, low, dim: qd.template()):
    """Numbers of the nodes at the corners of the cell from the whole coordinates `low` on, or of the nearest."""
    # Spelled out, because what vectors the compiler makes of this depends on how it is said, and with it last digits.
    x = qd.Vector([qd.min(qd.max(low[0] + k, 0), grid.nx - 1) for k in qd.static(range(2))])
    y = qd.Vector([qd.min(qd.max(low[1] + k, 0), grid.ny - 1) * grid.nx for k in qd.static(range(2))])
    z = qd.Vector([qd.min(qd.max(low[2] + k, 0), grid.nz - 1) * grid.nx * grid.ny for k in qd.static(range(2))])
    if qd.static(grid.repeats):
        for k in qd.static(range(2)):
            x[k] = on_axis(grid, low[0] + k, 0)
            y[k] = on_axis(grid, low[1] + k, 1) * grid.nx
            z[k] = on_axis(grid, low[2] + k, 2) * grid.nx * grid.ny
    return qd.Vector([x[k & 1] + y[k >> 1 & 1] + z[k >> 2] for k in qd.static(range(2**dim))])


@qd.func
def nearest(grid: CoarseGrid, c):
    """Number of the node with the whole coordinates `c`, or of the nearest."""
    x = qd.min(qd.max(c[0], 0), grid.nx - 1)
    y = qd.min(qd.max(c[1], 0), grid.ny - 1)
    z = qd.min(qd.max(c[2], 0), grid.nz - 1)
    if qd.static(grid.repeats):  # `corners` says why all is said twice
        x, y, z = on_axis(grid, c[0], 0), on_axis(grid, c[1], 1), on_axis(grid, c[2], 2)
    return x + grid.nx * (y + grid.ny * z)


@qd.func
def add_whole(sums: qd.template(), at, amount, alone: qd.template()):
    """Add a whole number; `alone` where no other thread adds to these sums."""
    if qd.static(alone):
        sums[at] = sums[at] + amount
    else:
        qd.atomic_add(sums[at], amount)


@qd.func
def parts_of(grid: CoarseGrid, cells: Grid):
    """Parts in which threads share the particles."""
    return grid.parts if qd.static(grid.alone) else cells.parts


@qd.func
def taken(sums: qd.template(), n, nodes, parts):
    """Sum of all `parts` at node `n`, which are 0 afterwards."""
    total = 0
    for part in range(parts):
        total += sums[part * nodes + n]
        sums[part * nodes + n] = 0
    return total


def new_levels(box: tuple[np.ndarray, np.ndarray], h: float, repeats: int = 0) -> list[CoarseGrid]:
    """Allocate the grid of a tank between the corners `box` [m] and its coarser levels, the finest first.

    Bits of `repeats` say along which axes the world repeats: there all levels have an even number of nodes, as the
    sweeps over every other node need it.
    """
    shape = _shape_of(box, h, repeats)
    levels = [_new_level(shape, box, repeats)]
    while any(_can_halve(n, repeats >> axis & 1) for axis, n in enumerate(shape)):
        shape = [n // 2 if _can_halve(n, repeats >> axis & 1) else n for axis, n in enumerate(shape)]
        levels.append(_new_level(shape, box, repeats))
    return levels


def nodes_of(box: tuple[np.ndarray, np.ndarray], h: float, repeats: int = 0) -> int:
    """Return how many nodes the finest of these grids has, in Python's integers: it may be more than there can be."""
    return math.prod(_shape_of(box, h, repeats))


def _shape_of(box: tuple[np.ndarray, np.ndarray], h: float, repeats: int) -> list[int]:
    lengths = [float(edge) / (EDGE * h) for edge in box[1] - box[0]]
    return [_ring(cells) if repeats >> axis & 1 else _divided(cells) for axis, cells in enumerate(lengths)]


def piece_width() -> int:
    """Return how many nodes of a row a thread takes at once: one of each colour at least (`poisson.py`)."""
    return max(2, lanes())


def sums_of(nodes: int) -> int:
    """Return how many sums each of so many nodes has: on a processor some, so that no thread waits for another."""
    if lanes() == 1:
        return 1
    return max(PARTS, min(threads(), MOST_PARTS)) if worth_sharing(nodes) else PARTS


def _can_halve(n: int, ring: int) -> bool:
    return n % (4 if ring else 2) == 0 and n > SMALLEST


def _divided(cells: float) -> int:
    """Return the number near `cells` that can be halved until `SMALLEST` or less is left."""
    halvings = max(0, math.ceil(math.log2(max(cells, 1.0) / SMALLEST)))
    return max(1, round(cells / 2**halvings)) * 2**halvings


def _ring(cells: float) -> int:
    """Return the even number near `cells` that can be halved until less than twice `SMALLEST`, and even, is left."""
    halvings = max(0, math.floor(math.log2(max(cells, 1.0) / SMALLEST)))
    return max(2, round(cells / 2 ** (halvings + 1))) * 2 ** (halvings + 1)


def _new_level(shape: list[int], box: tuple[np.ndarray, np.ndarray], repeats: int) -> CoarseGrid:
    nx, ny, nz = [*shape, 1][:3]
    edges = [float(edge) / n for edge, n in zip(box[1] - box[0], shape, strict=True)]
    x0, y0, z0 = [*map(float, box[0]), 0.0][:3]
    dx, dy, dz = [*edges, 1.0][:3]
    nodes = nx * ny * nz
    rim = nodes + nx * ny + LANES  # what is beyond the last node is read, and counts nothing
    kinds = {field.name: field.type for field in dataclasses.fields(CoarseGrid)}
    parts = sums_of(nodes)
    of_rows = parts * nodes + 2  # where a row is shorter than three, `parcels.py` adds nothing beyond its end
    sums = {"sums": integers(of_rows), "mass_sums": integers(of_rows), "basin": integers(rim)}
    numbers = (qd.i32, qd.f32, Final[int])
    fields = {name: scalars(rim) for name, kind in kinds.items() if kind not in numbers and name not in sums}
    return CoarseGrid(
        **sums,
        **fields,
        nx=nx,
        ny=ny,
        nz=nz,
        pieces=-(-nx // piece_width()),
        dx=dx,
        dy=dy,
        dz=dz,
        x0=x0,
        y0=y0,
        z0=z0,
        parts=parts,
        alone=int(parts > 1),
        width=piece_width(),
        repeats=repeats,
    )

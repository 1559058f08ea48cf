"""Particles sorted into cells, for whoever needs the neighbours of a particle of a frame.

The view knows a frame and nothing of the solver, so that a frame from a file or from a test is drawn like any other;
its own sort costs a few per cent of a picture. Cells are numbered x + nx (y + ny z) modulo their count for any whole
x, y, z: in a tank each has its own number, in the open two far ones may share one, which only costs distance tests.
Inside a cell particles stand in the order of their ids, so that sums over them repeat bit for bit.
"""

import dataclasses
import math

from wavetank.device.compiler import qd, worth_sharing
from wavetank.device.sums import blocks_of, sort_by
from wavetank.simulation.frame import Frame
from wavetank.solids.distance import lift
from wavetank.view.extent import Extent
from wavetank.view.lens import vec3


@dataclasses.dataclass(frozen=True, eq=False)
class Cells:
    """Cells of one edge length and what is in them."""

    start: qd.types.ndarray()  # i32 [cells + 1]: first particle of each cell, in sorted order
    fill: qd.types.ndarray()  # i32 [cells]: particles placed so far, afterwards 1 where a cell is deep inside
    blocks: qd.types.ndarray()  # i32 [blocks]: partial sums of the scan
    cell: qd.types.ndarray()  # i32 [capacity]: cell of each particle
    order: qd.types.ndarray()  # i32 [capacity]: which particle comes at each sorted place
    x: qd.types.ndarray()  # vec3 [capacity], m: positions in sorted order
    nx: qd.i32
    ny: qd.i32
    nz: qd.i32
    cells: qd.i32
    edge: qd.f32  # m
    own: qd.i32  # 1 where no two cells of the world share a number


def new_cells(frame: Frame, extent: Extent, edge: float) -> Cells:
    """Allocate cells of `edge` [m] for the particles of a frame."""
    capacity = max(int(frame.x.shape[0]), 1)
    limit = max(2 * capacity, 4096)
    sizes = [max(3, math.ceil(float(length) / edge) + 2) for length in extent.upper - extent.lower]
    if frame.scene.tank is None:
        sizes = [max(3, math.ceil(limit ** (1.0 / frame.dim)))] * frame.dim + [1] * (3 - frame.dim)
    own = frame.scene.tank is not None and math.prod(sizes) <= limit
    while math.prod(sizes) > limit and max(sizes) > 3:
        sizes[sizes.index(max(sizes))] = max(3, max(sizes) // 2)
    total = math.prod(sizes)
    start, fill = (qd.ndarray(qd.i32, shape=(n,)) for n in (total + 1, total))
    blocks = qd.ndarray(qd.i32, shape=(blocks_of(total),))
    cell, order = (qd.ndarray(qd.i32, shape=(capacity,)) for _ in range(2))
    x = qd.ndarray(vec3, shape=(capacity,))
    nx, ny, nz = sizes
    return Cells(
        start=start,
        fill=fill,
        blocks=blocks,
        cell=cell,
        order=order,
        x=x,
        nx=nx,
        ny=ny,
        nz=nz,
        cells=total,
        edge=float(edge),
        own=int(own),
    )


def sort(frame: Frame, cells: Cells) -> None:
    """Sort the particles of `frame`."""
    sort_particles(cells, frame.x, frame.id, int(worth_sharing(cells.cells + frame.count)), frame.count)


@qd.func
def cell_number(cells: Cells, c):
    """Number of the cell with the whole coordinates `c`; Python's modulo, never negative."""
    layer = (c[1] + cells.ny * (c[2] % cells.nz)) % (cells.ny * cells.nz)
    return (c[0] + cells.nx * layer) % cells.cells


@qd.kernel(fastcache=True)
def sort_particles(cells: Cells, x: qd.types.ndarray(), id: qd.types.ndarray(), shared: qd.template(), count: qd.i32):
    """Sort particles by cell, and those of a cell by id, and copy their positions: all in one kernel, to load fast.

    All threads count and place where the work is `shared`.
    """
    for i in range(count):
        p = lift(x[i])
        c = qd.Vector([0, 0, 0])
        for k in qd.static(range(x[0].n)):
            # Bounded, because a particle that is not a number must still have a cell.
            c[k] = qd.cast(qd.min(qd.max(qd.floor(p[k] / cells.edge), -1e6), 1e6), qd.i32)
        cells.cell[i] = qd.min(qd.max(cell_number(cells, c), 0), cells.cells - 1)
    sort_by(cells.cell, cells.order, cells.start, cells.fill, cells.blocks, cells.cells, count, shared)
    # Put each cell into the order of ids, and copy the positions.
    for k in range(cells.cells):
        for a in range(cells.start[k] + 1, cells.start[k + 1]):
            moved = cells.order[a]
            key = id[moved]
            b = a - 1
            while b >= cells.start[k] and id[cells.order[b]] > key:
                cells.order[b + 1] = cells.order[b]
                b -= 1
            cells.order[b + 1] = moved
    for a in range(count):
        cells.x[a] = lift(x[cells.order[a]])

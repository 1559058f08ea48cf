"""How much water is around a point: the sum of (1 - q^2)^2 over the particles in the cells next to it."""

import math

import numpy as np

from wavetank.device.compiler import download, qd
from wavetank.view.buffers import Buffers
from wavetank.view.cells import Cells, cell_number
from wavetank.view.lens import vec3
from wavetank.view.shot import Shot
from wavetank.view.water_buffers import water_of


def full_weight(cells: Cells, spacing: float, dim: int) -> float:
    """Sum of the weights over the lattice of full water, as an integral."""
    reach = cells.edge / spacing
    return math.pi / 3.0 * reach**2 if dim == 2 else 32.0 * math.pi / 105.0 * reach**3


def under_water(shot: Shot, buffers: Buffers) -> int:
    """1 if the eye is inside the water, else 0."""
    eye, extent = np.asarray(shot.lens.eye, float), shot.extent
    if shot.frame.dim == 2 or shot.lens.perspective < 0.5 or shot.frame.count == 0:
        return 0
    if np.any(eye < extent.lower - extent.spacing) or np.any(eye > extent.upper + extent.spacing):
        return 0
    cells, found = water_of(buffers, shot).cells, qd.ndarray(qd.f32, shape=(1,))
    weigh(found, cells, shot.lens.eye, shot.frame.dim)
    return int(float(download(found)[0]) > 0.5 * full_weight(cells, extent.spacing, 3))


@qd.func
def whole_place(cells: Cells, at, dim: qd.template()):
    """Whole coordinates of the cell around a point."""
    c = qd.Vector([0, 0, 0])
    for k in qd.static(range(dim)):
        c[k] = qd.cast(qd.floor(at[k] / cells.edge), qd.i32)
    return c


@qd.func
def cell_beside(cells: Cells, c, n, dim: qd.template()):
    """Number of cell `n`, of 9 or 27, of those around the cell with the whole coordinates `c`."""
    near = c + qd.Vector([n % 3 - 1, n // 3 % 3 - 1, 0])
    if qd.static(dim == 3):
        near[2] += n // 9 - 1
    return cell_number(cells, near)


@qd.func
def weight_of(cells: Cells, b, at):
    """Weight of the particle at the sorted place `b` at a point."""
    r = cells.x[b] - at
    w = qd.max(1.0 - r.dot(r) * (1.0 / (cells.edge * cells.edge)), 0.0)
    return w * w


@qd.kernel(fastcache=True)
def weigh(found: qd.types.ndarray(), cells: Cells, at: vec3, dim: qd.template()):
    """Write the sum of the weights around one point to `found`."""
    for k in range(1):
        c, weight = whole_place(cells, at, dim), 0.0
        for n in range(qd.static(27 if dim == 3 else 9)):
            cell = cell_beside(cells, c, n, dim)
            for b in range(cells.start[cell], cells.start[cell + 1]):
                weight += weight_of(cells, b, at)
        found[k] = weight

"""A cut through the water: the quantity on a plane, interpolated from the particles around each of its points.

The value is the mean of the neighbours weighted with (1 - q^2)^2 (Shepard's interpolation); where the weights add up to
less than 0.22 of those of full water, as next to an edge of the tank, there is none.

    code      symbol   meaning                                                  unit
    reach              radius of the neighbourhood, that of the cells           m
    weight             sum of the weights at a point                            1
    share              value between the limits of the quantity                 1
"""

import math

from wavetank.device.compiler import qd
from wavetank.view.buffers import Buffers
from wavetank.view.lens import Lens, ray_direction, ray_origin, vec3, vector, view_ray
from wavetank.view.passes import cells as sorting
from wavetank.view.passes.cells import Cells, cell_number
from wavetank.view.quantities import DEVICE_FUNCTIONS
from wavetank.view.shot import Shot
from wavetank.view.water_buffers import water_of


def prepare(shot: Shot, buffers: Buffers) -> None:
    """Sort the particles into cells."""
    sorting.sort(shot.frame, water_of(buffers, shot).cells)


def draw(shot: Shot, buffers: Buffers) -> None:
    """Lay the cut over the picture where it is nearer than what is there."""
    frame, water, d = shot.frame, water_of(buffers, shot), shot.extent.spacing
    full = full_weight(water.cells.edge / d, frame.dim)
    normal, offset = shot.plane
    low, high = shot.limits
    lay(
        water.cells, frame.x, frame.v, frame.rho, frame.material, shot.lens, frame.dim, shot.quantity, vector(*normal),
        offset, low, 1.0 / (high - low), 0.22 * full, shot.colors, buffers.depth, buffers.surface, buffers.color,
    )  # fmt: skip


def full_weight(reach: float, dim: int) -> float:
    """Sum of (1 - q^2)^2 over the lattice of full water, as an integral; `reach` in spacings."""
    return math.pi / 3.0 * reach**2 if dim == 2 else 32.0 * math.pi / 105.0 * reach**3


@qd.func
def whole_place(cells: Cells, at, dim: qd.template()):
    """Whole coordinates of the cell around a point."""
    c = qd.Vector([0, 0, 0])
    for k in qd.static(range(dim)):
        c[k] = qd.cast(qd.floor(at[k] / cells.edge), qd.i32)
    return c


@qd.func
def weight_at(cells: Cells, at, dim: qd.template()):
    """Sum of the weights at a point."""
    c = whole_place(cells, at, dim)
    weight = 0.0
    scale = 1.0 / (cells.edge * cells.edge)
    for n in range(qd.static(27 if dim == 3 else 9)):
        near = c + qd.Vector([n % 3 - 1, n // 3 % 3 - 1, 0])
        if qd.static(dim == 3):
            near[2] += n // 9 - 1
        cell = cell_number(cells, near)
        for b in range(cells.start[cell], cells.start[cell + 1]):
            r = cells.x[b] - at
            w = qd.max(1.0 - r.dot(r) * scale, 0.0)
            weight += w * w
    return weight


@qd.func
def value_at(
    cells: Cells, x: qd.template(), v: qd.template(), rho: qd.template(), material: qd.template(), at,
    dim: qd.template(), quantity: qd.template(),
):  # fmt: skip
    """(weight, weighted sum of the quantity) at a point."""
    c = whole_place(cells, at, dim)
    weight, total = 0.0, 0.0
    scale = 1.0 / (cells.edge * cells.edge)
    for n in range(qd.static(27 if dim == 3 else 9)):
        near = c + qd.Vector([n % 3 - 1, n // 3 % 3 - 1, 0])
        if qd.static(dim == 3):
            near[2] += n // 9 - 1
        cell = cell_number(cells, near)
        for b in range(cells.start[cell], cells.start[cell + 1]):
            r = cells.x[b] - at
            w = qd.max(1.0 - r.dot(r) * scale, 0.0)
            if w > 0.0:
                i = cells.order[b]
                weight += w * w
                total += w * w * qd.static(DEVICE_FUNCTIONS[quantity])(x[i], v[i], rho[i], material[i])
    return qd.Vector([weight, total])


@qd.kernel(fastcache=True)
def lay(
    cells: Cells, x: qd.types.ndarray(), v: qd.types.ndarray(), rho: qd.types.ndarray(), material: qd.types.ndarray(),
    lens: Lens,
    dim: qd.template(), quantity: qd.template(), normal: vec3, offset: qd.f32, low: qd.f32, scale: qd.f32,
    least: qd.f32, colors: qd.types.ndarray(), depth: qd.types.ndarray(), surface: qd.types.ndarray(),
    color: qd.types.ndarray(),
):  # fmt: skip
    """Colour every pixel whose ray meets the plane within the water."""
    for row, column in qd.ndrange(depth.shape[0], depth.shape[1]):
        ray = view_ray(lens, row, column)
        origin, direction = ray_origin(lens, ray), ray_direction(lens, ray)
        across = normal.dot(direction)
        if qd.abs(across) > 1e-6:
            t = (offset - normal.dot(origin)) / across
            if t > lens.near and t < 1e4 and t < qd.bit_cast(depth[row, column], qd.f32):
                found = value_at(cells, x, v, rho, material, origin + t * direction, dim, quantity)
                if found[0] > least:
                    share = (found[1] / found[0] - low) * scale
                    last = colors.shape[0] - 1
                    entry = qd.cast(qd.min(qd.max(share, 0.0), 1.0) * last + 0.5, qd.i32)
                    depth[row, column] = qd.bit_cast(t, qd.i32)
                    surface[row, column] = -1  # SOLID
                    color[row, column] = colors[qd.min(qd.max(entry, 0), last)]


@qd.kernel(fastcache=True)
def weigh(cells: Cells, at: vec3, dim: qd.template(), found: qd.types.ndarray()):
    """Write the sum of the weights around one point to `found`."""
    for k in range(1):
        found[k] = weight_at(cells, at, dim)

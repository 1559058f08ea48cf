"""A cut through the water: the quantity on a plane, interpolated from the particles around each of its points.

The value is the mean of the neighbours weighted with (1 - q^2)^2 (Shepard's interpolation); where the weights add up to
less than 0.22 of those of full water, as next to an edge of the tank, there is none. Where neighbours are ice, so is
as much of the colour as their share of the weights.

    code      symbol   meaning                                                  unit
    reach              radius of the neighbourhood, that of the cells           m
    weight             sum of the weights at a point                            1
    share              value between the limits of the quantity                 1
"""

import dataclasses

from wavetank.device.compiler import qd
from wavetank.device.state import interned
from wavetank.view.buffers import Buffers, Pixels
from wavetank.view.cells import Cells, sort
from wavetank.view.lens import Lens, ray_direction, ray_origin, vec3, vector, view_ray
from wavetank.view.optics.dyes import ICE, dyed
from wavetank.view.quantities import DEVICE_FUNCTIONS, Coloring, color_of, scalars_of
from wavetank.view.shot import Shot
from wavetank.view.water_buffers import water_of
from wavetank.view.weights import cell_beside, full_weight, weight_of, whole_place


@dataclasses.dataclass(frozen=True, eq=False)
class Plane:
    """Where the water is cut, on the device."""

    normal: vec3  # unit
    offset: qd.f32  # m: from the origin along the normal
    least: qd.f32  # weight of the water that has a value
    ice: qd.i32  # dye of ice; 0 where there is none


def prepare(shot: Shot, buffers: Buffers) -> None:
    """Sort the particles into cells."""
    sort(shot.frame, water_of(buffers, shot).cells)


def draw(shot: Shot, buffers: Buffers) -> None:
    """Draw the cut over the picture where it is nearer than what is there."""
    frame, cells, (normal, offset) = shot.frame, water_of(buffers, shot).cells, shot.plane
    least = 0.22 * full_weight(cells, shot.extent.spacing, frame.dim)
    ice = ICE if frame.frozen_count else 0
    plane = interned(Plane(normal=vector(*normal), offset=offset, least=least, ice=ice))
    draw_slice(
        buffers.pixels,
        frame.x,
        frame.v,
        scalars_of(frame, shot.quantity),
        frame.material,
        frame.frozen if ice else frame.material,
        cells,
        shot.lens,
        plane,
        shot.coloring,
        frame.dim,
        shot.quantity,
    )


@qd.func
def value_at(
    x: qd.template(),
    v: qd.template(),
    scalar: qd.template(),
    material: qd.template(),
    cells: Cells,
    at,
    dim: qd.template(),
    quantity: qd.template(),
):
    """(weight, weighted sum of the quantity) at a point."""
    c = whole_place(cells, at, dim)
    weight, total = 0.0, 0.0
    for n in range(qd.static(27 if dim == 3 else 9)):
        cell = cell_beside(cells, c, n, dim)
        for b in range(cells.start[cell], cells.start[cell + 1]):
            w = weight_of(cells, b, at)
            if w > 0.0:
                i = cells.order[b]
                weight += w
                total += w * qd.static(DEVICE_FUNCTIONS[quantity])(x[i], v[i], scalar[i], material[i])
    return weight, total


@qd.func
def weight_of_ice(frozen: qd.template(), cells: Cells, at, dim: qd.template()):
    """The part of the weight at a point that is ice."""
    c = whole_place(cells, at, dim)
    total = 0.0
    for n in range(qd.static(27 if dim == 3 else 9)):
        cell = cell_beside(cells, c, n, dim)
        for b in range(cells.start[cell], cells.start[cell + 1]):
            w = weight_of(cells, b, at)
            if w > 0.0 and frozen[cells.order[b]] == 1:
                total += w
    return total


@qd.kernel(fastcache=True)
def draw_slice(
    pixels: Pixels,
    x: qd.types.ndarray(),
    v: qd.types.ndarray(),
    scalar: qd.types.ndarray(),
    material: qd.types.ndarray(),
    frozen: qd.types.ndarray(),
    cells: Cells,
    lens: Lens,
    plane: Plane,
    coloring: Coloring,
    dim: qd.template(),
    quantity: qd.template(),
):
    """Colour every pixel whose ray meets the plane within the water."""
    for row, column in qd.ndrange(pixels.depth.shape[0], pixels.depth.shape[1]):
        ray = view_ray(lens, row, column)
        origin, direction = ray_origin(lens, ray), ray_direction(lens, ray)
        across = plane.normal.dot(direction)
        if qd.abs(across) > 1e-6:
            t = (plane.offset - plane.normal.dot(origin)) / across
            if t > lens.near and t < 1e4 and t < qd.bit_cast(pixels.depth[row, column], qd.f32):
                at = origin + t * direction
                weight, total = value_at(x, v, scalar, material, cells, at, dim, quantity)
                if weight > plane.least:
                    pixels.depth[row, column] = qd.bit_cast(t, qd.i32)
                    pixels.surface[row, column] = -1  # SOLID
                    color = color_of(coloring, total / weight)
                    if plane.ice != 0:
                        share = weight_of_ice(frozen, cells, at, dim) / weight
                        color += (dyed(color, plane.ice) - color) * share
                    pixels.color[row, column] = color

"""The water as a level-set field on a grid, and the empty space that rays can skip.

Nodes lie in the middle of boxes of half a spacing, which fill the tank exactly, so that mirroring at a pane mirrors
an index. Two nodes along each axis make a cell; a cell knows its distance to the nearest one that holds a surface.

    code      symbol   meaning                                                        unit
    level     phi      approximate depth below the surface, positive in the water     m
    skip               cells to the nearest one with a surface or a ball in it        1
"""

import dataclasses

from wavetank.device.compiler import qd
from wavetank.view.lens import vec3
from wavetank.view.optics.rays import Box


@dataclasses.dataclass(frozen=True, eq=False)
class Grid:
    """Where the nodes are, on the device."""

    lower: vec3  # m: corner of the grid
    upper: vec3  # m
    box: Box  # both, for rays
    step: vec3  # m: between nodes
    nx: qd.i32  # nodes; even
    ny: qd.i32
    nz: qd.i32
    spacing: qd.f32  # m: of particles
    walled: qd.i32  # 1 where the grid ends at panes, 0 in the open


@dataclasses.dataclass(frozen=True, eq=False)
class Field:
    """The water of one instant, on the device."""

    grid: Grid
    level: qd.types.ndarray()  # f32 [nodes], m
    skip: qd.types.ndarray()  # i32 [cells]


@qd.func
def node_place(grid: Grid, x):
    """Place of a point in units of nodes, whose middles are whole numbers; kept within the grid."""
    q = (x - grid.lower) / grid.step - 0.5
    last = vec3(grid.nx - 1.001, grid.ny - 1.001, grid.nz - 1.001)
    return qd.max(qd.min(q, last), 0.0)


@qd.func
def node_at(grid: Grid, i, j, k):
    """Number of a node."""
    return i + grid.nx * (j + grid.ny * k)


@qd.func
def value_at(values: qd.template(), grid: Grid, x):
    """A field between the eight nodes around a point."""
    q = node_place(grid, x)
    i, j, k = qd.cast(q.x, qd.i32), qd.cast(q.y, qd.i32), qd.cast(q.z, qd.i32)
    u, v, w = q.x - i, q.y - j, q.z - k
    at, up, back = node_at(grid, i, j, k), grid.nx, grid.nx * grid.ny
    a, b = values[at], values[at + 1]
    c, d = values[at + up], values[at + up + 1]
    e, f = values[at + back], values[at + back + 1]
    g, h = values[at + back + up], values[at + back + up + 1]
    ab, cd, ef, gh = a + (b - a) * u, c + (d - c) * u, e + (f - e) * u, g + (h - g) * u
    near, far = ab + (cd - ab) * v, ef + (gh - ef) * v
    return near + (far - near) * w


@qd.func
def downhill(sample: qd.template(), values: qd.template(), grid: Grid, x, reach):
    """Unit vector along the negative gradient of `sample`, by differences over `reach` nodes; zero where it is even."""
    n = vec3(0.0, 0.0, 0.0)
    for axis in range(3):  # one copy of the code to compile
        side = vec3(0.0, 0.0, 0.0)
        for k in qd.static(range(3)):
            side[k] = qd.select(axis == k, reach * grid.step[k], 0.0)
        fall = sample(values, grid, x - side) - sample(values, grid, x + side)
        for k in qd.static(range(3)):
            if axis == k:
                n[k] = fall / grid.step[k]
    return n.normalized(1e-12)


@qd.func
def outward_at(level: qd.template(), grid: Grid, x):
    """Unit normal of the surface out of the water at a point."""
    return downhill(value_at, level, grid, x, 1.0)

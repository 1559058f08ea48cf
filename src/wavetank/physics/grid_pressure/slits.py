"""Slits between water and a solid above it, which are no free surface: such cells count as full, and close.

Half a spacing of air between water and the bottom of a body was a free surface to the grid: the pressure there came
and went from step to step, and pushed a held box with 0.3 to 1.5 times its buoyancy (notebook/calm.md). So a cell below
a roof counts as full where there is water below it, and one that a solid takes a part of where the open ones beside it
are.

A roof faces down. Where any solid that takes room above counted as one, so did the side of a body that leans by a few
degrees: a cell at the waterline beside it was air in one frame and full in the next, water was drawn in and thrown, and
what it pushed was the body (notebook/calm.md, "Roofs and sides"). What is open is told by degrees: nodes crossed a
bound because a body had moved by a hundredth of a spacing.

    code      meaning                                                                         unit
    facing    how far the solid nearest to a node faces down: cosine of its normal's angle    1
    surely    how surely what lacks at a node is a slit                                       1
"""

from wavetank.device.compiler import qd
from wavetank.device.state import CoarseGrid, Coefficients
from wavetank.physics.grid_pressure.coarse_grid import coordinates, nearest, ramp
from wavetank.physics.grid_pressure.thin_walls import shut_towards
from wavetank.solids.distance import vec3


@qd.func
def whole():
    """Room of a node that no solid takes a part of; sums of tents beside walls are nearly one."""
    return 0.97


@qd.func
def mostly():
    """Room of a node that a solid takes so little of that its fill can be told."""
    return 0.75


@qd.func
def openness(grid: CoarseGrid, n):
    """How far a node counts as open, by its room: 0 where a solid takes so much that its fill cannot be told."""
    return ramp(grid.room[n], mostly(), 1.0)


@qd.func
def mostly_open(grid: CoarseGrid, n):
    """How surely a node is open for the most part."""
    return ramp(grid.room[n], mostly() - 0.05, mostly() + 0.05)


@qd.func
def is_water(fill):
    """How surely there is water without air at a node, from 0 to 1, by its fill."""
    return qd.min(qd.max(5.0 * (fill - 0.7), 0.0), 1.0)


@qd.func
def faces_down(grid: CoarseGrid, n, down):
    """How surely the solid nearest to node `n` is a roof: not if it leans by 60 degrees and more, up to 30 it is.

    `down` has the length 1.
    """
    return ramp(grid.facing_x[n] * down.x + grid.facing_y[n] * down.y + grid.facing_z[n] * down.z, 0.5, 0.85)


@qd.func
def below_roof(grid: CoarseGrid, n, c: Coefficients):
    """How surely what lacks at an open node `n` is a slit between water below and a solid above, against gravity."""
    surely = 0.0
    gravity = vec3(c.gravity_x, c.gravity_y, c.gravity_z)
    strength = gravity.norm()
    for axis in qd.static(range(3)):
        if grid.nz > 1 or axis < 2:
            for side in qd.static((-1, 1)):
                place = coordinates(grid, n)
                place[axis] += side
                roof = nearest(grid, place)
                place[axis] -= 2 * side
                water = nearest(grid, place)
                is_above = -side * gravity[axis] > 0.7 * strength
                if is_above and grid.room[roof] < whole() and grid.room[water] >= whole():
                    surely = qd.max(surely, is_water(grid.fill[water]))
    return surely * faces_down(grid, n, gravity / qd.max(strength, 1e-12))


@qd.func
def in_part(grid: CoarseGrid, n):
    """The same for a node whose cell a solid takes a part of: where all open nodes beside it, see `gaps`, are full.

    Where none is open, as below a roof near the face of a cell, those count that are mostly so. What lies behind a thin
    wall is not beside it.
    """
    lacks_open, most_open, lacks_mostly, most_mostly = 0.0, 0.0, 0.0, 0.0
    for axis in qd.static(range(3)):
        if grid.nz > 1 or axis < 2:
            for side in qd.static((-1, 1)):
                place = coordinates(grid, n)
                place[axis] += side
                at = nearest(grid, place)
                if at != n and shut_towards(grid, n, at, axis) == 0:
                    lacks = 1.0 - is_water(grid.gaps[at])
                    is_open = openness(grid, at)
                    lacks_open = qd.max(lacks_open, is_open * lacks)
                    most_open = qd.max(most_open, is_open)
                    is_open = mostly_open(grid, at)
                    lacks_mostly = qd.max(lacks_mostly, is_open * lacks)
                    most_mostly = qd.max(most_mostly, is_open)
    cut = 1.0 - mostly_open(grid, n)
    return most_open - lacks_open + (1.0 - most_open) * (most_mostly - lacks_mostly) * cut


@qd.func
def close_slit(grid: CoarseGrid, n, surely, full):
    """Count node `n` as full, as far as it is `surely` water, and keep what lacks up to `full` in `slope_x`."""
    fill = grid.fill[n]
    grid.slope_x[n] = surely * qd.max(full - fill, 0.0)
    grid.fill[n] = fill + surely * qd.max(1.0 - fill, 0.0)

"""Which share of the room is gaps between rows of particles.

Particles in rows, near in one direction and far in the other, read the density of water at rest where there is less:
the kernel is pointed and counts near ones most. The grid counts the room, so it knows: even the fullest cells around
are less than full. Near a free surface those below are full, so that water at rest is told nothing.

Single cells say little. One of four or eight particles is never quite even, and where the edge of a cell is no whole
number of spacings a lattice has a pattern in it, an alias: tents of r spacings add up to 1 + 2 sinc^2(r) cos(phase),
3.3 % more and less at r = 7/4. Below a level surface there is only the way down to ask, and where a column was less
full than others all the way down, the top row was told that it has gaps: tanks of 21, 35 or 42 spacings never came to
rest (notebook/calm.md, "Tanks of another size"). So three cells count, each with those beside it: a mean of three
leaves (1 + 2 cos(2 pi r)) / 3 of the pattern, a third at 7/4 and an eighth at 1.7.

    code         meaning                                                                 unit
    x, y, z      fill of a node and of those beside it across that axis, their mean      1
"""

from wavetank.device.compiler import qd
from wavetank.device.state import CoarseGrid
from wavetank.physics.grid_pressure.coarse_grid import coordinates, nearest


@qd.func
def across():
    """Share of each node beside, along one of the axes across, in such a mean."""
    return 1.0 / 3.0


@qd.func
def fullest_around(grid: CoarseGrid, x: qd.template(), y: qd.template(), z: qd.template(), n):
    """Mean fill of the fullest three cells in a row, of those that begin at node `n` or beside it."""
    fullest = 0.0
    for axis in qd.static(range(3)):
        for side in qd.static((-1, 1)):
            if grid.nz > 1 or axis < 2:
                place = coordinates(grid, n)
                fills = qd.static((x, y, z)[axis])
                row = qd.Vector.zero(qd.f32, 4)
                for k in qd.static(range(4)):
                    row[k] = fills[nearest(grid, place)]
                    place[axis] += side
                fullest = qd.max(fullest, qd.max(row[0], row[3]) + row[1] + row[2])
    return fullest / 3.0


@qd.func
def gaps_at(grid: CoarseGrid, x: qd.template(), y: qd.template(), z: qd.template(), n, full):
    """How far even the fullest cells around node `n` are from `full`.

    It is 0 near solids, whose room is known roughly, and where there is no water.
    """
    gaps = 0.0
    if qd.min(grid.clear[n], grid.fill[n]) > 0.0:
        gaps = qd.max(full - fullest_around(grid, x, y, z, n), 0.0)
    return gaps

"""The weight of the water, as the faces of the cells let it through.

What gravity moves particles by in a step, less what is carried on, is the same for all. Densities need not tell it, and
beside solids that cut cells they tell it wrong, by a part of the whole weight, which drove water round for ever. So it
goes to the right side of the equation as the faces of the cells count it, and densities are read where particles were
before (`boundary.fall`). The slope of water at rest then fulfils the equation whatever the solids are: a well-balanced
scheme, as Greenberg and Leroux 1996 (10.1137/0733001) have it for shallow water (notebook/calm.md). What particles
weigh among those of another fluid: `own_weight.py`.

    code     meaning                                                                      unit
    way      by which all particles have fallen alike                                     m
    fill     water in the tent of a node, over the room that it has                       1
"""

from wavetank.device.compiler import qd
from wavetank.device.state import CoarseGrid
from wavetank.physics.grid_pressure.coarse_grid import beside_on
from wavetank.physics.grid_pressure.couplings import air_above, has_lid, open_area
from wavetank.physics.grid_pressure.surface import nodes_beyond
from wavetank.physics.grid_pressure.thin_walls import shut_towards
from wavetank.solids.distance import vec3

BORNE = (0.6, 0.9)  # fill of a cell from where to where the grid bears its weight; thin water hardly fills one


@qd.func
def flow_out(grid: CoarseGrid, n, way):
    """Share of a cell that flows out of that of node `n`, where all water moves by the same `way` [m].

    Far from solids, and between two nodes, as much flows in.
    """
    edges = vec3(grid.dx, grid.dy, grid.dz)
    total = 0.0
    for axis in qd.static(range(3)):
        is_between = qd.min(nodes_beyond(grid, n, axis, -1), nodes_beyond(grid, n, axis, 1)) > 0
        if (grid.nz > 1 or axis < 2) and not (is_between and grid.clear[n] > 0.0):
            for side in qd.static((-1, 1)):
                if nodes_beyond(grid, n, axis, side) > 0:
                    m = beside_on(grid, n, axis, side)
                    if qd.min(grid.room[n], grid.room[m]) > 0.0 and shut_towards(grid, n, m, axis) == 0:
                        total += side * open_area(grid, n, m) * way[axis] / edges[axis]
                if qd.static(axis == 1 and side == 1):
                    total += air_above(grid, n, has_lid(way)) * way[axis] / edges[axis]
    return total

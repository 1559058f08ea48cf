"""Where the surface of the water is, by its volume, and how much the grid carries of a particle that sticks out.

The grid's push is the gradient of a smooth pressure. It knows no bump that is shorter than two cells, and carried all
particles of the top layer alike: without weight, a bump stayed where it was, and as particles of a bump that is lifted
move apart, the fill below it even fell and the push there rose. Bumps of the wave length of two cells grew by a tenth
of a spacing in three seconds, an egg carton, until single particles were thrown (notebook/calm.md).

Particles above the place of the top layer at rest, half a spacing below the surface, therefore lose the grid's push, by
a share that grows with their height: what sticks out has weight, rests on its neighbours, and sinks back. Nobody has
more than the grid's push: that would be a layer of light water below a heavy one. Nobody deeper loses any: iterations
between particles would have to carry it, and the top layer would sink by a sixth of a spacing. The bound lies a little
above that place (`push.SUPPORTED`): the top layer lags behind a wave by some hundredths of its height, and a push that
grew with that fed waves.

For that the surface must be known to some hundredths of a spacing, as boxes tell it (`parcels.py`). A crossing of the
fill between two nodes is off by up to a fifth; the sum of the fills on the way to the air is not, because shares add up
to the volume: the height function of the volume of fluid method (Cummins et al. 2005, 10.1016/j.compstruc.2004.08.017).
What three axes say is taken for the distance of a plane that cuts them there.

A node inside of a solid, below one or above one is on no such way. It counted as deep in the water, or as high above
it, and a particle at the waterline beside a body was carried or fell as the body gave that node room or took it, for
which a hundredth of a spacing is enough. Water is level: those nodes are told by the ones beside them.

    code      meaning                                                     unit
    depth     of a node below the surface, above it less than 0           m
    way       along an axis, from a node to the surface                   m
"""

from wavetank.device.compiler import qd
from wavetank.device.state import CoarseGrid
from wavetank.physics.grid_pressure.coarse_grid import beside_on, coordinates, on_axis, sizes
from wavetank.physics.grid_pressure.couplings import air_above, has_lid
from wavetank.physics.grid_pressure.thin_walls import is_beside, shut_towards
from wavetank.solids.distance import vec3


@qd.func
def nodes_beyond(grid: CoarseGrid, n, axis: qd.template(), side: qd.template()):
    """How many nodes there are beyond node `n` on a `side` along an `axis`: all of them where the world repeats."""
    beyond = sizes(grid)[axis]
    if qd.static(not grid.repeats >> axis & 1):
        place = coordinates(grid, n)[axis]
        beyond = place if qd.static(side < 0) else sizes(grid)[axis] - 1 - place
    return beyond


@qd.func
def way_to_air(grid: CoarseGrid, n, axis: qd.template(), side: qd.template(), gravity):
    """Cells from node `n`, in water, to the surface on a `side` along an `axis`; 0 if there is none within three.

    The last cells below the lid of a tank, or below a roof, have no air above them: there the surface is as far as
    these are full, and the farther away the less sure that is (`couplings.air_above`).
    """
    nodes = qd.min(nodes_beyond(grid, n, axis, side), 3)
    total, reached, closed, m = grid.fill[n] - 0.5, 0, 0, n
    for _ in range(nodes):
        ahead = beside_on(grid, m, axis, side)
        if grid.room[ahead] <= 0.0 or shut_towards(grid, m, ahead, axis) == 1:
            closed = 1
            break
        m = ahead
        total += qd.min(grid.fill[m], 1.0)
        reached = 1 if grid.fill[m] < 0.5 else reached
    way = qd.max(total, 1e-3) if reached == 1 else 0.0
    if qd.static(axis == 1 and side == 1):
        if reached == 0 and (closed == 1 or nodes < 3):
            sure = air_above(grid, m, has_lid(gravity))
            if sure > 0.0:
                way = qd.max(total, 1e-3) / qd.sqrt(sure)
    return way


@qd.func
def depth_in_air(grid: CoarseGrid, n, axis: qd.template(), side: qd.template()):
    """Depth [cells] of node `n`, in the air, if there is water at the next node; else one cell above the surface."""
    m = beside_on(grid, n, axis, side) if nodes_beyond(grid, n, axis, side) > 0 else n
    next_to_water = grid.room[m] > 0.0 and grid.fill[m] >= 0.5 and shut_towards(grid, n, m, axis) == 0
    return grid.fill[n] + qd.min(grid.fill[m], 1.0) - 1.5 if next_to_water else -1.0


@qd.func
def depth_at(grid: CoarseGrid, n, gravity):
    """Depth [m] of node `n` below the surface that the volume of the water has, at most three cells.

    `gravity` is a vector of any length.
    """
    edges = vec3(grid.dx, grid.dy, grid.dz)
    deepest = 3.0 * grid.dy
    closeness, depth = 0.0, -1.0  # sum of inverse squares of the ways [1/m^2]; cells
    for axis in qd.static(range(3)):
        if grid.nz > 1 or axis < 2:
            for side in qd.static((-1, 1)):
                if grid.fill[n] >= 0.5:
                    way = way_to_air(grid, n, axis, side, gravity) * edges[axis]
                    closeness += 1.0 / (way * way) if way > 0.0 else 0.0
                else:
                    depth = qd.max(depth, depth_in_air(grid, n, axis, side))
    below = qd.min(deepest, 1.0 / qd.sqrt(closeness)) if closeness > 0.0 else deepest
    found = below if grid.fill[n] >= 0.5 else depth * grid.dy
    return found if grid.room[n] > 0.0 else deepest  # inside of a solid nothing sticks out


@qd.func
def keep_extremes(grid: CoarseGrid, row):
    """Keep the smallest and the largest fill of a row of nodes: in `wx` and `lam`, at the number of the row.

    What is set up, and solved, behind it serves as memory.
    """
    least, most = 1e9, 0.0
    for n in range(grid.nx * row, grid.nx * row + grid.nx):
        least, most = qd.min(least, grid.fill[n]), qd.max(most, grid.fill[n])
    grid.wx[row], grid.lam[row] = least, most


@qd.func
def is_air(grid: CoarseGrid, row):
    """Whether there is no water in a row of nodes nor in those that follow along y and z (`keep_extremes`)."""
    y, z = row % grid.ny, row // grid.ny
    most = qd.max(grid.lam[row], grid.lam[on_axis(grid, y + 1, 1) + grid.ny * z])
    return qd.max(most, grid.lam[y + grid.ny * on_axis(grid, z + 1, 2)]) < 0.5


@qd.func
def find_depths(grid: CoarseGrid, row, gravity):
    """Find the depths of a row of nodes: of each of them only where the air, or the water, is near."""
    y, z = row % grid.ny, row // grid.ny
    least, most = grid.wx[row], grid.lam[row]
    for aside in qd.static((-3, -2, -1, 1, 2, 3)):
        for beside in qd.static(range(2)):
            other = on_axis(grid, y + aside, 1) + grid.ny * z
            if qd.static(beside == 1):
                other = y + grid.ny * on_axis(grid, z + aside, 2)
            least = qd.min(least, grid.wx[other])
            if qd.static(abs(aside) == 1):
                most = qd.max(most, grid.lam[other])
    for n in range(grid.nx * row, grid.nx * row + grid.nx):
        if most < 0.5:
            grid.depth[n] = -grid.dy if grid.room[n] > 0.0 else 3.0 * grid.dy
        elif least >= 0.5 and y + 3 < grid.ny:
            grid.depth[n] = 3.0 * grid.dy
        else:
            grid.depth[n] = depth_at(grid, n, gravity)


@qd.func
def is_below_air(grid: CoarseGrid, n):
    """Whether a way leads from node `n`, or one in the air, to the surface: else its depth is the deepest."""
    return grid.depth[n] < 2.999 * grid.dy


@qd.func
def is_told(grid: CoarseGrid, n):
    """Whether the depth of node `n` is known: a way leads to the surface from there, or no solid is near."""
    found = is_below_air(grid, n) and grid.depth[n] > -0.999 * grid.dy
    return grid.clear[n] > 0.0 or (grid.room[n] > 0.0 and found)


@qd.func
def depth_beside(grid: CoarseGrid, n, gravity):
    """Depth [m] of node `n`, or where a solid is in its way to the surface the mean of the nodes beside it.

    Those lie across `gravity`, a vector of any length. Thin walls have other levels on their other sides.
    """
    total, number = 0.0, 0
    if not is_told(grid, n) and not is_beside(grid, n):
        for axis in qd.static(range(3)):
            if (grid.nz > 1 or axis < 2) and qd.abs(gravity[axis]) <= 0.7 * gravity.norm():
                for side in qd.static((-1, 1)):
                    if nodes_beyond(grid, n, axis, side) > 0:
                        m = beside_on(grid, n, axis, side)
                        if is_told(grid, m) and shut_towards(grid, n, m, axis) == 0:
                            total += grid.depth[m]
                            number += 1
    return total / number if number > 0 else grid.depth[n]


@qd.func
def carried_share(grid: CoarseGrid, at: qd.template(), weights: qd.template(), supported, fade):
    """(share of the grid's push, fill) by the nodes `at` a place: 1 from a depth `supported` on, 0 `fade` above [m]."""
    depth, fill = 0.0, 0.0
    for k in qd.static(range(at.n)):
        depth += weights[k] * grid.depth[at[k]]
        fill += weights[k] * grid.fill[at[k]]
    return qd.Vector([qd.min(qd.max(1.0 + (depth - supported) / fade, 0.0), 1.0), fill])

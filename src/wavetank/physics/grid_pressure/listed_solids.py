"""Which solids are near some nodes of a row: a short list, so that not each place asks each solid of a world.

A list is a vector of whole numbers: how many solids there are, then their numbers in order. Where it is too short for
all that are near, it stands for every solid of the world but the walls of its tank, so that what is found is the same.
"""

from wavetank.device.compiler import qd
from wavetank.device.state import CoarseGrid
from wavetank.physics.grid_pressure.coarse_grid import center_of
from wavetank.solids.distance import SolidSet, image_near, vec3


@qd.func
def solids_near(grid: CoarseGrid, solids: SolidSet, n, nodes, far):
    """List the solids that reach as near as `far` [m] to the centres of so many `nodes` of a row from node `n` on."""
    around = qd.Vector.zero(qd.i32, 17)
    half = 0.5 * (nodes - 1) * grid.dx
    middle = center_of(grid, n) + vec3(half, 0.0, 0.0)
    for k in range(solids.tank_count, solids.count):
        way = image_near(solids, k, middle) - solids.position[k]
        way.x = qd.max(qd.abs(way.x) - half, 0.0)
        if way.norm() < solids.reach[k] + far:
            around[0] += 1
            if around[0] < around.n:
                around[around[0]] = k
    if around[0] >= around.n:
        around[0] = solids.count - solids.tank_count
    return around


@qd.func
def narrowed(solids: SolidSet, around: qd.template(), at, far):
    """List those of the solids listed as `around` that reach as near as `far` [m] to the place `at`."""
    close = around
    if around[0] < around.n:
        close[0] = 0
        for number in range(around[0]):
            k = around[1 + number]
            if (image_near(solids, k, at) - solids.position[k]).norm() < solids.reach[k] + far:
                close[0] += 1
                close[close[0]] = k
    return close


@qd.func
def listed(solids: SolidSet, around: qd.template(), number):
    """Solid that has this `number` in the list `around`."""
    k = solids.tank_count + number
    if around[0] < around.n:
        k = around[1 + number]
    return k

"""Water that no air bounds: a full tank, a bottle with its cap on, the water in a box that lies under water.

Its pressure has no level: the equation there has a solution only if what flows in flows out, all errors of densities
taken together. Where they are not 0 but positive, as for the layers beside walls, sweeps raise the pressure for ever,
the two colours of nodes by turns, and each step was left with a pattern of stripes; coarser levels handed it on to the
water behind the wall. So the mean of such a basin is taken from its errors. Where it is negative there is room that
lacks water, lambda <= 0 leaves it at the top, and all is well. The pressure that is found has any level, and is moved
to the least that it can have.

Air is where a cell is less than half full, by degrees from a quarter of a cell of it on. A sliver that a corner leaves
is told more room than it has, seemed empty, and all of its basin was left as it was: it boiled at 4 m/s.

A basin is room that is connected through open faces. Basins are found by joining rows in a forest, each with the lowest
number of its nodes as its root: that does not depend on the order of threads (Tarjan 1975, "Efficiency of a good but
not linear set union algorithm", 10.1145/321879.321884).

    code     meaning                                                         unit
    basin    number of the first node of the basin that a node belongs to    1
"""

from wavetank.device.compiler import qd
from wavetank.device.state import CoarseGrid
from wavetank.physics.grid_pressure.coarse_grid import beside_on, ramp
from wavetank.physics.grid_pressure.couplings import air_above, open_ahead

MOSTLY_FULL = 0.7  # share of the room that water takes, below which there is air somewhere


@qd.func
def root_of(grid: CoarseGrid, n):
    """Node that stands for all that are joined with node `n` so far."""
    root = n
    while grid.basin[root] != root:
        root = grid.basin[root]
    return root


@qd.func
def join(grid: CoarseGrid, n, m):
    """Make the nodes `n` and `m` belong to one basin; other threads may join nodes meanwhile."""
    a, b = root_of(grid, n), root_of(grid, m)
    while a != b:
        low, high = qd.min(a, b), qd.max(a, b)
        before = qd.atomic_min(grid.basin[high], low)
        a, b = low, low
        if before != high:  # another thread was faster: what it joined has to be joined with this, too
            a, b = root_of(grid, low), root_of(grid, before)


@qd.func
def start_basins(grid: CoarseGrid, row, found: qd.template()):
    """Number the nodes of a row by the first from which faces are open, and count those with room in `found[2]`."""
    begin, open_nodes = grid.nx * row, 0
    for x in range(grid.nx):
        first = begin + x
        if x > 0:
            first = grid.basin[begin + x - 1] if grid.open_x[begin + x - 1] > 0.0 else first
        grid.basin[begin + x] = first
        open_nodes += qd.cast(grid.room[begin + x] > 0.0, qd.i32)
    qd.atomic_add(found[2], open_nodes)


@qd.func
def join_ahead(grid: CoarseGrid, n):
    """Join node `n` with the next along each axis, if the face is open and not those before it in the same way."""
    x = n % grid.nx
    if qd.static(grid.repeats & 1):
        if x == grid.nx - 1 and grid.open_x[n] > 0.0:
            join(grid, n, beside_on(grid, n, 0, 1))
    follows = x > 0
    if follows:
        follows = grid.open_x[n - 1] > 0.0
    for axis in qd.static((1, 2)):
        if open_ahead(grid, n, axis) > 0.0:
            m = beside_on(grid, n, axis, 1)
            joined = follows
            if follows:
                joined = qd.min(grid.open_x[m - 1], open_ahead(grid, n - 1, axis)) > 0.0
            if not joined:
                join(grid, n, m)


@qd.kernel(fastcache=True)
def find_basins(grid: CoarseGrid, found: qd.types.ndarray()):
    """Find to which basin each node belongs, and count in `found` [3] those with room (1) and nodes with room (2)."""
    for row in range(grid.ny * grid.nz):
        start_basins(grid, row, found)
    for n in range(grid.nx * grid.ny * grid.nz):
        join_ahead(grid, n)
    for row in range(grid.ny * grid.nz):
        basins = 0
        for n in range(grid.nx * row, grid.nx * row + grid.nx):
            root = root_of(grid, n)
            basins += qd.cast(root == n and grid.room[n] > 0.0, qd.i32)
            grid.basin[n] = root
        qd.atomic_add(found[1], basins)


@qd.kernel(fastcache=True)
def balance(grid: CoarseGrid, per_error: qd.f32, lid: qd.i32):
    """Take the mean of a basin without air from its right side, where it is positive.

    Sums are of whole multiples of the inverse of `per_error` [m^2], so that the order of threads does not matter. What
    a step finds anew serves as memory, until `move_particles`: `slope_y` says at the root of a basin how surely there
    is air, `slope_z` counts its nodes. `lid` is 1 in a tank that is closed above its water.
    """
    for n in range(grid.nx * grid.ny * grid.nz):
        if grid.basin[n] == n:
            grid.slope_y[n], grid.slope_z[n] = 0.0, 0.0
    for n in range(grid.nx * grid.ny * grid.nz):
        if grid.room[n] > 0.0:
            air = ramp(grid.room[n] * (1.0 - grid.fill[n]), 0.25, 0.5)
            if grid.fill[n] > 0.5:
                air = air_above(grid, n, lid)
            amount = qd.cast(1024.0 * air, qd.i32)
            if amount > grid.sums[grid.basin[n]]:
                qd.atomic_max(grid.sums[grid.basin[n]], amount)
    for n in range(grid.nx * grid.ny * grid.nz):
        if grid.basin[n] == n:
            grid.slope_y[n] = grid.sums[n] / 1024.0
            grid.sums[n] = 0
    for n in range(grid.nx * grid.ny * grid.nz):
        root = grid.basin[n]
        if grid.inverse[n] > 0.0 and grid.slope_y[root] < 1.0:
            qd.atomic_add(grid.sums[root], qd.cast(qd.round(per_error * grid.rhs[n]), qd.i32))
            qd.atomic_add(grid.slope_z[root], 1.0)
    for n in range(grid.nx * grid.ny * grid.nz):
        root = grid.basin[n]
        if grid.inverse[n] > 0.0 and grid.slope_y[root] < 1.0:
            mean = qd.max(grid.sums[root], 0) / (per_error * grid.slope_z[root])
            grid.rhs[n] -= (1.0 - grid.slope_y[root]) * mean
    for n in range(grid.nx * grid.ny * grid.nz):
        if grid.basin[n] == n:
            grid.sums[n] = 0


@qd.kernel(fastcache=True)
def anchor(grid: CoarseGrid):
    """Give a basin without air the least pressure that it can have: 0 where it is least.

    Any other fulfils the equation as well, and what sweeps end at is by chance. A closed body that holds such water
    feels its pressure on all sides, and the more there is of it the more is left of the sum: a bottle was thrown.
    """
    for n in range(grid.nx * grid.ny * grid.nz):
        if grid.basin[n] == n:
            grid.sums[n] = -(1 << 30)
    for n in range(grid.nx * grid.ny * grid.nz):
        root = grid.basin[n]
        if grid.inverse[n] > 0.0 and grid.slope_y[root] < 1.0:
            qd.atomic_max(grid.sums[root], -qd.bit_cast(qd.abs(grid.lam[n]), qd.i32))  # such bits are in order
    for n in range(grid.nx * grid.ny * grid.nz):
        root = grid.basin[n]
        if grid.inverse[n] > 0.0 and grid.slope_y[root] < 1.0:
            least = -qd.bit_cast(-grid.sums[root], qd.f32)
            grid.lam[n] = qd.min(grid.lam[n] - (1.0 - grid.slope_y[root]) * least, 0.0)
    for n in range(grid.nx * grid.ny * grid.nz):
        if grid.basin[n] == n:
            grid.sums[n] = 0

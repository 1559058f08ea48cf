"""Connected open regions, and those that are enclosed: no air bounds their liquid.

A full tank, a bottle with its cap on, the water in a box under water: the equation there has Neumann conditions on all
sides. It has a solution only if the right-hand side is compatible, the errors of the region taken together. Where they
are not 0 but positive, as for the layers beside walls, sweeps raise the pressure without end, the two colours of nodes
alternately, and each step was left with a pattern of stripes. So the mean of an enclosed region is taken from its right
side. Where it is negative there is open volume that lacks liquid, lambda <= 0 leaves it at the top, and all is well.
The null space is fixed by the least pressure that the region can have.

Such a region has no surface: all of its nodes count as full. A sliver that a corner leaves of a cell reads half full
and counted as air, into which all that the errors add up to ran. Air is where a cell is less than half full, softly
from a quarter of a cell of air on: a sliver reads more open volume than it has as well.

Regions are found by joining rows in a forest, each with the lowest number of its nodes as its root, which does not
depend on the order of threads (Tarjan 1975, 10.1145/321879.321884).

    code     meaning                                                         unit
    region   number of the first node of the region that a node belongs to   1
"""

from wavetank.device.compiler import qd
from wavetank.physics.pressure.grid import Level, Workspace, neighbor, ramp
from wavetank.physics.pressure.multigrid import aperture_ahead
from wavetank.physics.pressure.surface import air_above


@qd.func
def root_of(w: Workspace, n):
    """Node that stands for all that are joined with node `n` so far."""
    root = n
    while w.region[root] != root:
        root = w.region[root]
    return root


@qd.func
def join(w: Workspace, n, m):
    """Make the nodes `n` and `m` belong to one region; other threads may join nodes meanwhile."""
    a, b = root_of(w, n), root_of(w, m)
    while a != b:
        low, high = qd.min(a, b), qd.max(a, b)
        before = qd.atomic_min(w.region[high], low)
        a, b = low, low
        if before != high:  # another thread was faster: what it joined has to be joined with this, too
            a, b = root_of(w, low), root_of(w, before)


@qd.func
def start_regions(grid: Level, w: Workspace, row, found: qd.template()):
    """Number the nodes of a row by the first from which faces are open; count those with open volume in `found[2]`."""
    begin, open_nodes = grid.nx * row, 0
    for x in range(grid.nx):
        first = begin + x
        if x > 0:
            first = w.region[begin + x - 1] if grid.aperture_x[begin + x - 1] > 0.0 else first
        w.region[begin + x] = first
        open_nodes += qd.cast(grid.open_volume[begin + x] > 0.0, qd.i32)
    qd.atomic_add(found[2], open_nodes)


@qd.func
def join_ahead(grid: Level, w: Workspace, n):
    """Join node `n` with the next along each axis, if the face is open and not those before it in the same way."""
    x = n % grid.nx
    if qd.static(grid.periodic & 1):
        if x == grid.nx - 1 and grid.aperture_x[n] > 0.0:
            join(w, n, neighbor(grid, n, 0, 1))
    follows = x > 0
    if follows:
        follows = grid.aperture_x[n - 1] > 0.0
    for axis in qd.static((1, 2)):
        if aperture_ahead(grid, n, axis) > 0.0:
            m = neighbor(grid, n, axis, 1)
            joined = follows
            if follows:
                joined = qd.min(grid.aperture_x[m - 1], aperture_ahead(grid, n - 1, axis)) > 0.0
            if not joined:
                join(w, n, m)


@qd.kernel(fastcache=True)
def find_regions(grid: Level, w: Workspace, found: qd.types.ndarray()):
    """Find the region of each node, and count in `found` [3] regions (1) and nodes (2) with open volume."""
    for row in range(grid.ny * grid.nz):
        start_regions(grid, w, row, found)
    for n in range(grid.nx * grid.ny * grid.nz):
        join_ahead(grid, w, n)
    for row in range(grid.ny * grid.nz):
        regions = 0
        for n in range(grid.nx * row, grid.nx * row + grid.nx):
            root = root_of(w, n)
            regions += qd.cast(root == n and grid.open_volume[n] > 0.0, qd.i32)
            w.region[n] = root
        qd.atomic_add(found[1], regions)


@qd.func
def air_in(w: Workspace, root):
    """Confidence that the region with that `root` has air, 0 to 1; below 1 it is enclosed, by degrees."""
    return w.region_air[root] / 1024.0


@qd.kernel(fastcache=True)
def fill_enclosed(grid: Level, w: Workspace, lid: qd.i32):
    """Find how surely each region has air, and count its nodes as liquid where it has none: there is no surface.

    `lid` is 1 in a tank that is closed above its liquid.
    """
    for n in range(grid.nx * grid.ny * grid.nz):
        w.region_air[n] = 0
    for n in range(grid.nx * grid.ny * grid.nz):
        if grid.open_volume[n] > 0.0:
            air = ramp(grid.open_volume[n] * (1.0 - grid.liquid[n]), grid.limits.air_from, grid.limits.air_to)
            if grid.liquid[n] > 0.5:
                air = air_above(grid, n, lid)
            amount = qd.cast(1024.0 * air, qd.i32)
            if amount > w.region_air[w.region[n]]:
                qd.atomic_max(w.region_air[w.region[n]], amount)
    for n in range(grid.nx * grid.ny * grid.nz):
        if grid.open_volume[n] > 0.0:
            lacks = qd.max(grid.limits.borne_to - grid.liquid[n], 0.0)
            grid.liquid[n] += (1.0 - air_in(w, w.region[n])) * lacks


@qd.kernel(fastcache=True)
def make_compatible(grid: Level, w: Workspace, per_error: qd.f32):
    """Take the mean of an enclosed region from its right-hand side, where it is positive.

    Sums are of whole multiples of the inverse of `per_error` [m^2], so that the order of threads does not matter.
    """
    for n in range(grid.nx * grid.ny * grid.nz):
        w.region_error[n], w.region_nodes[n] = 0, 0.0
    for n in range(grid.nx * grid.ny * grid.nz):
        root = w.region[n]
        if grid.inverse_diagonal[n] > 0.0 and air_in(w, root) < 1.0:
            qd.atomic_add(w.region_error[root], qd.cast(qd.round(per_error * grid.rhs[n]), qd.i32))
            qd.atomic_add(w.region_nodes[root], 1.0)
    for n in range(grid.nx * grid.ny * grid.nz):
        root = w.region[n]
        if grid.inverse_diagonal[n] > 0.0 and air_in(w, root) < 1.0:
            mean = qd.max(w.region_error[root], 0) / (per_error * w.region_nodes[root])
            grid.rhs[n] -= (1.0 - air_in(w, root)) * mean


@qd.kernel(fastcache=True)
def fix_null_space(grid: Level, w: Workspace):
    """Shift the multipliers of an enclosed region to the least pressure that it can have: 0 where it is least.

    Any other level fulfils the equation as well, and what sweeps end at is by chance. A closed body that holds such a
    liquid feels its pressure on all sides, and the more of it the more is left of the sum: a bottle was thrown.
    """
    for n in range(grid.nx * grid.ny * grid.nz):
        w.region_least[n] = -(1 << 30)
    for n in range(grid.nx * grid.ny * grid.nz):
        root = w.region[n]
        if grid.inverse_diagonal[n] > 0.0 and air_in(w, root) < 1.0:
            qd.atomic_max(w.region_least[root], -qd.bit_cast(qd.abs(grid.lam[n]), qd.i32))  # such bits are in order
    for n in range(grid.nx * grid.ny * grid.nz):
        root = w.region[n]
        if grid.inverse_diagonal[n] > 0.0 and air_in(w, root) < 1.0:
            least = -qd.bit_cast(-w.region_least[root], qd.f32)
            grid.lam[n] = qd.min(grid.lam[n] - (1.0 - air_in(w, root)) * least, 0.0)

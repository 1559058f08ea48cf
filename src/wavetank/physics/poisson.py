"""The Poisson equation laplace lambda = rhs on the grids of a tank, with lambda <= 0.

At the free surface lambda is 0, at the place between two nodes where the filling is one half (the ghost fluid method,
Gibou et al. 2002, 10.1006/jcph.2001.6977), and nothing flows into solids. The solution on a grid starts from that of
the next coarser one, so that a few sweeps of projected over-relaxation are enough on each. It does not start from the
time step before: pressures that are carried over make water pulse (docs/method.md).

    code    symbol     meaning                                                      unit
    fill    f          water in the tent of a node, over the room that it has       1
    theta              distance of the surface from the water's node, in edges      1
    wx      w          coupling with the next node along x, 1 / (theta dx^2 rho)    1/m^2
    lam     lambda     multiplier                                                   m^2
"""

from wavetank.compiler import current_backend, qd
from wavetank.physics.coarse_grid import coordinates, node
from wavetank.state import CoarseGrid

SWEEPS, COARSEST_SWEEPS = 8, 32  # of a level, and of the coarsest
OVER_RELAXATION = 1.5
LEAST_THETA = 0.1
ZERO, FROM_COARSER, GO_ON = 0, 1, 2  # where a level starts
LARGE = 50_000  # nodes, from where threads gain more than they cost


@qd.func
def coupling(grid: CoarseGrid, n, m, edge, least_theta):
    """What the face between the nodes `n` and `m` couples them with [1/m^2]: 0 into solids and between air and air.

    It is the inverse of the density, that of the heaviest fluid being 1, over the square of the distance.
    """
    a = qd.min(grid.fill[n], 1.0) - 0.5
    b = qd.min(grid.fill[m], 1.0) - 0.5
    theta = 1.0
    if a * b < 0.0:
        theta = qd.max(qd.max(a, b) / qd.abs(a - b), least_theta)
    # Light fluid gives way more: the inverse of the mean density, and of that of the water where there is air.
    density = 0.5 * (grid.density[n] + grid.density[m])
    if a <= 0.0:
        density = grid.density[m]
    if b <= 0.0:
        density = grid.density[n]
    result = 1.0 / (theta * edge * edge * density)
    if (a <= 0.0 and b <= 0.0) or grid.room[n] == 0.0 or grid.room[m] == 0.0:
        result = 0.0
    return result


@qd.func
def relax_node(grid: CoarseGrid, half, colour, over_relaxation):
    """One step of projected over-relaxation, lambda <= 0, at a node of a `colour`, the `half`-th of its colour."""
    row = half // grid.pairs
    y = row % grid.ny
    z = row // grid.ny
    x = half % grid.pairs * 2 + (y + z + colour) % 2
    n = x + grid.nx * row
    if x < grid.nx and grid.inverse[n] > 0.0:
        total = -grid.rhs[n] + grid.wx[n] * grid.lam[n + 1] + grid.wy[n] * grid.lam[n + grid.nx]
        layer = grid.nx * grid.ny
        total += grid.wz[n] * grid.lam[n + layer]
        if x > 0:
            total += grid.wx[n - 1] * grid.lam[n - 1]
        if y > 0:
            total += grid.wy[n - grid.nx] * grid.lam[n - grid.nx]
        if z > 0:
            total += grid.wz[n - layer] * grid.lam[n - layer]
        lam = grid.lam[n]
        grid.lam[n] = qd.min(lam + over_relaxation * (total * grid.inverse[n] - lam), 0.0)


@qd.kernel(fastcache=True)
def solve(
    grid: CoarseGrid, coarser: CoarseGrid, start: qd.i32, sweeps: qd.i32, over_relaxation: qd.f32,
    least_theta: qd.f32, shared: qd.template(),
):  # fmt: skip
    """Set up the Poisson equation and relax it in sweeps of two colours, starting as `start` says.

    One thread does the `sweeps`, or all threads share as many as `shared` says. Nodes outside of the water keep
    lambda = 0. The couplings of faces on the rim of the grid are 0.
    """
    for n in range(grid.nx * grid.ny * grid.nz):
        c = coordinates(grid, n)
        wx, wy, wz, diagonal = 0.0, 0.0, 0.0, 0.0
        if c[0] + 1 < grid.nx:
            wx = coupling(grid, n, n + 1, grid.dx, least_theta)
        if c[1] + 1 < grid.ny:
            wy = coupling(grid, n, n + grid.nx, grid.dy, least_theta)
        if c[2] + 1 < grid.nz:
            wz = coupling(grid, n, n + grid.nx * grid.ny, grid.dz, least_theta)
        grid.wx[n] = wx
        grid.wy[n] = wy
        grid.wz[n] = wz
        inverse, lam = 0.0, 0.0
        if grid.fill[n] > 0.5 and grid.room[n] > 0.0:
            diagonal = wx + wy + wz
            if c[0] > 0:
                diagonal += coupling(grid, n, n - 1, grid.dx, least_theta)
            if c[1] > 0:
                diagonal += coupling(grid, n, n - grid.nx, grid.dy, least_theta)
            if c[2] > 0:
                diagonal += coupling(grid, n, n - grid.nx * grid.ny, grid.dz, least_theta)
            if diagonal > 0.0:
                inverse = 1.0 / diagonal
                if start == 2:  # GO_ON
                    lam = grid.lam[n]
                if start == 1:  # FROM_COARSER
                    fx = grid.nx // coarser.nx
                    fy = grid.ny // coarser.ny
                    fz = grid.nz // coarser.nz
                    lam = coarser.lam[node(coarser, qd.Vector([c[0] // fx, c[1] // fy, c[2] // fz]))]
        grid.inverse[n] = inverse
        grid.lam[n] = lam
    if qd.static(shared):
        for colour in qd.static(range(2 * shared)):
            for half in range(grid.pairs * grid.ny * grid.nz):
                relax_node(grid, half, colour, over_relaxation)
    else:
        # A grid of some thousand nodes is done before other threads have started.
        qd.loop_config(serialize=True)
        for _ in range(1):
            for turn in range(2 * sweeps):
                for half in range(grid.pairs * grid.ny * grid.nz):
                    relax_node(grid, half, turn, over_relaxation)
    for n in range(grid.nx * grid.ny * grid.nz):
        lam = grid.lam[n]
        grid.slope_x[n] = grid.wx[n] * grid.dx * (grid.lam[n + 1] - lam)
        grid.slope_y[n] = grid.wy[n] * grid.dy * (grid.lam[n + grid.nx] - lam)
        grid.slope_z[n] = grid.wz[n] * grid.dz * (grid.lam[n + grid.nx * grid.ny] - lam)


def solve_levels(levels: list[CoarseGrid]) -> None:
    """Solve on all `levels`, the finest first in the list and last in time."""
    coarser = levels[-1]
    for level in reversed(levels):
        is_coarsest = level is coarser
        sweeps = COARSEST_SWEEPS if is_coarsest else SWEEPS
        is_large = current_backend() != "cpu" or level.nx * level.ny * level.nz > LARGE
        start = ZERO if is_coarsest else FROM_COARSER
        solve(level, coarser, start, sweeps, OVER_RELAXATION, LEAST_THETA, SWEEPS if is_large else 0)
        if is_large and is_coarsest:
            for _ in range(COARSEST_SWEEPS // SWEEPS - 1):
                solve(level, coarser, GO_ON, sweeps, OVER_RELAXATION, LEAST_THETA, SWEEPS)
        coarser = level

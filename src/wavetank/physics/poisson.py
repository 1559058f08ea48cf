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

import itertools
import math

from wavetank.compiler import current_backend, qd
from wavetank.distance import vec3
from wavetank.physics.coarse_grid import LARGE, coordinates, node
from wavetank.state import CoarseGrid

SWEEPS, MOST_SWEEPS = 8, 200  # of a level, and of the coarsest
OVER_RELAXATION = 1.5
LEAST_THETA = 0.1
ZERO, FROM_COARSER, GO_ON = 0, 1, 2  # where a level starts


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
def couple_node(grid: CoarseGrid, n, least_theta):
    """Set the couplings of node `n` with the next ones along x, y and z, and what inverts its equation."""
    c = coordinates(grid, n)
    nodes = qd.Vector([grid.nx, grid.ny, grid.nz])
    steps = qd.Vector([1, grid.nx, grid.nx * grid.ny])
    edges = vec3(grid.dx, grid.dy, grid.dz)
    w = vec3(0.0, 0.0, 0.0)
    diagonal = 0.0
    is_water = grid.fill[n] > 0.5 and grid.room[n] > 0.0
    for side in range(6):  # a loop around one copy of the code: the next nodes, then those before
        axis = side % 3
        sign = 1 if side < 3 else -1
        if c[axis] + sign >= 0 and c[axis] + sign < nodes[axis] and (side < 3 or is_water):
            coupled = coupling(grid, n, n + sign * steps[axis], edges[axis], least_theta)
            diagonal += coupled
            if side < 3:
                w[axis] = coupled
    grid.wx[n] = w.x
    grid.wy[n] = w.y
    grid.wz[n] = w.z
    grid.inverse[n] = 1.0 / diagonal if is_water and diagonal > 0.0 else 0.0


@qd.func
def start_node(grid: CoarseGrid, coarser: CoarseGrid, n, start):
    """Set lambda of node `n` to what `start` says; it stays 0 outside of the water."""
    lam = 0.0
    if grid.inverse[n] > 0.0:
        if start == 2:  # GO_ON
            lam = grid.lam[n]
        if start == 1:  # FROM_COARSER
            c = coordinates(grid, n)
            fx = grid.nx // coarser.nx
            fy = grid.ny // coarser.ny
            fz = grid.nz // coarser.nz
            lam = coarser.lam[node(coarser, qd.Vector([c[0] // fx, c[1] // fy, c[2] // fz]))]
    grid.lam[n] = lam


@qd.func
def relax_node(grid: CoarseGrid, pair, row, colour, over_relaxation):
    """One step of projected over-relaxation, lambda <= 0, at the node of that `colour` in a `pair` of a `row`."""
    y = row % grid.ny
    z = row // grid.ny
    x = 2 * pair + (y + z + colour) % 2
    n = x + grid.nx * row
    if x < grid.nx and grid.inverse[n] > 0.0:
        layer = grid.nx * grid.ny
        total = -grid.rhs[n] + grid.wx[n] * grid.lam[n + 1] + grid.wy[n] * grid.lam[n + grid.nx]
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
    shared: qd.template(),
):  # fmt: skip
    """Relax the equation of a level, whose couplings are set, in sweeps of two colours, starting as `start` says.

    One thread does the `sweeps`, or all threads share as many as `shared` says.
    """
    if qd.static(shared):
        for n in range(grid.nx * grid.ny * grid.nz):
            start_node(grid, coarser, n, start)
        for colour in qd.static(range(2 * shared)):
            for half in range(grid.pairs * grid.ny * grid.nz):
                relax_node(grid, half % grid.pairs, half // grid.pairs, colour, over_relaxation)
    else:
        # A grid of some thousand nodes is done before other threads have started.
        qd.loop_config(serialize=True)
        for _ in range(1):
            for n in range(grid.nx * grid.ny * grid.nz):
                start_node(grid, coarser, n, start)
            for turn in range(2 * sweeps):
                for row in range(grid.ny * grid.nz):
                    for pair in range(grid.pairs):
                        relax_node(grid, pair, row, turn, over_relaxation)


@qd.func
def average_node(coarse: CoarseGrid, fine: CoarseGrid, n):
    """Give node `n` of a coarser level the means of the finer nodes that it stands for."""
    c = coordinates(coarse, n)
    fx = fine.nx // coarse.nx
    fy = fine.ny // coarse.ny
    fz = fine.nz // coarse.nz
    room, fill, rhs, density = 0.0, 0.0, 0.0, 0.0
    for k in range(fx * fy * fz):
        m = node(fine, qd.Vector([c[0] * fx + k % fx, c[1] * fy + k // fx % fy, c[2] * fz + k // (fx * fy)]))
        room += fine.room[m]
        fill += fine.fill[m] * fine.room[m]
        rhs += fine.rhs[m] * fine.room[m]
        density += fine.density[m] * fine.fill[m] * fine.room[m]
    coarse.room[n] = room / (fx * fy * fz)
    coarse.density[n] = density / fill if fill > 0.0 else 1.0
    coarse.fill[n] = fill / qd.max(room, 1e-6)
    coarse.rhs[n] = rhs / qd.max(room, 1e-6)


@qd.kernel(fastcache=True)
def restrict(coarse: CoarseGrid, fine: CoarseGrid, least_theta: qd.f32, shared: qd.template()):
    """Set up the equation of a coarser level; `shared` by all threads, or done by one."""
    if qd.static(shared):
        for n in range(coarse.nx * coarse.ny * coarse.nz):
            average_node(coarse, fine, n)
        for n in range(coarse.nx * coarse.ny * coarse.nz):
            couple_node(coarse, n, least_theta)
    else:
        qd.loop_config(serialize=True)
        for _ in range(1):
            for n in range(coarse.nx * coarse.ny * coarse.nz):
                average_node(coarse, fine, n)
            for n in range(coarse.nx * coarse.ny * coarse.nz):
                couple_node(coarse, n, least_theta)


def is_shared(level: CoarseGrid) -> bool:
    """Whether threads gain more on a `level` than they cost; always on a graphics processor."""
    return current_backend() != "cpu" or level.nx * level.ny * level.nz > LARGE


def coarsest_relaxation(level: CoarseGrid) -> tuple[int, float]:
    """Return (sweeps, over-relaxation) that leave about a hundredth of the slowest mode; sweeps in whole `SWEEPS`.

    That is a quarter of a wave along one axis, from a wall to a surface. Where cells are long, their short edges tie
    them together and it takes many sweeps. (Young 1954, "Iterative methods for solving partial difference equations of
    elliptic type", 10.1090/S0002-9947-1954-0059635-7.)
    """
    axes = [
        (n, 1.0 / edge**2) for n, edge in ((level.nx, level.dx), (level.ny, level.dy), (level.nz, level.dz)) if n > 1
    ]
    total = sum(w for _, w in axes)
    slowest = min((w / total * (1.0 - math.cos(0.5 * math.pi / n)) for n, w in axes), default=1.0)
    radius = 1.0 - slowest  # of Jacobi's method
    over_relaxation = 2.0 / (1.0 + math.sqrt(1.0 - radius**2))
    sweeps = SWEEPS * math.ceil(5.0 / SWEEPS / -math.log(max(over_relaxation - 1.0, 0.1)))
    return min(sweeps, MOST_SWEEPS), over_relaxation


def solve_levels(levels: list[CoarseGrid]) -> None:
    """Solve on all `levels`, the finest first in the list and last in time; its couplings and right side are set."""
    for fine, coarse in itertools.pairwise(levels):
        restrict(coarse, fine, LEAST_THETA, int(is_shared(coarse)))
    coarsest = coarser = levels[-1]
    for level in reversed(levels):
        start, sweeps, over_relaxation = FROM_COARSER, SWEEPS, OVER_RELAXATION
        if level is coarsest:
            start = ZERO
            sweeps, over_relaxation = coarsest_relaxation(level)
        if is_shared(level):
            for _ in range(sweeps // SWEEPS):
                solve(level, coarser, start, sweeps, over_relaxation, SWEEPS)
                start = GO_ON
        else:
            solve(level, coarser, start, sweeps, over_relaxation, 0)
        coarser = level

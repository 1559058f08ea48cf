"""The Poisson equation laplace lambda = rhs on the grids of a tank, with lambda <= 0.

At the free surface lambda is 0 (the ghost fluid method, Gibou et al. 2002, 10.1006/jcph.2001.6977): as far from a node
in the water as the water of its cell and of the next one reaches (`surface.py`; notebook/calm.md). Nothing flows
into solids. The solution on a grid starts from that of the next coarser one, linearly between its nodes, so that a few
sweeps of projected over-relaxation are enough on each. It does not start from the time step before: pressures that are
carried over make water pulse (notebook/solver.md). What nodes are coupled with: `couplings.py`.
"""

import itertools
import math

from wavetank.device.compiler import current_backend, qd
from wavetank.device.state import CoarseGrid
from wavetank.physics.grid_pressure.block import block_threads, in_block, is_shared, wait_for_block
from wavetank.physics.grid_pressure.coarse_grid import nearest
from wavetank.physics.grid_pressure.couplings import (
    LEAST_THETA,
    open_towards,
    restrict,
    restrict_in_block,
    restrict_room,
)

SWEEPS, MOST_SWEEPS = 8, 200  # at once, and of the coarsest level
ON_EACH = (2 * SWEEPS, 1.7)  # sweeps of a level and their relaxation: eight leave what drives calm water round


@qd.func
def start_at_zero():
    """A level starts at 0."""
    return 0


@qd.func
def start_from_coarser():
    """A level starts at what the coarser one has found."""
    return 1


@qd.func
def start_where_it_was():
    """A level goes on."""
    return 2


ZERO, FROM_COARSER, GO_ON = (start.fn() for start in (start_at_zero, start_from_coarser, start_where_it_was))


@qd.func
def interpolated(coarser: CoarseGrid, c, halved):
    """Value at the node `c` of the next finer level between those of a `coarser` one, linear along each axis.

    Axes that are not `halved` have as many nodes on both. Beyond solids and the rim of the tank it is even, and so it
    is where no water flows from one node to the other.
    """
    at = c >> halved
    own = coarser.lam[at[0] + coarser.nx * (at[1] + coarser.ny * at[2])]
    found = own
    for axis in qd.static(range(3)):
        if halved[axis] == 1:
            place = at
            place[axis] += 2 * (c[axis] & 1) - 1
            m = nearest(coarser, place)
            if open_towards(coarser, at, m, axis, c[axis] & 1) > 0.0:
                found += 0.25 * (coarser.lam[m] - own)
    return qd.min(found, 0.0)


@qd.func
def start_nodes(grid: CoarseGrid, coarser: CoarseGrid, row, first, last, start):
    """Set lambda of the nodes of a `row` from x = `first` to `last` to what `start` says; 0 outside of the water."""
    halved = qd.Vector([grid.nx // coarser.nx - 1, grid.ny // coarser.ny - 1, grid.nz // coarser.nz - 1])
    c = qd.Vector([0, row % grid.ny, row // grid.ny])
    for x in range(first, last):
        n = grid.nx * row + x
        lam = 0.0
        if grid.inverse[n] > 0.0:
            if start == start_where_it_was():
                lam = grid.lam[n]
            if start == start_from_coarser():
                c[0] = x
                lam = interpolated(coarser, c, halved)
        grid.lam[n] = lam


@qd.func
def relax_nodes(grid: CoarseGrid, row, first, last, over_relaxation):
    """One step of projected over-relaxation, lambda <= 0, at every other node of a `row` from x = `first` to `last`.

    What a node is coupled with beyond the tank stands in the rim of the arrays, and is 0. Along axes that repeat the
    numbers of nodes are even, so that colours alternate across the seam as well.
    """
    begin, layer, rim = grid.nx * row, grid.nx * grid.ny, grid.nx * grid.ny * grid.nz
    y, z = row % grid.ny, row // grid.ny
    before_y = begin - grid.nx if y > 0 else rim
    before_z = begin - layer if row >= grid.ny else rim
    after_y, after_z = begin + grid.nx if y + 1 < grid.ny else rim, begin + layer
    if qd.static(grid.repeats & 2):
        before_y = before_y if y > 0 else begin + (grid.ny - 1) * grid.nx
        after_y = begin + grid.nx if y + 1 < grid.ny else begin - y * grid.nx
    if qd.static(grid.repeats & 4):
        before_z = before_z if z > 0 else begin + (grid.nz - 1) * layer
        after_z = after_z if z + 1 < grid.nz else begin - z * layer
    for k in range((last - first + 1) // 2):
        x = first + 2 * k
        n = begin + x
        if grid.inverse[n] > 0.0:
            after_x = n + 1
            if qd.static(grid.repeats & 1):
                after_x = n + 1 if x + 1 < grid.nx else begin
            total = grid.wx[n] * grid.lam[after_x] - grid.rhs[n]
            total += grid.wy[n] * grid.lam[after_y + x] + grid.wy[before_y + x] * grid.lam[before_y + x]
            total += grid.wz[n] * grid.lam[after_z + x] + grid.wz[before_z + x] * grid.lam[before_z + x]
            if x > 0:
                total += grid.wx[n - 1] * grid.lam[n - 1]
            elif qd.static(grid.repeats & 1):
                total += grid.wx[begin + grid.nx - 1] * grid.lam[begin + grid.nx - 1]
            lam = grid.lam[n]
            grid.lam[n] = qd.min(lam + over_relaxation * (total * grid.inverse[n] - lam), 0.0)


@qd.func
def mark_water(grid: CoarseGrid, at, row, first, last):
    """Mark the place `at` where nodes of a `row` from x = `first` to `last` have water, for `has_water`.

    What `move_particles` finds anew serves as memory.
    """
    grid.slope_x[at] = 0.0
    for n in range(grid.nx * row + first, grid.nx * row + last):
        if grid.inverse[n] > 0.0:
            grid.slope_x[at] = 1.0


@qd.func
def has_water(grid: CoarseGrid, at):
    """Whether nodes that are marked at the place `at` have water: half of most tanks is air, and needs no sweeps."""
    return grid.slope_x[at] > 0.0


@qd.func
def start_piece(grid: CoarseGrid, coarser: CoarseGrid, piece, start):
    """Set lambda of `width` nodes of a row to what `start` says, and mark whether they have water."""
    first = piece % grid.pieces * grid.width
    last = qd.min(first + grid.width, grid.nx)
    start_nodes(grid, coarser, piece // grid.pieces, first, last, start)
    mark_water(grid, piece, piece // grid.pieces, first, last)


@qd.func
def relax_piece(grid: CoarseGrid, piece, colour, over_relaxation):
    """Relax those of `width` nodes of a row that have a `colour`."""
    if has_water(grid, piece):
        row = piece // grid.pieces
        first = piece % grid.pieces * grid.width
        x = first + (row % grid.ny + row // grid.ny + colour) % 2
        relax_nodes(grid, row, x, qd.min(first + grid.width, grid.nx), over_relaxation)


@qd.kernel(fastcache=True)
def solve(
    grid: CoarseGrid, coarser: CoarseGrid, start: qd.i32, sweeps: qd.i32, over_relaxation: qd.f32, shared: qd.template()
):
    """Relax the equation of a level, whose couplings are set, in sweeps of two colours, starting as `start` says.

    One thread does the `sweeps`, or all threads share as many as `shared` says, `width` nodes of a row at once.
    """
    if qd.static(shared):
        for piece in range(grid.pieces * grid.ny * grid.nz):
            start_piece(grid, coarser, piece, start)
        for colour in qd.static(range(2 * shared)):
            for piece in range(grid.pieces * grid.ny * grid.nz):
                relax_piece(grid, piece, colour, over_relaxation)
    else:
        # A grid of some thousand nodes is done before other threads have started.
        qd.loop_config(serialize=True)
        for _ in range(1):
            for row in range(grid.ny * grid.nz):
                start_nodes(grid, coarser, row, 0, grid.nx, start)
                mark_water(grid, row, row, 0, grid.nx)
            for colour in range(2 * sweeps):
                for row in range(grid.ny * grid.nz):
                    if has_water(grid, row):
                        first = (row % grid.ny + row // grid.ny + colour) % 2
                        relax_nodes(grid, row, first, grid.nx, over_relaxation)


@qd.kernel(fastcache=True)
def solve_in_block(
    grid: CoarseGrid, coarser: CoarseGrid, start: qd.i32, sweeps: qd.i32, over_relaxation: qd.f32, fenced: qd.template()
):
    """Do what `solve` does, in one launch on a graphics processor: its threads wait for each other after each colour.

    Only those of a block can, so that this is for levels of some thousand nodes.
    """
    qd.loop_config(block_dim=block_threads())
    for thread in range(block_threads()):
        pieces = grid.pieces * grid.ny * grid.nz
        piece = thread
        while piece < pieces:
            start_piece(grid, coarser, piece, start)
            piece += block_threads()
        wait_for_block(fenced)
        for colour in range(2 * sweeps):
            piece = thread
            while piece < pieces:
                relax_piece(grid, piece, colour, over_relaxation)
                piece += block_threads()
            wait_for_block(fenced)


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


def restrict_rooms(levels: list[CoarseGrid]) -> None:
    """Let all `levels` know which room the solids leave on the finest one, the first in the list."""
    for fine, coarse in itertools.pairwise(levels):
        restrict_room(coarse, fine, int(is_shared(coarse)))


def solve_levels(levels: list[CoarseGrid], lid: int = 0) -> None:
    """Solve on all `levels`, the finest first in the list and last in time; its couplings and right side are set.

    They know their rooms (`restrict_rooms`). `lid` is 1 in a tank that is closed above its water, else 0.
    """
    fenced = int(current_backend() != "cuda")
    for fine, coarse in itertools.pairwise(levels):
        if in_block(coarse):
            restrict_in_block(coarse, fine, LEAST_THETA, lid, fenced)
        else:
            restrict(coarse, fine, LEAST_THETA, lid, int(is_shared(coarse)))
    coarsest = coarser = levels[-1]
    for level in reversed(levels):
        start = FROM_COARSER
        sweeps, over_relaxation = ON_EACH
        if level is coarsest:
            start = ZERO
            sweeps, over_relaxation = coarsest_relaxation(level)
        if in_block(level):
            solve_in_block(level, coarser, start, sweeps, over_relaxation, fenced)
        elif is_shared(level):
            for _ in range(sweeps // SWEEPS):
                solve(level, coarser, start, sweeps, over_relaxation, SWEEPS)
                start = GO_ON
        else:
            solve(level, coarser, start, sweeps, over_relaxation, 0)
        coarser = level

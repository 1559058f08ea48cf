"""The Poisson equation laplace lambda = rhs on the grids of a tank, with lambda <= 0.

At the free surface lambda is 0 (the ghost fluid method, Gibou et al. 2002, 10.1006/jcph.2001.6977): as far from a node
in the water as the water of its cell and of the next one reaches (`surface.py`; docs/notebook/calm.md). Nothing flows
into solids. The solution on a grid starts from that of the next coarser one, linearly between its nodes, so that a few
sweeps of projected over-relaxation are enough on each. It does not start from the time step before: pressures that are
carried over make water pulse (docs/notebook/solver.md).

    code    symbol     meaning                                                      unit
    fill    f          water in the tent of a node, over the room that it has       1
    theta              distance of the surface from the water's node, in edges      1
    wx      w          coupling with the next node along x, A / (theta dx^2 rho)    1/m^2
            A          open share of the face between them                          1
    lam     lambda     multiplier                                                   m^2
"""

import itertools
import math

from wavetank.device.compiler import current_backend, qd, worth_sharing
from wavetank.device.state import CoarseGrid
from wavetank.physics.grid_pressure.coarse_grid import coordinates, nearest

SWEEPS, MOST_SWEEPS = 8, 200  # at once, and of the coarsest level
ON_EACH = (2 * SWEEPS, 1.7)  # sweeps of a level and their relaxation: eight leave what drives calm water round
LEAST_THETA = 0.01  # what is less slants the pressure along a surface that lies at nodes: docs/notebook/calm.md
BLOCK_NODES = 8192  # at most, of a level that one block of a graphics processor sees to


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
def block_threads():
    """Threads of a block of a graphics processor that see to a level."""
    return 512


@qd.func
def open_area(grid: CoarseGrid, n, m):
    """Share of the face between the nodes `n` and `m` that is open, if both have room.

    A face towards a whole cell is open as a whole, one between two that a wall cuts as much as they are.
    """
    return qd.min(qd.max(grid.room[n], grid.room[m]), 1.0)


@qd.func
def coupling(grid: CoarseGrid, n, m, share, edge, least_theta):
    """What a face between the nodes `n` and `m`, of which a `share` is open, couples them with [1/m^2].

    It is 0 between air and air, else the inverse of the density, that of the heaviest fluid being 1, over the square
    of the distance.
    """
    a = qd.min(grid.fill[n], 1.0) - 0.5
    b = qd.min(grid.fill[m], 1.0) - 0.5
    theta = qd.select(a * b < 0.0, qd.min(qd.max(a + b + 0.5, least_theta), 1.0), 1.0)
    # Light fluid gives way more: the inverse of the mean density, and of that of the water where there is air.
    mean = 0.5 * (grid.density[n] + grid.density[m])
    density = qd.select(a <= 0.0, grid.density[m], qd.select(b <= 0.0, grid.density[n], mean))
    is_open = qd.min(qd.max(a, b), share) > 0.0
    return qd.select(is_open, share / qd.max(theta * edge * edge * density, 1e-12), 0.0)


@qd.func
def couple_nodes(grid: CoarseGrid, piece, least_theta):
    """Set the couplings of `width` nodes of a row with the next ones along x, y and z, and what inverts their equation.

    The rim of the arrays, where there is no room, stands for what is beyond the tank.
    """
    first = piece % grid.pieces * grid.width
    row = piece // grid.pieces
    y = row % grid.ny
    z = row // grid.ny
    begin, layer, rim = grid.nx * row, grid.nx * grid.ny, grid.nx * grid.ny * grid.nz
    over_x = begin if qd.static(grid.repeats & 1) else rim
    under_x = begin + grid.nx - 1 if qd.static(grid.repeats & 1) else rim
    over_y = begin - y * grid.nx if qd.static(grid.repeats & 2) else rim
    under_y = begin + (grid.ny - 1) * grid.nx if qd.static(grid.repeats & 2) else rim
    over_z = begin - z * layer if qd.static(grid.repeats & 4) else rim
    under_z = begin + (grid.nz - 1) * layer if qd.static(grid.repeats & 4) else rim
    after_y = begin + grid.nx if y + 1 < grid.ny else over_y
    before_y = begin - grid.nx if y > 0 else under_y
    after_z = begin + layer if z + 1 < grid.nz else over_z
    before_z = begin - layer if z > 0 else under_z
    found = qd.Matrix.zero(qd.f32, 4, grid.width)
    for lane in range(grid.width):
        x = first + lane
        n = begin + x
        before = qd.Vector([qd.select(x > 0, n - 1, under_x), before_y + x, before_z + x])
        wx = coupling(grid, n, qd.select(x + 1 < grid.nx, n + 1, over_x), grid.open_x[n], grid.dx, least_theta)
        wy = coupling(grid, n, after_y + x, grid.open_y[n], grid.dy, least_theta)
        wz = coupling(grid, n, after_z + x, grid.open_z[n], grid.dz, least_theta)
        diagonal = wx + wy + wz
        diagonal += coupling(grid, n, before.x, grid.open_x[before.x], grid.dx, least_theta)
        diagonal += coupling(grid, n, before.y, grid.open_y[before.y], grid.dy, least_theta)
        diagonal += coupling(grid, n, before.z, grid.open_z[before.z], grid.dz, least_theta)
        is_water = qd.min(grid.fill[n] - 0.5, qd.min(grid.room[n], diagonal)) > 0.0
        found[0, lane] = wx
        found[1, lane] = wy
        found[2, lane] = wz
        found[3, lane] = qd.select(is_water, 1.0 / qd.max(diagonal, 1e-12), 0.0)
    for lane in range(qd.min(grid.width, grid.nx - first)):
        n = begin + first + lane
        grid.wx[n] = found[0, lane]
        grid.wy[n] = found[1, lane]
        grid.wz[n] = found[2, lane]
        grid.inverse[n] = found[3, lane]


@qd.func
def open_towards(grid: CoarseGrid, c, m, axis: qd.template(), ahead):
    """Share that is open of the face from the node `c` to the next one along an axis, or if not `ahead` from `m`."""
    n = qd.select(ahead == 1, c[0] + grid.nx * (c[1] + grid.ny * c[2]), m)
    share = grid.open_z[n]
    if qd.static(axis == 0):
        share = grid.open_x[n]
    elif qd.static(axis == 1):
        share = grid.open_y[n]
    return share


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
    after_y, after_z = begin + grid.nx, begin + layer
    if qd.static(grid.repeats & 2):
        before_y = before_y if y > 0 else begin + (grid.ny - 1) * grid.nx
        after_y = after_y if y + 1 < grid.ny else begin - y * grid.nx
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
def start_piece(grid: CoarseGrid, coarser: CoarseGrid, piece, start):
    """Set lambda of `width` nodes of a row to what `start` says."""
    first = piece % grid.pieces * grid.width
    start_nodes(grid, coarser, piece // grid.pieces, first, qd.min(first + grid.width, grid.nx), start)


@qd.func
def relax_piece(grid: CoarseGrid, piece, colour, over_relaxation):
    """Relax those of `width` nodes of a row that have a `colour`."""
    row = piece // grid.pieces
    first = piece % grid.pieces * grid.width
    x = first + (row % grid.ny + row // grid.ny + colour) % 2
    relax_nodes(grid, row, x, qd.min(first + grid.width, grid.nx), over_relaxation)


@qd.kernel(fastcache=True)
def solve(
    grid: CoarseGrid, coarser: CoarseGrid, start: qd.i32, sweeps: qd.i32, over_relaxation: qd.f32,
    shared: qd.template(),
):  # fmt: skip
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
            for colour in range(2 * sweeps):
                for row in range(grid.ny * grid.nz):
                    relax_nodes(grid, row, (row % grid.ny + row // grid.ny + colour) % 2, grid.nx, over_relaxation)


@qd.func
def wait_for_block(fenced: qd.template()):
    """Wait until all threads of the block are here; what they wrote is read from here on.

    On CUDA that is what the barrier means, elsewhere it must be said, so that waits are `fenced`.
    """
    if qd.static(fenced):
        qd.simt.grid.mem_fence()
    qd.simt.block.sync()
    if qd.static(fenced):
        qd.simt.grid.mem_fence()


@qd.kernel(fastcache=True)
def solve_in_block(
    grid: CoarseGrid, coarser: CoarseGrid, start: qd.i32, sweeps: qd.i32, over_relaxation: qd.f32,
    fenced: qd.template(),
):  # fmt: skip
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


@qd.func
def open_through(fine: CoarseGrid, c, ratio, axis: qd.template()):
    """Share that is open of the face of a coarser node `c` to the next one, by those of the nodes that it stands for.

    It is shut as well where a wall parts these nodes from each other.
    """
    last, shut = 0.0, 0.0
    size = ratio[0] * ratio[1] * ratio[2] // ratio[axis]
    for k in range(ratio[0] * ratio[1] * ratio[2]):
        way = qd.Vector([k % ratio[0], k // ratio[0] % ratio[1], k // (ratio[0] * ratio[1])])
        place = c * ratio + way
        n = place[0] + fine.nx * (place[1] + fine.ny * place[2])
        share = qd.Vector([fine.open_x[n], fine.open_y[n], fine.open_z[n]])[axis]
        after = place
        after[axis] += 1
        if way[axis] == ratio[axis] - 1:
            last += share
        elif share == 0.0 and qd.min(fine.room[n], fine.room[nearest(fine, after)]) > 0.0:
            shut += 1.0
    return qd.select(2.0 * shut >= size, 0.0, last / size)


@qd.func
def average_node(coarse: CoarseGrid, fine: CoarseGrid, n):
    """Give node `n` of a coarser level the means of the finer nodes that it stands for."""
    c = coordinates(coarse, n)
    ratio = qd.Vector([fine.nx // coarse.nx, fine.ny // coarse.ny, fine.nz // coarse.nz])
    room, fill, rhs, density = 0.0, 0.0, 0.0, 0.0
    for z in range(c[2] * ratio[2], c[2] * ratio[2] + ratio[2]):
        for y in range(c[1] * ratio[1], c[1] * ratio[1] + ratio[1]):
            row = fine.nx * (y + fine.ny * z)
            for m in range(row + c[0] * ratio[0], row + c[0] * ratio[0] + ratio[0]):
                room += fine.room[m]
                fill += fine.fill[m] * fine.room[m]
                rhs += fine.rhs[m]
                density += fine.density[m] * fine.fill[m] * fine.room[m]
    coarse.open_x[n] = open_through(fine, c, ratio, 0)
    coarse.open_y[n] = open_through(fine, c, ratio, 1)
    coarse.open_z[n] = open_through(fine, c, ratio, 2)
    size = ratio[0] * ratio[1] * ratio[2]
    coarse.room[n] = room / size
    coarse.density[n] = density / fill if fill > 0.0 else 1.0
    coarse.fill[n] = fill / qd.max(room, 1e-6)
    coarse.rhs[n] = rhs / size


@qd.kernel(fastcache=True)
def restrict(coarse: CoarseGrid, fine: CoarseGrid, least_theta: qd.f32, shared: qd.template()):
    """Set up the equation of a coarser level; `shared` by all threads, or done by one."""
    qd.loop_config(serialize=not shared)
    for n in range(coarse.nx * coarse.ny * coarse.nz):
        average_node(coarse, fine, n)
    qd.loop_config(serialize=not shared)
    for piece in range(coarse.pieces * coarse.ny * coarse.nz):
        couple_nodes(coarse, piece, least_theta)


@qd.kernel(fastcache=True)
def restrict_in_block(coarse: CoarseGrid, fine: CoarseGrid, least_theta: qd.f32, fenced: qd.template()):
    """Do what `restrict` does, in one launch of one block on a graphics processor."""
    qd.loop_config(block_dim=block_threads())
    for thread in range(block_threads()):
        n = thread
        while n < coarse.nx * coarse.ny * coarse.nz:
            average_node(coarse, fine, n)
            n += block_threads()
        wait_for_block(fenced)
        piece = thread
        while piece < coarse.pieces * coarse.ny * coarse.nz:
            couple_nodes(coarse, piece, least_theta)
            piece += block_threads()


def is_shared(level: CoarseGrid) -> bool:
    """Whether all threads see to a `level`."""
    return worth_sharing(level.nx * level.ny * level.nz)


def in_block(level: CoarseGrid) -> bool:
    """Whether one block of a graphics processor sees to a `level`: it is done before as many launches have begun."""
    return current_backend() != "cpu" and level.nx * level.ny * level.nz <= BLOCK_NODES


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
    fenced = int(current_backend() != "cuda")
    for fine, coarse in itertools.pairwise(levels):
        if in_block(coarse):
            restrict_in_block(coarse, fine, LEAST_THETA, fenced)
        else:
            restrict(coarse, fine, LEAST_THETA, int(is_shared(coarse)))
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

"""The Poisson equation div(beta grad lambda) = rhs on the levels of the grid, with lambda <= 0, by multigrid sweeps.

At the free surface lambda is 0 (ghost fluid method, Gibou et al. 2002, 10.1006/jcph.2001.6977), as far from a node as
the liquid of its cell and of the next one reaches. Nothing flows into solids: a face counts with its aperture, and a
face of a coarser level with those that it stands for. (Coupled by the open volume of their cells alone, coarser nodes
on both sides of a wall were one.) The solution on a level starts from that of the next coarser one, interpolated
linearly, so that a few sweeps of projected red-black over-relaxation are enough on each. It is not warm-started from
the last time step: pressures that are carried over make water pulse (notebook/solver.md).

    code      symbol     meaning                                                         unit
    liquid    f          liquid fraction of a cell                                       1
    theta                distance of the surface from the node in liquid, in edges       1
    coef_x    beta       face coefficient to the next node along x, A / (theta dx^2 rho) 1/m^2
              A          aperture of the face between them                               1
    lam       lambda     multiplier                                                      m^2
"""

import enum
import itertools
import math

from wavetank.device.compiler import current_backend, qd, worth_sharing
from wavetank.physics.pressure.grid import Level, coordinates, node_at
from wavetank.physics.pressure.surface import air_above

SWEEPS, MOST_SWEEPS = 8, 200  # in one launch, and of the coarsest level
ON_EACH = (2 * SWEEPS, 1.7)  # sweeps of a level and their relaxation: eight leave what drives calm water round
BLOCK_NODES = 8192  # at most, of a level that one block of a graphics processor computes


class Start(enum.IntEnum):
    """Where the sweeps of a level start."""

    ZERO = 0
    COARSER = 1  # at the solution of the coarser level
    CURRENT = 2  # where they are


# --- coefficients ---


@qd.func
def face_coefficient(grid: Level, n, m, share, edge):
    """Coefficient [1/m^2] of the face between the nodes `n` and `m`, of which a `share` is open.

    It is 0 between air and air, else the inverse of the density, that of the heaviest fluid being 1, over the square
    of the distance.
    """
    a = qd.min(grid.liquid[n], 1.0) - 0.5
    b = qd.min(grid.liquid[m], 1.0) - 0.5
    theta = qd.select(a * b < 0.0, qd.min(qd.max(a + b + 0.5, grid.limits.least_theta), 1.0), 1.0)
    # A light fluid accelerates more: the inverse of the mean density, and of that of the liquid where there is air.
    mean = 0.5 * (grid.density[n] + grid.density[m])
    density = qd.select(a <= 0.0, grid.density[m], qd.select(b <= 0.0, grid.density[n], mean))
    is_open = qd.min(qd.max(a, b), share) > 0.0
    return qd.select(is_open, share / qd.max(theta * edge * edge * density, 1e-12), 0.0)


@qd.func
def set_coefficients(grid: Level, segment, lid):
    """Set the face coefficients and the inverse diagonal of a segment of `width` nodes of a row.

    The rim of the arrays, without open volume, stands for what is beyond the tank, and for air where it has a `lid`.
    """
    first = segment % grid.segments * grid.width
    row = segment // grid.segments
    y = row % grid.ny
    z = row // grid.ny
    begin, layer, rim = grid.nx * row, grid.nx * grid.ny, grid.nx * grid.ny * grid.nz
    over_x = begin if qd.static(grid.periodic & 1) else rim
    under_x = begin + grid.nx - 1 if qd.static(grid.periodic & 1) else rim
    over_y = begin - y * grid.nx if qd.static(grid.periodic & 2) else rim
    under_y = begin + (grid.ny - 1) * grid.nx if qd.static(grid.periodic & 2) else rim
    over_z = begin - z * layer if qd.static(grid.periodic & 4) else rim
    under_z = begin + (grid.nz - 1) * layer if qd.static(grid.periodic & 4) else rim
    after_y = begin + grid.nx if y + 1 < grid.ny else over_y
    before_y = begin - grid.nx if y > 0 else under_y
    after_z = begin + layer if z + 1 < grid.nz else over_z
    before_z = begin - layer if z > 0 else under_z
    found = qd.Matrix.zero(qd.f32, 4, grid.width)
    for lane in range(grid.width):
        x = first + lane
        n = begin + x
        before = qd.Vector([qd.select(x > 0, n - 1, under_x), before_y + x, before_z + x])
        wx = face_coefficient(grid, n, qd.select(x + 1 < grid.nx, n + 1, over_x), grid.aperture_x[n], grid.dx)
        open_y = grid.aperture_y[n] + air_above(grid, n, lid)
        wy = face_coefficient(grid, n, after_y + x, open_y, grid.dy)
        wz = face_coefficient(grid, n, after_z + x, grid.aperture_z[n], grid.dz)
        diagonal = wx + wy + wz
        diagonal += face_coefficient(grid, n, before.x, grid.aperture_x[before.x], grid.dx)
        diagonal += face_coefficient(grid, n, before.y, grid.aperture_y[before.y], grid.dy)
        diagonal += face_coefficient(grid, n, before.z, grid.aperture_z[before.z], grid.dz)
        is_water = qd.min(grid.liquid[n] - 0.5, qd.min(grid.open_volume[n], diagonal)) > 0.0
        found[0, lane] = wx
        found[1, lane] = wy
        found[2, lane] = wz
        found[3, lane] = qd.select(is_water, 1.0 / qd.max(diagonal, 1e-12), 0.0)
    for lane in range(qd.min(grid.width, grid.nx - first)):
        n = begin + first + lane
        grid.coef_x[n] = found[0, lane]
        grid.coef_y[n] = found[1, lane]
        grid.coef_z[n] = found[2, lane]
        grid.inverse_diagonal[n] = found[3, lane]


@qd.func
def decouple(grid: Level, segment):
    """Set the coefficients of a segment in air, where nodes are decoupled."""
    first = grid.nx * (segment // grid.segments) + segment % grid.segments * grid.width
    for n in range(first, qd.min(first + grid.width, grid.nx * (segment // grid.segments + 1))):
        grid.coef_x[n], grid.coef_y[n], grid.coef_z[n], grid.inverse_diagonal[n] = 0.0, 0.0, 0.0, 0.0


# --- coarser levels ---


@qd.func
def aperture_ahead(grid: Level, n, axis: qd.template()):
    """Aperture of the face from node `n` to the next one along an axis."""
    share = grid.aperture_z[n]
    if qd.static(axis == 0):
        share = grid.aperture_x[n]
    elif qd.static(axis == 1):
        share = grid.aperture_y[n]
    return share


@qd.func
def aperture_towards(grid: Level, c, m, axis: qd.template(), ahead):
    """The same from the node `c`, or if the next one is not `ahead` but before from that, which is `m`."""
    return aperture_ahead(grid, qd.select(ahead == 1, c[0] + grid.nx * (c[1] + grid.ny * c[2]), m), axis)


@qd.func
def offset_of(ratio, k):
    """Whole coordinates of the `k`-th of the finer nodes that a coarser one stands for, from the first of them on."""
    return qd.Vector([k % ratio[0], k // ratio[0] % ratio[1], k // (ratio[0] * ratio[1])])


@qd.func
def restricted_aperture(fine: Level, c, ratio, axis: qd.template()):
    """Aperture of the face of a coarser node `c` to the next one, by those of the finer nodes that it stands for.

    It is closed as well where a wall separates these nodes from each other.
    """
    last, closed = 0.0, 0.0
    size = ratio[0] * ratio[1] * ratio[2] // ratio[axis]
    for k in range(ratio[0] * ratio[1] * ratio[2]):
        way = offset_of(ratio, k)
        place = c * ratio + way
        n = place[0] + fine.nx * (place[1] + fine.ny * place[2])
        share = aperture_ahead(fine, n, axis)
        after = place
        after[axis] += 1
        if way[axis] == ratio[axis] - 1:
            last += share
        elif share == 0.0 and qd.min(fine.open_volume[n], fine.open_volume[node_at(fine, after)]) > 0.0:
            closed += 1.0
    return qd.select(2.0 * closed >= size, 0.0, last / size)


@qd.func
def ratio_of(coarse: Level, fine: Level):
    """How many finer nodes one of a coarser level stands for along each axis."""
    return qd.Vector([fine.nx // coarse.nx, fine.ny // coarse.ny, fine.nz // coarse.nz])


@qd.func
def restrict_node(coarse: Level, fine: Level, n):
    """Restrict liquid, density and right-hand side to node `n` of a coarser level, whose open volume is known."""
    c, ratio = coordinates(coarse, n), ratio_of(coarse, fine)
    liquid, rhs, density = 0.0, 0.0, 0.0
    size = ratio[0] * ratio[1] * ratio[2]
    for z in range(c[2] * ratio[2], c[2] * ratio[2] + ratio[2]):
        for y in range(c[1] * ratio[1], c[1] * ratio[1] + ratio[1]):
            row = fine.nx * (y + fine.ny * z)
            for m in range(row + c[0] * ratio[0], row + c[0] * ratio[0] + ratio[0]):
                liquid += fine.liquid[m] * fine.open_volume[m]
                rhs += fine.rhs[m]
                density += fine.density[m] * fine.liquid[m] * fine.open_volume[m]
    coarse.density[n] = density / liquid if liquid > 0.0 else 1.0
    coarse.liquid[n] = liquid / qd.max(coarse.open_volume[n] * size, 1e-6)
    coarse.rhs[n] = rhs / size


@qd.kernel(fastcache=True)
def restrict_open_volume(coarse: Level, fine: Level, shared: qd.template()):
    """Restrict open volume and apertures to a coarser level; `shared` by all threads, or done by one."""
    qd.loop_config(serialize=not shared)
    for n in range(coarse.nx * coarse.ny * coarse.nz):
        c, ratio = coordinates(coarse, n), ratio_of(coarse, fine)
        volume = 0.0
        for k in range(ratio[0] * ratio[1] * ratio[2]):
            place = c * ratio + offset_of(ratio, k)
            volume += fine.open_volume[place[0] + fine.nx * (place[1] + fine.ny * place[2])]
        coarse.open_volume[n] = volume / (ratio[0] * ratio[1] * ratio[2])
        coarse.aperture_x[n] = restricted_aperture(fine, c, ratio, 0)
        coarse.aperture_y[n] = restricted_aperture(fine, c, ratio, 1)
        coarse.aperture_z[n] = restricted_aperture(fine, c, ratio, 2)


@qd.kernel(fastcache=True)
def restrict(coarse: Level, fine: Level, lid: qd.i32, shared: qd.template()):
    """Restrict the equation to a coarser level, whose open volume is known; `shared` by all threads, or done by one."""
    qd.loop_config(serialize=not shared)
    for n in range(coarse.nx * coarse.ny * coarse.nz):
        restrict_node(coarse, fine, n)
    qd.loop_config(serialize=not shared)
    for segment in range(coarse.segments * coarse.ny * coarse.nz):
        set_coefficients(coarse, segment, lid)


@qd.kernel(fastcache=True)
def restrict_in_block(coarse: Level, fine: Level, lid: qd.i32, fenced: qd.template()):
    """Do what `restrict` does, in one launch of one block on a graphics processor."""
    qd.loop_config(block_dim=block_threads())
    for thread in range(block_threads()):
        n = thread
        while n < coarse.nx * coarse.ny * coarse.nz:
            restrict_node(coarse, fine, n)
            n += block_threads()
        wait_for_block(fenced)
        segment = thread
        while segment < coarse.segments * coarse.ny * coarse.nz:
            set_coefficients(coarse, segment, lid)
            segment += block_threads()


# --- sweeps ---


@qd.func
def interpolated(coarser: Level, c, halved):
    """Interpolate lambda at the node `c` of a level from those of the next `coarser` one, linearly along each axis.

    Axes that are not `halved` have as many nodes on both. It is constant towards solids, the rim of the tank and where
    a face is closed.
    """
    at = c >> halved
    own = coarser.lam[at[0] + coarser.nx * (at[1] + coarser.ny * at[2])]
    found = own
    for axis in qd.static(range(3)):
        if halved[axis] == 1:
            place = at
            place[axis] += 2 * (c[axis] & 1) - 1
            m = node_at(coarser, place)
            if aperture_towards(coarser, at, m, axis, c[axis] & 1) > 0.0:
                found += 0.25 * (coarser.lam[m] - own)
    return qd.min(found, 0.0)


@qd.func
def start_nodes(grid: Level, coarser: Level, row, first, last, start):
    """Set lambda of the nodes of a `row` from x = `first` to `last` to its `start`; 0 outside of the liquid."""
    halved = qd.Vector([grid.nx // coarser.nx - 1, grid.ny // coarser.ny - 1, grid.nz // coarser.nz - 1])
    c = qd.Vector([0, row % grid.ny, row // grid.ny])
    for x in range(first, last):
        n = grid.nx * row + x
        lam = 0.0
        if grid.inverse_diagonal[n] > 0.0:
            if start == Start.CURRENT:
                lam = grid.lam[n]
            if start == Start.COARSER:
                c[0] = x
                lam = interpolated(coarser, c, halved)
        grid.lam[n] = lam


@qd.func
def relax_nodes(grid: Level, row, first, last, over_relaxation):
    """One step of projected over-relaxation, lambda <= 0, at every other node of a `row` from x = `first` to `last`.

    Coefficients beyond the tank stand in the rim of the arrays, and are 0. Along periodic axes the numbers of nodes are
    even, so that colours alternate across the seam as well.
    """
    begin, layer, rim = grid.nx * row, grid.nx * grid.ny, grid.nx * grid.ny * grid.nz
    y, z = row % grid.ny, row // grid.ny
    before_y = begin - grid.nx if y > 0 else rim
    before_z = begin - layer if row >= grid.ny else rim
    after_y, after_z = begin + grid.nx if y + 1 < grid.ny else rim, begin + layer
    if qd.static(grid.periodic & 2):
        before_y = before_y if y > 0 else begin + (grid.ny - 1) * grid.nx
        after_y = begin + grid.nx if y + 1 < grid.ny else begin - y * grid.nx
    if qd.static(grid.periodic & 4):
        before_z = before_z if z > 0 else begin + (grid.nz - 1) * layer
        after_z = after_z if z + 1 < grid.nz else begin - z * layer
    for k in range((last - first + 1) // 2):
        x = first + 2 * k
        n = begin + x
        if grid.inverse_diagonal[n] > 0.0:
            after_x = n + 1
            if qd.static(grid.periodic & 1):
                after_x = n + 1 if x + 1 < grid.nx else begin
            total = grid.coef_x[n] * grid.lam[after_x] - grid.rhs[n]
            total += grid.coef_y[n] * grid.lam[after_y + x] + grid.coef_y[before_y + x] * grid.lam[before_y + x]
            total += grid.coef_z[n] * grid.lam[after_z + x] + grid.coef_z[before_z + x] * grid.lam[before_z + x]
            if x > 0:
                total += grid.coef_x[n - 1] * grid.lam[n - 1]
            elif qd.static(grid.periodic & 1):
                total += grid.coef_x[begin + grid.nx - 1] * grid.lam[begin + grid.nx - 1]
            lam = grid.lam[n]
            grid.lam[n] = qd.min(lam + over_relaxation * (total * grid.inverse_diagonal[n] - lam), 0.0)


@qd.func
def mark_liquid(grid: Level, at, row, first, last):
    """Mark at the place `at` whether nodes of a `row` from x = `first` to `last` have liquid: air needs no sweeps."""
    grid.has_liquid[at] = 0
    for n in range(grid.nx * row + first, grid.nx * row + last):
        if grid.inverse_diagonal[n] > 0.0:
            grid.has_liquid[at] = 1


@qd.func
def start_segment(grid: Level, coarser: Level, segment, start):
    """Set lambda of a segment to its `start`, and mark whether it has liquid."""
    first = segment % grid.segments * grid.width
    last = qd.min(first + grid.width, grid.nx)
    start_nodes(grid, coarser, segment // grid.segments, first, last, start)
    mark_liquid(grid, segment, segment // grid.segments, first, last)


@qd.func
def relax_segment(grid: Level, segment, colour, over_relaxation):
    """Relax the nodes of a segment that have a `colour`, red or black."""
    if grid.has_liquid[segment] == 1:
        row = segment // grid.segments
        first = segment % grid.segments * grid.width
        x = first + (row % grid.ny + row // grid.ny + colour) % 2
        relax_nodes(grid, row, x, qd.min(first + grid.width, grid.nx), over_relaxation)


@qd.kernel(fastcache=True)
def solve(grid: Level, coarser: Level, start: qd.i32, sweeps: qd.i32, over_relaxation: qd.f32, shared: qd.template()):
    """Relax the equation of a level, whose coefficients are set, in red-black sweeps from a `start`, see `Start`.

    One thread does the `sweeps`, or all threads share as many as `shared` says, `width` nodes of a row at once.
    """
    if qd.static(shared):
        for segment in range(grid.segments * grid.ny * grid.nz):
            start_segment(grid, coarser, segment, start)
        for colour in qd.static(range(2 * shared)):
            for segment in range(grid.segments * grid.ny * grid.nz):
                relax_segment(grid, segment, colour, over_relaxation)
    else:
        # A grid of some thousand nodes is done before other threads have started.
        qd.loop_config(serialize=True)
        for _ in range(1):
            for row in range(grid.ny * grid.nz):
                start_nodes(grid, coarser, row, 0, grid.nx, start)
                mark_liquid(grid, row, row, 0, grid.nx)
            for colour in range(2 * sweeps):
                for row in range(grid.ny * grid.nz):
                    if grid.has_liquid[row] == 1:
                        first = (row % grid.ny + row // grid.ny + colour) % 2
                        relax_nodes(grid, row, first, grid.nx, over_relaxation)


@qd.kernel(fastcache=True)
def solve_in_block(
    grid: Level, coarser: Level, start: qd.i32, sweeps: qd.i32, over_relaxation: qd.f32, fenced: qd.template()
):
    """Do what `solve` does, in one launch on a graphics processor: its threads wait for each other after each colour.

    Only those of a block can, so that this is for levels of some thousand nodes.
    """
    qd.loop_config(block_dim=block_threads())
    for thread in range(block_threads()):
        segments = grid.segments * grid.ny * grid.nz
        segment = thread
        while segment < segments:
            start_segment(grid, coarser, segment, start)
            segment += block_threads()
        wait_for_block(fenced)
        for colour in range(2 * sweeps):
            segment = thread
            while segment < segments:
                relax_segment(grid, segment, colour, over_relaxation)
                segment += block_threads()
            wait_for_block(fenced)


# --- levels and processors ---


def coarsest_relaxation(level: Level) -> tuple[int, float]:
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


def is_shared(level: Level) -> bool:
    """Whether a `level` is large enough for all threads."""
    return worth_sharing(level.nx * level.ny * level.nz)


def in_block(level: Level) -> bool:
    """Whether one block of a graphics processor computes a `level`: it is done before as many launches have begun."""
    return current_backend() != "cpu" and level.nx * level.ny * level.nz <= BLOCK_NODES


@qd.func
def block_threads():
    """Threads of a block of a graphics processor that compute a level."""
    return 512


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


def restrict_solids(levels: list[Level]) -> None:
    """Restrict open volume and apertures from the finest of the `levels`, the first in the list, to all others."""
    for fine, coarse in itertools.pairwise(levels):
        restrict_open_volume(coarse, fine, int(is_shared(coarse)))


def solve_levels(levels: list[Level], lid: int = 0) -> None:
    """Solve the equation of the finest of the `levels`, the first in the list, whose coefficients and rhs are set.

    Open volumes are restricted (`restrict_solids`). `lid` is 1 in a tank that is closed above its liquid, else 0.
    """
    fenced = int(current_backend() != "cuda")
    for fine, coarse in itertools.pairwise(levels):
        if in_block(coarse):
            restrict_in_block(coarse, fine, lid, fenced)
        else:
            restrict(coarse, fine, lid, int(is_shared(coarse)))
    coarsest = coarser = levels[-1]
    for level in reversed(levels):
        start = Start.COARSER
        sweeps, over_relaxation = ON_EACH
        if level is coarsest:
            start = Start.ZERO
            sweeps, over_relaxation = coarsest_relaxation(level)
        if in_block(level):
            solve_in_block(level, coarser, int(start), sweeps, over_relaxation, fenced)
        elif is_shared(level):
            for _ in range(sweeps // SWEEPS):
                solve(level, coarser, int(start), sweeps, over_relaxation, SWEEPS)
                start = Start.CURRENT
        else:
            solve(level, coarser, int(start), sweeps, over_relaxation, 0)
        coarser = level

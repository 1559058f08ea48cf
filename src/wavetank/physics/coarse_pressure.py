"""Pressure of the whole tank: a correction on a coarse grid before the iterations between particles.

An iteration between particles carries pressure two supports far, so deep water needs many, or short time steps, or it
gives way. Here the density errors of all particles are gathered on a grid of about the support, a Poisson equation is
solved there, and the particles are moved by the gradient of its solution. What is left for the iterations is what the
grid cannot see: errors of a few spacings, which they remove fast, whatever the depth.

A field of multipliers lambda moves particles by M grad lambda (Eq. 6; M from the rest lattice, `stiffness`), and
changes the density by -M laplace lambda. The grid therefore solves M laplace lambda = C for the mean error C, with
lambda <= 0 (water pushes and does not pull), lambda = 0 at the free surface, and no flow into solids.

    code    symbol     meaning                                                      unit
    fill    f          water in the tent of a node, over the room that it has       1
    open    o          share of a cell that no solid takes                          1
    phi     f - 1/2    level set: the surface is where it is zero                   1
    theta              distance of a node from the surface, in cells                1
    rhs     C / M      mean error, over the stiffness                               1
    lam     lambda     multiplier                                                   m^2

Tents and their sums: particle-in-cell methods (Harlow 1964; Zhu and Bridson 2005, 10.1145/1073204.1073298). The
surface inside of a cell: the ghost fluid method, Gibou et al. 2002 (10.1006/jcph.2001.6977). Pressure of particles
from a grid and details from the particles: Cornelis et al. 2014 (10.1111/cgf.12324). The sums are of whole numbers,
so that runs repeat bit for bit. What was tried, and what it gives: docs/method.md.
"""

import math
from wavetank.compiler import current_backend, qd
from wavetank.distance import SolidSet, lift, signed_distance, vec3
from wavetank.physics.boundary import flattened, kept_in_tank
from wavetank.physics.places import predict_at, predicted
from wavetank.state import CoarseGrid, Coefficients, Particles, Scratch, integers, scalars

EDGE = 1.0  # of a cell, over the support
SMALLEST = 8  # cells along an axis that is not halved any more
UNIT = float(1 << 20)  # sums are whole multiples of its inverse
SWEEPS, COARSEST_SWEEPS = 8, 32  # of a level, and of the coarsest
OVER_RELAXATION = 1.5
LARGE = 50_000  # nodes, from where threads gain more than they cost
LEAST_OPEN = 0.1  # a cell that is less open is solid
LEAST_THETA = 0.1
INNER = (0.8, 0.95)  # from where to where `fill` lets a particle count: near a surface its density says nothing
REACH = 0.2  # of the support: the longest correction


@qd.func
def node(grid: CoarseGrid, c):
    """Number of the node with the whole coordinates `c`, or of the nearest that there is."""
    x = qd.min(qd.max(c[0], 0), grid.nx - 1)
    y = qd.min(qd.max(c[1], 0), grid.ny - 1)
    z = qd.min(qd.max(c[2], 0), grid.nz - 1)
    return x + grid.nx * (y + grid.ny * z)


@qd.func
def coordinates(grid: CoarseGrid, n):
    """Whole coordinates of node `n`."""
    return qd.Vector([n % grid.nx, n // grid.nx % grid.ny, n // (grid.nx * grid.ny)])


@qd.func
def in_cells(grid: CoarseGrid, p: qd.template()):
    """The place `p` [m] in cells, whole at nodes; 0 along an axis that the world does not have."""
    point = lift(p)
    return vec3(point.x / grid.dx - 0.5, point.y / grid.dy - 0.5, point.z / grid.dz - (0.5 if qd.static(p.n == 3) else 0.0))


@qd.func
def tent(share, k: qd.template()):
    """Weight of corner `k` of 8 of a cell for a place with the coordinates `share` in it."""
    w = share.x if qd.static(k & 1) else 1.0 - share.x
    w *= share.y if qd.static(k & 2) else 1.0 - share.y
    w *= share.z if qd.static(k & 4) else 1.0 - share.z
    return w


@qd.func
def at_corner(low, k: qd.template()):
    """Whole coordinates of corner `k` of 8 of the cell from `low` on."""
    return low + qd.Vector([qd.static(k & 1), qd.static(k >> 1 & 1), qd.static(k >> 2)])


@qd.kernel(fastcache=True)
def gather_fill(
    grid: CoarseGrid, particles: Particles, scratch: Scratch, solids: SolidSet, unit: qd.f32, volume: qd.f32,
    least_open: qd.f32, count: qd.i32, searched: qd.template(), mixed: qd.template(),
):  # fmt: skip
    """Sum the tents of all particles at the nodes, and relate them to the room there.

    `volume` is that of a particle over that of a cell and over the `unit`. Solids take their share of a cell where
    they are `searched`; else there are only the walls of the tank, which end where the cells do. Where fluids are
    `mixed`, their densities are averaged.
    """
    for n in range(grid.nx * grid.ny * grid.nz):
        grid.fill_sum[n] = 0
        grid.error_sum[n] = 0
        grid.mass_sum[n] = 0
    for i in range(count):
        p = predicted(particles, i)
        s = in_cells(grid, p)
        low = qd.floor(s, qd.i32)
        share = s - qd.floor(s)
        for k in qd.static(range(2**p.n)):
            n = node(grid, at_corner(low, k))
            w = unit * tent(share, k)
            qd.atomic_add(grid.fill_sum[n], qd.cast(qd.round(w), qd.i32))
            if qd.static(mixed):
                qd.atomic_add(grid.mass_sum[n], qd.cast(qd.round(w / scratch.weight[i]), qd.i32))
    for n in range(grid.nx * grid.ny * grid.nz):
        room = 1.0
        if qd.static(searched):
            c = coordinates(grid, n)
            center = vec3((c[0] + 0.5) * grid.dx, (c[1] + 0.5) * grid.dy, (c[2] + 0.5) * grid.dz)
            edge = qd.min(grid.dx, grid.dy)
            if grid.nz > 1:
                edge = qd.min(edge, grid.dz)
            else:
                center.z = 0.0
            for k in range(solids.count):
                if room > 0.0:
                    room = qd.min(room, 0.5 + signed_distance(solids, k, center).w / edge)
        room = qd.max(room, 0.0)
        grid.room[n] = room if room >= least_open else 0.0
        grid.fill[n] = volume * grid.fill_sum[n] / qd.max(room, least_open)
        grid.density[n] = 1.0
        if qd.static(mixed):
            grid.density[n] = qd.max(grid.mass_sum[n], 1) / qd.cast(qd.max(grid.fill_sum[n], 1), qd.f32)


@qd.kernel(fastcache=True)
def gather_errors(
    grid: CoarseGrid, particles: Particles, scratch: Scratch, unit: qd.f32, scale: qd.f32, inner_from: qd.f32,
    inner_to: qd.f32, least_open: qd.f32, count: qd.i32,
):  # fmt: skip
    """Sum the density errors (Eq. 2) of the particles inside of the water at the nodes, and set the right side to them.

    `scale` is the volume of a particle over that of a cell, over the unit and over the stiffness M.
    """
    for i in range(count):
        p = predicted(particles, i)
        s = in_cells(grid, p)
        low = qd.floor(s, qd.i32)
        share = s - qd.floor(s)
        filled = 0.0
        for k in qd.static(range(2**p.n)):
            filled += tent(share, k) * grid.fill[node(grid, at_corner(low, k))]
        inside = qd.min(qd.max((filled - inner_from) / (inner_to - inner_from), 0.0), 1.0)
        error = unit * inside * qd.min(qd.max(scratch.rho[i] * scratch.weight[i] - 1.0, -1.0), 1.0)
        for k in qd.static(range(2**p.n)):
            qd.atomic_add(grid.error_sum[node(grid, at_corner(low, k))], qd.cast(qd.round(error * tent(share, k)), qd.i32))
    for n in range(grid.nx * grid.ny * grid.nz):
        grid.rhs[n] = scale * grid.error_sum[n] / qd.max(grid.room[n], least_open)


@qd.kernel(fastcache=True)
def restrict(coarse: CoarseGrid, fine: CoarseGrid):
    """Give the nodes of a coarser level the means of the finer ones that they stand for."""
    for n in range(coarse.nx * coarse.ny * coarse.nz):
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
    pairs = (grid.nx + 1) // 2
    row = half // pairs
    y = row % grid.ny
    z = row // grid.ny
    x = (half - row * pairs) * 2 + (y + z + colour) % 2
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
    grid: CoarseGrid, coarser: CoarseGrid, guessed: qd.i32, sweeps: qd.i32, over_relaxation: qd.f32, least_theta: qd.f32,
    parallel: qd.template(),
):  # fmt: skip
    """Set up the Poisson equation and relax it in some sweeps of two colours; start from the `coarser` level if so.

    Nodes outside of the water keep lambda = 0. The couplings of faces on the rim of the grid are 0.
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
                if guessed != 0:
                    fx = grid.nx // coarser.nx
                    fy = grid.ny // coarser.ny
                    fz = grid.nz // coarser.nz
                    lam = coarser.lam[node(coarser, qd.Vector([c[0] // fx, c[1] // fy, c[2] // fz]))]
        grid.inverse[n] = inverse
        grid.lam[n] = lam
    if qd.static(parallel):
        for colour in qd.static(range(16)):
            for half in range((grid.nx + 1) // 2 * grid.ny * grid.nz):
                relax_node(grid, half, colour, over_relaxation)
    else:
        # A grid of some thousand nodes is done before other threads have started.
        qd.loop_config(serialize=True)
        for _ in range(1):
            for turn in range(2 * sweeps):
                for half in range((grid.nx + 1) // 2 * grid.ny * grid.nz):
                    relax_node(grid, half, turn, over_relaxation)
    for n in range(grid.nx * grid.ny * grid.nz):
        lam = grid.lam[n]
        grid.slope_x[n] = grid.wx[n] * grid.dx * (grid.lam[n + 1] - lam)
        grid.slope_y[n] = grid.wy[n] * grid.dy * (grid.lam[n + grid.nx] - lam)
        grid.slope_z[n] = grid.wz[n] * grid.dz * (grid.lam[n + grid.nx * grid.ny] - lam)


@qd.func
def slope_along(
    grid: CoarseGrid, slope: qd.template(), coupled: qd.template(), s, axis: qd.template(), dim: qd.template()
):
    """Derivative of lambda [m] along `axis` at the place `s` [cells], from the faces around that lead into water."""
    at = s
    at[axis] -= 0.5
    low = qd.floor(at)
    share = at - low
    total, weights = 0.0, 0.0
    for k in qd.static(range(2**dim)):
        n = node(grid, at_corner(qd.cast(low, qd.i32), k))
        if coupled[n] > 0.0:
            w = tent(share, k)
            total += w * slope[n]
            weights += w
    return total / qd.max(weights, 1e-9)


@qd.kernel(fastcache=True)
def move_particles(
    grid: CoarseGrid, particles: Particles, solids: SolidSet, c: Coefficients, stiffness: qd.f32, reach: qd.f32,
    count: qd.i32,
):  # fmt: skip
    """Move the predicted positions by M grad lambda, at most by `reach` [m], inside the tank."""
    for i in range(count):
        p = predicted(particles, i)
        s = in_cells(grid, p)
        dp = p * 0.0
        dp[0] = slope_along(grid, grid.slope_x, grid.wx, s, 0, p.n)
        dp[1] = slope_along(grid, grid.slope_y, grid.wy, s, 1, p.n)
        if qd.static(p.n == 3):
            dp[2] = slope_along(grid, grid.slope_z, grid.wz, s, 2, p.n)
        dp *= stiffness
        p += dp * qd.min(1.0, reach / qd.max(dp.norm(), 1e-12))
        near = particles.near[i]
        if near != 0:
            p = flattened(kept_in_tank(lift(p), near, solids, c.wall_gap), p)
        predict_at(particles, i, p)


def new_levels(size: tuple[float, ...], h: float) -> list[CoarseGrid]:
    """Allocate the grid of a tank of that `size` [m] and its coarser levels, the finest first."""
    shape = [_divided(edge / (EDGE * h)) for edge in size]
    levels = [_new_level(shape, size)]
    while any(_can_halve(n) for n in shape):
        shape = [n // 2 if _can_halve(n) else n for n in shape]
        levels.append(_new_level(shape, size))
    return levels


def _can_halve(n: int) -> bool:
    return n % 2 == 0 and n > SMALLEST


def _divided(cells: float) -> int:
    """Return the number near `cells` that can be halved until `SMALLEST` or less is left."""
    halvings = max(0, math.ceil(math.log2(max(cells, 1.0) / SMALLEST)))
    return max(1, round(cells / 2**halvings)) * 2**halvings


def _new_level(shape: list[int], size: tuple[float, ...]) -> CoarseGrid:
    nx, ny, nz = [*shape, 1][:3]
    edges = [edge / n for edge, n in zip(size, shape, strict=True)]
    dx, dy, dz = [*edges, 1.0][:3]
    nodes = nx * ny * nz
    rim = nodes + nx * ny  # the next node of those on the rim is read, and counts nothing
    return CoarseGrid(
        *(integers(nodes) for _ in range(3)), *(scalars(rim) for _ in range(12)), nx=nx, ny=ny, nz=nz, dx=dx, dy=dy, dz=dz
    )


def correct_pressure(
    levels: list[CoarseGrid], particles: Particles, scratch: Scratch, solids: SolidSet, c: Coefficients,
    stiffness: float, volume: float, count: int, share: float, *, searched: bool, mixed: bool,
) -> None:  # fmt: skip
    """Move the predicted positions of `particles` so that the `share` of the mean errors of their densities vanishes.

    `scratch.rho` holds the densities over that of the heaviest fluid there, `volume` [m^dim] is that of a particle at rest.
    """
    finest = levels[0]
    scale = volume / (finest.dx * finest.dy * finest.dz) / UNIT
    gather_fill(finest, particles, scratch, solids, UNIT, scale, LEAST_OPEN, count, int(searched), int(mixed))
    gather_errors(finest, particles, scratch, UNIT, share * scale / stiffness, *INNER, LEAST_OPEN, count)
    for fine, coarse in zip(levels, levels[1:], strict=False):
        restrict(coarse, fine)
    coarser = levels[-1]
    for level in reversed(levels):
        is_coarsest = level is coarser
        parallel = int(current_backend() != "cpu" or level.nx * level.ny * level.nz > LARGE)
        sweeps = COARSEST_SWEEPS if is_coarsest else SWEEPS
        solve(level, coarser, int(not is_coarsest), sweeps, OVER_RELAXATION, LEAST_THETA, parallel)
        coarser = level
    move_particles(finest, particles, solids, c, stiffness, REACH * c.h, count)

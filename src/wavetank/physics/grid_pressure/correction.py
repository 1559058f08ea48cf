"""Pressure of the whole tank: a correction on a coarse grid before the iterations between particles.

An iteration between particles carries pressure two supports far, so deep water needs many, or short time steps, or it
gives way. Here the density errors of all particles are gathered on a grid of about the support, a Poisson equation is
solved there (`poisson.py`), and the particles are moved by the gradient of its solution. What is left for the
iterations is what the grid cannot see: errors of a few spacings, which they remove fast, whatever the depth.

A field of multipliers lambda moves particles by M grad lambda (Eq. 6; M from the rest lattice, `stiffness`), and
changes the density by -M laplace lambda. For the mean error C the equation is therefore M laplace lambda = C, with
lambda <= 0, because water pushes and does not pull.

Pressure from a grid, details from the particles: Zhu and Bridson 2005 (10.1145/1073204.1073298) in FLIP, Cornelis et
al. 2014 (10.1111/cgf.12324) for SPH. Where we differ: the right side is the error of the particles' own densities, so
that volume does not drift, and it is the positions that are moved. The sums are of whole numbers, so that runs repeat
bit for bit. What was tried, and what it gives: notebook/grid-pressure.md.

In time. A correction at the end of a step is implicit Euler, which damps waves by half of omega^2 dt. Each particle
therefore carries what the grid accelerated it by, `a`, and a share w of it acts in the next prediction;
the grid corrects what that leaves. What acts is then the sum of (1 - w) w^n times the acceleration that was found n
steps ago, w / (1 - w) steps late on average. With w = 1/2 that is one step, and just what takes a velocity from half a
step before a place to half a step behind it, as v = (p - x) / dt is: leapfrog, of second order, and waves keep their
height. Below, the share (1 - 2 w) / (1 - w) of the damping stays: w is such that a step of any length damps as one of
the share `DAMPING` of a frame would, and steps shorter than that carry nothing. It is stable for every omega dt, and
modes that are much stiffer than a step are stopped at once, as without it. No more than `LARGEST_CARRIED` times gravity
is carried, so that water that hits a wall does not bounce.

Gaps. Particles in rows, near in one direction and far in the other, read the density of water at rest where there is
less. Where even the fullest cells around are less than `FULL` (`gaps.py`), the rows have gaps that the water around may
close, and an error is less by `GAP_SHARE` times what is missing there.

Slips. The other way round, a row that slides off the one below reads less than the room that it takes. Where a cell is
full, water that is drawn in for that pushes the row on: it slid ever faster, 0.014 m/s in a tank that had been at rest
for a minute (notebook/calm.md, "Slow slips"). So a cell draws in no more where it is full, but in worlds
with bodies, see `DRAWN`.
"""

import dataclasses
import math

from wavetank.device.compiler import download, qd
from wavetank.device.state import CoarseGrid, Coefficients, Grid, Particles, Scratch, Walls, remembered
from wavetank.foundation.params import Parameters
from wavetank.physics.boundary import fall
from wavetank.physics.grid_pressure.approach import approached
from wavetank.physics.grid_pressure.block import is_shared
from wavetank.physics.grid_pressure.buoyancy import push_on_grid
from wavetank.physics.grid_pressure.coarse_grid import (
    add_whole,
    corners,
    in_cells,
    nearest,
    parts_of,
    ramp,
    taken,
    tents,
)
from wavetank.physics.grid_pressure.couplings import LEAST_THETA, couple_nodes, has_lid, part_nodes
from wavetank.physics.grid_pressure.films import left_to_grid
from wavetank.physics.grid_pressure.gaps import across, gaps_at
from wavetank.physics.grid_pressure.parcels import add_parcels
from wavetank.physics.grid_pressure.poisson import restrict_rooms, solve_levels
from wavetank.physics.grid_pressure.push import move_particles, push_of
from wavetank.physics.grid_pressure.room import LEAST_OPEN, find_room, open_tents, spread_along
from wavetank.physics.grid_pressure.sealed import MOSTLY_FULL, anchor, balance, find_basins
from wavetank.physics.grid_pressure.slits import below_roof, close_slit, in_part, mostly, openness
from wavetank.physics.grid_pressure.surface import depth_beside, find_depths, is_air, keep_extremes
from wavetank.physics.grid_pressure.thin_walls import may_be_cut_off
from wavetank.physics.grid_pressure.weight import BORNE, flow_out
from wavetank.physics.mixture import Blend
from wavetank.physics.predicted_positions import predicted
from wavetank.physics.smoothing import rest_lattice
from wavetank.physics.teams import end_of_part, first_of_part, part_of, teams, turns_over
from wavetank.physics.world import World
from wavetank.solids.distance import SolidSet, lift, vec3

UNIT = float(1 << 20)  # sums are whole multiples of its inverse
LARGEST_SUM = float(1 << 29)  # of errors, in whole numbers
INNER = (0.7, 0.85)  # from where to where `fill` lets a particle count: near a surface its density says nothing
BELOW = (0.4, 0.65)  # supports: and its depth, so that the top layer never counts, however it lies in the cells
FILM = (0.75, 1.25)  # cells of water: from where to where the grid takes part in a film
DAMPING = 0.1  # of a frame: the length of a step that damps as much, notebook/calm.md
LARGEST_CARRIED = 1.2  # of gravity
MISSING = 1.0 / 3.0  # of a wall's answer, over what it gives: all of what lacks, notebook/grid-pressure.md
FULL = 0.98  # fill that cells without gaps have at least, also where few rows of particles do not match them
SLIT = 0.7  # fill of a cell that touches a solid, as far as its tents can tell
CLOSING = 0.5  # of what lacks, in a step
GAP_SHARE = 6.0  # by which errors are less, of what lacks there
#: Fill from where to where a cell that reads too little draws nothing in, in worlds with bodies or without: beside them
#: all draw, or a box of half of water's density swings for ever in a plane.
DRAWN = {True: (1e3, 2e3), False: (0.96, 1.0)}


@dataclasses.dataclass(frozen=True)
class Errors:
    """The numbers of `gather`, which are the same in every step of a world."""

    unit: qd.f32  # what a whole number in the sums is the inverse of
    volume: qd.f32  # of a particle, over that of a cell and the unit
    scale: qd.f32  # 1/m^2, the same over the stiffness M
    per_way: qd.f32  # the share of errors that is removed, over the stiffness M
    borne_from: qd.f32  # the fill from which weight is borne
    borne_to: qd.f32  # and from which all of it is
    inner_from: qd.f32  # the fill from which a particle counts
    inner_to: qd.f32  # and with which it counts in full
    below_from: qd.f32  # m: and the depth below the surface from which it does
    below_to: qd.f32  # m: and in full
    missing: qd.f32  # share by which the answer of solids is increased
    full: qd.f32  # fill of cells without gaps
    gap_share: qd.f32  # by which errors are less, of what lacks there
    drawn_from: qd.f32  # fill from which on a cell that reads too little draws in less
    drawn_to: qd.f32  # and from which on nothing
    least_open: qd.f32  # share of a cell
    slit: qd.f32  # fill from which on there is no slit
    closing: qd.f32  # 1/m^2: what lacks is closed by in a step, over the stiffness M
    least_theta: qd.f32  # of an edge
    thin: qd.f32  # cells of water that are left to the iterations
    thick: qd.f32  # and from which on the grid does all
    spacing: qd.f32  # m


def carried(dt: float, frame_time: float) -> float:
    """Return the share w of the grid's pressure that a step of `dt` [s] carries on."""
    share = min(1.0, DAMPING * frame_time / dt)
    return (1.0 - share) / (2.0 - share)


@qd.func
def weights_at(grid: CoarseGrid, nodes: qd.template(), s, dim: qd.template(), searched: qd.template()):
    """Weights of the `nodes` around the place `s` [cells]: tents, cut by solids if `searched`, if 2 by thin walls."""
    return open_tents(grid, nodes, s, dim, searched - 1) if qd.static(searched) else tents(s - qd.floor(s), dim)


@qd.func
def inside_at(grid: CoarseGrid, n, e: Errors):
    """How far inside of the water node `n` lies: below 0 no particle there counts, above 1 all do in full.

    Depths beside solids are known only roughly, and so do not count. `slope_y` keeps it until errors are summed.
    """
    by_fill = (grid.fill[n] - e.inner_from) / (e.inner_to - e.inner_from)
    by_depth = (grid.depth[n] - e.below_from) / (e.below_to - e.below_from)
    return qd.min(by_fill, by_depth) if grid.clear[n] > 0.0 else by_fill


@qd.func
def find_errors(
    at: qd.template(),
    amounts: qd.template(),
    added: qd.template(),
    grid: CoarseGrid,
    particles: Particles,
    scratch: Scratch,
    e: Errors,
    first,
    part,
    lanes: qd.template(),
    searched: qd.template(),
):
    """Find what a team's particles from number `first` on add to a `part`'s sums, and where."""
    dim = qd.static(particles.x[first].n)
    for lane in range(lanes):
        s = in_cells(grid, predicted(particles, first + lane))
        nodes = corners(grid, qd.floor(s, qd.i32), dim)
        weights = weights_at(grid, nodes, s, dim, searched)
        inside = 0.0
        for k in qd.static(range(2**dim)):
            inside += weights[k] * grid.slope_y[nodes[k]]
        error = scratch.rho[first + lane] * scratch.weight[first + lane] - 1.0
        error += added[0, lane] - e.gap_share * grid.gaps[nearest(grid, qd.floor(s + 0.5, qd.i32))]
        error = e.unit * ramp(inside, 0.0, 1.0) * qd.min(qd.max(error, -1.0), 1.0)
        for k in qd.static(range(2**dim)):
            at[k, lane] = part * grid.nx * grid.ny * grid.nz + nodes[k]
            amounts[k, lane] = qd.cast(qd.round(error * weights[k]), qd.i32)


@qd.func
def add_errors(
    grid: CoarseGrid,
    particles: Particles,
    scratch: Scratch,
    solids: SolidSet,
    walls: Walls,
    c: Coefficients,
    e: Errors,
    cells: Grid,
    team,
    part,
    count,
    searched: qd.template(),
):
    """Add the tents of a team's particles, if inside of the water, times their errors (Eq. 2) to a `part`'s sums."""
    lanes = qd.static(cells.lanes)
    first = team * lanes
    dim = qd.static(particles.x[first].n)
    at = qd.Matrix.zero(qd.i32, 2**dim, lanes)
    amounts = qd.Matrix.zero(qd.i32, 2**dim, lanes)
    added = qd.Matrix.zero(qd.f32, 1, lanes)
    gravity = vec3(c.gravity_x, c.gravity_y, c.gravity_z)
    for i in range(first, qd.min(first + lanes, count)):
        near = particles.near[i]
        if near != 0:
            x, p = lift(particles.x[i]), lift(predicted(particles, i))
            driven = p - x - c.dt * c.dt * (gravity + lift(particles.a[i]))
            added[0, i - first] = approached(
                i, x, p - fall(c), driven, near, scratch, solids, walls, c, e.missing, e.spacing, searched
            )
    is_beside = False
    if qd.static(searched):
        for i in range(first, qd.min(first + lanes, count)):
            is_beside = is_beside or may_be_cut_off(grid, in_cells(grid, predicted(particles, i)))
    if is_beside:
        find_errors(at, amounts, added, grid, particles, scratch, e, first, part, lanes, searched)
    else:
        find_errors(at, amounts, added, grid, particles, scratch, e, first, part, lanes, 0)
    for lane in range(qd.min(lanes, count - first)):
        for k in qd.static(range(2**dim)):
            add_whole(grid.sums, at[k, lane], amounts[k, lane], grid.alone)


@qd.kernel(fastcache=True)
def gather(
    grid: CoarseGrid,
    particles: Particles,
    scratch: Scratch,
    cells: Grid,
    solids: SolidSet,
    walls: Walls,
    c: Coefficients,
    e: Errors,
    count: qd.i32,
    searched: qd.template(),
    mixed: qd.template(),
    few: qd.template(),
):
    """Sum what nodes have of all particles, find gaps, sum density errors (Eq. 2), and set up the equation.

    The sums are 0 before. There are only the walls of the tank unless solids are `searched`. Where fluids are `mixed`,
    their densities are averaged.

    Threads share the particles in parts; where these are alone, each has sums of its own and waits for no other. Where
    nodes are `few`, one thread is done with them before others have started.
    """
    for turn in range(turns_over(teams(cells, count), parts_of(grid, cells), cells.lanes)):
        begin = first_of_part(turn, teams(cells, count), parts_of(grid, cells), cells.lanes)
        for team in range(begin, end_of_part(turn, teams(cells, count), parts_of(grid, cells), cells.lanes)):
            add_parcels(
                grid,
                particles,
                scratch,
                e.spacing,
                e.unit,
                team,
                grid.alone * part_of(turn),
                count,
                qd.static(cells.lanes),
                searched,
                mixed,
            )
    qd.loop_config(serialize=bool(few))
    for n in range(grid.nx * grid.ny * grid.nz):
        total = taken(grid.sums, n, grid.nx * grid.ny * grid.nz, grid.parts)
        grid.fill[n] = e.volume * total / qd.max(grid.room[n], e.least_open)
        grid.density[n] = 1.0
        if qd.static(mixed):
            mass = taken(grid.mass_sums, n, grid.nx * grid.ny * grid.nz, grid.parts)
            grid.density[n] = qd.max(mass, 1) / qd.cast(qd.max(total, 1), qd.f32)
    if qd.static(searched):
        qd.loop_config(serialize=bool(few))
        for n in range(grid.nx * grid.ny * grid.nz):
            surely = below_roof(grid, n, c) if grid.room[n] >= mostly() else 0.0
            grid.gaps[n] = grid.fill[n] + surely * qd.max(1.0 - grid.fill[n], 0.0)
            grid.slope_y[n] = surely
        qd.loop_config(serialize=bool(few))
        for n in range(grid.nx * grid.ny * grid.nz):
            surely = grid.slope_y[n]
            if grid.room[n] > 0.0 and grid.room[n] < 1.0:
                is_open = openness(grid, n)
                surely = is_open * surely + (1.0 - is_open) * in_part(grid, n)
            close_slit(grid, n, surely, e.slit)
    qd.loop_config(serialize=bool(few))
    for row in range(grid.ny * grid.nz):
        spread_along(grid.rhs, grid.fill, grid, row, 0, across())
        spread_along(grid.slope_y, grid.fill, grid, row, 1, across())
        keep_extremes(grid, row)
    qd.loop_config(serialize=bool(few))
    for row in range(grid.ny * grid.nz):
        spread_along(grid.slope_z, grid.rhs, grid, row, 1, across())
        spread_along(grid.depth, grid.rhs, grid, row, 2, across())
        spread_along(grid.gaps, grid.slope_y, grid, row, 2, across())
    qd.loop_config(serialize=bool(few))
    for n in range(grid.nx * grid.ny * grid.nz):
        grid.rhs[n] = gaps_at(grid, grid.gaps, grid.depth, grid.slope_z, n, e.full)
    qd.loop_config(serialize=bool(few))
    for row in range(grid.ny * grid.nz):
        find_depths(grid, row, vec3(c.gravity_x, c.gravity_y, c.gravity_z))
        for n in range(grid.nx * row, grid.nx * row + grid.nx):
            grid.gaps[n] = grid.rhs[n]
            grid.slope_y[n] = inside_at(grid, n, e)
    if qd.static(searched):
        qd.loop_config(serialize=bool(few))
        for n in range(grid.nx * grid.ny * grid.nz):
            grid.slope_z[n] = depth_beside(grid, n, vec3(c.gravity_x, c.gravity_y, c.gravity_z))
        qd.loop_config(serialize=bool(few))
        for n in range(grid.nx * grid.ny * grid.nz):
            grid.depth[n] = grid.slope_z[n]
    for turn in range(turns_over(teams(cells, count), parts_of(grid, cells), cells.lanes)):
        begin = first_of_part(turn, teams(cells, count), parts_of(grid, cells), cells.lanes)
        for team in range(begin, end_of_part(turn, teams(cells, count), parts_of(grid, cells), cells.lanes)):
            add_errors(
                grid, particles, scratch, solids, walls, c, e, cells, team, grid.alone * part_of(turn), count, searched
            )
    # By all threads even where nodes are few: one thread's loop is compiled to other last digits.
    for n in range(grid.nx * grid.ny * grid.nz):
        total = taken(grid.sums, n, grid.nx * grid.ny * grid.nz, grid.parts)
        error = e.scale * total
        drawn = qd.min(error, 0.0) * ramp(grid.fill[n], e.drawn_from, e.drawn_to)
        borne = ramp(grid.fill[n], e.borne_from, e.borne_to)
        flows = flow_out(grid, n, fall(c)) if borne > 0.0 else 0.0
        grid.rhs[n] = error - drawn - e.per_way * flows * borne
        if qd.static(searched):
            grid.rhs[n] -= grid.slope_x[n] * e.closing * grid.room[n]
        grid.rhs[n] *= left_to_grid(grid, n, e.thin, e.thick)
    qd.loop_config(serialize=bool(few))
    for piece in range(grid.pieces * grid.ny * grid.nz):
        if is_air(grid, piece // grid.pieces):
            part_nodes(grid, piece)
        else:
            couple_nodes(grid, piece, e.least_theta, has_lid(vec3(c.gravity_x, c.gravity_y, c.gravity_z)))


def correct_pressure(world: World, kinds: Blend, params: Parameters, c: Coefficients) -> None:
    """Move the predicted positions so that the share `grid_pressure` of the mean errors of densities vanishes.

    `scratch.rho` holds the densities over that of the heaviest fluid there. Unless solids have moved, the room that
    they leave is what it was.
    """
    finest, cells, count, searched = world.levels[0], world.grid, world.count, int(world.has_solids)
    gravity, few = (c.gravity_x, c.gravity_y, c.gravity_z), int(not is_shared(finest))
    if world.room_version != world.solids_version or (world.pieces and world.room_gravity != gravity):
        world.room_found.fill(0)
        find_room(
            finest, world.room_found, world.solids, c, LEAST_OPEN, UNIT, params.spacing, world.searched, params.dim, few
        )
        find_basins(finest, world.room_found)
        restrict_rooms(world.levels)
        world.room_version, world.room_gravity = world.solids_version, gravity
        thin, world.basins, world.open_nodes = map(int, download(world.room_found))
        world.has_thin_walls = thin > 0
    stiffness = rest_lattice(params.kernel, params.dim, params.support).stiffness
    numbers = errors(finest, params, stiffness, bodies=world.pieces is not None)
    gather(
        finest,
        world.particles,
        world.scratch,
        cells,
        world.solids,
        world.walls,
        c,
        numbers,
        count,
        searched * (1 + world.has_thin_walls),
        kinds.mixed,
        few,
    )
    lid = int(-gravity[1] > 0.7 * math.hypot(*gravity))
    water = count * params.spacing**params.dim
    may_be_sealed = world.basins > 1 or water > MOSTLY_FULL * world.open_nodes * finest.dx * finest.dy * finest.dz
    if may_be_sealed:
        nodes = finest.nx * finest.ny * finest.nz
        balance(finest, LARGEST_SUM / nodes / numbers.per_way if numbers.per_way else 0.0, lid)
    solve_levels(world.levels, lid)
    if may_be_sealed:
        anchor(finest)
    move_particles(
        finest,
        world.particles,
        world.scratch,
        cells,
        world.solids,
        c,
        push_of(params, stiffness, c.h),
        count,
        few,
        searched * (1 + world.has_thin_walls),
        kinds.mixed,
    )
    if world.pieces:
        acting = (1.0 - carried(c.dt, params.frame_time)) * math.hypot(*params.gravity) * c.dt**2
        per_lambda = stiffness / acting if acting else 0.0  # nothing is deep without gravity
        push_on_grid(world, stiffness, per_lambda, c, mixed=kinds.mixed)


def errors(grid: CoarseGrid, params: Parameters, stiffness: float, *, bodies: bool) -> Errors:
    """Return the numbers of `gather`, in a world with `bodies` or without."""
    h = params.support * params.spacing
    volume = params.spacing**params.dim / (grid.dx * grid.dy * grid.dz) / UNIT
    return remembered(
        Errors(
            unit=UNIT,
            volume=volume,
            scale=params.grid_pressure * volume / stiffness,
            per_way=params.grid_pressure / stiffness,
            borne_from=BORNE[0],
            borne_to=BORNE[1],
            inner_from=INNER[0],
            inner_to=INNER[1],
            below_from=BELOW[0] * h,
            below_to=BELOW[1] * h,
            missing=MISSING,
            full=FULL,
            gap_share=GAP_SHARE,
            drawn_from=DRAWN[bodies][0],
            drawn_to=DRAWN[bodies][1],
            least_open=LEAST_OPEN,
            slit=SLIT,
            closing=CLOSING * params.grid_pressure / stiffness,
            least_theta=LEAST_THETA,
            thin=FILM[0],
            thick=FILM[1],
            spacing=params.spacing,
        )
    )

"""Pressure of the whole tank: a correction on a coarse grid before the iterations between particles.

An iteration between particles carries pressure two supports far, so deep water needs many, or short time steps, or it
gives way. Here the density errors of all particles are summed on a grid with cells of about one support, a Poisson
equation is solved there (`multigrid.py`), and the particles are moved by the gradient of its solution. What is left for
the iterations is what the grid cannot see: errors of a few spacings, which they remove fast, whatever the depth.

A field of multipliers lambda moves particles by M grad lambda (Eq. 6; M from the rest lattice, `stiffness`), and
changes the density by -M laplace lambda. For the mean error C the equation is therefore M laplace lambda = C, with
lambda <= 0, because water pushes and does not pull.

Pressure from a grid, details from the particles: Zhu and Bridson 2005 (10.1145/1073204.1073298) in FLIP, Cornelis et
al. 2014 (10.1111/cgf.12324) for SPH. Where we differ: the right-hand side is the error of the particles' own densities,
so that volume does not drift, and it is the positions that are moved. Sums are of whole numbers, so that runs repeat
bit for bit. What was tried: notebook/grid-pressure.md.

In time. A correction at the end of a step is implicit Euler, which damps waves by half of omega^2 dt. Each particle
therefore keeps the acceleration `a` that the grid gave it, and a warm-started share w of it acts in the next
prediction; the grid corrects what that leaves. What acts is the sum of (1 - w) w^n times the acceleration found n
steps ago, w / (1 - w) steps late on average. With w = 1/2 that is one step, and just what takes a velocity from half a
step before a place to half a step after it, as v = (p - x) / dt is: leapfrog, of second order, and waves keep their
height. Below, the share (1 - 2 w) / (1 - w) of the damping stays: w is such that a step of any length damps as one of
the share `damping` of a usual one would (`Parameters.usual_steps`), and steps shorter than that are not warm-started.
It is stable for every omega dt, and modes that are much stiffer than a step are stopped at once, as without it. No more
than `largest_warm_start` times gravity is kept, so that water that hits a wall does not bounce.

Dispersed particles. The displacement accelerates all particles of a place alike, and bears a drop of brine in water as
it bears the water. A particle that is dispersed in another fluid has the displacement of a sphere: the buoyancy
(rho_e - rho_i) g over the inertia rho_i + rho_e / 2 of the sphere and its added mass (Lamb 1932, art. 92). How
dispersed it is, is how far its density lies from the mean there, over how far it lies from any mean near by: 1 for a
drop and in a mixture of single particles, 0 within its own fluid, about 1/3 in the layers on both sides of a level
interface, which are to have no weight of their own; what is higher by a spacing reads 0.7.

    code        symbol     meaning                                                       unit
    density     rho_i      of the particle, over that of the heaviest fluid              1
    around      rho_e      mean at its place                                             1
    share                  of the displacement that a particle takes (`surface.py`)      1
    shallow                confidence that a particle lies in a cell with little liquid  1
"""

import dataclasses
import math

from wavetank.device.compiler import download, qd
from wavetank.device.state import Coefficients, Grid, Particles, Temporaries, interned
from wavetank.foundation.params import Parameters
from wavetank.physics.boundary import fall
from wavetank.physics.clusters import chunks, end_cluster, end_of, first_cluster
from wavetank.physics.contact import clamp_to_tank, flattened
from wavetank.physics.mixture import Blend
from wavetank.physics.pairs import column
from wavetank.physics.predicted_positions import predict_at, predicted
from wavetank.physics.pressure.bodies import push_bodies_by_pressure
from wavetank.physics.pressure.grid import (
    THRESHOLDS,
    Level,
    Part,
    PressureGrid,
    Variant,
    Workspace,
    corners,
    hat_weights,
    in_cells,
    nearest_node,
    neighbor,
    node_at,
    nodes_beyond,
    ramp,
)
from wavetank.physics.pressure.multigrid import is_shared, restrict_solids, solve_levels
from wavetank.physics.pressure.regions import fill_enclosed, find_regions, fix_null_space, make_compatible
from wavetank.physics.pressure.solids import (
    UNIT,
    clear_solids,
    find_apertures,
    find_nearest_walls,
    find_open_volume,
    open_area,
    open_hat_weights,
)
from wavetank.physics.pressure.source import assemble, find_surface, source_of, sum_liquid
from wavetank.physics.pressure.thin_walls import may_be_cut_off
from wavetank.physics.smoothing import rest_lattice
from wavetank.physics.world import World
from wavetank.solids.distance import SolidSet, lift

LARGEST_SUM = float(1 << 29)  # of errors of a region, in whole numbers


@dataclasses.dataclass(frozen=True)
class Displacement:
    """The numbers of `displace_particles`, which are the same in every step of a world."""

    stiffness: qd.f32  # M
    reach: qd.f32  # m: the longest displacement
    carried_depth: qd.f32  # m: depth from which on particles take all of it
    carried_fade: qd.f32  # m: by how much higher they take nothing


def warm_start_share(params: Parameters, dt: float) -> float:
    """Return the share w of the grid's pressure that a step of `dt` [s] starts with; 0 without gravity."""
    share = min(1.0, THRESHOLDS.damping / max(params.usual_steps(dt), 1e-6))
    return (1.0 - share) / (2.0 - share)


# --- what a particle takes of the displacement ---


@qd.func
def gradient_across(grid: Level, coefficient, edge, n, m):
    """Derivative of lambda [m] across the face from node `n` to `m`; not exactly 0 where it leads into liquid."""
    area = qd.max(open_area(grid, n, m), 1e-3)
    return coefficient / area * edge * (grid.lam[m] - grid.lam[n]) + (1e-30 if coefficient > 0.0 else 0.0)


@qd.func
def gradient_along(
    grid: Level, gradient: qd.template(), s, axis: qd.template(), at_rest, dim: qd.template(), has: Variant
):
    """Derivative of lambda [m] along `axis` at the place `s` [cells], from the faces around that lead into liquid.

    The `gradient` of the others is 0. In a gap so narrow that there is none it is that of liquid `at_rest`.
    """
    place = s
    place[axis] -= 0.5
    at = corners(grid, qd.floor(place, qd.i32), dim)
    weights = hat_weights(place - qd.floor(place), dim)
    total, weight = 0.0, 0.0
    for k in qd.static(range(2**dim)):
        own = gradient[at[k]]
        total += weights[k] * own
        weight += weights[k] if own != 0.0 else 0.0
    found = total / qd.max(weight, 1e-9)
    if qd.static(has.solids):
        enclosed = at_rest * ramp(grid.liquid[nearest_node(grid, s)], grid.limits.borne_from, grid.limits.borne_to)
        found = qd.select(weight == 0.0, enclosed, found)
    return found


@qd.func
def farthest_density(grid: Level, middle, density, dim: qd.template()):
    """How far a `density` lies at most from the mean ones at the node at the whole coordinates `middle` and beside it.

    Nodes that are nearly empty do not count.
    """
    farthest = 1e-3
    for k in range(3**dim):
        place = middle + qd.Vector([k % 3 - 1, k // 3 % 3 - 1, k // 9 - 1 if qd.static(dim == 3) else 0])
        n = node_at(grid, place)
        farthest = qd.max(farthest, qd.abs(grid.density[n] - density) if grid.liquid[n] > 0.1 else 0.0)
    return farthest


@qd.func
def buoyancy_share(grid: Level, s, at: qd.template(), weights: qd.template(), density):
    """Displacement of a particle at the place `s` [cells] over that of the fluid around, by the nodes `at` it."""
    dim = qd.static(3 if at.n == 8 else 2)
    around = 0.0
    for k in qd.static(range(at.n)):
        around += weights[k] * grid.density[at[k]]
    dispersed = qd.abs(around - density) / farthest_density(grid, qd.floor(s + 0.5, qd.i32), density, dim)
    share = ramp(dispersed, grid.limits.dispersed_from, grid.limits.dispersed_to)
    return 1.0 + share * (around - density) / (density + 0.5 * around)


@qd.func
def shares_by(
    grid: Level,
    w: Workspace,
    temporaries: Temporaries,
    i,
    s,
    at: qd.template(),
    weights: qd.template(),
    d: Displacement,
    has: Variant,
):
    """(share of the displacement, confidence of shallow liquid) of particle `i` at `s` [cells], by its nodes `at`."""
    depth, liquid = 0.0, 0.0
    for k in qd.static(range(at.n)):
        depth += weights[k] * w.depth[at[k]]
        liquid += weights[k] * grid.liquid[at[k]]
    share = qd.min(qd.max(1.0 + (depth - d.carried_depth) / d.carried_fade, 0.0), 1.0)
    if qd.static(has.mixed):
        share *= buoyancy_share(grid, s, at, weights, 1.0 / temporaries.inverse_mass[i])
    return qd.Vector([share, 1.0 - ramp(liquid, grid.limits.shallow_from, grid.limits.shallow_to)])


# --- the kernel ---


@qd.func
def find_gradients(grid: Level, w: Workspace, n):
    """Find the derivatives of lambda across the faces from node `n` to the next ones."""
    w.gradient_x[n] = gradient_across(grid, grid.coef_x[n], grid.dx, n, neighbor(grid, n, 0, 1))
    above = neighbor(grid, n, 1, 1) if nodes_beyond(grid, n, 1, 1) > 0 else grid.nx * grid.ny * grid.nz
    w.gradient_y[n] = gradient_across(grid, grid.coef_y[n], grid.dy, n, above)  # air below a lid is the arrays' rim
    w.gradient_z[n] = gradient_across(grid, grid.coef_z[n], grid.dz, n, neighbor(grid, n, 2, 1))


@qd.func
def find_shares_behind_walls(
    shares: qd.template(),
    grid: Level,
    w: Workspace,
    particles: Particles,
    temporaries: Temporaries,
    first,
    end,
    d: Displacement,
    has: Variant,
):
    """Find the shares of those particles from `first` to `end` that some nodes are closed to by the others."""
    dim = qd.static(particles.x[first].n)
    for i in range(first, end):
        s = in_cells(grid, predicted(particles, i))
        if may_be_cut_off(grid, w, s):
            at = corners(grid, qd.floor(s, qd.i32), dim)
            weights = open_hat_weights(grid, w, at, s, dim, 1)
            if weights.sum() > 0.5:
                own = shares_by(grid, w, temporaries, i, s, at, weights, d, has)
                shares[0, i - first], shares[1, i - first] = own[0], own[1]


@qd.func
def displace(particles: Particles, i, dp: qd.template(), solids: SolidSet, c: Coefficients, reach):
    """Displace particle `i` by `dp` [m], at most by `reach` [m], inside the tank, and keep that as acceleration."""
    p = predicted(particles, i)
    dp *= qd.min(1.0, reach / qd.max(dp.norm(), 1e-12))
    p += dp
    a = particles.a[i] + dp / (c.dt * c.dt)
    particles.a[i] = a * qd.min(1.0, c.largest_warm_start / qd.max(a.norm(), 1e-12))
    near = particles.near[i]
    if near != 0:
        p = flattened(clamp_to_tank(lift(p), near, solids, c.wall_gap), p)
    predict_at(particles, i, p)


@qd.kernel(fastcache=True)
def displace_particles(
    grid: Level,
    w: Workspace,
    particles: Particles,
    temporaries: Temporaries,
    cells: Grid,
    solids: SolidSet,
    c: Coefficients,
    d: Displacement,
    count: qd.i32,
    has: Variant,
):
    """Displace the predicted positions by M grad lambda, inside the tank; what sticks out of the surface takes less."""
    qd.loop_config(serialize=bool(has.few_nodes))
    for n in range(grid.nx * grid.ny * grid.nz):
        find_gradients(grid, w, n)
    for chunk in range(chunks(cells, count)):
        at_rest = -fall(c) / d.stiffness
        for cluster in range(first_cluster(chunk, cells, count), end_cluster(chunk, cells, count)):
            first = cluster * cells.lanes
            dim = qd.static(particles.x[first].n)
            gradients = qd.Matrix.zero(qd.f32, dim, cells.lanes)
            shares = qd.Matrix.zero(qd.f32, 2, cells.lanes)
            for lane in range(cells.lanes):
                s = in_cells(grid, predicted(particles, first + lane))
                at = corners(grid, qd.floor(s, qd.i32), dim)
                own = shares_by(grid, w, temporaries, first + lane, s, at, hat_weights(s - qd.floor(s), dim), d, has)
                shares[0, lane], shares[1, lane] = own[0], own[1]
                gradients[0, lane] = gradient_along(grid, w.gradient_x, s, 0, at_rest.x, dim, has)
                gradients[1, lane] = gradient_along(grid, w.gradient_y, s, 1, at_rest.y, dim, has)
                if qd.static(dim == 3):
                    gradients[2, lane] = gradient_along(grid, w.gradient_z, s, 2, at_rest.z, dim, has)
            if qd.static(has.thin_walls):
                end = end_of(cluster, cells, count)
                find_shares_behind_walls(shares, grid, w, particles, temporaries, first, end, d, has)
            for i in range(first, end_of(cluster, cells, count)):
                dp = column(gradients, i - first) * (d.stiffness * shares[0, i - first])
                displace(particles, i, dp, solids, c, d.reach)
                temporaries.shallow[i] = shares[1, i - first]


# --- a correction ---


def correct_pressure(world: World, kinds: Blend, params: Parameters, c: Coefficients) -> None:
    """Move the predicted positions so that the share `grid_pressure` of the mean density errors vanishes.

    `temporaries.rho` holds the densities over that of the heaviest fluid there.
    """
    grid = world.pressure
    assert grid is not None, "there is no tank"
    finest, gravity = grid.finest, (c.gravity_x, c.gravity_y, c.gravity_z)
    grid.make_room(*parts_for(world, mixed=kinds.mixed))
    if grid.solids_version != world.solids_version or (world.pieces and grid.gravity != gravity):
        update_open_volume(world, grid, params, c)
    w, has = grid.workspace, variant_of(world, mixed=kinds.mixed, thin_walls=grid.has_thin_walls)
    stiffness = rest_lattice(params.kernel, params.dim, params.support).stiffness
    source = source_of(finest, params, stiffness, bodies=world.pieces is not None)
    sum_liquid(finest, w, world.particles, world.temporaries, world.grid, source, world.count, has)
    find_surface(finest, w, c, source, has)
    lid = int(-c.gravity_y > 0.7 * math.hypot(*gravity))
    may_be_enclosed = grid.may_be_enclosed(world.count * params.spacing**params.dim)
    if may_be_enclosed:
        grid.make_room(Part.ENCLOSED)
        w = grid.workspace
        fill_enclosed(finest, w, lid)
    assemble(
        finest,
        w,
        world.particles,
        world.temporaries,
        world.grid,
        world.solids,
        world.walls,
        c,
        source,
        world.count,
        has,
    )
    if may_be_enclosed:
        nodes = finest.nx * finest.ny * finest.nz
        make_compatible(finest, w, LARGEST_SUM / nodes / source.per_way if source.per_way else 0.0)
    solve_levels(grid.levels, lid)
    if may_be_enclosed:
        fix_null_space(finest, w)
    displace_particles(
        finest,
        w,
        world.particles,
        world.temporaries,
        world.grid,
        world.solids,
        c,
        displacement_of(params, stiffness, c.h),
        world.count,
        has,
    )
    if world.pieces:
        acting = (1.0 - warm_start_share(params, c.dt)) * math.hypot(*params.gravity) * c.dt**2
        per_lambda = stiffness / acting if acting else 0.0  # nothing is deep without gravity
        push_bodies_by_pressure(world, stiffness, per_lambda, c, has)


def variant_of(world: World, *, mixed: int = 0, thin_walls: bool) -> Variant:
    """Return what kernels of the grid are compiled for; some walls may be `thin_walls`."""
    return interned(
        Variant(
            solids=int(world.has_solids),
            thin_walls=int(thin_walls),
            bodies=int(world.pieces is not None),
            mixed=int(mixed),
            few_nodes=int(world.pressure is not None and not is_shared(world.pressure.finest)),
        )
    )


def parts_for(world: World, *, mixed: int = 0) -> list[Part]:
    """Return the parts of the workspace that a world's kernels use, besides those of enclosed regions."""
    needed = ((Part.SOLIDS, world.has_solids), (Part.BODIES, world.pieces is not None), (Part.MIXED, mixed))
    return [part for part, is_needed in needed if is_needed]


def update_open_volume(world: World, grid: PressureGrid, params: Parameters, c: Coefficients) -> None:
    """Find what solids leave open of the cells, once they have moved."""
    has = variant_of(world, thin_walls=world.may_have_thin_walls)
    grid.found.fill(0)
    grid.make_room(*parts_for(world))
    if has.solids:
        find_nearest_walls(grid.finest, grid.workspace, grid.found, world.solids, has)
        find_open_volume(grid.finest, grid.workspace, world.solids, c, UNIT, params.spacing, params.dim, has)
        find_apertures(grid.finest, grid.workspace, params.spacing, has)
    else:
        clear_solids(grid.finest, grid.workspace)
    find_regions(grid.finest, grid.workspace, grid.found)
    restrict_solids(grid.levels)
    grid.solids_version, grid.gravity = world.solids_version, (c.gravity_x, c.gravity_y, c.gravity_z)
    thin, grid.regions, grid.open_nodes = map(int, download(grid.found))
    grid.has_thin_walls = thin > 0


def displacement_of(params: Parameters, stiffness: float, h: float) -> Displacement:
    """Return the numbers of `displace_particles` with `stiffness` M of the rest lattice and support `h` [m]."""
    return interned(
        Displacement(
            stiffness=stiffness,
            reach=THRESHOLDS.reach * h,
            carried_depth=THRESHOLDS.carried_depth * params.spacing,
            carried_fade=THRESHOLDS.carried_fade * params.spacing,
        )
    )

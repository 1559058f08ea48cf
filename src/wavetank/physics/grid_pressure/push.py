"""What the solution of the grid moves particles by.

Each goes by M grad lambda, interpolated from the faces between nodes that lead into water, and carries it on into the
next prediction (`correction.py`, "In time"). What sticks out of the surface has less of it (`surface.py`), what lies in
another fluid that of its own weight (`own_weight.py`).
"""

import dataclasses

from wavetank.device.compiler import qd
from wavetank.device.state import CoarseGrid, Coefficients, Grid, Particles, Scratch, remembered
from wavetank.foundation.params import Parameters
from wavetank.physics.boundary import fall, flattened, kept_in_tank
from wavetank.physics.grid_pressure.coarse_grid import beside_on, corners, in_cells, nearest, ramp, tents
from wavetank.physics.grid_pressure.couplings import open_area
from wavetank.physics.grid_pressure.own_weight import FOREIGN, own_push
from wavetank.physics.grid_pressure.room import open_tents
from wavetank.physics.grid_pressure.surface import carried_share, nodes_beyond
from wavetank.physics.grid_pressure.thin_walls import may_be_cut_off
from wavetank.physics.grid_pressure.weight import BORNE
from wavetank.physics.pairs import column
from wavetank.physics.predicted_positions import predict_at, predicted
from wavetank.physics.teams import end_of, end_team, first_team, turns
from wavetank.solids.distance import SolidSet, lift

PUDDLE = (0.43, 0.6)  # fill at a particle: up to where it lies in a puddle, and from where in none
REACH = 0.2  # of the support: the longest correction
SUPPORTED = 0.48  # d: depth from which on the grid carries a particle in full, a little above the top layer at rest
FADE = 1.0  # d: by how much higher it carries nothing


@dataclasses.dataclass(frozen=True)
class Push:
    """The numbers of `move_particles`, which are the same in every step of a world."""

    stiffness: qd.f32  # M
    reach: qd.f32  # m: the longest correction
    supported: qd.f32  # m: depth from which on particles have all of it
    fade: qd.f32  # m: by how much higher they have none
    borne_from: qd.f32  # the fill from which weight is borne in gaps
    borne_to: qd.f32  # and from which all of it is
    dry: qd.f32  # the fill up to which water is a puddle
    wet: qd.f32  # and from which it is none
    foreign_from: qd.f32  # how foreign a particle is where its own weight begins to count
    foreign_to: qd.f32  # and where all of it does


@qd.func
def slope_across(grid: CoarseGrid, coupled, edge, n, m):
    """Derivative of lambda [m] across the face from node `n` to `m`, told from 0 where it leads into water."""
    area = qd.max(open_area(grid, n, m), 1e-3)
    return coupled / area * edge * (grid.lam[m] - grid.lam[n]) + (1e-30 if coupled > 0.0 else 0.0)


@qd.func
def slope_along(
    grid: CoarseGrid,
    slope: qd.template(),
    s,
    axis: qd.template(),
    at_rest,
    push: Push,
    dim: qd.template(),
    searched: qd.template(),
):
    """Derivative of lambda [m] along `axis` at the place `s` [cells], from the faces around that lead into water.

    The `slope` of the others is 0. In a gap so narrow that there is none it is what holds water `at_rest`.
    """
    place = s
    place[axis] -= 0.5
    at = corners(grid, qd.floor(place, qd.i32), dim)
    weights = tents(place - qd.floor(place), dim)
    total, weight = 0.0, 0.0
    for k in qd.static(range(2**dim)):
        own = slope[at[k]]
        total += weights[k] * own
        weight += weights[k] if own != 0.0 else 0.0
    found = total / qd.max(weight, 1e-9)
    if qd.static(searched):
        enclosed = at_rest * ramp(grid.fill[nearest(grid, qd.floor(s + 0.5, qd.i32))], push.borne_from, push.borne_to)
        found = qd.select(weight == 0.0, enclosed, found)
    return found


@qd.func
def shares_by(
    grid: CoarseGrid,
    scratch: Scratch,
    i,
    s,
    at: qd.template(),
    weights: qd.template(),
    push: Push,
    mixed: qd.template(),
):
    """(share of the grid's push, how surely in a puddle) of particle `i` at `s` [cells], by its nodes `at`."""
    carried_at = carried_share(grid, at, weights, push.supported, push.fade)
    share = carried_at[0]
    if qd.static(mixed):
        density = 1.0 / scratch.weight[i]
        share *= own_push(grid, s, at, weights, density, push.foreign_from, push.foreign_to)
    return qd.Vector([share, 1.0 - ramp(carried_at[1], push.dry, push.wet)])


@qd.kernel(fastcache=True)
def move_particles(
    grid: CoarseGrid,
    particles: Particles,
    scratch: Scratch,
    cells: Grid,
    solids: SolidSet,
    c: Coefficients,
    push: Push,
    count: qd.i32,
    few: qd.template(),
    searched: qd.template(),
    mixed: qd.template(),
):
    """Move the predicted positions by M grad lambda, inside the tank, and carry it on; what sticks out has less.

    Where solids are `searched`, 2 if some are thin walls: how deep water is on their other side is not asked. One
    thread sees to the nodes where they are `few`.
    """
    qd.loop_config(serialize=bool(few))
    for n in range(grid.nx * grid.ny * grid.nz):
        grid.slope_x[n] = slope_across(grid, grid.wx[n], grid.dx, n, beside_on(grid, n, 0, 1))
        above = beside_on(grid, n, 1, 1) if nodes_beyond(grid, n, 1, 1) > 0 else grid.nx * grid.ny * grid.nz
        grid.slope_y[n] = slope_across(grid, grid.wy[n], grid.dy, n, above)  # air below a lid is the rim of the arrays
        grid.slope_z[n] = slope_across(grid, grid.wz[n], grid.dz, n, beside_on(grid, n, 2, 1))
    for turn in range(turns(cells, count)):
        at_rest = -fall(c) / push.stiffness
        for team in range(first_team(turn, cells, count), end_team(turn, cells, count)):
            first = team * cells.lanes
            dim = qd.static(particles.x[first].n)
            slopes = qd.Matrix.zero(qd.f32, dim, cells.lanes)
            shares = qd.Matrix.zero(qd.f32, 2, cells.lanes)
            for lane in range(cells.lanes):
                s = in_cells(grid, predicted(particles, first + lane))
                at = corners(grid, qd.floor(s, qd.i32), dim)
                own = shares_by(grid, scratch, first + lane, s, at, tents(s - qd.floor(s), dim), push, mixed)
                shares[0, lane], shares[1, lane] = own[0], own[1]
                slopes[0, lane] = slope_along(grid, grid.slope_x, s, 0, at_rest.x, push, dim, searched)
                slopes[1, lane] = slope_along(grid, grid.slope_y, s, 1, at_rest.y, push, dim, searched)
                if qd.static(dim == 3):
                    slopes[2, lane] = slope_along(grid, grid.slope_z, s, 2, at_rest.z, push, dim, searched)
            if qd.static(searched == 2):
                for i in range(first, end_of(team, cells, count)):
                    s = in_cells(grid, predicted(particles, i))
                    if may_be_cut_off(grid, s):
                        at = corners(grid, qd.floor(s, qd.i32), dim)
                        weights = open_tents(grid, at, s, dim, 1)
                        if weights.sum() > 0.5:
                            own = shares_by(grid, scratch, i, s, at, weights, push, mixed)
                            shares[0, i - first], shares[1, i - first] = own[0], own[1]
            for i in range(first, end_of(team, cells, count)):
                p = predicted(particles, i)
                dp = column(slopes, i - first) * (push.stiffness * shares[0, i - first])
                dp *= qd.min(1.0, push.reach / qd.max(dp.norm(), 1e-12))
                p += dp
                a = particles.a[i] + dp / (c.dt * c.dt)
                particles.a[i] = a * qd.min(1.0, c.largest_carried / qd.max(a.norm(), 1e-12))
                near = particles.near[i]
                if near != 0:
                    p = flattened(kept_in_tank(lift(p), near, solids, c.wall_gap), p)
                predict_at(particles, i, p)
                scratch.puddle[i] = shares[1, i - first]


def push_of(params: Parameters, stiffness: float, h: float) -> Push:
    """Return the numbers of `move_particles`, of a stiffness M and the support `h` [m]."""
    d = params.spacing
    return remembered(Push(stiffness, REACH * h, SUPPORTED * d, FADE * d, *BORNE, *PUDDLE, *FOREIGN))

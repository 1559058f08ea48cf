"""The right-hand side: density errors of the particles, the weight of the liquid, and moving walls.

Density errors. The right-hand side is the mean error C of the particles' own densities over the stiffness M, so that
volume does not drift. Two corrections: a row in voids reads the density of water at rest where there is less, so that
an error is less by `void_gain` times the void fraction; a row that slides off the one below reads less than the volume
that it takes, and where a cell is full, water that is drawn in for that pushes the row on (it slid ever faster, 0.014
m/s in a tank that had been at rest for a minute: notebook/calm.md, "Slow slips"). So a full cell draws nothing in.

Weight. What gravity moves particles by in a step, less the warm-started share, is the same for all. Beside solids that
cut cells, densities tell it wrong by a part of the whole weight, which drove water round. So it goes to the right-hand
side as the apertures of the cells let it through, and densities are read where particles were before
(`boundary.fall`). The pressure of liquid at rest then fulfils the equation whatever the solids are: a well-balanced
scheme, as Greenberg and Leroux 1996 (10.1137/0733001) have it for shallow water.

Moving walls. The density that a wall adds answers the way of a particle towards it by a share that falls with the
distance: in full where liquid presses on it, by a third below a body, where it stands off a little. `wall_boost` makes
up for what lacks at rest. What a solid moves by itself in a step is answered in full, whatever the distance, as the
layer of particles at it has to make room for all of that way: else a body closes the gap first and hits the water
three steps later.

    code      meaning                                                                       unit
    driven    way of a particle in this step but for gravity and warm-started pressure      m
    fallen    way by which all particles have fallen alike                                  m
"""

import dataclasses

from wavetank.device.compiler import qd
from wavetank.device.state import Coefficients, Grid, Particles, Temporaries, Walls, interned
from wavetank.foundation.params import Parameters
from wavetank.physics.boundary import fall, wall_share
from wavetank.physics.broad_phase import next_marked
from wavetank.physics.clusters import chunks_over, cluster_count, end_of_part, first_of_part, part_of
from wavetank.physics.near_solids import contact_plane, known_solids, slot_index
from wavetank.physics.predicted_positions import predicted
from wavetank.physics.pressure.grid import (
    DRAW_RAMP,
    THRESHOLDS,
    Level,
    Thresholds,
    Variant,
    Workspace,
    add_fixed,
    collected,
    corners,
    hat_weights,
    in_cells,
    nearest_node,
    neighbor,
    nodes_beyond,
    parts_of,
    ramp,
    smooth_along,
)
from wavetank.physics.pressure.liquid import add_footprints, fill_slit, find_roof, voids_at
from wavetank.physics.pressure.multigrid import decouple, set_coefficients
from wavetank.physics.pressure.solids import UNIT, open_area, open_hat_weights
from wavetank.physics.pressure.surface import (
    air_above,
    find_depths,
    find_row_extremes,
    has_lid,
    is_air_row,
    level_depth,
    share_of_grid,
)
from wavetank.physics.pressure.thin_walls import is_blocked_between, may_be_cut_off
from wavetank.solids.distance import SolidSet, image_near, lift, plane_distance, rotate, to_local, vec3


@dataclasses.dataclass(frozen=True)
class Source:
    """The numbers of `assemble` that follow from parameters; they are the same in every step of a world."""

    unit: qd.f32  # what a whole number in the sums is the inverse of
    volume: qd.f32  # of a particle, over that of a cell and the unit
    scale: qd.f32  # 1/m^2, the same over the stiffness M
    per_way: qd.f32  # 1/m^2, the share of errors that is removed, over the stiffness M
    deep_from: qd.f32  # m: depth below the surface from which an error counts
    deep_to: qd.f32  # m: and counts in full
    draw_from: qd.f32  # liquid fraction from which on a cell that reads too little draws in less
    draw_to: qd.f32  # and from which on nothing
    closing: qd.f32  # 1/m^2: share of what lacks in slits that is closed in a step, over the stiffness M
    spacing: qd.f32  # m


def source_of(grid: Level, params: Parameters, stiffness: float, *, bodies: bool) -> Source:
    """Return the numbers of `assemble`, in a world with `bodies` or without; `stiffness` is M of the rest lattice."""
    h = params.support * params.spacing
    volume = params.spacing**params.dim / (grid.dx * grid.dy * grid.dz) / UNIT
    return interned(
        Source(
            unit=UNIT,
            volume=volume,
            scale=params.grid_pressure * volume / stiffness,
            per_way=params.grid_pressure / stiffness,
            deep_from=THRESHOLDS.deep_from * h,
            deep_to=THRESHOLDS.deep_to * h,
            draw_from=DRAW_RAMP[bodies][0],
            draw_to=DRAW_RAMP[bodies][1],
            closing=THRESHOLDS.slit_closing * params.grid_pressure / stiffness,
            spacing=params.spacing,
        )
    )


# --- moving walls ---


@qd.func
def added_by_solids(
    i,
    x,
    p,
    driven,
    near,
    temporaries: Temporaries,
    solids: SolidSet,
    walls: Walls,
    c: Coefficients,
    limits: Thresholds,
    boost,
    spacing,
    searched: qd.template(),
):
    """Relative density that the solids near particle `i` have added on its way from `x` to `p`, in their motion."""
    added, free = 0.0, 1.0
    k = next_marked(near, -1, solids)
    while k < solids.tank_count:
        add_approach(added, free, plane_distance(solids, k, p), p - x, walls, c, boost)
        k = next_marked(near, k, solids)
    if qd.static(searched):
        if near >> solids.tank_count != 0:
            for slot in range(known_solids(temporaries, i)):
                at = slot_index(temporaries, i, slot)
                value = contact_plane(temporaries, at, i, p)
                if value.w < qd.max(c.h, limits.reaction_layer * spacing):  # else nothing of it counts
                    k = temporaries.solid[at]
                    before = image_near(solids, k, x)
                    own = to_local(solids.old_position[k], solids.old_rotation[k], before)
                    moved = solids.position[k] + rotate(solids.rotation[k], own) - before
                    if solids.sweep[k].norm_sqr() > 0.0:
                        added += free * not_answered(value, moved - driven, walls, c, limits, boost, spacing)
                    add_approach(added, free, value, p - x - moved, walls, c, boost)
    return added


@qd.func
def not_answered(value, moved, walls: Walls, c: Coefficients, limits: Thresholds, boost, spacing):
    """What lacks of the answer to a solid, (gradient, distance) as `value`, that has `moved` [m] in this step.

    Its layer of particles has to make room for all of its way.
    """
    wanted = qd.min(qd.max(2.0 * limits.reaction_layer - 2.0 * value.w / spacing, 0.0), 1.0) / spacing
    answer = (1.0 + boost) * wall_share(walls, value.w, c.h)[1] * c.wall_density / c.h
    return moved.dot(vec3(value.x, value.y, value.z)) * qd.max(wanted - answer, 0.0)


@qd.func
def add_approach(added: qd.template(), free: qd.template(), value, way, walls: Walls, c: Coefficients, boost):
    """Add what a solid, (gradient, distance) as `value`, has added on a `way` [m] relative to it."""
    if value.w < c.h:
        share = wall_share(walls, value.w, c.h) * c.wall_density
        inward = -boost * way.dot(vec3(value.x, value.y, value.z))
        added = added * (1.0 - share[0]) + inward * free * share[1] / c.h
        free *= 1.0 - share[0]


# --- density errors of particles ---


@qd.func
def inside_at(grid: Level, w: Workspace, n, source: Source):
    """How far inside of the liquid node `n` lies: below 0 no particle there counts, above 1 all do in full.

    Depths beside solids are known only roughly, and so do not count.
    """
    by_liquid = (grid.liquid[n] - grid.limits.inner_from) / (grid.limits.inner_to - grid.limits.inner_from)
    by_depth = (w.own_depth[n] - source.deep_from) / (source.deep_to - source.deep_from)
    return qd.min(by_liquid, by_depth) if w.far_from_solids[n] > 0.0 else by_liquid


@qd.func
def weights_at(
    grid: Level, w: Workspace, nodes: qd.template(), s, dim: qd.template(), cut: qd.template(), thin: qd.template()
):
    """Hat weights of the `nodes` around the place `s` [cells]; where `cut`, only of those open to it."""
    return open_hat_weights(grid, w, nodes, s, dim, thin) if qd.static(cut) else hat_weights(s - qd.floor(s), dim)


@qd.func
def find_errors(
    at: qd.template(),
    amounts: qd.template(),
    added: qd.template(),
    grid: Level,
    w: Workspace,
    particles: Particles,
    temporaries: Temporaries,
    source: Source,
    first,
    part,
    lanes: qd.template(),
    cut: qd.template(),
    thin: qd.template(),
):
    """Find what a cluster's particles from number `first` on add to a `part`'s sums, and where."""
    dim = qd.static(particles.x[first].n)
    for lane in range(lanes):
        s = in_cells(grid, predicted(particles, first + lane))
        nodes = corners(grid, qd.floor(s, qd.i32), dim)
        weights = weights_at(grid, w, nodes, s, dim, cut, thin)
        inside = 0.0
        for k in qd.static(range(2**dim)):
            inside += weights[k] * w.inside[nodes[k]]
        error = temporaries.rho[first + lane] * temporaries.inverse_mass[first + lane] - 1.0
        error += added[0, lane] - grid.limits.void_gain * w.voids[nearest_node(grid, s)]
        error = source.unit * ramp(inside, 0.0, 1.0) * qd.min(qd.max(error, -1.0), 1.0)
        for k in qd.static(range(2**dim)):
            at[k, lane] = part * grid.nx * grid.ny * grid.nz + nodes[k]
            amounts[k, lane] = qd.cast(qd.round(error * weights[k]), qd.i32)


@qd.func
def add_errors(
    grid: Level,
    w: Workspace,
    particles: Particles,
    temporaries: Temporaries,
    solids: SolidSet,
    walls: Walls,
    c: Coefficients,
    source: Source,
    cluster,
    part,
    count,
    lanes: qd.template(),
    has: Variant,
):
    """Add the hat weights of a cluster's particles times their errors (Eq. 2) to a `part`'s sums."""
    first = cluster * lanes
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
            added[0, i - first] = added_by_solids(
                i,
                x,
                p - fall(c),
                driven,
                near,
                temporaries,
                solids,
                walls,
                c,
                grid.limits,
                grid.limits.wall_boost,
                source.spacing,
                has.solids,
            )
    is_cut_off = False
    if qd.static(has.solids):
        for i in range(first, qd.min(first + lanes, count)):
            is_cut_off = is_cut_off or may_be_cut_off(grid, w, in_cells(grid, predicted(particles, i)))
    if is_cut_off:
        find_errors(
            at, amounts, added, grid, w, particles, temporaries, source, first, part, lanes, has.solids, has.thin_walls
        )
    else:
        find_errors(at, amounts, added, grid, w, particles, temporaries, source, first, part, lanes, 0, 0)
    for lane in range(qd.min(lanes, count - first)):
        for k in qd.static(range(2**dim)):
            add_fixed(w.sums, at[k, lane], amounts[k, lane], grid.alone)


# --- weight ---


@qd.func
def flow_out(grid: Level, w: Workspace, n, fallen):
    """Share of a cell that flows out of that of node `n`, where all liquid has `fallen` by the same way [m].

    Far from solids, and between two nodes, as much flows in.
    """
    edges = vec3(grid.dx, grid.dy, grid.dz)
    total = 0.0
    for axis in qd.static(range(3)):  # unrolled: sums of a loop round differently
        is_between = qd.min(nodes_beyond(grid, n, axis, -1), nodes_beyond(grid, n, axis, 1)) > 0
        if (grid.nz > 1 or axis < 2) and not (is_between and w.far_from_solids[n] > 0.0):
            for side in qd.static((-1, 1)):
                if nodes_beyond(grid, n, axis, side) > 0:
                    m = neighbor(grid, n, axis, side)
                    is_open = qd.min(grid.open_volume[n], grid.open_volume[m]) > 0.0
                    if is_open and is_blocked_between(grid, w, n, m, axis) == 0:
                        total += side * open_area(grid, n, m) * fallen[axis] / edges[axis]
                if qd.static(axis == 1 and side == 1):
                    total += air_above(grid, n, has_lid(fallen)) * fallen[axis] / edges[axis]
    return total


# --- the kernel; its loops are tasks of their own, and what they do for a node, a row or a cluster are functions ---


@qd.func
def measure_liquid(grid: Level, w: Workspace, n, source: Source, has: Variant):
    """Turn the sums of footprints at node `n` into its liquid fraction and mean density."""
    total = collected(w.sums, n, grid.nx * grid.ny * grid.nz, grid.parts)
    grid.liquid[n] = source.volume * total / qd.max(grid.open_volume[n], grid.limits.least_open)
    grid.density[n] = 1.0
    if qd.static(has.mixed):
        mass = collected(w.mass_sums, n, grid.nx * grid.ny * grid.nz, grid.parts)
        grid.density[n] = qd.max(mass, 1) / qd.cast(qd.max(total, 1), qd.f32)


@qd.func
def find_depths_and_inside(grid: Level, w: Workspace, row, c: Coefficients, source: Source):
    """Find the depths of a row of nodes, and how far inside of the liquid they lie."""
    find_depths(grid, w, w.own_depth, row, vec3(c.gravity_x, c.gravity_y, c.gravity_z))
    for n in range(grid.nx * row, grid.nx * row + grid.nx):
        w.depth[n] = w.own_depth[n]
        w.inside[n] = inside_at(grid, w, n, source)


@qd.func
def set_rhs(grid: Level, w: Workspace, n, c: Coefficients, source: Source, has: Variant):
    """Turn the sums of errors at node `n` into its right-hand side."""
    total = collected(w.sums, n, grid.nx * grid.ny * grid.nz, grid.parts)
    error = source.scale * total
    drawn = qd.min(error, 0.0) * ramp(grid.liquid[n], source.draw_from, source.draw_to)
    borne = ramp(grid.liquid[n], grid.limits.borne_from, grid.limits.borne_to)
    flows = flow_out(grid, w, n, fall(c)) if borne > 0.0 else 0.0
    grid.rhs[n] = error - drawn - source.per_way * flows * borne
    if qd.static(has.solids):
        grid.rhs[n] -= w.slit_deficit[n] * source.closing * grid.open_volume[n]
    grid.rhs[n] *= share_of_grid(grid, w, n)


@qd.kernel(fastcache=True)
def sum_liquid(
    grid: Level,
    w: Workspace,
    particles: Particles,
    temporaries: Temporaries,
    cells: Grid,
    source: Source,
    count: qd.i32,
    has: Variant,
):
    """Sum the footprints of all particles at the nodes.

    The sums are 0 before. Threads share the particles in parts; where these are alone, each has sums of its own and
    waits for no other.
    """
    for chunk in range(chunks_over(cluster_count(cells, count), parts_of(grid, cells), cells.lanes)):
        begin = first_of_part(chunk, cluster_count(cells, count), parts_of(grid, cells), cells.lanes)
        end = end_of_part(chunk, cluster_count(cells, count), parts_of(grid, cells), cells.lanes)
        for cluster in range(begin, end):
            add_footprints(
                grid,
                w,
                particles,
                temporaries,
                source.spacing,
                source.unit,
                cluster,
                grid.alone * part_of(chunk),
                count,
                qd.static(cells.lanes),
                has,
            )


@qd.kernel(fastcache=True)
def find_surface(grid: Level, w: Workspace, c: Coefficients, source: Source, has: Variant):
    """Find how full the cells are, the voids in the liquid, its surface, and how deep nodes lie below it."""
    qd.loop_config(serialize=bool(has.few_nodes))
    for n in range(grid.nx * grid.ny * grid.nz):
        measure_liquid(grid, w, n, source, has)
    if qd.static(has.solids):
        qd.loop_config(serialize=bool(has.few_nodes))
        for n in range(grid.nx * grid.ny * grid.nz):
            find_roof(grid, w, n, c)
        qd.loop_config(serialize=bool(has.few_nodes))
        for n in range(grid.nx * grid.ny * grid.nz):
            fill_slit(grid, w, n)
    qd.loop_config(serialize=bool(has.few_nodes))
    for row in range(grid.ny * grid.nz):
        smooth_along(w.mean_x, grid.liquid, grid, row, 0, grid.limits.void_across)
        smooth_along(w.mean_y, grid.liquid, grid, row, 1, grid.limits.void_across)
        find_row_extremes(grid, w, row)
    qd.loop_config(serialize=bool(has.few_nodes))
    for row in range(grid.ny * grid.nz):
        smooth_along(w.mean_xy, w.mean_x, grid, row, 1, grid.limits.void_across)
        smooth_along(w.mean_xz, w.mean_x, grid, row, 2, grid.limits.void_across)
        smooth_along(w.mean_yz, w.mean_y, grid, row, 2, grid.limits.void_across)
    qd.loop_config(serialize=bool(has.few_nodes))
    for n in range(grid.nx * grid.ny * grid.nz):
        w.voids[n] = voids_at(grid, w, n, grid.limits.full)
    qd.loop_config(serialize=bool(has.few_nodes))
    for row in range(grid.ny * grid.nz):
        find_depths_and_inside(grid, w, row, c, source)
    if qd.static(has.solids):
        qd.loop_config(serialize=bool(has.few_nodes))
        for n in range(grid.nx * grid.ny * grid.nz):
            w.depth[n] = level_depth(grid, w, n, vec3(c.gravity_x, c.gravity_y, c.gravity_z))


@qd.kernel(fastcache=True)
def assemble(
    grid: Level,
    w: Workspace,
    particles: Particles,
    temporaries: Temporaries,
    cells: Grid,
    solids: SolidSet,
    walls: Walls,
    c: Coefficients,
    source: Source,
    count: qd.i32,
    has: Variant,
):
    """Sum the particles' density errors at the nodes, and set up the equation; the sums are 0 before and after."""
    for chunk in range(chunks_over(cluster_count(cells, count), parts_of(grid, cells), cells.lanes)):
        begin = first_of_part(chunk, cluster_count(cells, count), parts_of(grid, cells), cells.lanes)
        end = end_of_part(chunk, cluster_count(cells, count), parts_of(grid, cells), cells.lanes)
        for cluster in range(begin, end):
            add_errors(
                grid,
                w,
                particles,
                temporaries,
                solids,
                walls,
                c,
                source,
                cluster,
                grid.alone * part_of(chunk),
                count,
                qd.static(cells.lanes),
                has,
            )
    # By all threads even where nodes are few: one thread's loop is compiled to other last digits.
    for n in range(grid.nx * grid.ny * grid.nz):
        set_rhs(grid, w, n, c, source, has)
    qd.loop_config(serialize=bool(has.few_nodes))
    for segment in range(grid.segments * grid.ny * grid.nz):
        if is_air_row(grid, w, segment // grid.segments):
            decouple(grid, segment)
        else:
            set_coefficients(grid, segment, has_lid(vec3(c.gravity_x, c.gravity_y, c.gravity_z)))

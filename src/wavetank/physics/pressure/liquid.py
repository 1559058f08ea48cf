"""The liquid in the cells: liquid fractions, cells under overhangs, and voids between rows of particles.

Footprints. A particle that counts at nodes as a point makes a level row fill a cell by more or less as it passes a
node. Cells whose edges are not a whole number of spacings then read up to 1 % too much and too little, and the height
of a surface was off by -7 %, or +47 % while a row passed a node; waves grew from nothing in some tanks and were damped
eight times too much in others (notebook/calm.md, "Tanks that slosh"). So a particle counts as a box of the spacing,
which fills the space of a lattice without a gap: what a node has of it is the mean of its hat function over the box, a
GIMP shape function (Bardenhagen and Kober 2004, 10.3970/cmes.2004.005.477). Three nodes along an axis have a share.

Cells under overhangs. Half a spacing of air between liquid and the bottom of a body was a free surface to the grid: the
pressure there came and went from step to step, and pushed a held box with 0.3 to 1.5 times its buoyancy. So a cell
below a roof counts as full where there is liquid below it, and a cell that a solid cuts where the open ones beside it
are. A roof faces down: the side of a body that leans by a few degrees is not one. All of it is a confidence from 0 to 1
and not a decision, since nodes crossed a bound because a body had moved by a hundredth of a spacing
(notebook/calm.md, "Roofs and sides").

Voids. Particles in rows, near in one direction and far in the other, read the density of water at rest where there is
less: the kernel is pointed and counts near ones most. The grid counts volume, so it knows: even the fullest cells
around are less than full. Near a free surface those below are full, so that water at rest has no voids. Single cells
say little: a lattice of r spacings a cell aliases, hat weights add up to 1 + 2 sinc^2(r) cos(phase), 3.3 % more and
less at r = 7/4. So three cells in a row count, each with those beside it, which leaves (1 + 2 cos(2 pi r)) / 3 of that
pattern, a third at 7/4 and an eighth at 1.7 (notebook/calm.md, "Tanks of another size").

    code      meaning                                                                  unit
    s         place of a particle                                                      cells
    share     of the box, which the nodes before, nearest and after have               1
    roof      confidence that what lacks at a node is a slit below a roof              1
    x, y, z   liquid fraction of a node and of those beside it across that axis, mean  1
"""

from wavetank.device.compiler import qd
from wavetank.device.state import Coefficients, Particles, Temporaries
from wavetank.physics.predicted_positions import predicted
from wavetank.physics.pressure.grid import (
    Level,
    Variant,
    Workspace,
    add_fixed,
    clamped,
    clamped_neighbor,
    directions,
    in_cells,
    on_axis,
    ramp,
)
from wavetank.physics.pressure.thin_walls import is_blocked_between, is_open_to
from wavetank.solids.distance import vec3

# --- footprints of particles ---


@qd.func
def find_shares(shares: qd.template(), nodes: qd.template(), lane, grid: Level, s, spacing, dim: qd.template()):
    """Find for a `lane` what the nodes before, nearest to and after the place `s` [cells] have, axis by axis.

    `nodes` are by how much these add to the number of a node, beyond the tank as the nearest one there. Along x they
    are three that follow each other, also at its ends: beyond these the last ones have it. The tenth, 0 before, is the
    nearest node.
    """
    edges, strides = vec3(grid.dx, grid.dy, grid.dz), qd.Vector([1, grid.nx, grid.nx * grid.ny])
    for axis in qd.static(range(dim)):
        size = qd.min(spacing / edges[axis], 1.0)
        middle = qd.floor(s[axis] + 0.5)
        aside, half = s[axis] - middle, 0.5 * size
        before, over_before = qd.max(half - aside, 0.0), qd.max(-half - aside, 0.0)
        after, over_after = qd.max(half + aside, 0.0), qd.max(aside - half, 0.0)
        shares[3 * axis, lane] = (before * before - over_before * over_before) / (2.0 * size)
        shares[3 * axis + 2, lane] = (after * after - over_after * over_after) / (2.0 * size)
        shares[3 * axis + 1, lane] = 1.0 - shares[3 * axis, lane] - shares[3 * axis + 2, lane]
        for k in qd.static(range(3)):
            nodes[3 * axis + k, lane] = clamped(grid, qd.cast(middle, qd.i32) + k - 1, axis) * strides[axis]
        nodes[9, lane] += nodes[3 * axis + 1, lane]
        if qd.static(axis == 0 and not grid.periodic & 1):
            begin = qd.max(qd.min(qd.cast(middle, qd.i32) - 1, grid.nx - 3), 0)
            own = vec3(shares[0, lane], shares[1, lane], shares[2, lane])
            for k in qd.static(range(3)):
                share = 0.0
                for other in qd.static(range(3)):
                    share += qd.select(nodes[other, lane] == begin + k, own[other], 0.0)
                shares[k, lane] = share
            for k in qd.static(range(3)):
                nodes[k, lane] = begin + k


@qd.func
def share_of(shares: qd.template(), lane, k: qd.template(), dim: qd.template()):
    """Share that the `k`-th of the nodes around has, the first axis fastest."""
    share = shares[k % 3, lane] * shares[3 + k // 3 % 3, lane]
    if qd.static(dim == 3):
        share *= shares[6 + k // 9, lane]
    return share


@qd.func
def node_of(nodes: qd.template(), lane, k: qd.template(), dim: qd.template()):
    """Number of the `k`-th of the nodes around, the first axis fastest."""
    node = nodes[k % 3, lane] + nodes[3 + k // 3 % 3, lane]
    if qd.static(dim == 3):
        node += nodes[6 + k // 9, lane]
    return node


@qd.func
def aside_of(grid: Level, nodes: qd.template(), lane, k: qd.template()):
    """By how much the number of the `k`-th node of a row is more than that of the first."""
    aside = k
    if qd.static(grid.periodic & 1):
        aside = nodes[k, lane] - nodes[0, lane]
    return aside


@qd.func
def add_to_open_nodes(grid: Level, w: Workspace, s, spacing, unit, density, begin, dim: qd.template(), has: Variant):
    """Add the shares of the particle at the place `s` [cells], where nodes closed to it leave theirs to the others."""
    shares, nodes = qd.Matrix.zero(qd.f32, 9, 1), qd.Matrix.zero(qd.i32, 10, 1)
    find_shares(shares, nodes, 0, grid, s, spacing, dim)
    own, at = qd.Vector.zero(qd.f32, 3**dim), qd.Vector.zero(qd.i32, 3**dim)
    low = qd.floor(s + 0.5, qd.i32) - 1
    total, found = 0.0, 0
    for row in range(qd.static(3 ** (dim - 1))):
        share = shares[3 + row % 3, 0]
        first = nodes[3 + row % 3, 0]
        if qd.static(dim == 3):
            share *= shares[6 + row // 3, 0]
            first += nodes[6 + row // 3, 0]
        if share > 0.0:
            node = qd.Vector([low[0], low[1] + row % 3, low[2] + row // 3 if dim == 3 else 0])
            for k in range(3):
                n = first + nodes[k, 0]
                node[0] = nodes[k, 0] if qd.static(not grid.periodic & 1) else low[0] + k
                if shares[k, 0] > 0.0 and is_open_to(grid, w, n, node, s, has.thin_walls) > 0.0:
                    own[found], at[found] = shares[k, 0] * share, n
                    total += own[found]
                    found += 1
    for k in range(found):
        amount = unit * own[k] / qd.max(total, 1e-3)
        add_fixed(w.sums, begin + at[k], qd.cast(qd.round(amount), qd.i32), grid.alone)
        if qd.static(has.mixed):
            add_fixed(w.mass_sums, begin + at[k], qd.cast(qd.round(amount * density), qd.i32), grid.alone)


@qd.func
def add_footprints(
    grid: Level,
    w: Workspace,
    particles: Particles,
    temporaries: Temporaries,
    spacing,
    unit,
    cluster,
    part,
    count,
    lanes: qd.template(),
    has: Variant,
):
    """Add the volume of a cluster's `lanes` particles to the nodes that their boxes overlap, in the sums of a `part`.

    Where fluids are mixed their masses are added as well. A node without open volume, or behind a thin wall, takes
    nothing: its share goes to the particle's other nodes.
    """
    # All loops over lanes but the last become vectors, which takes half of the time; shares and sums in one would not.
    first, begin = cluster * lanes, part * grid.nx * grid.ny * grid.nz
    dim = qd.static(particles.x[first].n)
    shares = qd.Matrix.zero(qd.f32, 9, lanes)
    nodes = qd.Matrix.zero(qd.i32, 10, lanes)
    rows = qd.Matrix.zero(qd.i32, 3 ** (dim - 1), lanes)
    amounts = qd.Matrix.zero(qd.i32, 3**dim, lanes)
    masses = qd.Matrix.zero(qd.i32, 3**dim if has.mixed else 1, lanes)
    for lane in range(lanes):
        find_shares(shares, nodes, lane, grid, in_cells(grid, predicted(particles, first + lane)), spacing, dim)
    for lane in range(lanes):
        for row in qd.static(range(3 ** (dim - 1))):
            rows[row, lane] = begin + node_of(nodes, lane, 3 * row, dim)
        for k in qd.static(range(3**dim)):
            amount = unit * share_of(shares, lane, k, dim)
            amounts[k, lane] = qd.cast(qd.round(amount), qd.i32)
            if qd.static(has.mixed):
                masses[k, lane] = qd.cast(qd.round(amount / temporaries.inverse_mass[first + lane]), qd.i32)
    for lane in range(qd.min(lanes, count - first)):
        is_cut_off = False
        if qd.static(has.solids):
            is_cut_off = w.near_closed[nodes[9, lane]] > 0.0
            if is_cut_off:
                s = in_cells(grid, predicted(particles, first + lane))
                density = 1.0 / temporaries.inverse_mass[first + lane]
                add_to_open_nodes(grid, w, s, spacing, unit, density, begin, dim, has)
        if not is_cut_off:
            for k in qd.static(range(3**dim)):
                at = rows[k // 3, lane] + aside_of(grid, nodes, lane, k % 3)
                add_fixed(w.sums, at, amounts[k, lane], grid.alone)
                if qd.static(has.mixed):
                    add_fixed(w.mass_sums, at, masses[k, lane], grid.alone)


# --- cells under overhangs ---


@qd.func
def openness(grid: Level, n):
    """How far a node counts as open, 0 to 1: at 0 a solid takes so much that its liquid fraction is not reliable."""
    return ramp(grid.open_volume[n], grid.limits.mostly_open, 1.0)


@qd.func
def is_mostly_open(grid: Level, n):
    """Confidence that a node is open for the most part."""
    return ramp(grid.open_volume[n], grid.limits.mostly_open - 0.05, grid.limits.mostly_open + 0.05)


@qd.func
def is_without_air(liquid):
    """Confidence that a cell with this `liquid` fraction has no air."""
    return qd.min(qd.max(5.0 * (liquid - 0.7), 0.0), 1.0)


@qd.func
def is_below_roof(grid: Level, w: Workspace, n, c: Coefficients):
    """Confidence that what lacks at an open node `n` is a slit between liquid below and a solid above.

    A wall that leans by 60 degrees and more from the horizontal is not a roof, one up to 30 degrees is.
    """
    surely = 0.0
    gravity = vec3(c.gravity_x, c.gravity_y, c.gravity_z)
    strength = gravity.norm()
    for direction in range(directions(grid)):
        axis, side = direction // 2, 2 * (direction % 2) - 1
        if -side * on_axis(gravity.x, gravity.y, gravity.z, axis) > 0.7 * strength:
            roof, below = clamped_neighbor(grid, n, axis, side), clamped_neighbor(grid, n, axis, -side)
            if grid.open_volume[roof] < grid.limits.uncut and grid.open_volume[below] >= grid.limits.uncut:
                surely = qd.max(surely, is_without_air(grid.liquid[below]))
    down = gravity / qd.max(strength, 1e-12)
    facing = w.wall_x[n] * down.x + w.wall_y[n] * down.y + w.wall_z[n] * down.z
    return surely * ramp(facing, grid.limits.roof_from, grid.limits.roof_to)


@qd.func
def is_slit_in_cut_cell(grid: Level, w: Workspace, n):
    """The same for a node whose cell a solid cuts: where all open nodes beside it are full.

    Where none is open, as below a roof near the face of a cell, those count that are mostly so. What lies behind a thin
    wall is not beside it.
    """
    lacks_open, most_open, lacks_mostly, most_mostly = 0.0, 0.0, 0.0, 0.0
    for direction in range(directions(grid)):
        axis, side = direction // 2, 2 * (direction % 2) - 1
        at = clamped_neighbor(grid, n, axis, side)
        if at != n and is_blocked_between(grid, w, n, at, axis) == 0:
            lacks = 1.0 - is_without_air(w.liquid_below_roofs[at])
            is_open = openness(grid, at)
            lacks_open = qd.max(lacks_open, is_open * lacks)
            most_open = qd.max(most_open, is_open)
            is_open = is_mostly_open(grid, at)
            lacks_mostly = qd.max(lacks_mostly, is_open * lacks)
            most_mostly = qd.max(most_mostly, is_open)
    cut = 1.0 - is_mostly_open(grid, n)
    return most_open - lacks_open + (1.0 - most_open) * (most_mostly - lacks_mostly) * cut


@qd.func
def find_roof(grid: Level, w: Workspace, n, c: Coefficients):
    """Find the confidence that node `n` is a slit below a roof, and the liquid fraction with that slit filled."""
    surely = is_below_roof(grid, w, n, c) if grid.open_volume[n] >= grid.limits.mostly_open else 0.0
    w.liquid_below_roofs[n] = grid.liquid[n] + surely * qd.max(1.0 - grid.liquid[n], 0.0)
    w.roof[n] = surely


@qd.func
def fill_slit(grid: Level, w: Workspace, n):
    """Count node `n` as full of liquid as far as it is a slit, and keep what lacks there."""
    surely = w.roof[n]
    if grid.open_volume[n] > 0.0 and grid.open_volume[n] < 1.0:
        is_open = openness(grid, n)
        surely = is_open * surely + (1.0 - is_open) * is_slit_in_cut_cell(grid, w, n)
    liquid = grid.liquid[n]
    w.slit_deficit[n] = surely * qd.max(grid.limits.slit_full - liquid, 0.0)
    grid.liquid[n] = liquid + surely * qd.max(1.0 - liquid, 0.0)


# --- voids between rows of particles ---


@qd.func
def fullest_around(grid: Level, w: Workspace, n):
    """Mean liquid fraction of the fullest three cells in a row, of those that begin at node `n` or beside it."""
    fullest = 0.0
    for axis in qd.static(range(3)):
        if grid.nz > 1 or axis < 2:
            means = qd.static((w.mean_yz, w.mean_xz, w.mean_xy)[axis])
            for direction in range(2):
                at, row = n, qd.Vector.zero(qd.f32, 4)
                for k in qd.static(range(4)):
                    row[k] = means[at]
                    at = clamped_neighbor(grid, at, axis, 2 * direction - 1)
                fullest = qd.max(fullest, qd.max(row[0], row[3]) + row[1] + row[2])
    return fullest / 3.0


@qd.func
def voids_at(grid: Level, w: Workspace, n, full):
    """How far even the fullest cells around node `n` are from `full`.

    It is 0 near solids, where open volumes are not known well enough, and where there is no liquid.
    """
    voids = 0.0
    if qd.min(w.far_from_solids[n], grid.liquid[n]) > 0.0:
        voids = qd.max(full - fullest_around(grid, w, n), 0.0)
    return voids

"""Which share of a particle each node of the grid has: that of a box as large as the spacing.

A particle that counts at nodes as a point, with the tents of linear interpolation, makes a level row fill a cell by
more or less as it passes a node. Cells whose edges are no whole number of spacings then read up to 1 % too much and
too little, and by how far a surface rises was told wrong by -7 %, or +47 % while a row passed a node. The top layer,
which is carried by its depth, followed with a delay: waves grew from nothing in some tanks, by a factor e in 20 s, and
in others they were damped eight times too much (notebook/calm.md, "Tanks that slosh").

Boxes of the spacing fill the room of a lattice without a gap, wherever it lies. What a node has of one is the mean of
its tent over the box: the generalized interpolation of Bardenhagen and Kober 2004 (10.3970/cmes.2004.005.477), who
cured the noise of material points that cross cells with it. Three nodes along an axis have a share.

    code      meaning                                                        unit
    s         place of a particle                                            cells
    size      edge of the box                                                cells
    share     of the box, which the nodes before, nearest and behind have    1
"""

from wavetank.device.compiler import qd
from wavetank.device.state import CoarseGrid, Particles, Scratch
from wavetank.physics.grid_pressure.coarse_grid import add_whole, in_cells, on_axis
from wavetank.physics.grid_pressure.thin_walls import is_open_to
from wavetank.physics.predicted_positions import predicted
from wavetank.solids.distance import vec3


@qd.func
def find_shares(shares: qd.template(), nodes: qd.template(), lane, grid: CoarseGrid, s, spacing, dim: qd.template()):
    """Find for a `lane` what the nodes before, nearest to and behind the place `s` [cells] have, axis by axis.

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
            nodes[3 * axis + k, lane] = on_axis(grid, qd.cast(middle, qd.i32) + k - 1, axis) * strides[axis]
        nodes[9, lane] += nodes[3 * axis + 1, lane]
        if qd.static(axis == 0 and not grid.repeats & 1):
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
def aside_of(grid: CoarseGrid, nodes: qd.template(), lane, k: qd.template()):
    """By how much the number of the `k`-th node of a row is more than that of the first."""
    aside = k
    if qd.static(grid.repeats & 1):
        aside = nodes[k, lane] - nodes[0, lane]
    return aside


@qd.func
def add_to_open(
    grid: CoarseGrid, s, spacing, unit, density, begin, dim: qd.template(), thin: qd.template(), mixed: qd.template()
):
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
                node[0] = nodes[k, 0] if qd.static(not grid.repeats & 1) else low[0] + k
                if shares[k, 0] > 0.0 and is_open_to(grid, n, node, s, thin) > 0.0:
                    own[found], at[found] = shares[k, 0] * share, n
                    total += own[found]
                    found += 1
    for k in range(found):
        amount = unit * own[k] / qd.max(total, 1e-3)
        add_whole(grid.sums, begin + at[k], qd.cast(qd.round(amount), qd.i32), grid.alone)
        if qd.static(mixed):
            add_whole(grid.mass_sums, begin + at[k], qd.cast(qd.round(amount * density), qd.i32), grid.alone)


@qd.func
def add_parcels(
    grid: CoarseGrid,
    particles: Particles,
    scratch: Scratch,
    spacing,
    unit,
    team,
    part,
    count,
    lanes: qd.template(),
    searched: qd.template(),
    mixed: qd.template(),
):
    """Add to the sums of a `part` what nodes have of a team of `lanes` particles; where `mixed`, times their densities.

    Where solids are `searched`, nodes without room leave theirs to others; with 2, so do those behind a thin wall.
    """
    # All loops over lanes but the last become vectors, which takes half of the time; shares and sums in one would not.
    first, begin = team * lanes, part * grid.nx * grid.ny * grid.nz
    dim = qd.static(particles.x[first].n)
    shares = qd.Matrix.zero(qd.f32, 9, lanes)
    nodes = qd.Matrix.zero(qd.i32, 10, lanes)
    rows = qd.Matrix.zero(qd.i32, 3 ** (dim - 1), lanes)
    amounts = qd.Matrix.zero(qd.i32, 3**dim, lanes)
    masses = qd.Matrix.zero(qd.i32, 3**dim if mixed else 1, lanes)
    for lane in range(lanes):
        find_shares(shares, nodes, lane, grid, in_cells(grid, predicted(particles, first + lane)), spacing, dim)
    for lane in range(lanes):
        for row in qd.static(range(3 ** (dim - 1))):
            rows[row, lane] = begin + node_of(nodes, lane, 3 * row, dim)
        for k in qd.static(range(3**dim)):
            amount = unit * share_of(shares, lane, k, dim)
            amounts[k, lane] = qd.cast(qd.round(amount), qd.i32)
            if qd.static(mixed):
                masses[k, lane] = qd.cast(qd.round(amount / scratch.weight[first + lane]), qd.i32)
    for lane in range(qd.min(lanes, count - first)):
        is_beside = False
        if qd.static(searched):
            is_beside = grid.clear[nodes[9, lane]] < 0.0
            if is_beside:
                s = in_cells(grid, predicted(particles, first + lane))
                density = 1.0 / scratch.weight[first + lane]
                add_to_open(grid, s, spacing, unit, density, begin, dim, searched - 1, mixed)
        if not is_beside:
            for k in qd.static(range(3**dim)):
                at = rows[k // 3, lane] + aside_of(grid, nodes, lane, k % 3)
                add_whole(grid.sums, at, amounts[k, lane], grid.alone)
                if qd.static(mixed):
                    add_whole(grid.mass_sums, at, masses[k, lane], grid.alone)

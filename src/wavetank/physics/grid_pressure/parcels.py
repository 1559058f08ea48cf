"""Which share of a particle each node of the grid has: that of a box as large as the spacing.

A particle that counts at nodes as a point, with the tents of linear interpolation, makes a level row fill a cell by
more or less as it passes a node. Cells whose edges are no whole number of spacings then read up to 1 % too much and
too little, and by how far a surface rises was told wrong by -7 %, or +47 % while a row passed a node. The top layer,
which is carried by its depth, followed with a delay: waves grew from nothing in some tanks, by a factor e in 20 s, and
in others they were damped eight times too much (docs/notebook/calm.md, "Tanks that slosh").

Boxes of the spacing fill the room of a lattice without a gap, wherever it lies. What a node has of one is the mean of
its tent over the box: the generalized interpolation of Bardenhagen and Kober 2004 (10.3970/cmes.2004.005.477), who
cured the noise of material points that cross cells with it. Three nodes along an axis have a share.

    code      meaning                                                        unit
    s         place of a particle                                            cells
    size      edge of the box                                                cells
    share     of the box, which the nodes before, nearest and behind have    1
"""

from wavetank.device.compiler import qd
from wavetank.device.state import CoarseGrid
from wavetank.physics.grid_pressure.coarse_grid import add_whole, nearest, on_axis
from wavetank.physics.grid_pressure.thin_walls import behind
from wavetank.solids.distance import vec3


@qd.func
def parcel_shares(s, size):
    """Shares that the nodes around the coordinate `s` have, and the whole coordinate of the nearest as the fourth."""
    middle = qd.floor(s + 0.5)
    aside, half = s - middle, 0.5 * size
    before = (qd.max(half - aside, 0.0) ** 2 - qd.max(-half - aside, 0.0) ** 2) / (2.0 * size)
    after = (qd.max(half + aside, 0.0) ** 2 - qd.max(aside - half, 0.0) ** 2) / (2.0 * size)
    return qd.Vector([before, 1.0 - before - after, after, middle])


@qd.func
def parcel_at(grid: CoarseGrid, s, spacing):
    """Shares along x, y and z of the nodes around the place `s` [cells], in rows: three each, and the nearest node."""
    x = parcel_shares(s.x, qd.min(spacing / grid.dx, 1.0))
    y = parcel_shares(s.y, qd.min(spacing / grid.dy, 1.0))
    z = parcel_shares(s.z, qd.min(spacing / grid.dz, 1.0))
    return qd.Vector([x[0], x[1], x[2], x[3], y[0], y[1], y[2], y[3], z[0], z[1], z[2], z[3]])


@qd.func
def is_open_to(grid: CoarseGrid, n, s, node, thin: qd.template()):
    """Whether node `n`, at the whole coordinates `node`, has room for what is at the place `s` [cells]: 1 or 0.

    It has none behind a `thin` wall, if there are any in this world.
    """
    found = grid.room[n] > 0.0
    if qd.static(thin):
        way = vec3((s.x - node.x) * grid.dx, (s.y - node.y) * grid.dy, (s.z - node.z) * grid.dz)
        found = found and not behind(grid, n, way)
    return qd.cast(found, qd.f32)


@qd.func
def open_total(grid: CoarseGrid, parcel, s, dim: qd.template(), thin: qd.template()):
    """Share of a particle at the place `s` [cells] that nodes with room have."""
    total = 0.0
    for k in range(qd.static(3**dim)):
        node = vec3(parcel[3] + k % 3 - 1.0, parcel[7] + k // 3 % 3 - 1.0, 0.0)
        share = parcel[k % 3] * parcel[4 + k // 3 % 3]
        if qd.static(dim == 3):
            node.z = parcel[11] + k // 9 - 1.0
            share *= parcel[8 + k // 9]
        total += share * is_open_to(grid, nearest(grid, qd.cast(node, qd.i32)), s, node, thin)
    return total


@qd.func
def add_parcel(
    grid: CoarseGrid, parcel, s, unit, density, part, dim: qd.template(), searched: qd.template(),
    mixed: qd.template(),
):  # fmt: skip
    """Add to the sums of a `part` what nodes have of a particle, and that times its `density` where `mixed`.

    Where solids are `searched`, nodes without room leave theirs to others; with 2, so do those behind a thin wall.
    """
    whole, beside = unit, False
    if qd.static(searched):
        z = parcel[11] if qd.static(dim == 3) else 0.0
        beside = grid.clear[nearest(grid, qd.cast(vec3(parcel[3], parcel[7], z), qd.i32))] == 0.0
        if beside:
            whole /= qd.max(open_total(grid, parcel, s, dim, searched - 1), 1e-3)
    begin = part * grid.nx * grid.ny * grid.nz
    for row in range(qd.static(3 ** (dim - 1))):
        of_row, z = whole * parcel[4 + row % 3], 0.0
        if qd.static(dim == 3):
            of_row *= parcel[8 + row // 3]
            z = parcel[11] + row // 3 - 1.0
        if of_row > 0.0:
            y = parcel[7] + row % 3 - 1.0
            first = grid.nx * (on_axis(grid, qd.cast(y, qd.i32), 1) + grid.ny * on_axis(grid, qd.cast(z, qd.i32), 2))
            for k in qd.static(range(3)):
                x = parcel[3] + (k - 1.0)
                n = first + on_axis(grid, qd.cast(x, qd.i32), 0)
                amount = of_row * parcel[k]
                if qd.static(searched):
                    if beside:
                        amount *= is_open_to(grid, n, s, vec3(x, y, z), searched - 1)
                add_whole(grid.sums, begin + n, qd.cast(qd.round(amount), qd.i32), grid.alone)
                if qd.static(mixed):
                    mass = qd.cast(qd.round(amount * density), qd.i32)
                    add_whole(grid.mass_sums, begin + n, mass, grid.alone)

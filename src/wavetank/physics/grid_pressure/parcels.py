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
from wavetank.physics.grid_pressure.coarse_grid import add_whole, nearest
from wavetank.physics.grid_pressure.thin_walls import is_open_to
from wavetank.solids.distance import vec3


@qd.func
def parcel_shares(s, size):
    """Shares that the node nearest to the coordinate `s`, the one before and the one behind have, in their order."""
    aside, half = s - qd.floor(s + 0.5), 0.5 * size
    before = (qd.max(half - aside, 0.0) ** 2 - qd.max(-half - aside, 0.0) ** 2) / (2.0 * size)
    after = (qd.max(half + aside, 0.0) ** 2 - qd.max(aside - half, 0.0) ** 2) / (2.0 * size)
    return vec3(before, 1.0 - before - after, after)


@qd.func
def add_parcel(
    grid: CoarseGrid, s, spacing, unit, density, part, dim: qd.template(), searched: qd.template(),
    mixed: qd.template(),
):  # fmt: skip
    """Add to the sums of a `part` what nodes have of a particle at the place `s`; where `mixed`, times `density`, too.

    Where solids are `searched`, nodes without room leave theirs to others; with 2, so do those behind a thin wall.
    """
    x = parcel_shares(s.x, qd.min(spacing / grid.dx, 1.0))
    y = parcel_shares(s.y, qd.min(spacing / grid.dy, 1.0))
    z = vec3(0.0, 1.0, 0.0)
    if qd.static(dim == 3):
        z = parcel_shares(s.z, qd.min(spacing / grid.dz, 1.0))
    low = qd.floor(s + 0.5, qd.i32) - 1
    whole, beside = unit, False
    if qd.static(searched):
        beside = grid.clear[nearest(grid, low + 1)] == 0.0
        if beside:
            total = 0.0
            for k in range(qd.static(3**dim)):
                way = qd.Vector([k % 3, k // 3 % 3, k // 9 if qd.static(dim == 3) else 1])
                node = low + way
                share = x[way[0]] * y[way[1]] * z[way[2]]
                total += share * is_open_to(grid, nearest(grid, node), node, s, searched - 1)
            whole /= qd.max(total, 1e-3)
    begin = part * grid.nx * grid.ny * grid.nz
    for row in range(qd.static(3 ** (dim - 1))):
        of_row = whole * y[row % 3] * z[row // 3 if qd.static(dim == 3) else 1]
        if of_row > 0.0:
            for k in qd.static(range(3)):
                node = low + qd.Vector([k, row % 3, row // 3 if qd.static(dim == 3) else 1])
                n = nearest(grid, node)
                amount = of_row * x[k]
                if qd.static(searched):
                    if beside:
                        amount *= is_open_to(grid, n, node, s, searched - 1)
                add_whole(grid.sums, begin + n, qd.cast(qd.round(amount), qd.i32), grid.alone)
                if qd.static(mixed):
                    mass = qd.cast(qd.round(amount * density), qd.i32)
                    add_whole(grid.mass_sums, begin + n, mass, grid.alone)

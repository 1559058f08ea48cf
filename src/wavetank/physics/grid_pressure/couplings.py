"""The equation of each level: with what the nodes of the grid are coupled.

Nothing flows into solids, and a face of a coarser level is open as much as those that it stands for. Coupled by the
room of their cells alone, coarser nodes on both sides of a wall were one: the water in a box and that around it started
from one pressure, and a few sweeps did not part them again (notebook/calm.md, "Seams and sealed water").

    code    symbol     meaning                                                      unit
    fill    f          water in the tent of a node, over the room that it has       1
    theta              distance of the surface from the water's node, in edges      1
    wx      w          coupling with the next node along x, A / (theta dx^2 rho)    1/m^2
            A          open share of the face between them                          1
"""

from wavetank.device.compiler import qd
from wavetank.device.state import CoarseGrid
from wavetank.physics.grid_pressure.block import block_threads, wait_for_block
from wavetank.physics.grid_pressure.coarse_grid import coordinates, nearest, ramp
from wavetank.physics.grid_pressure.thin_walls import is_shut
from wavetank.solids.distance import vec3

LEAST_THETA = 0.01  # what is less slants the pressure along a surface that lies at nodes: notebook/calm.md


@qd.func
def open_area(grid: CoarseGrid, n, m):
    """Share of the face between the nodes `n` and `m` that is open, if both have room.

    A face towards a whole cell is open as a whole, one between two that a wall cuts as much as they are.
    """
    return qd.min(qd.max(grid.room[n], grid.room[m]), 1.0)


@qd.func
def open_faces(grid: CoarseGrid, n):
    """Find which share of its faces to the next nodes along each axis is open for node `n`."""
    share = vec3(0.0, 0.0, 0.0)
    for axis in qd.static(range(3)):
        ahead = coordinates(grid, n)
        ahead[axis] += 1
        m = nearest(grid, ahead)
        if m != n and qd.min(grid.room[n], grid.room[m]) > 0.0 and is_shut(grid, n, axis) == 0:
            share[axis] = open_area(grid, n, m)
    grid.open_x[n], grid.open_y[n], grid.open_z[n] = share.x, share.y, share.z


@qd.func
def coupling(grid: CoarseGrid, n, m, share, edge, least_theta):
    """What a face between the nodes `n` and `m`, of which a `share` is open, couples them with [1/m^2].

    It is 0 between air and air, else the inverse of the density, that of the heaviest fluid being 1, over the square
    of the distance.
    """
    a = qd.min(grid.fill[n], 1.0) - 0.5
    b = qd.min(grid.fill[m], 1.0) - 0.5
    theta = qd.select(a * b < 0.0, qd.min(qd.max(a + b + 0.5, least_theta), 1.0), 1.0)
    # Light fluid gives way more: the inverse of the mean density, and of that of the water where there is air.
    mean = 0.5 * (grid.density[n] + grid.density[m])
    density = qd.select(a <= 0.0, grid.density[m], qd.select(b <= 0.0, grid.density[n], mean))
    is_open = qd.min(qd.max(a, b), share) > 0.0
    return qd.select(is_open, share / qd.max(theta * edge * edge * density, 1e-12), 0.0)


@qd.func
def has_lid(gravity):
    """Whether a tank is closed above its water, which falls along y: 1 or 0."""
    return qd.cast(-gravity[1] > 0.7 * gravity.norm(), qd.i32)


@qd.func
def air_above(grid: CoarseGrid, n, lid):
    """Share of the face of node `n` to the `lid` of the tank, or to a roof, that air lies at: 0 where there is none.

    The surface may lie in the last cells below the lid, which have no air above them: there it is as far as these are
    full, and the fuller they are the less sure it is that there is one. Those of a full tank are nearly full.

    A roof leaves the next node above no room, and overhangs: what is above a floor and below a slit is no surface. What
    lacks below a roof over water is no air (`slits.py`); elsewhere a cell there that passes half of its room has a
    surface, and none any more by degrees. Only the finest level knows which way solids face.
    """
    share = 0.0
    if qd.static(not grid.repeats & 2):
        if lid == 1 and n < grid.nx * grid.ny * grid.nz:
            if n // grid.nx % grid.ny == grid.ny - 1:
                share = 1.0 - ramp(grid.fill[n], 0.8, 0.95)
            elif grid.room[n] > 0.0 and grid.room[n + grid.nx] <= 0.0:
                overhangs = ramp(-grid.facing_y[n], 0.1, 0.4)
                share = overhangs * (1.0 - ramp(grid.fill[n], 0.5, 0.7))
    return share


@qd.func
def couple_nodes(grid: CoarseGrid, piece, least_theta, lid):
    """Set the couplings of `width` nodes of a row with the next ones along x, y and z, and what inverts their equation.

    The rim of the arrays, where there is no room, stands for what is beyond the tank, and for air where it has a `lid`.
    """
    first = piece % grid.pieces * grid.width
    row = piece // grid.pieces
    y = row % grid.ny
    z = row // grid.ny
    begin, layer, rim = grid.nx * row, grid.nx * grid.ny, grid.nx * grid.ny * grid.nz
    over_x = begin if qd.static(grid.repeats & 1) else rim
    under_x = begin + grid.nx - 1 if qd.static(grid.repeats & 1) else rim
    over_y = begin - y * grid.nx if qd.static(grid.repeats & 2) else rim
    under_y = begin + (grid.ny - 1) * grid.nx if qd.static(grid.repeats & 2) else rim
    over_z = begin - z * layer if qd.static(grid.repeats & 4) else rim
    under_z = begin + (grid.nz - 1) * layer if qd.static(grid.repeats & 4) else rim
    after_y = begin + grid.nx if y + 1 < grid.ny else over_y
    before_y = begin - grid.nx if y > 0 else under_y
    after_z = begin + layer if z + 1 < grid.nz else over_z
    before_z = begin - layer if z > 0 else under_z
    found = qd.Matrix.zero(qd.f32, 4, grid.width)
    for lane in range(grid.width):
        x = first + lane
        n = begin + x
        before = qd.Vector([qd.select(x > 0, n - 1, under_x), before_y + x, before_z + x])
        wx = coupling(grid, n, qd.select(x + 1 < grid.nx, n + 1, over_x), grid.open_x[n], grid.dx, least_theta)
        open_y = grid.open_y[n] + air_above(grid, n, lid)
        wy = coupling(grid, n, after_y + x, open_y, grid.dy, least_theta)
        wz = coupling(grid, n, after_z + x, grid.open_z[n], grid.dz, least_theta)
        diagonal = wx + wy + wz
        diagonal += coupling(grid, n, before.x, grid.open_x[before.x], grid.dx, least_theta)
        diagonal += coupling(grid, n, before.y, grid.open_y[before.y], grid.dy, least_theta)
        diagonal += coupling(grid, n, before.z, grid.open_z[before.z], grid.dz, least_theta)
        is_water = qd.min(grid.fill[n] - 0.5, qd.min(grid.room[n], diagonal)) > 0.0
        found[0, lane] = wx
        found[1, lane] = wy
        found[2, lane] = wz
        found[3, lane] = qd.select(is_water, 1.0 / qd.max(diagonal, 1e-12), 0.0)
    for lane in range(qd.min(grid.width, grid.nx - first)):
        n = begin + first + lane
        grid.wx[n] = found[0, lane]
        grid.wy[n] = found[1, lane]
        grid.wz[n] = found[2, lane]
        grid.inverse[n] = found[3, lane]


@qd.func
def part_nodes(grid: CoarseGrid, piece):
    """Couple `width` nodes of a row with nothing: where all is air."""
    first = grid.nx * (piece // grid.pieces) + piece % grid.pieces * grid.width
    for n in range(first, qd.min(first + grid.width, grid.nx * (piece // grid.pieces + 1))):
        grid.wx[n], grid.wy[n], grid.wz[n], grid.inverse[n] = 0.0, 0.0, 0.0, 0.0


@qd.func
def open_ahead(grid: CoarseGrid, n, axis: qd.template()):
    """Share that is open of the face from node `n` to the next one along an axis."""
    share = grid.open_z[n]
    if qd.static(axis == 0):
        share = grid.open_x[n]
    elif qd.static(axis == 1):
        share = grid.open_y[n]
    return share


@qd.func
def open_towards(grid: CoarseGrid, c, m, axis: qd.template(), ahead):
    """The same from the node `c`, or if the next one is not `ahead` but behind from that, which is `m`."""
    return open_ahead(grid, qd.select(ahead == 1, c[0] + grid.nx * (c[1] + grid.ny * c[2]), m), axis)


@qd.func
def way_to(ratio, k):
    """Whole coordinates of the `k`-th of the finer nodes that a coarser one stands for, from the first of them on."""
    return qd.Vector([k % ratio[0], k // ratio[0] % ratio[1], k // (ratio[0] * ratio[1])])


@qd.func
def open_through(fine: CoarseGrid, c, ratio, axis: qd.template()):
    """Share that is open of the face of a coarser node `c` to the next one, by those of the nodes that it stands for.

    It is shut as well where a wall parts these nodes from each other.
    """
    last, shut = 0.0, 0.0
    size = ratio[0] * ratio[1] * ratio[2] // ratio[axis]
    for k in range(ratio[0] * ratio[1] * ratio[2]):
        way = way_to(ratio, k)
        place = c * ratio + way
        n = place[0] + fine.nx * (place[1] + fine.ny * place[2])
        share = open_ahead(fine, n, axis)
        after = place
        after[axis] += 1
        if way[axis] == ratio[axis] - 1:
            last += share
        elif share == 0.0 and qd.min(fine.room[n], fine.room[nearest(fine, after)]) > 0.0:
            shut += 1.0
    return qd.select(2.0 * shut >= size, 0.0, last / size)


@qd.func
def ratio_of(coarse: CoarseGrid, fine: CoarseGrid):
    """How many finer nodes one of a coarser level stands for along each axis."""
    return qd.Vector([fine.nx // coarse.nx, fine.ny // coarse.ny, fine.nz // coarse.nz])


@qd.func
def average_node(coarse: CoarseGrid, fine: CoarseGrid, n):
    """Give node `n` of a coarser level, whose room is known, the means of the finer nodes that it stands for."""
    c, ratio = coordinates(coarse, n), ratio_of(coarse, fine)
    fill, rhs, density = 0.0, 0.0, 0.0
    size = ratio[0] * ratio[1] * ratio[2]
    for z in range(c[2] * ratio[2], c[2] * ratio[2] + ratio[2]):
        for y in range(c[1] * ratio[1], c[1] * ratio[1] + ratio[1]):
            row = fine.nx * (y + fine.ny * z)
            for m in range(row + c[0] * ratio[0], row + c[0] * ratio[0] + ratio[0]):
                fill += fine.fill[m] * fine.room[m]
                rhs += fine.rhs[m]
                density += fine.density[m] * fine.fill[m] * fine.room[m]
    coarse.density[n] = density / fill if fill > 0.0 else 1.0
    coarse.fill[n] = fill / qd.max(coarse.room[n] * size, 1e-6)
    coarse.rhs[n] = rhs / size


@qd.kernel(fastcache=True)
def restrict_room(coarse: CoarseGrid, fine: CoarseGrid, shared: qd.template()):
    """Give a coarser level the room of the finer one and its faces, which stay until solids have moved.

    It is `shared` by all threads, or done by one.
    """
    qd.loop_config(serialize=not shared)
    for n in range(coarse.nx * coarse.ny * coarse.nz):
        c, ratio = coordinates(coarse, n), ratio_of(coarse, fine)
        room = 0.0
        for k in range(ratio[0] * ratio[1] * ratio[2]):
            place = c * ratio + way_to(ratio, k)
            room += fine.room[place[0] + fine.nx * (place[1] + fine.ny * place[2])]
        coarse.room[n] = room / (ratio[0] * ratio[1] * ratio[2])
        coarse.open_x[n] = open_through(fine, c, ratio, 0)
        coarse.open_y[n] = open_through(fine, c, ratio, 1)
        coarse.open_z[n] = open_through(fine, c, ratio, 2)


@qd.kernel(fastcache=True)
def restrict(coarse: CoarseGrid, fine: CoarseGrid, least_theta: qd.f32, lid: qd.i32, shared: qd.template()):
    """Set up the equation of a coarser level, whose room is known; `shared` by all threads, or done by one."""
    qd.loop_config(serialize=not shared)
    for n in range(coarse.nx * coarse.ny * coarse.nz):
        average_node(coarse, fine, n)
    qd.loop_config(serialize=not shared)
    for piece in range(coarse.pieces * coarse.ny * coarse.nz):
        couple_nodes(coarse, piece, least_theta, lid)


@qd.kernel(fastcache=True)
def restrict_in_block(coarse: CoarseGrid, fine: CoarseGrid, least_theta: qd.f32, lid: qd.i32, fenced: qd.template()):
    """Do what `restrict` does, in one launch of one block on a graphics processor."""
    qd.loop_config(block_dim=block_threads())
    for thread in range(block_threads()):
        n = thread
        while n < coarse.nx * coarse.ny * coarse.nz:
            average_node(coarse, fine, n)
            n += block_threads()
        wait_for_block(fenced)
        piece = thread
        while piece < coarse.pieces * coarse.ny * coarse.nz:
            couple_nodes(coarse, piece, least_theta, lid)
            piece += block_threads()

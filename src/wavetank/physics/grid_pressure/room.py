"""Which room the cells of a tank have for water, and which share of it is gaps between rows of particles."""

from wavetank.device.compiler import qd
from wavetank.device.state import CoarseGrid
from wavetank.physics.grid_pressure.coarse_grid import coordinates, nearest
from wavetank.solids.distance import SolidSet, signed_distance, vec3

LEAST_OPEN = 0.1  # a cell that is less open is solid


@qd.func
def sample_parts():
    """Parts along each edge of a cell that a surface crosses."""
    return 4


@qd.func
def open_tents(grid: CoarseGrid, nodes, weights: qd.template()):
    """The `weights` of `nodes` that have room, as shares of their sum; all of them where none has room.

    Water that stands beside a solid counts at the nodes outside, as beside a wall of the tank at the nearest alone.
    """
    result = weights
    total = 0.0
    for k in qd.static(range(weights.n)):
        result[k] = weights[k] if grid.room[nodes[k]] > 0.0 else 0.0
        total += result[k]
    for k in qd.static(range(weights.n)):
        result[k] = result[k] / total if total > 1e-6 else weights[k]
    return result


@qd.func
def gaps_at(grid: CoarseGrid, n, full):
    """How far even the fullest two cells in a row are from `full`, of those around node `n`.

    0 near solids, since what room these leave is known only roughly.
    """
    fullest = 0.0
    if grid.clear[n] > 0.0:
        for axis in qd.static(range(3)):
            for side in qd.static((-1, 1)):
                if grid.nz > 1 or axis < 2:
                    c = coordinates(grid, n)
                    before = grid.fill[n]
                    for _ in qd.static(range(2)):
                        c[axis] += side
                        at = nearest(grid, c)
                        fullest = qd.max(fullest, 0.5 * (before + grid.fill[at]))
                        before = grid.fill[at]
    return qd.max(full - fullest, 0.0) if grid.clear[n] > 0.0 else 0.0


@qd.func
def place_of(grid: CoarseGrid, c):
    """The place [m] with the coordinates `c` in cells from the tank's corner; z = 0 in 2-D."""
    return vec3(c[0] * grid.dx, c[1] * grid.dy, c[2] * grid.dz if grid.nz > 1 else 0.0)


@qd.func
def free_share(solids: SolidSet, center, edges):
    """Share of a box around `center` with these `edges` [m], in a 2-D world the last one 0, that no solid takes.

    A box that a surface may cross is divided in parts, in each of which surfaces count as planes.
    """
    share = 1.0
    radius = 0.5 * edges.norm()
    near = 0
    for k in range(solids.tank_count, solids.count):
        if (center - solids.position[k]).norm() < solids.reach[k] + radius:
            distance = signed_distance(solids, k, center).w
            share = 0.0 if distance <= -radius else share
            near |= qd.cast(qd.abs(distance) < radius, qd.i32)
    if near == 1 and share > 0.0:
        parts = qd.Vector([sample_parts() if edges[axis] > 0.0 else 1 for axis in qd.static(range(3))])
        edge = vec3(edges.x / parts[0], edges.y / parts[1], edges.z / parts[2])
        total = 0.0
        for sample in range(parts[0] * parts[1] * parts[2]):
            number = qd.Vector([sample % parts[0], sample // parts[0] % parts[1], sample // (parts[0] * parts[1])])
            place = center
            for axis in qd.static(range(3)):
                place[axis] += (number[axis] + 0.5) * edge[axis] - 0.5 * edges[axis]
            free = 1.0
            for k in range(solids.tank_count, solids.count):
                if free > 0.0 and (place - solids.position[k]).norm() < solids.reach[k] + radius:
                    value = signed_distance(solids, k, place)
                    extent = qd.abs(value.x) * edge.x + qd.abs(value.y) * edge.y + qd.abs(value.z) * edge.z
                    free = qd.min(free, 0.5 + value.w / qd.max(extent, 1e-3 * radius))
            total += qd.max(free, 0.0)
        share = total / (parts[0] * parts[1] * parts[2])
    return share if share < 0.9999 else 1.0  # rounding is no solid


@qd.func
def is_water(fill):
    """How surely there is water without air at a node, from 0 to 1, by its fill."""
    return qd.min(qd.max(5.0 * (fill - 0.7), 0.0), 1.0)


@qd.func
def below_roof(grid: CoarseGrid, n):
    """How surely what lacks at an open node `n` is a slit between water on one side and a solid on the other."""
    surely = 0.0
    for axis in qd.static(range(3)):
        if grid.nz > 1 or axis < 2:
            for side in qd.static((-1, 1)):
                c = coordinates(grid, n)
                c[axis] += side
                roof = nearest(grid, c)
                c[axis] -= 2 * side
                water = nearest(grid, c)
                if grid.room[roof] < 1.0 and grid.room[water] >= 1.0:
                    surely = qd.max(surely, is_water(grid.fill[water]))
    return surely


@qd.func
def in_part(grid: CoarseGrid, n):
    """The same for a node whose cell a solid takes a part of: where all open nodes beside it, see `gaps`, are full."""
    emptiest = 2.0
    for axis in qd.static(range(3)):
        if grid.nz > 1 or axis < 2:
            for side in qd.static((-1, 1)):
                c = coordinates(grid, n)
                c[axis] += side
                at = nearest(grid, c)
                if grid.room[at] >= 1.0:
                    emptiest = qd.min(emptiest, grid.gaps[at])
    return is_water(emptiest) if emptiest < 2.0 else 0.0


@qd.func
def close_slit(grid: CoarseGrid, n, surely, full):
    """Count node `n` as full, as far as it is `surely` water, and keep what lacks up to `full` in `slope_x`."""
    fill = grid.fill[n]
    grid.slope_x[n] = surely * qd.max(full - fill, 0.0)
    grid.fill[n] = fill + surely * qd.max(1.0 - fill, 0.0)


@qd.func
def open_share(grid: CoarseGrid, solids: SolidSet, n):
    """Share of the cell of node `n` that no solid takes."""
    corner = vec3(grid.x0, grid.y0, grid.z0)
    return free_share(solids, corner + place_of(grid, coordinates(grid, n) + 0.5), place_of(grid, vec3(1.0, 1.0, 1.0)))


@qd.func
def clear_at(grid: CoarseGrid, n):
    """1 where no solid takes room within two cells of node `n`, diagonals included; else 0."""
    c = coordinates(grid, n)
    room = 1.0
    for z in range(qd.max(c[2] - 2, 0), qd.min(c[2] + 3, grid.nz)):
        for y in range(qd.max(c[1] - 2, 0), qd.min(c[1] + 3, grid.ny)):
            for x in range(qd.max(c[0] - 2, 0), qd.min(c[0] + 3, grid.nx)):
                room = qd.min(room, grid.room[x + grid.nx * (y + grid.ny * z)])
    return 1.0 if room >= 1.0 else 0.0


@qd.kernel(fastcache=True)
def find_room(grid: CoarseGrid, solids: SolidSet, least_open: qd.f32, searched: qd.template()):
    """Find which share of each cell is open where solids are `searched`; else the tank ends where the cells do."""
    for n in range(grid.nx * grid.ny * grid.nz):
        room = 1.0
        if qd.static(searched):
            room = open_share(grid, solids, n)
        grid.room[n] = room if room >= least_open else 0.0
    for n in range(grid.nx * grid.ny * grid.nz):
        clear = 1.0
        if qd.static(searched):
            clear = clear_at(grid, n)
        grid.clear[n] = clear

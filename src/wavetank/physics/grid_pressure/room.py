"""Which room the cells of a tank have for water, and which share of it is gaps between rows of particles."""

from wavetank.device.compiler import qd
from wavetank.device.state import CoarseGrid
from wavetank.physics.grid_pressure.coarse_grid import coordinates, nearest
from wavetank.solids.distance import SolidSet, signed_distance, vec3

LEAST_OPEN = 0.1  # a cell that is less open is solid


@qd.func
def gaps_at(grid: CoarseGrid, n, full):
    """How far even the fullest two cells in a row are from `full`, of those around node `n`.

    0 near solids, since what room these leave is known only roughly.
    """
    fullest, room = 0.0, grid.room[n]
    for axis in qd.static(range(3)):
        for side in qd.static((-1, 1)):
            if grid.nz > 1 or axis < 2:
                c = coordinates(grid, n)
                before = grid.fill[n]
                for _ in qd.static(range(2)):
                    c[axis] += side
                    at = nearest(grid, c)
                    fullest = qd.max(fullest, 0.5 * (before + grid.fill[at]))
                    room = qd.min(room, grid.room[at])
                    before = grid.fill[at]
    return qd.max(full - fullest, 0.0) if room >= 1.0 else 0.0


@qd.func
def open_share(grid: CoarseGrid, solids: SolidSet, n):
    """Share of the cell of node `n` that no solid takes."""
    c = coordinates(grid, n)
    center = vec3((c[0] + 0.5) * grid.dx, (c[1] + 0.5) * grid.dy, (c[2] + 0.5) * grid.dz)
    center += vec3(grid.x0, grid.y0, grid.z0)
    edge = qd.min(grid.dx, grid.dy)
    if grid.nz > 1:
        edge = qd.min(edge, grid.dz)
    else:
        center.z = 0.0
    room = 1.0
    for k in range(solids.count):
        if k < solids.tank_count or (center - solids.position[k]).norm() < solids.reach[k] + 0.5 * edge:
            if room > 0.0:
                room = qd.min(room, 0.5 + signed_distance(solids, k, center).w / edge)
    return qd.max(room, 0.0)


@qd.kernel(fastcache=True)
def find_room(grid: CoarseGrid, solids: SolidSet, least_open: qd.f32, searched: qd.template()):
    """Find which share of each cell is open where solids are `searched`; else the tank ends where the cells do."""
    for n in range(grid.nx * grid.ny * grid.nz):
        room = 1.0
        if qd.static(searched):
            room = open_share(grid, solids, n)
        grid.room[n] = room if room >= least_open else 0.0

"""Which room the cells of a tank have for water.

Where there are bodies, the slits between them and what they lie on have none. The layer that a body comes down on is a
lone row of particles in less than half a cell, and all that its densities are off had to leave through the length of
the slit at once: a hundredth gave a fifth of the pressure below a box of fifteen spacings, which trembled for ever. The
pressure there is continued from around instead (`buoyancy.py`), and what such a film is pressed by is the iterations'
(notebook/bodies.md, "A box a tenth heavier than water").
"""

from wavetank.device.compiler import qd
from wavetank.device.state import CoarseGrid, Coefficients
from wavetank.physics.grid_pressure.coarse_grid import (
    add_whole,
    center_of,
    coordinates,
    corners,
    nearest,
    on_axis,
    taken,
    tents,
)
from wavetank.physics.grid_pressure.couplings import open_faces
from wavetank.physics.grid_pressure.listed_solids import listed, solids_near
from wavetank.physics.grid_pressure.slits import mostly
from wavetank.physics.grid_pressure.thin_walls import farthest, is_open_to, keep_thin, mark_closed, mark_shut
from wavetank.physics.teams import end_of_part, first_of_part, part_of, turns_over
from wavetank.solids.distance import SolidSet, image_near, signed_distance, vec2, vec3, vec4

LEAST_OPEN = 0.1  # a cell that is less open is solid


@qd.func
def narrow():
    """Cells that are left between two solids, up to which there is a slit."""
    return 0.5


@qd.func
def tent_beside():
    """Share of a free cell that counts at the node of the next one along an axis, see `add_tents`."""
    return 0.125


@qd.func
def wall_at(grid: CoarseGrid, solids: SolidSet, around: qd.template(), at):
    """Number of that of the solids `around` nearest to the place `at`, and its (gradient, distance [m]).

    The number is -1, and the distance is large, where none is near.
    """
    edge = longest_edge(grid)
    found, nearest = -1, vec4(0.0, 1.0, 0.0, 4.0 * edge)
    for number in range(around[0]):
        k = listed(solids, around, number)
        way, reach = image_near(solids, k, at) - solids.position[k], solids.reach[k]
        if way.norm_sqr() < (reach + nearest.w) ** 2 and reach + nearest.w > 0.0 and nearest.w > -2.0 * edge:
            # What is farther away takes no room: that of the ball around the solid is good enough there.
            value = vec4(way.x, way.y, way.z, way.norm() - reach)
            if value.w < 2.0 * edge:
                value = signed_distance(solids, k, at)
            if value.w < nearest.w:
                found, nearest = k, value
    return found, nearest


@qd.func
def seam():
    """Cells up to which two solids touch, and how far beyond a surface the wall that they make is looked for."""
    return vec2(0.08, 0.5)


@qd.func
def nearest_wall(grid: CoarseGrid, solids: SolidSet, around: qd.template(), n):
    """(gradient, distance [m]) of that of the solids `around` nearest to node `n`; far away where none is near.

    Where solids touch, or parts of one, the surfaces between them are no walls: what was taken for room along the
    seams of a box of boards let the pressure out. Beyond a seam the wall is that of the solid there.
    """
    edge, center = longest_edge(grid), center_of(grid, n)
    wall, touching, at = vec4(0.0, 1.0, 0.0, 4.0 * edge), 1.0, center
    outward, surface, looks = vec3(0.0, 1.0, 0.0), center, 0
    while looks < 3:
        k, value = wall_at(grid, solids, around, at)
        if looks == 0:
            wall, outward = value, vec3(value.x, value.y, value.z)
            surface = center - outward * value.w
            parts = solids.first[qd.max(k, 0) + 1] - solids.first[qd.max(k, 0)]  # none is near if k < 0: far away
            at = surface + outward * (2.0 * seam().x * edge)
            if qd.abs(value.w) >= edge or qd.max(parts, around[0]) < 2:
                looks = 3
        elif looks == 1:
            touching = qd.min(-value.w / (seam().x * edge), 1.0)
            at = surface + outward * (seam().y * edge)
            if touching <= 0.0:
                looks = 3
        elif value.w < 0.0:
            beyond = vec3(value.x, value.y, value.z)
            depth = -edge
            if beyond.dot(outward) > -0.7:
                depth = value.w + beyond.dot(center - at)
                outward = beyond
            depth = qd.min(wall.w, depth)
            wall = vec4(outward.x, outward.y, outward.z, wall.w + touching * (depth - wall.w))
        looks += 1
    return wall


@qd.func
def longest_edge(grid: CoarseGrid):
    """Longest edge of a cell [m]."""
    edge = qd.max(grid.dx, grid.dy)
    if grid.nz > 1:
        edge = qd.max(edge, grid.dz)
    return edge


@qd.func
def free_of(wall, way, edge):
    """Share that is free of a piece of a cell with that `edge` [m], a `way` from the place where the wall was asked."""
    return qd.min(qd.max(0.5 + (wall.w + way.dot(vec3(wall.x, wall.y, wall.z))) / edge, 0.0), 1.0)


@qd.func
def kept_wall(grid: CoarseGrid, n):
    """What `nearest_wall` has found."""
    return vec4(grid.slope_x[n], grid.slope_y[n], grid.slope_z[n], grid.lam[n])


@qd.func
def open_share(grid: CoarseGrid, n):
    """Share of the cell of node `n` that no solid takes."""
    edge = qd.min(grid.dx, grid.dy)
    if grid.nz > 1:
        edge = qd.min(edge, grid.dz)
    return free_of(kept_wall(grid, n), vec3(0.0, 0.0, 0.0), edge)


@qd.func
def add_tents(grid: CoarseGrid, n, part, unit, dim: qd.template()):
    """Add what free places of the cell of node `n` count at the nodes around, as particles there would, to the sums.

    Those are of a `part` of the nodes. Pieces of half an edge are asked. Next to nodes without room the others have
    their share.
    """
    own = coordinates(grid, n)
    edges = vec3(grid.dx, grid.dy, grid.dz)
    edge = 0.5 * qd.min(grid.dx, grid.dy)
    if grid.nz > 1:
        edge = qd.min(edge, 0.5 * grid.dz)
    wall = kept_wall(grid, n)
    for k in range(qd.static(2**dim)):
        way, s = vec3(0.0, 0.0, 0.0), vec3(0.0, 0.0, 0.0)
        for axis in qd.static(range(dim)):
            aside = 0.5 * ((k >> axis) % 2) - 0.25  # of the piece, in cells from the node
            s[axis] = own[axis] + aside
            way[axis] = aside * edges[axis]
        free = free_of(wall, way, edge)
        if free > 0.0:
            at = corners(grid, qd.floor(s, qd.i32), dim)
            weights = open_tents(grid, at, s, dim, 1)
            for corner in qd.static(range(2**dim)):
                amount = unit * free * weights[corner] / 2.0**dim
                of_part = part * grid.nx * grid.ny * grid.nz + at[corner]
                add_whole(grid.sums, of_part, qd.cast(qd.round(amount), qd.i32), grid.alone)


@qd.func
def open_tents(grid: CoarseGrid, at: qd.template(), s, dim: qd.template(), thin: qd.template()):
    """Weights of the nodes `at` the corners around the place `s` [cells]; those without room leave theirs to others.

    So do those that lie behind a `thin` wall, if there are any in this world.
    """
    weights = tents(s - qd.floor(s), dim)
    low = qd.floor(s, qd.i32)
    total = 0.0
    for k in qd.static(range(2**dim)):
        node = qd.Vector([low[0] + (k & 1), low[1] + (k >> 1 & 1), low[2] + (k >> 2)])
        weights[k] *= is_open_to(grid, at[k], node, s, thin)
        total += weights[k]
    return weights / qd.max(total, 1e-3)


@qd.func
def row_beside(grid: CoarseGrid, row, axis: qd.template(), aside):
    """Number of the first node of the row that is `aside` of a `row` along y or z, or of the nearest."""
    c = qd.Vector([0, row % grid.ny, row // grid.ny])
    c[axis] += aside
    return nearest(grid, c)


@qd.func
def largest_along(
    to: qd.template(), values: qd.template(), grid: CoarseGrid, row, axis: qd.template(), far: qd.template()
):
    """Put the largest of the values of `far` nodes on each side along an axis to the nodes of a row."""
    first = grid.nx * row
    if qd.static(axis == 0):
        for x in range(grid.nx):
            largest = 0.0
            for aside in qd.static(range(-far, far + 1)):
                largest = qd.max(largest, values[first + on_axis(grid, x + aside, 0)])
            to[first + x] = largest
    else:
        rows = qd.Vector([row_beside(grid, row, axis, aside) for aside in qd.static(range(-far, far + 1))])
        for x in range(grid.nx):
            largest = 0.0
            for k in qd.static(range(2 * far + 1)):
                largest = qd.max(largest, values[rows[k] + x])
            to[first + x] = largest


@qd.func
def largest_around(to: qd.template(), grid: CoarseGrid, far: qd.template(), few: qd.template()):
    """Put the largest `rhs` of `far` nodes on each side, diagonals included, to the nodes; to be called at the top."""
    qd.loop_config(serialize=bool(few))
    for row in range(grid.ny * grid.nz):
        largest_along(grid.depth, grid.rhs, grid, row, 0, far)
    qd.loop_config(serialize=bool(few))
    for row in range(grid.ny * grid.nz):
        largest_along(grid.gaps, grid.depth, grid, row, 1, far)
    qd.loop_config(serialize=bool(few))
    for row in range(grid.ny * grid.nz):
        largest_along(to, grid.gaps, grid, row, 2, far)


@qd.func
def spread_along(
    to: qd.template(), values: qd.template(), grid: CoarseGrid, row, axis: qd.template(), share: qd.template()
):
    """Put mean values along an axis, in which each node beside has that `share`, to the nodes of a row."""
    first = grid.nx * row
    if qd.static(axis == 0):
        for x in range(grid.nx):
            around = values[first + on_axis(grid, x - 1, 0)] + values[first + on_axis(grid, x + 1, 0)]
            to[first + x] = (1.0 - 2.0 * share) * values[first + x] + share * around
    else:
        before, behind_it = row_beside(grid, row, axis, -1), row_beside(grid, row, axis, 1)
        for x in range(grid.nx):
            around = values[before + x] + values[behind_it + x]
            to[first + x] = (1.0 - 2.0 * share) * values[first + x] + share * around


@qd.func
def find_walls(grid: CoarseGrid, thin: qd.template(), solids: SolidSet, piece, least_open):
    """Find the wall nearest to each of `width` nodes of a row, and whether it leaves them room, for `find_room`."""
    first = piece % grid.pieces * grid.width
    begin = grid.nx * (piece // grid.pieces) + first
    nodes = qd.min(grid.width, grid.nx - first)
    around = solids_near(grid, solids, begin, nodes, farthest() * longest_edge(grid))
    for n in range(begin, begin + nodes):
        wall = nearest_wall(grid, solids, around, n)
        grid.slope_x[n], grid.slope_y[n], grid.slope_z[n], grid.lam[n] = wall.x, wall.y, wall.z, wall.w
        grid.facing_x[n], grid.facing_y[n], grid.facing_z[n] = wall.x, wall.y, wall.z
        grid.room[n] = qd.cast(open_share(grid, n) >= least_open, qd.f32)
        if keep_thin(grid, solids, around, n, wall) == 1:
            qd.atomic_add(thin[0], 1)
        grid.rhs[n] = 0.0


@qd.func
def is_slit(grid: CoarseGrid, n, gravity):
    """Whether node `n` lies between two solids that leave less than half a cell, and no node beside it is open.

    One lies above the other: what stands upright beside a wall is open to the air above, and pressed on by nothing.
    Rooms are in `rhs`, `gravity` is a vector of any length; without it all slits count.
    """
    narrowest, widest = 1.0, 0.0
    if grid.rhs[n] > 0.0 and grid.rhs[n] < narrow():
        for axis in qd.static(range(3)):
            if (grid.nz > 1 or axis < 2) and qd.abs(gravity[axis]) >= 0.7 * gravity.norm():
                width = grid.rhs[n]
                for side in qd.static((-1, 1)):
                    place = coordinates(grid, n)
                    before, is_open = n, grid.rhs[n] > 0.0
                    for _ in range(2):
                        place[axis] += side
                        m = nearest(grid, place)
                        is_open = is_open and m != before
                        width += grid.rhs[m] if is_open else 0.0
                        widest = qd.max(widest, grid.rhs[m] if is_open and before == n else 0.0)
                        is_open = is_open and grid.rhs[m] > 0.0
                        before = m
                narrowest = qd.min(narrowest, width)
    return narrowest < narrow() and widest < mostly()


@qd.kernel(fastcache=True)
def find_room(
    grid: CoarseGrid,
    thin: qd.types.ndarray(),
    solids: SolidSet,
    c: Coefficients,
    least_open: qd.f32,
    unit: qd.f32,
    spacing: qd.f32,
    searched: qd.template(),
    dim: qd.template(),
    few: qd.template(),
):
    """Find which room each node has for water where solids are `searched`; else the tank ends where the cells do.

    Sums are of whole multiples of the inverse of `unit`, so that the order of threads does not matter; 0 before. Cells
    that are free, and beside which all nodes have room, count the same at the nodes around: along one axis after the
    other. What a step finds anew serves as memory. `thin` [1] counts nodes at thin walls. Where some of the solids are
    bodies, `searched` is 2. Where nodes are `few`, one thread does what takes less than to wake the others.
    """
    if qd.static(not searched):
        for n in range(grid.nx * grid.ny * grid.nz):
            grid.room[n] = 1.0
            grid.clear[n] = 1.0
    else:
        for piece in range(grid.pieces * grid.ny * grid.nz):
            find_walls(grid, thin, solids, piece, least_open)
        qd.loop_config(serialize=bool(few))
        for n in range(grid.nx * grid.ny * grid.nz):
            mark_shut(grid, n)
            mark_closed(grid.rhs, grid, n, spacing)
        for turn in range(turns_over(grid.nx * grid.ny * grid.nz, grid.parts, 1 + grid.alone)):
            edge = longest_edge(grid)
            first = first_of_part(turn, grid.nx * grid.ny * grid.nz, grid.parts, 1 + grid.alone)
            for n in range(first, end_of_part(turn, grid.nx * grid.ny * grid.nz, grid.parts, 1 + grid.alone)):
                grid.rhs[n] = qd.cast(grid.rhs[n] == 0.0 and grid.lam[n] >= 0.75 * edge, qd.f32)
                if grid.rhs[n] == 0.0 and grid.lam[n] > -edge:
                    add_tents(grid, n, grid.alone * part_of(turn), unit, dim)
        qd.loop_config(serialize=bool(few))
        for row in range(grid.ny * grid.nz):
            spread_along(grid.depth, grid.rhs, grid, row, 0, tent_beside())
        qd.loop_config(serialize=bool(few))
        for row in range(grid.ny * grid.nz):
            spread_along(grid.gaps, grid.depth, grid, row, 1, tent_beside())
        qd.loop_config(serialize=bool(few))
        for row in range(grid.ny * grid.nz):
            spread_along(grid.rhs, grid.gaps, grid, row, 2, tent_beside())
        qd.loop_config(serialize=bool(few))
        for n in range(grid.nx * grid.ny * grid.nz):
            total = taken(grid.sums, n, grid.nx * grid.ny * grid.nz, grid.parts)
            if grid.room[n] > 0.0 and grid.lam[n] < 2.0 * longest_edge(grid):
                grid.room[n] = total / unit + grid.rhs[n]
            grid.rhs[n] = grid.room[n]
        if qd.static(searched == 2):
            qd.loop_config(serialize=bool(few))
            for n in range(grid.nx * grid.ny * grid.nz):
                if is_slit(grid, n, vec3(c.gravity_x, c.gravity_y, c.gravity_z)):
                    grid.room[n] = 0.0
        qd.loop_config(serialize=bool(few))
        for n in range(grid.nx * grid.ny * grid.nz):
            grid.rhs[n] = qd.abs(grid.room[n] - 1.0)
        # No solid takes room within two cells, diagonals included.
        largest_around(grid.clear, grid, 2, few)
        # Not all nodes beside it, diagonals included, are open to what is at this one.
        qd.loop_config(serialize=bool(few))
        for n in range(grid.nx * grid.ny * grid.nz):
            grid.rhs[n] = 0.0
        qd.loop_config(serialize=bool(few))
        for n in range(grid.nx * grid.ny * grid.nz):
            mark_closed(grid.rhs, grid, n, spacing)
        qd.loop_config(serialize=bool(few))
        for n in range(grid.nx * grid.ny * grid.nz):
            grid.clear[n] = 1.0 if grid.clear[n] < 1e-3 else -grid.rhs[n]
    qd.loop_config(serialize=bool(few))
    for n in range(grid.nx * grid.ny * grid.nz):
        open_faces(grid, n)

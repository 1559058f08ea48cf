"""Walls so thin that a node is reached from both of their sides: a cup, a tub, a partition.

A wall thinner than two cells may lie between nodes, or between a particle and its nodes. Water on one side then counted
on the other too, seemed half empty here and was a film there, and its pressure ended in the air behind the wall.

Each node near such a wall therefore keeps the plane of the wall's surface on its own side. Particles and free places
behind that plane do not count at it, and faces between nodes of which one lies behind the plane of the other are shut.
A node a little inside of the wall belongs to the side that is nearer, as one a little inside of a thick solid has room:
water in a bowl went round where some nodes had and others had not. One deeper inside is closed, as it is on neither
side. It is one plane a node: in a corner that two thin walls make, one of them is felt.
"""

from wavetank.device.compiler import qd
from wavetank.device.state import CoarseGrid
from wavetank.physics.grid_pressure.coarse_grid import center_of, coordinates, nearest, on_axis, stride
from wavetank.physics.grid_pressure.listed_solids import listed, narrowed
from wavetank.solids.distance import SolidSet, image_near, signed_distance, vec3


@qd.func
def near():
    """Edges of a cell up to which a wall is near a node."""
    return 1.75


@qd.func
def farthest():
    """Edges of a cell from a node up to which solids are asked: its wall is near, and looked through from there."""
    return 4.0


@qd.func
def thickest():
    """Edges of a cell: a wall that is thicker is no thin one."""
    return 1.6


@qd.func
def depth_in_solids(solids: SolidSet, around: qd.template(), at):
    """Depth [m] of the place `at` in that of the solids listed as `around` that it is in, 0 outside."""
    depth = 0.0
    for number in range(around[0]):
        k = listed(solids, around, number)
        if (image_near(solids, k, at) - solids.position[k]).norm() < solids.reach[k]:
            depth = qd.max(depth, -signed_distance(solids, k, at).w)
    return depth


@qd.func
def is_inside(solids: SolidSet, around: qd.template(), at):
    """Say whether the place `at` is in one of the solids listed as `around`."""
    found = False
    number = 0
    while number < around[0] and not found:
        k = listed(solids, around, number)
        if (image_near(solids, k, at) - solids.position[k]).norm() < solids.reach[k]:
            found = signed_distance(solids, k, at).w < 0.0
        number += 1
    return found


@qd.func
def ahead(solids: SolidSet, around: qd.template(), middle, way, outward):
    """Return 1 where a solid goes on from its `middle` by a `way` along it, or bends up or down from there."""
    goes = 0
    # Straight on first; thin walls are met by a step of a sixteenth of a turn. Kept, as they are asked for so often.
    cosines = qd.Vector([1.0, 0.9238795, 0.70710677, 0.38268343])
    sines = qd.Vector([0.0, 0.38268346, 0.70710677, 0.9238795])
    for number in range(7):
        if goes == 0:
            turn = (number + 1) // 2
            at = middle + way * cosines[turn] - outward * (sines[turn] * (1 - 2 * (number % 2)))
            goes = qd.cast(is_inside(solids, around, at), qd.i32)
    return goes


@qd.func
def along(grid: CoarseGrid, outward):
    """Two directions along a wall whose normal is `outward`; the second is 0 in a plane, which goes on along z."""
    aside = vec3(0.0, 0.0, 1.0)
    if grid.nz > 1 and qd.abs(outward.z) > 0.7:
        aside = vec3(1.0, 0.0, 0.0)
    first = outward.cross(aside).normalized()
    return first, outward.cross(first) if grid.nz > 1 else vec3(0.0, 0.0, 0.0)


@qd.func
def goes_on(grid: CoarseGrid, solids: SolidSet, around: qd.template(), surface, outward, edge):
    """Say whether what is thin behind the place `surface` goes on to its sides: a wall, perhaps its rim, no bar."""
    middle, deepest = surface, 0.0
    for k in qd.static(range(4)):
        at = surface - outward * (0.1 * 2.0**k * edge)
        depth = depth_in_solids(solids, around, at)
        if depth > deepest:
            middle, deepest = at, depth
    first, second = along(grid, outward)
    inside = 0
    for k in range(4):
        if inside >= k - 1:  # else two sides are free already
            way = (first if k % 2 == 0 else second) * ((k // 2 - 0.5) * 1.5 * edge)
            inside += ahead(solids, around, middle, way, outward * (0.75 * edge))
    return inside >= 3


@qd.func
def straight_across(grid: CoarseGrid, solids: SolidSet, around: qd.template(), at, edge):
    """The one axis on which a place `at` inside of a wall is free on both sides, towards the nearer; 0 if no one is.

    In the middle of a wall that a grid of distances hardly resolves these tell no direction.
    """
    found, axes = vec3(0.0, 0.0, 0.0), 0
    for axis in range(3 if grid.nz > 1 else 2):
        free, nearer = 0.0, 0.0  # how much of a solid is on both sides; by how much it is deeper ahead
        for number in range(4):  # asked in one place of the code: what a kernel takes to compile grows with these
            side = 1.0 - 2.0 * (number % 2)
            way = vec3(0.0, 0.0, 0.0)
            way[axis] = side * (0.5 if number < 2 else 0.15) * thickest() * edge
            depth = depth_in_solids(solids, around, at + way)
            free += depth if number < 2 else 0.0
            nearer += 0.0 if number < 2 else side * depth
        if free == 0.0:
            axes += 1
            found = vec3(0.0, 0.0, 0.0)
            found[axis] = 1.0 if nearer <= 0.0 else -1.0
    return found * (1.0 if axes == 1 else 0.0)


@qd.func
def is_beside(grid: CoarseGrid, n):
    """Whether node `n` lies at a thin wall, which it is on one side of."""
    return qd.abs(grid.thin_x[n]) + qd.abs(grid.thin_y[n]) + qd.abs(grid.thin_z[n]) > 0.0


@qd.func
def belongs(grid: CoarseGrid, solids: SolidSet, around: qd.template(), surface, outward, distance, edge):
    """Say whether a node inside of a wall, at a `distance` [m] below 0 from its `surface`, belongs to the side there.

    It does a little inside, as at thick solids, unless a corner is near: what is free ahead of the surface must be so
    beside it as well.
    """
    found = distance > -0.35 * edge  # what is deeper has next to no room, `room.LEAST_OPEN`
    first, second = along(grid, outward)
    for k in range(5 if grid.nz > 1 else 3):
        if found:
            way = outward * (0.1 if k == 0 else 0.5)
            if k > 0:
                way += (first if k < 3 else second) * (0.5 if k % 2 == 0 else -0.5)
            found = not is_inside(solids, around, surface + way * edge)
    return found


@qd.func
def keep_thin(grid: CoarseGrid, solids: SolidSet, around: qd.template(), n, wall):
    """Keep the plane of a thin `wall`, (gradient, distance [m]), that node `n` lies at; return 1 if there is one.

    If the node lies inside of it and belongs to neither side, it is closed. A wall is thin where it is free beyond,
    straight through; the solids that are asked are those listed as `around`.
    """
    edge = qd.min(grid.dx, grid.dy)
    outward = vec3(wall.x, wall.y, wall.z)
    grid.thin_x[n], grid.thin_y[n], grid.thin_z[n], grid.thin_s[n] = 0.0, 0.0, 0.0, 0.0
    found = 0
    if wall.w < near() * edge and wall.w > -edge and outward.norm() > 0.5:
        surface = center_of(grid, n) - outward * wall.w
        most = thickest() * edge
        close = narrowed(solids, around, surface, 1.1 * most)  # no place that is asked for is farther away than `most`
        is_thin = not is_inside(solids, close, surface - outward * most)
        is_thin = is_thin or not is_inside(solids, close, surface - outward * (0.5 * most))
        if wall.w <= 0.0 and not is_thin:
            outward = straight_across(grid, solids, close, center_of(grid, n), edge)
            surface = center_of(grid, n) - outward * wall.w
            is_thin = outward.norm() > 0.0
        if is_thin and goes_on(grid, solids, close, surface, outward, edge):
            found = 1
            if wall.w <= 0.0 and not belongs(grid, solids, close, surface, outward, wall.w, edge):
                grid.room[n] = 0.0
            else:
                grid.thin_x[n], grid.thin_y[n], grid.thin_z[n] = outward.x, outward.y, outward.z
                grid.thin_s[n] = wall.w
    return found


@qd.func
def way_from(grid: CoarseGrid, node, s):
    """Way [m] to the place `s` [cells] from the whole coordinates `node`, or from the nearest node of the tank."""
    start = node
    for axis in qd.static(range(3)):
        if qd.static(not grid.repeats >> axis & 1):
            start[axis] = on_axis(grid, node[axis], axis)
    return vec3((s.x - start[0]) * grid.dx, (s.y - start[1]) * grid.dy, (s.z - start[2]) * grid.dz)


@qd.func
def is_through(grid: CoarseGrid, n, m):
    """Say whether the nodes `n` and `m` lie in one wall, each nearer to another side of it.

    Surfaces are as the search for walls left them, see `room.kept_wall`.
    """
    facing = grid.slope_x[n] * grid.slope_x[m] + grid.slope_y[n] * grid.slope_y[m] + grid.slope_z[n] * grid.slope_z[m]
    return qd.max(grid.lam[n], grid.lam[m]) < 0.0 and facing < -0.3


@qd.func
def parts(grid: CoarseGrid, n, m, way):
    """Say whether the thin wall that node `n` lies at parts it from node `m`, a `way` [m] from there.

    Not if `m` lies in that wall and belongs to the same side.
    """
    alike = grid.thin_x[n] * grid.thin_x[m] + grid.thin_y[n] * grid.thin_y[m] + grid.thin_z[n] * grid.thin_z[m]
    return behind(grid, n, way) and not (grid.thin_s[m] < 0.0 and alike > 0.3)


@qd.func
def mark_shut(grid: CoarseGrid, n):
    """Find in which faces of node `n` to the next nodes a wall lies, of thin ones and of those a little thicker."""
    edges = vec3(grid.dx, grid.dy, grid.dz)
    bits = 0
    for axis in qd.static(range(3)):
        ahead = coordinates(grid, n)
        ahead[axis] += 1
        m = nearest(grid, ahead)
        way = vec3(0.0, 0.0, 0.0)
        way[axis] = edges[axis]
        if m != n and (parts(grid, n, m, way) or parts(grid, m, n, -way) or is_through(grid, n, m)):
            bits |= 1 << axis
    grid.shut[n] = bits


@qd.func
def behind(grid: CoarseGrid, n, way):
    """Say whether the place that is a `way` [m] from node `n` lies behind a thin wall, seen from there."""
    ahead = way.dot(vec3(grid.thin_x[n], grid.thin_y[n], grid.thin_z[n])) + grid.thin_s[n]
    return ahead < -0.15 * qd.min(grid.dx, grid.dy)


@qd.func
def may_be_behind(grid: CoarseGrid, n, aside, spacing):
    """Say whether a particle of the cell `aside` of node `n` may count there and lie behind the thin wall at it.

    `aside` are whole cells; a particle counts as far as a box as large as the `spacing` [m] reaches (`parcels.py`).
    """
    edges, nearest_way = vec3(grid.dx, grid.dy, grid.dz), vec3(0.0, 0.0, 0.0)
    outward = vec3(grid.thin_x[n], grid.thin_y[n], grid.thin_z[n])
    for axis in qd.static(range(3)):
        far = 1.0 + 0.5 * qd.min(spacing / edges[axis], 1.0)
        side = 0.5 if outward[axis] < 0.0 else -0.5
        nearest_way[axis] = qd.min(qd.max(aside[axis] + side, -far), far) * edges[axis]
    return behind(grid, n, nearest_way)


@qd.func
def mark_closed(marks: qd.template(), grid: CoarseGrid, n, spacing):
    """Mark those of the nodes around, and node `n` itself, in whose cells a particle may be that is closed to `n`."""
    if grid.room[n] <= 0.0 or is_beside(grid, n):
        for k in range(27 if grid.nz > 1 else 9):
            aside = qd.Vector([k % 3 - 1, k // 3 % 3 - 1, k // 9 - 1 if grid.nz > 1 else 0])
            if grid.room[n] <= 0.0 or may_be_behind(grid, n, aside, spacing):
                marks[nearest(grid, coordinates(grid, n) + aside)] = 1.0


@qd.func
def is_open_to(grid: CoarseGrid, n, node, s, thin: qd.template()):
    """Whether node `n`, at the whole coordinates `node`, has room for what is at the place `s` [cells]: 1 or 0.

    It has none for what lies behind a `thin` wall, if there are any in this world.
    """
    found = grid.room[n] > 0.0
    if qd.static(thin):
        if found and is_beside(grid, n):
            found = not behind(grid, n, way_from(grid, node, s))
    return qd.cast(found, qd.f32)


@qd.func
def may_be_cut_off(grid: CoarseGrid, s):
    """Say whether nodes around the place `s` [cells] may have no room for what is there, see `mark_closed`."""
    return grid.clear[nearest(grid, qd.floor(s + 0.5, qd.i32))] < 0.0


@qd.func
def is_shut(grid: CoarseGrid, n, axis: qd.template()):
    """Say whether a thin wall lies between node `n` and the next along an axis."""
    return (qd.cast(grid.shut[n], qd.i32) >> axis) & 1


@qd.func
def shut_towards(grid: CoarseGrid, n, m, axis: qd.template()):
    """The same for two nodes that are neighbours along an axis."""
    first = qd.min(n, m)
    if qd.static(grid.repeats >> axis & 1):
        if qd.abs(n - m) != stride(grid, axis):  # the last node of a row and the first
            first = qd.max(n, m)
    return is_shut(grid, first, axis)

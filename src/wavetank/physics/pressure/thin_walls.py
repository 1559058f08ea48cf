"""Walls so thin that a node is reached from both of their sides: a cup, a tub, a partition.

A wall thinner than two cells may lie between nodes, or between a particle and its nodes. Liquid on one side would count
on the other too, seem half empty here and a film there, and its pressure would end in the air behind the wall.

Each node near such a wall therefore keeps the plane of the wall's surface on its own side. Particles and free places
behind that plane do not count at the node, and faces between nodes of which one lies behind the plane of the other are
blocked. A node a little inside of the wall belongs to the nearer side, as a node a little inside of a thick solid has
open volume; one deeper inside is closed, as it is on neither side. A node has one plane: in a corner that two thin
walls make, one of them is seen.
"""

from wavetank.device.compiler import qd
from wavetank.physics.pressure.grid import (
    Level,
    Workspace,
    center_of,
    clamped,
    clamped_neighbor,
    coordinates,
    edge,
    nearest_node,
    node_at,
    on_axis,
    stride,
)
from wavetank.solids.distance import SolidSet, image_near, signed_distance, vec3

# --- which solids are near: a vector that holds their count, then their numbers; too long a list stands for all ---


@qd.func
def solids_near(grid: Level, solids: SolidSet, n, nodes, far):
    """List the solids within `far` [m] of the centres of that many `nodes` of a row from node `n` on."""
    around = qd.Vector.zero(qd.i32, 17)
    half = 0.5 * (nodes - 1) * grid.dx
    middle = center_of(grid, n) + vec3(half, 0.0, 0.0)
    for k in range(solids.tank_count, solids.count):
        way = image_near(solids, k, middle) - solids.position[k]
        way.x = qd.max(qd.abs(way.x) - half, 0.0)
        if way.norm() < solids.reach[k] + far:
            around[0] += 1
            if around[0] < around.n:
                around[around[0]] = k
    if around[0] >= around.n:
        around[0] = solids.count - solids.tank_count
    return around


@qd.func
def narrowed(solids: SolidSet, around: qd.template(), at, far):
    """List those of the solids `around` that are within `far` [m] of the place `at`."""
    close = around
    if around[0] < around.n:
        close[0] = 0
        for number in range(around[0]):
            k = around[1 + number]
            if (image_near(solids, k, at) - solids.position[k]).norm() < solids.reach[k] + far:
                close[0] += 1
                close[close[0]] = k
    return close


@qd.func
def listed(solids: SolidSet, around: qd.template(), number):
    """Return the solid that has this `number` in the list `around`."""
    k = solids.tank_count + number
    if around[0] < around.n:
        k = around[1 + number]
    return k


# --- is a wall thin? ---


@qd.func
def depth_in_solids(solids: SolidSet, around: qd.template(), at):
    """Depth [m] of the place `at` in that of the solids `around` that it is in, 0 outside."""
    depth = 0.0
    for number in range(around[0]):
        k = listed(solids, around, number)
        if (image_near(solids, k, at) - solids.position[k]).norm() < solids.reach[k]:
            depth = qd.max(depth, -signed_distance(solids, k, at).w)
    return depth


@qd.func
def is_inside(solids: SolidSet, around: qd.template(), at):
    """Say whether the place `at` is in one of the solids `around`."""
    found = False
    number = 0
    while number < around[0] and not found:
        k = listed(solids, around, number)
        if (image_near(solids, k, at) - solids.position[k]).norm() < solids.reach[k]:
            found = signed_distance(solids, k, at).w < 0.0
        number += 1
    return found


@qd.func
def is_free_beyond(solids: SolidSet, around: qd.template(), surface, outward, thickest):
    """Say whether it is free behind a `surface`, by the `thickest` [m] of thin walls or by half of that."""
    found = False
    for half in range(2):
        if not found:
            found = not is_inside(solids, around, surface - outward * (thickest * (1.0 - 0.5 * half)))
    return found


@qd.func
def continues(solids: SolidSet, around: qd.template(), middle, way, outward):
    """Return 1 where a solid extends from the place `middle` in it by a `way` [m] along it, else 0.

    It may bend: the way is turned in steps of a sixteenth of a turn, three towards `outward` [m], as long, and three
    away from it.
    """
    found = 0
    # Straight on first; thin walls are met by a step of a sixteenth of a turn. Kept, as they are asked for so often.
    cosines = qd.Vector([1.0, 0.9238795, 0.70710677, 0.38268343])
    sines = qd.Vector([0.0, 0.38268346, 0.70710677, 0.9238795])
    for number in range(7):
        if found == 0:
            turn = (number + 1) // 2
            at = middle + way * cosines[turn] - outward * (sines[turn] * (1 - 2 * (number % 2)))
            found = qd.cast(is_inside(solids, around, at), qd.i32)
    return found


@qd.func
def tangents(grid: Level, outward):
    """Two directions along a wall whose normal is `outward`; the second is 0 in 2-D, where the wall extends along z."""
    aside = vec3(0.0, 0.0, 1.0)
    if grid.nz > 1 and qd.abs(outward.z) > 0.7:
        aside = vec3(1.0, 0.0, 0.0)
    first = outward.cross(aside).normalized()
    return first, outward.cross(first) if grid.nz > 1 else vec3(0.0, 0.0, 0.0)


@qd.func
def is_sheet(grid: Level, solids: SolidSet, around: qd.template(), surface, outward, edge):
    """Say whether what is thin behind a `surface` continues to its sides: a wall, perhaps its rim, but not a bar."""
    middle, deepest = surface, 0.0
    for k in range(4):
        at = surface - outward * (0.1 * qd.cast(1 << k, qd.f32) * edge)
        depth = depth_in_solids(solids, around, at)
        if depth > deepest:
            middle, deepest = at, depth
    first, second = tangents(grid, outward)
    inside = 0
    for k in range(4):
        if inside >= k - 1:  # else two sides are free already
            way = (first if k % 2 == 0 else second) * ((k // 2 - 0.5) * 1.5 * edge)
            inside += continues(solids, around, middle, way, outward * (0.75 * edge))
    return inside >= 3


@qd.func
def axis_across(grid: Level, solids: SolidSet, around: qd.template(), at, edge):
    """The one axis along which a place inside of a wall is free on both sides, towards the nearer; 0 if not just one.

    In the middle of a wall that a grid of distances hardly resolves, these tell no direction.
    """
    found, axes = vec3(0.0, 0.0, 0.0), 0
    for axis in range(3 if grid.nz > 1 else 2):
        free, nearer = 0.0, 0.0  # how much of a solid is on both sides; by how much it is deeper ahead
        for number in range(4):
            side = 1.0 - 2.0 * (number % 2)
            way = vec3(0.0, 0.0, 0.0)
            way[axis] = side * (0.5 if number < 2 else 0.15) * grid.limits.thickest * edge
            depth = depth_in_solids(solids, around, at + way)
            free += depth if number < 2 else 0.0
            nearer += 0.0 if number < 2 else side * depth
        if free == 0.0:
            axes += 1
            found = vec3(0.0, 0.0, 0.0)
            found[axis] = 1.0 if nearer <= 0.0 else -1.0
    return found * (1.0 if axes == 1 else 0.0)


@qd.func
def belongs_to_side(grid: Level, solids: SolidSet, around: qd.template(), surface, outward, distance, edge):
    """Say whether a node inside of a wall, at a `distance` [m] below 0 from its `surface`, belongs to the side there.

    It does a little inside, as at thick solids, unless a corner is near: what is free ahead of the surface must be so
    beside it as well.
    """
    found = distance > -grid.limits.inside_kept * edge  # a node that is deeper has hardly any open volume
    first, second = tangents(grid, outward)
    for k in range(5 if grid.nz > 1 else 3):
        if found:
            way = outward * (0.1 if k == 0 else 0.5)
            if k > 0:
                way += (first if k < 3 else second) * (0.5 if k % 2 == 0 else -0.5)
            found = not is_inside(solids, around, surface + way * edge)
    return found


@qd.func
def find_thin_wall(grid: Level, w: Workspace, solids: SolidSet, around: qd.template(), n, wall):
    """Keep the plane of the thin `wall`, (gradient, distance [m]), that node `n` lies at; return 1 if there is one.

    If the node lies inside of it and belongs to neither side, it is closed. A wall is thin where it is free beyond,
    straight through; the solids that are asked are those listed as `around`.
    """
    edge = qd.min(grid.dx, grid.dy)
    outward = vec3(wall.x, wall.y, wall.z)
    w.thin_x[n], w.thin_y[n], w.thin_z[n], w.thin_distance[n] = 0.0, 0.0, 0.0, 0.0
    found = 0
    if wall.w < grid.limits.thin_near * edge and wall.w > -edge and outward.norm() > 0.5:
        surface = center_of(grid, n) - outward * wall.w
        thickest = grid.limits.thickest * edge
        close = narrowed(solids, around, surface, 1.1 * thickest)  # no place that is asked for is farther away
        is_thin = is_free_beyond(solids, close, surface, outward, thickest)
        if wall.w <= 0.0 and not is_thin:
            outward = axis_across(grid, solids, close, center_of(grid, n), edge)
            surface = center_of(grid, n) - outward * wall.w
            is_thin = outward.norm() > 0.0
        if is_thin and is_sheet(grid, solids, close, surface, outward, edge):
            found = 1
            if wall.w <= 0.0 and not belongs_to_side(grid, solids, close, surface, outward, wall.w, edge):
                grid.open_volume[n] = 0.0
            else:
                w.thin_x[n], w.thin_y[n], w.thin_z[n] = outward.x, outward.y, outward.z
                w.thin_distance[n] = wall.w
    return found


# --- what lies behind a thin wall ---


@qd.func
def is_at_thin_wall(w: Workspace, n):
    """Say whether node `n` lies at a thin wall, which it is on one side of."""
    return qd.abs(w.thin_x[n]) + qd.abs(w.thin_y[n]) + qd.abs(w.thin_z[n]) > 0.0


@qd.func
def is_behind(grid: Level, w: Workspace, n, way):
    """Say whether the place that is a `way` [m] from node `n` lies behind a thin wall, seen from there."""
    ahead = way.dot(vec3(w.thin_x[n], w.thin_y[n], w.thin_z[n])) + w.thin_distance[n]
    return ahead < -grid.limits.behind * qd.min(grid.dx, grid.dy)


@qd.func
def way_from(grid: Level, node, s):
    """Way [m] to the place `s` [cells] from the whole coordinates `node`, or from the nearest node of the tank."""
    start = node
    for axis in qd.static(range(3)):
        if qd.static(not grid.periodic >> axis & 1):
            start[axis] = clamped(grid, node[axis], axis)
    return vec3((s.x - start[0]) * grid.dx, (s.y - start[1]) * grid.dy, (s.z - start[2]) * grid.dz)


@qd.func
def is_open_to(grid: Level, w: Workspace, n, node, s, thin: qd.template()):
    """Return 1 where node `n`, at the whole coordinates `node`, is open to what is at the place `s` [cells], else 0.

    It is not to what lies behind a `thin` wall, if this world has any.
    """
    found = grid.open_volume[n] > 0.0
    if qd.static(thin):
        if found and is_at_thin_wall(w, n):
            found = not is_behind(grid, w, n, way_from(grid, node, s))
    return qd.cast(found, qd.f32)


@qd.func
def may_be_cut_off(grid: Level, w: Workspace, s):
    """Say whether nodes around the place `s` [cells] may be closed to what is there, see `mark_near_closed`."""
    return w.near_closed[nearest_node(grid, s)] > 0.0


@qd.func
def separates(grid: Level, w: Workspace, n, m, way):
    """Say whether the thin wall that node `n` lies at separates it from node `m`, a `way` [m] from there.

    Not if `m` lies in that wall and belongs to the same side.
    """
    alike = w.thin_x[n] * w.thin_x[m] + w.thin_y[n] * w.thin_y[m] + w.thin_z[n] * w.thin_z[m]
    return is_behind(grid, w, n, way) and not (w.thin_distance[m] < 0.0 and alike > 0.3)


@qd.func
def is_through(w: Workspace, n, m):
    """Say whether the nodes `n` and `m` lie in one wall, each nearer to another side of it."""
    facing = w.wall_x[n] * w.wall_x[m] + w.wall_y[n] * w.wall_y[m] + w.wall_z[n] * w.wall_z[m]
    return qd.max(w.wall_distance[n], w.wall_distance[m]) < 0.0 and facing < -0.3


@qd.func
def mark_blocked_faces(grid: Level, w: Workspace, n, thin: qd.template()):
    """Find in which faces of node `n` to the next nodes a wall lies, of `thin` ones and of those a little thicker."""
    bits = 0
    for axis in range(3):
        m = clamped_neighbor(grid, n, axis, 1)
        if m != n:
            blocked = is_through(w, n, m)
            if qd.static(thin):
                if not blocked:
                    length = edge(grid, axis)
                    way = vec3(on_axis(length, 0.0, 0.0, axis), on_axis(0.0, length, 0.0, axis), 0.0)
                    way.z = on_axis(0.0, 0.0, length, axis)
                    blocked = separates(grid, w, n, m, way) or separates(grid, w, m, n, -way)
            if blocked:
                bits |= 1 << axis
    w.blocked_faces[n] = bits


@qd.func
def may_be_behind(grid: Level, w: Workspace, n, aside, spacing):
    """Say whether a particle of the cell `aside` of node `n` may count there and lie behind the thin wall at it.

    `aside` are whole cells; a particle counts as far as a box as large as the `spacing` [m] reaches (`liquid.py`).
    """
    edges, nearest_way = vec3(grid.dx, grid.dy, grid.dz), vec3(0.0, 0.0, 0.0)
    outward = vec3(w.thin_x[n], w.thin_y[n], w.thin_z[n])
    for axis in qd.static(range(3)):
        far = 1.0 + 0.5 * qd.min(spacing / edges[axis], 1.0)
        side = 0.5 if outward[axis] < 0.0 else -0.5
        nearest_way[axis] = qd.min(qd.max(aside[axis] + side, -far), far) * edges[axis]
    return is_behind(grid, w, n, nearest_way)


@qd.func
def mark_near_closed(grid: Level, w: Workspace, n, spacing, thin: qd.template()):
    """Mark those of the nodes around, and node `n` itself, in whose cells a particle may be that is closed to `n`."""
    is_closed = grid.open_volume[n] <= 0.0
    has_closed = is_closed
    if qd.static(thin):
        has_closed = is_closed or is_at_thin_wall(w, n)
    if has_closed:
        for k in range(27 if grid.nz > 1 else 9):
            aside = qd.Vector([k % 3 - 1, k // 3 % 3 - 1, k // 9 - 1 if grid.nz > 1 else 0])
            marked = is_closed
            if qd.static(thin):
                if not is_closed:
                    marked = may_be_behind(grid, w, n, aside, spacing)
            if marked:
                w.near_closed[node_at(grid, coordinates(grid, n) + aside)] = 1.0


@qd.func
def is_blocked(w: Workspace, n, axis):
    """Return 1 where a wall lies in the face from node `n` to the next along an axis, else 0."""
    return (w.blocked_faces[n] >> axis) & 1


@qd.func
def is_blocked_between(grid: Level, w: Workspace, n, m, axis):
    """Return the same for two nodes that are neighbours along an axis."""
    first = qd.min(n, m)
    if qd.static(grid.periodic):
        if grid.periodic >> axis & 1 and qd.abs(n - m) != stride(grid, axis):  # the last node of a row and the first
            first = qd.max(n, m)
    return is_blocked(w, first, axis)

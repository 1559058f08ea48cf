"""What solids leave open: open volume fractions of cells, and apertures of the faces between them.

A cell counts the volume that solids leave it as particles there would count, so that a cell at a wall that is full of
liquid has the liquid fraction 1 (`liquid.py`). Half-edge pieces of the cells that a wall cuts are asked for how much of
them is free of it, and add that to the nodes around with hat weights; cells that no wall cuts are added by a filter.
A plane wall is asked for once a cell, any other, in a corner say, by each piece: of a corner's cell with a third more
open volume than it has the grid bore three quarters of the weight, and water turned there at 0.2 m/s.

Where there are bodies, the slits between them and what they lie on have no open volume. The layer that a body comes
down on is a lone row of particles in less than half a cell, and all of its density error had to leave through the
length of the slit at once: an error of a hundredth gave a fifth of the pressure below a box of fifteen spacings, which
trembled. The pressure there is extrapolated instead (`bodies.py`), and what presses on such a film is the iterations'
(notebook/bodies.md, "A box a tenth heavier than water").
"""

from wavetank.device.compiler import qd
from wavetank.device.state import Coefficients
from wavetank.physics.clusters import chunks_over, end_of_part, first_of_part, part_of
from wavetank.physics.pressure.grid import (
    Level,
    Variant,
    Workspace,
    add_fixed,
    center_of,
    clamped_neighbor,
    collected,
    coordinates,
    corners,
    directions,
    hat_weights,
    largest_along,
    longest_edge,
    on_axis,
    shortest_edge,
    smooth_along,
)
from wavetank.physics.pressure.grid import edge as edge_along
from wavetank.physics.pressure.thin_walls import (
    find_thin_wall,
    is_open_to,
    listed,
    mark_blocked_faces,
    mark_near_closed,
    solids_near,
)
from wavetank.solids.distance import SolidSet, image_near, signed_distance, vec3, vec4

UNIT = float(1 << 20)  # fixed-point sums are whole multiples of its inverse


# --- the nearest wall ---


@qd.func
def nearest_solid(grid: Level, solids: SolidSet, around: qd.template(), at):
    """Return the number of that of the solids `around` nearest to a place, and its (gradient, distance [m]).

    The number is -1, and the distance is large, where none is near.
    """
    edge = longest_edge(grid)
    found, nearest = -1, vec4(0.0, 1.0, 0.0, 4.0 * edge)
    for number in range(around[0]):
        k = listed(solids, around, number)
        way, reach = image_near(solids, k, at) - solids.position[k], solids.reach[k]
        if way.norm_sqr() < (reach + nearest.w) ** 2 and reach + nearest.w > 0.0 and nearest.w > -2.0 * edge:
            # What is farther away takes no volume: the distance to its bounding sphere is good enough there.
            value = vec4(way.x, way.y, way.z, way.norm() - reach)
            if value.w < 2.0 * edge:
                value = signed_distance(solids, k, at)
            if value.w < nearest.w:
                found, nearest = k, value
    return found, nearest


@qd.func
def nearest_wall(grid: Level, solids: SolidSet, around: qd.template(), center):
    """Return (gradient, distance [m]) of the wall nearest to the place `center`; far away where none is near.

    Where solids touch, or parts of one, the surfaces between them are not walls: open volume along the seams of a box
    of boards let the pressure out. Beyond a seam the wall is that of the solid there.
    """
    edge = longest_edge(grid)
    wall, touching, at = vec4(0.0, 1.0, 0.0, 4.0 * edge), 1.0, center
    outward, surface, queries = vec3(0.0, 1.0, 0.0), center, 0
    while queries < 3:  # one query in a loop, as what a kernel takes to compile grows with the places that have one
        k, value = nearest_solid(grid, solids, around, at)
        if queries == 0:
            wall, outward = value, vec3(value.x, value.y, value.z)
            surface = center - outward * value.w
            parts = solids.first[qd.max(k, 0) + 1] - solids.first[qd.max(k, 0)]  # none is near if k < 0: far away
            at = surface + outward * (2.0 * grid.limits.seam_touching * edge)
            if qd.abs(value.w) >= edge or qd.max(parts, around[0]) < 2:
                queries = 3
        elif queries == 1:
            touching = qd.min(-value.w / (grid.limits.seam_touching * edge), 1.0)
            at = surface + outward * (grid.limits.seam_beyond * edge)
            if touching <= 0.0:
                queries = 3
        elif value.w < 0.0:
            beyond = vec3(value.x, value.y, value.z)
            depth = -edge
            if beyond.dot(outward) > -0.7:
                depth = value.w + beyond.dot(center - at)
                outward = beyond
            depth = qd.min(wall.w, depth)
            wall = vec4(outward.x, outward.y, outward.z, wall.w + touching * (depth - wall.w))
        queries += 1
    return wall


# --- open volume ---


@qd.func
def free_of(distance, edge):
    """Share of a cell or piece with that `edge` [m] that is free of a wall at a `distance` [m] from its middle."""
    return qd.min(qd.max(0.5 + distance / edge, 0.0), 1.0)


@qd.func
def open_hat_weights(grid: Level, w: Workspace, at: qd.template(), s, dim: qd.template(), thin: qd.template()):
    """Weights of the nodes `at` the corners around the place `s` [cells]; solid ones leave their share to the others.

    So do those behind a `thin` wall, if this world has any.
    """
    weights = hat_weights(s - qd.floor(s), dim)
    low = qd.floor(s, qd.i32)
    total = 0.0
    for k in range(qd.static(2**dim)):
        node = qd.Vector([low[0] + (k & 1), low[1] + (k >> 1 & 1), low[2] + (k >> 2)])
        weights[k] *= is_open_to(grid, w, at[k], node, s, thin)
        total += weights[k]
    return weights / qd.max(total, 1e-3)


@qd.func
def is_at_plane(grid: Level, w: Workspace, n):
    """Say whether the wall nearest to node `n` is a plane there: the distances of the nodes beside tell the same."""
    found = True
    for axis in range(3 if grid.nz > 1 else 2):
        slope = on_axis(w.wall_x[n], w.wall_y[n], w.wall_z[n], axis) * edge_along(grid, axis)
        for side in range(2):
            m = clamped_neighbor(grid, n, axis, 2 * side - 1)
            if found and m != n:
                bend = w.wall_distance[m] - w.wall_distance[n] - slope * (2 * side - 1)
                found = qd.abs(bend) < grid.limits.plane * shortest_edge(grid)
    return found


@qd.func
def add_free_pieces(
    grid: Level, w: Workspace, solids: SolidSet, n, part, unit, dim: qd.template(), thin: qd.template()
):
    """Add the free pieces of the cell of node `n` to the sums of a `part`, with the weights of particles there.

    Where the wall is not a plane, as in a corner, each piece is asked for its own.
    """
    own = coordinates(grid, n)
    edges = vec3(grid.dx, grid.dy, grid.dz)
    wall = vec4(w.wall_x[n], w.wall_y[n], w.wall_z[n], w.wall_distance[n])
    is_plane = wall.w > shortest_edge(grid) or is_at_plane(grid, w, n)
    around = qd.Vector.zero(qd.i32, 17)
    if not is_plane:
        around = solids_near(grid, solids, n, 1, 2.0 * longest_edge(grid))
    for k in range(qd.static(2**dim)):
        way, s = vec3(0.0, 0.0, 0.0), vec3(0.0, 0.0, 0.0)
        for axis in qd.static(range(dim)):
            aside = 0.5 * ((k >> axis) % 2) - 0.25  # of the piece, in cells from the node
            s[axis] = own[axis] + aside
            way[axis] = aside * edges[axis]
        distance = wall.w + way.dot(vec3(wall.x, wall.y, wall.z))
        if not is_plane:
            distance = nearest_wall(grid, solids, around, center_of(grid, n) + way).w
        free = free_of(distance, 0.5 * shortest_edge(grid))
        if free > 0.0:
            at = corners(grid, qd.floor(s, qd.i32), dim)
            weights = open_hat_weights(grid, w, at, s, dim, thin)
            for corner in qd.static(range(2**dim)):
                amount = unit * free * weights[corner] / 2.0**dim
                of_part = part * grid.nx * grid.ny * grid.nz + at[corner]
                add_fixed(w.sums, of_part, qd.cast(qd.round(amount), qd.i32), grid.alone)


@qd.func
def is_slit(grid: Level, w: Workspace, n, gravity):
    """Say whether node `n` lies between two solids that leave less than half a cell, without an open node beside it.

    One lies above the other: what stands upright beside a wall is open to the air above, and pressed on by nothing.
    `gravity` is a vector of any length; without it slits along all axes count.
    """
    narrowest, widest = 1.0, 0.0
    if grid.open_volume[n] > 0.0 and grid.open_volume[n] < grid.limits.slit:
        for axis in range(directions(grid) // 2):
            if qd.abs(on_axis(gravity.x, gravity.y, gravity.z, axis)) >= 0.7 * gravity.norm():
                width = grid.open_volume[n]
                for direction in range(2):
                    m, is_open = n, True
                    for _ in range(2):
                        ahead = clamped_neighbor(grid, m, axis, 2 * direction - 1)
                        is_open = is_open and ahead != m
                        width += grid.open_volume[ahead] if is_open else 0.0
                        widest = qd.max(widest, grid.open_volume[ahead] if is_open and m == n else 0.0)
                        is_open = is_open and grid.open_volume[ahead] > 0.0
                        m = ahead
                narrowest = qd.min(narrowest, width)
    return narrowest < grid.limits.slit and widest < grid.limits.mostly_open


# --- apertures ---


@qd.func
def open_area(grid: Level, n, m):
    """Open fraction of the face between the nodes `n` and `m`, if both have open volume.

    A face towards an uncut cell is open as a whole, one between two that a wall cuts as much as they are.
    """
    return qd.min(qd.max(grid.open_volume[n], grid.open_volume[m]), 1.0)


@qd.func
def aperture_to(grid: Level, n, m, blocked):
    """Open fraction of the face from node `n` to the next one `m`, 0 where there is none or it is `blocked`."""
    is_open = m != n and qd.min(grid.open_volume[n], grid.open_volume[m]) > 0.0 and blocked == 0
    return open_area(grid, n, m) if is_open else 0.0


@qd.func
def set_apertures(grid: Level, w: Workspace, n):
    """Find the open fractions of the faces from node `n` to the next ones along each axis."""
    blocked = w.blocked_faces[n]
    grid.aperture_x[n] = aperture_to(grid, n, clamped_neighbor(grid, n, 0, 1), blocked & 1)
    grid.aperture_y[n] = aperture_to(grid, n, clamped_neighbor(grid, n, 1, 1), blocked & 2)
    grid.aperture_z[n] = aperture_to(grid, n, clamped_neighbor(grid, n, 2, 1), blocked & 4)


# --- the kernel; its loops are tasks of their own, and what they do for a node or a row are functions ---


@qd.func
def find_walls(grid: Level, w: Workspace, found: qd.template(), solids: SolidSet, segment, has: Variant):
    """Find the wall nearest to each node of a segment, and whether it is a thin one."""
    first = segment % grid.segments * grid.width
    begin = grid.nx * (segment // grid.segments) + first
    nodes = qd.min(grid.width, grid.nx - first)
    around = solids_near(grid, solids, begin, nodes, grid.limits.search * longest_edge(grid))
    for n in range(begin, begin + nodes):
        wall = nearest_wall(grid, solids, around, center_of(grid, n))
        w.wall_x[n], w.wall_y[n], w.wall_z[n], w.wall_distance[n] = wall.x, wall.y, wall.z, wall.w
        grid.overhang[n] = -wall.y
        grid.open_volume[n] = qd.cast(free_of(wall.w, shortest_edge(grid)) >= grid.limits.least_open, qd.f32)
        if qd.static(has.thin_walls):
            if find_thin_wall(grid, w, solids, around, n, wall) == 1:
                qd.atomic_add(found[0], 1)
        w.near_closed[n] = 0.0


@qd.func
def sum_free_volume(grid: Level, w: Workspace, solids: SolidSet, n, part, unit, dim: qd.template(), has: Variant):
    """Mark node `n` as uncut where nothing closed is near, else add the free pieces of its cell to the sums."""
    edge = longest_edge(grid)
    w.uncut_cells[n] = qd.cast(w.near_closed[n] == 0.0 and w.wall_distance[n] >= 0.75 * edge, qd.f32)
    if w.uncut_cells[n] == 0.0 and w.wall_distance[n] > -edge:
        add_free_pieces(grid, w, solids, n, part, unit, dim, has.thin_walls)


@qd.func
def set_open_volume(grid: Level, w: Workspace, n, unit):
    """Set the open volume fraction of node `n` from the sums of pieces and the filtered uncut cells."""
    total = collected(w.sums, n, grid.nx * grid.ny * grid.nz, grid.parts)
    if grid.open_volume[n] > 0.0 and w.wall_distance[n] < 2.0 * longest_edge(grid):
        grid.open_volume[n] = total / unit + w.uncut_cells[n]


@qd.func
def mark_far(w: Workspace, n):
    """Mark node `n` where no solid takes volume within two cells; nothing closed is near there."""
    w.far_from_solids[n] = qd.cast(w.volume_change[n] < 1e-3, qd.f32)
    if w.far_from_solids[n] > 0.0:
        w.near_closed[n] = 0.0


@qd.kernel(fastcache=True)
def clear_solids(grid: Level, w: Workspace):
    """Leave all cells and faces open, in a world without solids but for the walls of the tank."""
    for n in range(grid.nx * grid.ny * grid.nz):
        grid.open_volume[n] = 1.0
        grid.overhang[n] = -1.0
        w.far_from_solids[n] = 1.0
        w.blocked_faces[n] = 0
    for n in range(grid.nx * grid.ny * grid.nz):
        set_apertures(grid, w, n)


@qd.kernel(fastcache=True)
def find_nearest_walls(grid: Level, w: Workspace, found: qd.types.ndarray(), solids: SolidSet, has: Variant):
    """Find the nearest wall of each node; `found[0]` counts nodes at thin walls."""
    for segment in range(grid.segments * grid.ny * grid.nz):
        find_walls(grid, w, found, solids, segment, has)


@qd.kernel(fastcache=True)
def find_open_volume(
    grid: Level,
    w: Workspace,
    solids: SolidSet,
    c: Coefficients,
    unit: qd.f32,
    spacing: qd.f32,
    dim: qd.template(),
    has: Variant,
):
    """Find the open volume of each cell; slits are closed where there are bodies.

    Sums are of whole multiples of the inverse of `unit`, so that the order of threads does not matter; they are 0
    before and after.
    """
    qd.loop_config(serialize=bool(has.few_nodes))
    for n in range(grid.nx * grid.ny * grid.nz):
        mark_blocked_faces(grid, w, n, has.thin_walls)
        mark_near_closed(grid, w, n, spacing, has.thin_walls)
    for chunk in range(chunks_over(grid.nx * grid.ny * grid.nz, grid.parts, 1 + grid.alone)):
        first = first_of_part(chunk, grid.nx * grid.ny * grid.nz, grid.parts, 1 + grid.alone)
        for n in range(first, end_of_part(chunk, grid.nx * grid.ny * grid.nz, grid.parts, 1 + grid.alone)):
            sum_free_volume(grid, w, solids, n, grid.alone * part_of(chunk), unit, dim, has)
    qd.loop_config(serialize=bool(has.few_nodes))
    for row in range(grid.ny * grid.nz):
        smooth_along(w.mean_x, w.uncut_cells, grid, row, 0, grid.limits.hat_beside)
    qd.loop_config(serialize=bool(has.few_nodes))
    for row in range(grid.ny * grid.nz):
        smooth_along(w.mean_xy, w.mean_x, grid, row, 1, grid.limits.hat_beside)
    qd.loop_config(serialize=bool(has.few_nodes))
    for row in range(grid.ny * grid.nz):
        smooth_along(w.uncut_cells, w.mean_xy, grid, row, 2, grid.limits.hat_beside)
    qd.loop_config(serialize=bool(has.few_nodes))
    for n in range(grid.nx * grid.ny * grid.nz):
        set_open_volume(grid, w, n, unit)
    if qd.static(has.bodies):
        qd.loop_config(serialize=bool(has.few_nodes))
        for n in range(grid.nx * grid.ny * grid.nz):
            w.slit_cells[n] = qd.cast(is_slit(grid, w, n, vec3(c.gravity_x, c.gravity_y, c.gravity_z)), qd.f32)
        qd.loop_config(serialize=bool(has.few_nodes))
        for n in range(grid.nx * grid.ny * grid.nz):
            grid.open_volume[n] = 0.0 if w.slit_cells[n] > 0.0 else grid.open_volume[n]


@qd.kernel(fastcache=True)
def find_apertures(grid: Level, w: Workspace, spacing: qd.f32, has: Variant):
    """Find the apertures of the cells' faces."""
    qd.loop_config(serialize=bool(has.few_nodes))
    for n in range(grid.nx * grid.ny * grid.nz):
        w.volume_change[n] = qd.abs(grid.open_volume[n] - 1.0)
        w.near_closed[n] = 0.0
    qd.loop_config(serialize=bool(has.few_nodes))
    for row in range(grid.ny * grid.nz):
        largest_along(w.mean_x, w.volume_change, grid, row, 0, 2)
    qd.loop_config(serialize=bool(has.few_nodes))
    for row in range(grid.ny * grid.nz):
        largest_along(w.mean_xy, w.mean_x, grid, row, 1, 2)
    qd.loop_config(serialize=bool(has.few_nodes))
    for row in range(grid.ny * grid.nz):
        largest_along(w.volume_change, w.mean_xy, grid, row, 2, 2)
    qd.loop_config(serialize=bool(has.few_nodes))
    for n in range(grid.nx * grid.ny * grid.nz):
        mark_near_closed(grid, w, n, spacing, has.thin_walls)
    qd.loop_config(serialize=bool(has.few_nodes))
    for n in range(grid.nx * grid.ny * grid.nz):
        mark_far(w, n)
        set_apertures(grid, w, n)

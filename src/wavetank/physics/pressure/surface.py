"""The free surface: depth of nodes below it, air below closed tops and overhangs, thin films.

Depth. The pressure displacement is the gradient of a smooth field. It does not see bumps shorter than two cells, and
carried all particles of the top layer alike: without weight a bump stayed, and as the particles of a bump that is
lifted move apart, the liquid fraction below it fell and it was lifted more, until single particles were thrown. Those
above the place of the top layer at rest, half a spacing below the surface, therefore lose the displacement by a share
that grows with their height (`correct.py`): what sticks out has weight, rests on its neighbours and sinks back.

For that the surface must be known to some hundredths of a spacing. A crossing of the liquid fraction between two nodes
is off by up to a fifth; the sum of the fractions on the way to the air is not, because footprints add up to the volume:
the height function of the volume-of-fluid method (Cummins et al. 2005, 10.1016/j.compstruc.2004.08.017). The heights
along three axes are taken for the distance of a plane that cuts them there. A node inside of a solid, below one or
above one is on no such way; as a liquid at rest is level, its depth is that of the nodes beside it.

Films. In a film one cell lies between floor and air. Grid and iterations both see the whole of its density error, and
each answers it in full. What removes an error more than 4/3 times in a step makes it grow with its sign changed, and
more than 1.2 times with a warm-started pressure: layers on floors jumped up and down by 0.02 spacings from step to
step. So thin films are left to the iterations, which reach through them.

    code      meaning                                                     unit
    depth     of a node below the surface, above it less than 0           m
    way       along an axis, from a node to the surface                   m
"""

from wavetank.device.compiler import qd
from wavetank.physics.pressure.grid import (
    Level,
    Workspace,
    clamped,
    directions,
    edge,
    neighbor,
    nodes_beyond,
    on_axis,
    ramp,
)
from wavetank.physics.pressure.thin_walls import is_at_thin_wall, is_blocked_between

# --- air below closed tops and overhangs ---


@qd.func
def has_lid(gravity):
    """Return 1 where a tank is closed above its liquid, which falls along y, else 0."""
    return qd.cast(-gravity[1] > 0.7 * gravity.norm(), qd.i32)


@qd.func
def air_above(grid: Level, n, lid):
    """Soft fraction of the face above node `n` that air lies at, below the `lid` of the tank or an overhang; else 0.

    The surface may lie in the last cells below a closed top, which have no air above them: there it is as far as these
    are full, and the fuller they are the less sure it is that there is one. Those of a full tank are nearly full.

    An overhang leaves the next node above no open volume. What is above a floor and below a slit is not a surface, and
    what lacks below a roof over liquid is not air (`liquid.fill_slits`); elsewhere a cell there that passes half of its
    open volume has a surface, and loses it by degrees. Only the finest level knows which way walls face.
    """
    share = 0.0
    if qd.static(not grid.periodic & 2):
        if lid == 1 and n < grid.nx * grid.ny * grid.nz:
            if n // grid.nx % grid.ny == grid.ny - 1:
                share = 1.0 - ramp(grid.liquid[n], grid.limits.lid_from, grid.limits.lid_to)
            elif grid.open_volume[n] > 0.0 and grid.open_volume[n + grid.nx] <= 0.0:
                overhangs = ramp(grid.overhang[n], grid.limits.overhang_from, grid.limits.overhang_to)
                share = overhangs * (1.0 - ramp(grid.liquid[n], grid.limits.below_from, grid.limits.below_to))
    return share


# --- depth ---


@qd.func
def cells_to_air(grid: Level, w: Workspace, n, axis, side, gravity):
    """Cells from node `n`, in liquid, to the surface on a `side` along an `axis`; 0 if there is none within three.

    The last cells below a closed top, or below an overhang, have no air above them: there the surface is as far as
    these are full, and the farther away the less sure that is (`air_above`).
    """
    nodes = qd.min(nodes_beyond(grid, n, axis, side), 3)
    total, reached, closed, m = grid.liquid[n] - 0.5, 0, 0, n
    for _ in range(nodes):
        ahead = neighbor(grid, m, axis, side)
        if grid.open_volume[ahead] <= 0.0 or is_blocked_between(grid, w, m, ahead, axis) == 1:
            closed = 1
            break
        m = ahead
        total += qd.min(grid.liquid[m], 1.0)
        reached = 1 if grid.liquid[m] < 0.5 else reached
    way = qd.max(total, 1e-3) if reached == 1 else 0.0
    if axis == 1 and side == 1 and reached == 0 and (closed == 1 or nodes < 3):
        sure = air_above(grid, m, has_lid(gravity))
        if sure > 0.0:
            way = qd.max(total, 1e-3) / qd.sqrt(sure)
    return way


@qd.func
def depth_in_air(grid: Level, w: Workspace, n, axis, side):
    """Depth [cells] of node `n`, which has air, below the surface at the next node on a `side` along an `axis`.

    It is below 0, and -1 where that node has no liquid.
    """
    m = neighbor(grid, n, axis, side) if nodes_beyond(grid, n, axis, side) > 0 else n
    has_liquid = grid.open_volume[m] > 0.0 and grid.liquid[m] >= 0.5 and is_blocked_between(grid, w, n, m, axis) == 0
    return grid.liquid[n] + qd.min(grid.liquid[m], 1.0) - 1.5 if has_liquid else -1.0


@qd.func
def depth_along_axes(grid: Level, w: Workspace, n, gravity):
    """Depth [m] of node `n` below the surface that the volume of the liquid has, at most three cells.

    `gravity` is a vector of any length.
    """
    deepest = 3.0 * grid.dy
    depth, ways = -1.0, qd.Vector.zero(qd.f32, 6)  # cells; m
    for direction in range(directions(grid)):
        axis, side = direction // 2, 2 * (direction % 2) - 1
        if grid.liquid[n] >= 0.5:
            ways[direction] = cells_to_air(grid, w, n, axis, side, gravity) * edge(grid, axis)
        else:
            depth = qd.max(depth, depth_in_air(grid, w, n, axis, side))
    closeness = 0.0  # 1/m^2: sum of inverse squares of the ways; unrolled, as sums of a loop round differently
    for direction in qd.static(range(6)):
        closeness += 1.0 / (ways[direction] * ways[direction]) if ways[direction] > 0.0 else 0.0
    below = qd.min(deepest, 1.0 / qd.sqrt(closeness)) if closeness > 0.0 else deepest
    found = below if grid.liquid[n] >= 0.5 else depth * grid.dy
    return found if grid.open_volume[n] > 0.0 else deepest  # inside of a solid nothing sticks out


@qd.func
def find_row_extremes(grid: Level, w: Workspace, row):
    """Find the smallest and the largest liquid fraction of a row of nodes."""
    least, most = 1e9, 0.0
    for n in range(grid.nx * row, grid.nx * row + grid.nx):
        least, most = qd.min(least, grid.liquid[n]), qd.max(most, grid.liquid[n])
    w.row_least[row], w.row_most[row] = least, most


@qd.func
def is_air_row(grid: Level, w: Workspace, row):
    """Say whether there is no liquid in a row of nodes nor in those that follow along y and z."""
    y, z = row % grid.ny, row // grid.ny
    most = qd.max(w.row_most[row], w.row_most[clamped(grid, y + 1, 1) + grid.ny * z])
    return qd.max(most, w.row_most[y + grid.ny * clamped(grid, z + 1, 2)]) < 0.5


@qd.func
def find_depths(grid: Level, w: Workspace, to: qd.template(), row, gravity):
    """Write the depths of a row of nodes: each is computed only where both air and liquid are near."""
    y, z = row % grid.ny, row // grid.ny
    least, most = w.row_least[row], w.row_most[row]
    for k in range(12):
        aside = k // 2 - 3 if k < 6 else k // 2 - 2  # -3 to 3 without 0
        other = clamped(grid, y + aside, 1) + grid.ny * z
        if k % 2 == 1:
            other = y + grid.ny * clamped(grid, z + aside, 2)
        least = qd.min(least, w.row_least[other])
        if qd.abs(aside) == 1:
            most = qd.max(most, w.row_most[other])
    for n in range(grid.nx * row, grid.nx * row + grid.nx):
        if most < 0.5:
            to[n] = -grid.dy if grid.open_volume[n] > 0.0 else 3.0 * grid.dy
        elif least >= 0.5 and y + 3 < grid.ny:
            to[n] = 3.0 * grid.dy
        else:
            to[n] = depth_along_axes(grid, w, n, gravity)


@qd.func
def has_way_to_air(grid: Level, depth):
    """Say whether a way leads to the surface from a node with that `depth` [m]: else it has the largest."""
    return depth < 2.999 * grid.dy


@qd.func
def is_depth_known(grid: Level, w: Workspace, n):
    """Say whether the depth of node `n` along the axes is known: a way leads to the surface, or no solid is near."""
    has_way = has_way_to_air(grid, w.own_depth[n]) and w.own_depth[n] > -0.999 * grid.dy
    return w.far_from_solids[n] > 0.0 or (grid.open_volume[n] > 0.0 and has_way)


@qd.func
def level_depth(grid: Level, w: Workspace, n, gravity):
    """Depth [m] of node `n`, or where a solid is in its way to the surface the mean of the nodes beside it.

    Those lie across `gravity`, a vector of any length. The other side of a thin wall may have another level.
    """
    total, number = 0.0, 0
    if not is_depth_known(grid, w, n) and not is_at_thin_wall(w, n):
        for direction in range(directions(grid)):
            axis, side = direction // 2, 2 * (direction % 2) - 1
            across = qd.abs(on_axis(gravity.x, gravity.y, gravity.z, axis)) <= 0.7 * gravity.norm()
            if across and nodes_beyond(grid, n, axis, side) > 0:
                m = neighbor(grid, n, axis, side)
                if is_depth_known(grid, w, m) and is_blocked_between(grid, w, n, m, axis) == 0:
                    total += w.own_depth[m]
                    number += 1
    return total / number if number > 0 else w.own_depth[n]


# --- thin films ---


@qd.func
def film_thickness(grid: Level, w: Workspace, n, axis):
    """Cells of liquid along an axis through node `n`, from a floor or wall to the air; many where it is not a film."""
    reach = grid.limits.film_reach
    total = qd.min(grid.liquid[n], 1.0)
    closed, opened = 0, 0
    for direction in range(2):
        side = 2 * direction - 1
        nodes = nodes_beyond(grid, n, axis, side)
        m, ended = n, 0
        for _ in range(qd.min(nodes, reach)):
            if ended == 0:
                before = m
                m = neighbor(grid, m, axis, side)
                if grid.open_volume[m] <= 0.0 or is_blocked_between(grid, w, before, m, axis) == 1:
                    closed, ended = closed + 1, 1
                else:
                    total += qd.min(grid.liquid[m], 1.0)
                    if grid.liquid[m] < 0.5:
                        opened, ended = opened + 1, 1
        if ended == 0 and nodes < reach:  # the tank ends there
            closed += 1
    return qd.select(closed == 1 and opened == 1, total, 2.0 * reach)


@qd.func
def share_of_grid(grid: Level, w: Workspace, n):
    """Share of the errors at node `n` that the grid corrects: 0 in a thin film just below the air, else 1."""
    cells = 2.0 * grid.limits.film_reach
    if grid.liquid[n] >= 0.5 and grid.open_volume[n] > 0.0 and has_way_to_air(grid, w.depth[n]):
        for axis in range(directions(grid) // 2):
            cells = qd.min(cells, film_thickness(grid, w, n, axis))
    return ramp(cells, grid.limits.film_from, grid.limits.film_to)

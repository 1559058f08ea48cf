"""What the pressure of the whole tank does to bodies.

The force on a body is the integral of the pressure over its surface. A body is cut into the pieces of a lattice about
as fine as the particles, or half as thick as its walls, and each is pushed by the difference between its faces. What
lies between two pieces cancels; what is left are the faces behind which there is less of the next piece, and these add
up to the surface. There the pressure is that of the liquid or air on the side that the surface looks to, from the
nodes that are open to it, so that a wall thinner than a cell feels water on one side and air on the other, as cut cells
with virtual nodes do (Azevedo, Batty and Oliveira 2016, 10.1145/2897824.2925919). Where no node is open, as below what
lies on the ground, multipliers are continued into the body, straight on from the water and from the air around.

    code      meaning                                                     unit
    sweep     of extrapolation: how many nodes it is to open volume       1
    volume    of a piece, over that of a particle                         1
"""

import math

from wavetank.device.compiler import qd
from wavetank.device.state import Coefficients, Particles
from wavetank.physics.bodies import Pieces, add_to_body, displacing, immersion, of_grid
from wavetank.physics.boundary import fall
from wavetank.physics.contact import flattened
from wavetank.physics.pressure.grid import (
    Level,
    Variant,
    Workspace,
    center_of,
    corners,
    directions,
    edge,
    hat_weights,
    in_cells,
    neighbor,
    nodes_beyond,
    on_axis,
)
from wavetank.physics.pressure.thin_walls import is_open_to, way_from
from wavetank.physics.world import World
from wavetank.solids.distance import SolidSet, parts, rotate, signed_distance, vec3

FARTHEST = 24  # nodes into a body that the pressure is continued
AIR = 1e-3  # weight of what is continued from the air, where there is water to continue it from as well


@qd.kernel(fastcache=True)
def mark_known(grid: Level, w: Workspace):
    """Mark where the pressure is known: where there is open volume."""
    for n in range(grid.nx * grid.ny * grid.nz):
        w.known_after[n] = 0.0 if grid.open_volume[n] > 0.0 else 1e9


@qd.func
def continued_slope(grid: Level, w: Workspace, m, axis, side, at_rest, sweep):
    """Change of the multiplier from node `m` to the one before it on that `side` of an axis: on straight at first.

    Farther on it is that `at_rest` [m]: where a body lies on something, what the liquid at the mouth of the slit does
    by chance would grow from node to node.
    """
    slope = -side * edge(grid, axis) * on_axis(at_rest.x, at_rest.y, at_rest.z, axis)
    if sweep == 1:
        slope = 0.0
        if nodes_beyond(grid, m, axis, side) > 0:
            farther = neighbor(grid, m, axis, side)
            if w.known_after[farther] < sweep:
                slope = grid.lam[m] - grid.lam[farther]
    return slope


@qd.kernel(fastcache=True)
def extrapolate(
    grid: Level, w: Workspace, c: Coefficients, stiffness: qd.f32, sweep: qd.i32, air: qd.f32, mixed: qd.template()
):
    """Extrapolate multipliers by one node, from those known after an earlier `sweep`; `air` is the weight of air nodes.

    Where fluids are `mixed`, so are their densities.
    """
    for n in range(grid.nx * grid.ny * grid.nz):
        at_rest = fall(c) / -stiffness
        if w.known_after[n] > sweep:
            lam, weight, mass, filled = 0.0, 0.0, 0.0, 0.0
            for direction in qd.static(range(6)):  # unrolled: sums of a loop round differently
                axis, side = qd.static(direction // 2, 2 * (direction % 2) - 1)
                m = n
                if direction < directions(grid) and nodes_beyond(grid, n, axis, side) > 0:
                    m = neighbor(grid, n, axis, side)
                if w.known_after[m] < sweep:
                    share, slope = 1.0, continued_slope(grid, w, m, axis, side, at_rest, sweep)
                    if grid.lam[m] == 0.0:  # air, or continued from there
                        share, slope = air, 0.0
                    lam += share * (grid.lam[m] + slope)
                    weight += share
                    if qd.static(mixed):
                        mass += filled_at(grid, w, m) * grid.density[m]
                        filled += filled_at(grid, w, m)
            if weight > 0.0:
                grid.lam[n] = lam / weight
                if qd.static(mixed):
                    grid.density[n] = mass / filled if filled > 0.0 else 1.0
                w.known_after[n] = sweep


@qd.func
def filled_at(grid: Level, w: Workspace, n):
    """Liquid fraction of node `n`, at most 1; 1 where the liquid is continued into a body."""
    return qd.min(grid.liquid[n], 1.0) if w.known_after[n] == 0.0 else 1.0


@qd.func
def density_at(grid: Level, w: Workspace, at, x: qd.template()):
    """The density of the fluid around a place in the world, over that of the heaviest."""
    dim = qd.static(x.n)
    s = in_cells(grid, flattened(at, x))
    nodes = corners(grid, qd.floor(s, qd.i32), dim)
    weights = hat_weights(s - qd.floor(s), dim)
    mass, filled = 0.0, 0.0
    for c in qd.static(range(2**dim)):
        share = weights[c] * filled_at(grid, w, nodes[c])
        mass += share * grid.density[nodes[c]]
        filled += share
    return mass / filled if filled > 0.0 else 1.0


@qd.func
def multiplier_at(grid: Level, at, x: qd.template()):
    """The multiplier at a place in the world, a plane's beyond the last nodes, and 0 where it would pull.

    Above the surface it does, where it is continued into a body. Cut off at the nodes, as it is at those in the air, it
    would press on a bottom that only touches the water as if that lay a quarter of a cell deep.
    """
    dim = qd.static(x.n)
    s = in_cells(grid, flattened(at, x))
    last = vec3(grid.nx - 2, grid.ny - 2, grid.nz - 2)
    low = qd.floor(s)
    for axis in qd.static(range(3)):
        if qd.static(not grid.periodic >> axis & 1):
            low[axis] = qd.max(qd.min(low[axis], last[axis]), 0.0)
    nodes = corners(grid, qd.cast(low, qd.i32), dim)
    weights = hat_weights(s - low, dim)
    total = 0.0
    for c in qd.static(range(2**dim)):
        total += weights[c] * grid.lam[nodes[c]]
    return qd.min(total, 0.0)


@qd.func
def is_in_sight(solids: SolidSet, k, start, end, near):
    """Return 1 where body `k` does not lie between two places, else 0; it does where it is as `near` as that [m]."""
    length, passed, distance = (end - start).norm(), 0.0, near
    for _ in range(16):
        if passed < length and distance >= near:
            distance = signed_distance(solids, k, start + (end - start) * (passed / length)).w
            passed += distance
    return qd.cast(passed >= length, qd.f32)


@qd.func
def multiplier_of_open(
    grid: Level, w: Workspace, solids: SolidSet, k, at, outside, at_rest, x: qd.template(), thin: qd.template(), seen
):
    """(multiplier at a place of body `k`'s surface by the nodes that are open to a place just `outside`, their weight).

    It goes straight on by the slope of the heaviest liquid `at_rest` [m], times the density there; air has none. `thin`
    is how it is asked what is open.
    """
    dim = qd.static(x.n)
    s, place = in_cells(grid, flattened(outside, x)), in_cells(grid, flattened(at, x))
    low = qd.floor(s, qd.i32)
    nodes = corners(grid, low, dim)
    weights = hat_weights(s - qd.floor(s), dim)
    total, lam = 0.0, 0.0
    for corner in range(qd.static(2**dim)):
        node = qd.Vector([low[0] + (corner & 1), low[1] + (corner >> 1 & 1), low[2] + (corner >> 2)])
        n = nodes[corner]
        share = weights[corner] * is_open_to(grid, w, n, node, s, thin)
        if w.known_after[n] > 0.0:
            share = 0.0
        if qd.static(thin == 0):
            if seen == 1 and share > 0.0:
                share *= is_in_sight(solids, k, outside, center_of(grid, n), 0.02 * qd.min(grid.dx, grid.dy))
        total += share
        slope = way_from(grid, node, place).dot(at_rest) * grid.density[n]
        lam += share * (grid.lam[n] + (slope if grid.lam[n] < 0.0 else 0.0))
    return qd.min(lam / qd.max(total, 1e-6), 0.0), total


@qd.func
def multiplier_on_side(
    grid: Level, w: Workspace, solids: SolidSet, k, at, outward, at_rest, x: qd.template(), has: Variant
):
    """The multiplier at a place on body `k`'s surface that looks `outward`; 0 where that is 0, inside of the body.

    It is that of the liquid or air on this side, from the nodes that are open to it; where none is, it is what was
    continued into the body. In a corner of thin walls, where a node knows one of them only, those in sight are open.
    """
    found = 0.0
    if outward.norm_sqr() > 0.0:
        found = multiplier_at(grid, at, x)
        outside = at + outward * (grid.limits.outside * qd.min(grid.dx, grid.dy))
        own, total = multiplier_of_open(grid, w, solids, k, at, outside, at_rest, x, has.thin_walls, 0)
        if qd.static(has.thin_walls):
            if total < grid.limits.open_from_outside:
                own, total = multiplier_of_open(grid, w, solids, k, at, outside, at_rest, x, 0, 1)
        found += qd.min(total / grid.limits.open_from_outside, 1.0) * (own - found)
    return found


@qd.kernel(fastcache=True)
def push_pieces(
    grid: Level,
    w: Workspace,
    pieces: Pieces,
    solids: SolidSet,
    particles: Particles,
    stiffness: qd.f32,
    per_lambda: qd.f32,
    c: Coefficients,
    has: Variant,
):
    """Push each piece of each body by what presses on its faces that are at the surface.

    `per_lambda` [1/m] makes a multiplier the depth of water at rest. The grid has the water where it fell, its surface
    as well, so a body is read there too: at a step of 1/60 s it would float 1.4 mm too deep.
    """
    for number in range(pieces.count):
        k = pieces.solid[number]
        dim = qd.static(particles.x[0].n)
        turn = solids.rotation[k]
        at = solids.position[k] + rotate(turn, pieces.place[number])
        fallen, at_rest = at + fall(c), fall(c) / -stiffness
        slope = vec3(0.0, 0.0, 0.0)
        for axis in qd.static(range(dim)):
            half = vec3(0.0, 0.0, 0.0)
            half[axis] = 0.5 * pieces.edges[number][axis]
            way = rotate(turn, half)
            along = way / half[axis]
            x = particles.x[0]
            ahead = multiplier_on_side(
                grid, w, solids, k, fallen + way, along * pieces.ahead[number][axis], at_rest, x, has
            )
            behind = multiplier_on_side(
                grid, w, solids, k, fallen - way, along * pieces.behind[number][axis], at_rest, x, has
            )
            slope[axis] = (ahead - behind) / pieces.edges[number][axis]
        push = rotate(turn, slope) * (stiffness * pieces.volume[number])
        add_to_body(solids, k, of_grid(), at, push)
        depth = -per_lambda * multiplier_at(grid, fallen, particles.x[0])
        # In metres, as the pushes are that the body's unit is for: times the edge of a cell.
        wet = qd.min(qd.max(2.0 * depth / grid.dy, 0.0), 1.0) * pieces.volume[number] * grid.dy
        qd.atomic_add(solids.reaction[parts() * k + immersion()], qd.cast(qd.round(solids.unit[k] * wet), qd.i32))
        if qd.static(has.mixed):
            wet *= density_at(grid, w, fallen, particles.x[0])
        qd.atomic_add(solids.reaction[parts() * k + displacing()], qd.cast(qd.round(solids.unit[k] * wet), qd.i32))


def push_bodies_by_pressure(world: World, stiffness: float, per_lambda: float, c: Coefficients, has: Variant) -> None:
    """Push the bodies by the pressure on the finest grid; a body is no deeper than `FARTHEST` nodes.

    `stiffness` is M of the rest lattice, `per_lambda` [1/m] makes a multiplier the depth of liquid at rest.
    """
    pressure, pieces = world.pressure, world.pieces
    assert pressure is not None and pieces is not None, "there are no bodies in a tank"
    grid, w = pressure.finest, pressure.workspace
    mark_known(grid, w)
    for sweep in range(1, min(FARTHEST, math.ceil(pieces.reach / min(grid.dx, grid.dy)) + 1) + 1):
        extrapolate(grid, w, c, stiffness, sweep, AIR, has.mixed)
    push_pieces(grid, w, pieces, world.solids, world.particles, stiffness, per_lambda, c, has)

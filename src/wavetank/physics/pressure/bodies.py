"""What the pressure of the whole tank does to bodies.

The force on a body is the integral of the pressure over its surface, which is that of the pressure's slope over its
volume (Gauss) for whatever field continues the pressure into the body. So the multipliers are continued there, straight
on from the water and from the air around, and each small piece of the body is pushed as the water would be that it took
the place of: Archimedes' principle, piece by piece. Pieces are those of a lattice about as fine as the particles.

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
    Workspace,
    corners,
    directions,
    edge,
    hat_weights,
    in_cells,
    neighbor,
    nodes_beyond,
    on_axis,
)
from wavetank.physics.world import World
from wavetank.solids.distance import SolidSet, parts, rotate, vec3

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
    mixed: qd.template(),
):
    """Push each piece of each body as the water that it took the place of, by the difference between its faces.

    From piece to piece these differences add up to what is at the surface, whatever the field between is. `per_lambda`
    [1/m] makes a multiplier the depth of water at rest. The grid has the water where it fell, its surface as well, so a
    body is read there too: at a step of 1/60 s it would float 1.4 mm too deep.
    """
    for number in range(pieces.count):
        k = pieces.solid[number]
        dim = qd.static(particles.x[0].n)
        turn = solids.rotation[k]
        at = solids.position[k] + rotate(turn, pieces.place[number])
        fallen = at + fall(c)
        slope = vec3(0.0, 0.0, 0.0)
        for axis in qd.static(range(dim)):
            half = vec3(0.0, 0.0, 0.0)
            half[axis] = 0.5 * pieces.edges[number][axis]
            way = rotate(turn, half)
            ahead = multiplier_at(grid, fallen + way, particles.x[0])
            slope[axis] = (ahead - multiplier_at(grid, fallen - way, particles.x[0])) / pieces.edges[number][axis]
        push = rotate(turn, slope) * (stiffness * pieces.volume[number])
        add_to_body(solids, k, of_grid(), at, push)
        depth = -per_lambda * multiplier_at(grid, fallen, particles.x[0])
        # In metres, as the pushes are that the body's unit is for: times the edge of a cell.
        wet = qd.min(qd.max(2.0 * depth / grid.dy, 0.0), 1.0) * pieces.volume[number] * grid.dy
        qd.atomic_add(solids.reaction[parts() * k + immersion()], qd.cast(qd.round(solids.unit[k] * wet), qd.i32))
        if qd.static(mixed):
            wet *= density_at(grid, w, fallen, particles.x[0])
        qd.atomic_add(solids.reaction[parts() * k + displacing()], qd.cast(qd.round(solids.unit[k] * wet), qd.i32))


def push_bodies_by_pressure(world: World, stiffness: float, per_lambda: float, c: Coefficients, *, mixed: int) -> None:
    """Push the bodies by the pressure on the finest grid; a body is no deeper than `FARTHEST` nodes.

    `stiffness` is M of the rest lattice, `per_lambda` [1/m] makes a multiplier the depth of liquid at rest.
    """
    pressure, pieces = world.pressure, world.pieces
    assert pressure is not None and pieces is not None, "there are no bodies in a tank"
    grid, w = pressure.finest, pressure.workspace
    mark_known(grid, w)
    for sweep in range(1, min(FARTHEST, math.ceil(pieces.reach / min(grid.dx, grid.dy)) + 1) + 1):
        extrapolate(grid, w, c, stiffness, sweep, AIR, mixed)
    push_pieces(grid, w, pieces, world.solids, world.particles, stiffness, per_lambda, c, mixed)

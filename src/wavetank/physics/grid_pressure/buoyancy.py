"""What the pressure of the whole tank does to bodies.

The force on a body is the integral of the pressure over its surface, which is that of the pressure's slope over its
volume (Gauss) for whatever field continues the pressure into the body. So the multipliers are continued there, straight
on from the water and from the air around, and each small piece of the body is pushed as the water would be that it took
the place of: Archimedes' principle, piece by piece. Pieces are those of a lattice about as fine as the particles.

    code      meaning                                                     unit
    stage     how many nodes it is to where pressure is known             1
    volume    of a piece, over that of a particle                         1
"""

import math

from wavetank.device.compiler import qd
from wavetank.device.state import CoarseGrid, Coefficients, Particles
from wavetank.physics.bodies import Pieces
from wavetank.physics.boundary import fall, flattened
from wavetank.physics.grid_pressure.coarse_grid import beside_on, corners, in_cells, tents
from wavetank.physics.grid_pressure.surface import nodes_beyond
from wavetank.physics.reactions import add_to_body, displacing, immersion, of_grid
from wavetank.physics.world import World
from wavetank.solids.distance import SolidSet, parts, rotate, vec3

FARTHEST = 24  # nodes into a body that the pressure is continued
AIR = 1e-3  # weight of what is continued from the air, where there is water to continue it from as well


@qd.kernel(fastcache=True)
def mark_known(grid: CoarseGrid):
    """Mark where the pressure is known: where there is room."""
    for n in range(grid.nx * grid.ny * grid.nz):
        grid.slope_z[n] = 0.0 if grid.room[n] > 0.0 else 1e9


@qd.kernel(fastcache=True)
def continue_pressure(
    grid: CoarseGrid, c: Coefficients, stiffness: qd.f32, turn: qd.i32, air: qd.f32, mixed: qd.template()
):
    """Continue multipliers by one node, from those that are known since an earlier `turn`; the `air` counts so much.

    Where fluids are `mixed`, so are their densities. At first they go on straight, farther on as at rest: where a body
    lies on something, what the water at the mouth of the slit does by chance would grow from node to node.
    """
    for n in range(grid.nx * grid.ny * grid.nz):
        at_rest = fall(c) / -stiffness
        if grid.slope_z[n] > turn:
            edges = vec3(grid.dx, grid.dy, grid.dz)
            lam, weight = 0.0, 0.0
            mass, filled = 0.0, 0.0
            for axis in qd.static(range(3)):
                if grid.nz > 1 or axis < 2:
                    for side in qd.static((-1, 1)):
                        nodes = nodes_beyond(grid, n, axis, side)
                        if nodes > 0:
                            m = beside_on(grid, n, axis, side)
                            if grid.slope_z[m] < turn:
                                slope = -side * edges[axis] * at_rest[axis]
                                if turn == 1:
                                    slope = 0.0
                                    if nodes > 1:
                                        farther = beside_on(grid, m, axis, side)
                                        if grid.slope_z[farther] < turn:
                                            slope = grid.lam[m] - grid.lam[farther]
                                share = 1.0
                                if grid.lam[m] == 0.0:  # air, or continued from there
                                    share, slope = air, 0.0
                                lam += share * (grid.lam[m] + slope)
                                weight += share
                                if qd.static(mixed):
                                    mass += filled_at(grid, m) * grid.density[m]
                                    filled += filled_at(grid, m)
            if weight > 0.0:
                grid.lam[n] = lam / weight
                if qd.static(mixed):
                    grid.density[n] = mass / filled if filled > 0.0 else 1.0
                grid.slope_z[n] = turn


@qd.func
def filled_at(grid: CoarseGrid, n):
    """How full of fluid node `n` is; all, where the fluid is continued into a body."""
    return qd.min(grid.fill[n], 1.0) if grid.slope_z[n] == 0.0 else 1.0


@qd.func
def density_at(grid: CoarseGrid, at, x: qd.template()):
    """The density of the fluid around a place in the world, over that of the heaviest."""
    dim = qd.static(x.n)
    s = in_cells(grid, flattened(at, x))
    nodes = corners(grid, qd.floor(s, qd.i32), dim)
    weights = tents(s - qd.floor(s), dim)
    mass, filled = 0.0, 0.0
    for c in qd.static(range(2**dim)):
        share = weights[c] * filled_at(grid, nodes[c])
        mass += share * grid.density[nodes[c]]
        filled += share
    return mass / filled if filled > 0.0 else 1.0


@qd.func
def multiplier_at(grid: CoarseGrid, at, x: qd.template()):
    """The multiplier at a place in the world, a plane's beyond the last nodes, and 0 where it would pull.

    Above the surface it does, where it is continued into a body. Cut off at the nodes, as it is at those in the air, it
    would press on a bottom that only touches the water as if that lay a quarter of a cell deep.
    """
    dim = qd.static(x.n)
    s = in_cells(grid, flattened(at, x))
    last = vec3(grid.nx - 2, grid.ny - 2, grid.nz - 2)
    low = qd.floor(s)
    for axis in qd.static(range(3)):
        if qd.static(not grid.repeats >> axis & 1):
            low[axis] = qd.max(qd.min(low[axis], last[axis]), 0.0)
    nodes = corners(grid, qd.cast(low, qd.i32), dim)
    weights = tents(s - low, dim)
    total = 0.0
    for c in qd.static(range(2**dim)):
        total += weights[c] * grid.lam[nodes[c]]
    return qd.min(total, 0.0)


@qd.kernel(fastcache=True)
def push_bodies(
    grid: CoarseGrid,
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
            wet *= density_at(grid, fallen, particles.x[0])
        qd.atomic_add(solids.reaction[parts() * k + displacing()], qd.cast(qd.round(solids.unit[k] * wet), qd.i32))


def push_on_grid(world: World, stiffness: float, per_lambda: float, c: Coefficients, *, mixed: int) -> None:
    """Let the pressure that the finest grid has push the bodies; a body is no deeper than `FARTHEST` nodes."""
    grid, pieces = world.levels[0], world.pieces
    assert pieces is not None, "there are no bodies"
    mark_known(grid)
    for turn in range(1, min(FARTHEST, math.ceil(pieces.reach / min(grid.dx, grid.dy)) + 1) + 1):
        continue_pressure(grid, c, stiffness, turn, AIR, mixed)
    push_bodies(grid, pieces, world.solids, world.particles, stiffness, per_lambda, c, mixed)

"""Friction between water and solids: Coulomb's, and what lets thin water on a solid come to rest.

A wall that has pushed a particle by delta along its normal in this substep may hold back its sliding by at most
mu delta. The push is that of the wall's share of the density (`boundary.py`): |lambda_i grad rho_wall|.
Position-based friction after Macklin et al. 2014, "Unified Particle Physics" (10.1145/2601097.2601152), Sec. 6.1.

Solids of a scene (not the walls of its tank) also take a share of slow sliding from the layer of particles that lies on
them. A layer or two of water on a ledge is thinner than the boundary layer that it has in nature, and without that it
slid to and fro for minutes on what the coarse grid has wrong about the room beside an edge.

The tank's floor takes it from puddles, a layer at most.

And all of them, but bodies, take the same share from slow motion towards them and away, from the layer next to them.
Iterations answer what presses a layer or two together with more than all of it, so that it jumped from step to step.

Where water lies between a body and another solid, that takes none where water is squeezed out: by a body that is on
its way, and where one lies above the other. A layer that cannot leave would bear it. Beside upright sides of bodies
that rest solids do as elsewhere, the tank's walls as other solids do, and so do two bodies: without that, water there
was thrown to and fro without end, crept up and down walls and went up and down between bodies (notebook/calm.md,
"Upright slits", "Between two bodies"). A body beside what is none takes nothing, or small ones turn back and forth.

    code     symbol    meaning                                           unit
    push     delta     displacement that the wall has given              m
    slip     v_t       velocity along the wall, in the wall's motion     m/s
"""

from wavetank.device.compiler import qd
from wavetank.device.state import Coefficients, Grid, Particles, Scratch, Walls
from wavetank.physics.boundary import is_near, next_near, wall_share
from wavetank.physics.near_solids import facing_at, known, place_of
from wavetank.physics.pairs import column
from wavetank.physics.predicted_positions import predicted
from wavetank.physics.pressure.grid import ramp
from wavetank.physics.teams import end_of, end_team, first_team, turns
from wavetank.solids.distance import SolidSet, image_near, lift, plane_distance, rotate, to_local, vec3


@qd.kernel(fastcache=True)
def apply_friction(
    particles: Particles,
    scratch: Scratch,
    grid: Grid,
    solids: SolidSet,
    walls: Walls,
    c: Coefficients,
    count: qd.i32,
    on_grid: qd.template(),
    felt: qd.template(),
):
    """Reduce the velocities along walls and solids, and slow ones towards them and away.

    Where the step was taken `on_grid`, the floor of the tank lets puddles come to rest. Bodies are `felt` where there
    are some. The tank's walls are computed for a team at once.
    """
    for turn in range(turns(grid, count)):
        for team in range(first_team(turn, grid, count), end_team(turn, grid, count)):
            first, end, near = team * grid.lanes, end_of(team, grid, count), 0
            for i in range(first, end):
                near |= particles.near[i]
            if near != 0:
                dim = qd.static(particles.v[first].n)
                v_of = qd.Matrix.zero(qd.f32, 3, grid.lanes)
                calmings = qd.Matrix.zero(qd.f32, 3, grid.lanes)  # by the tank, beside bodies and by bodies, by solids
                for lane in range(grid.lanes):
                    v = particles.v[first + lane]
                    for axis in qd.static(range(dim)):
                        v_of[axis, lane] = v[axis]
                    calmings[1, lane] = c.calming_at_solids
                    calmings[2, lane] = c.calming_at_solids
                if qd.static(felt):
                    for i in range(first, end):
                        found = between(i, lift(predicted(particles, i)), scratch, particles.near[i], solids, c)
                        calmings[0, i - first] = c.calming_at_solids * (found[0] - found[1])
                        calmings[1, i - first] = c.calming_at_solids * (1.0 - found[0])
                        calmings[2, i - first] = c.calming_at_solids * (1.0 - found[1])
                k = next_near(near, -1, solids)
                while k < solids.tank_count:
                    for lane in range(grid.lanes):
                        slow_at_wall(v_of, calmings, lane, k, first, particles, scratch, solids, walls, c, on_grid)
                    k = next_near(near, k, solids)
                for i in range(first, end):
                    if particles.near[i] != 0:
                        v = column(v_of, i - first)
                        if particles.near[i] >> solids.tank_count != 0:
                            calming = column(calmings, i - first)
                            v = slowed_at_solids(v, calming, i, particles, scratch, solids, walls, c)
                        held = particles.v[i]
                        for axis in qd.static(range(dim)):
                            held[axis] = v[axis]
                        particles.v[i] = held


@qd.func
def rubbed(i, k, distance, slip, scratch: Scratch, solids: SolidSet, walls: Walls, c: Coefficients):
    """Share of a `slip` [m/s] along solid `k`, at that `distance` [m], that Coulomb's friction takes."""
    share = 0.0
    if solids.friction[k] > 0.0:
        push = scratch.weight[i] * qd.abs(scratch.lam[i]) * wall_share(walls, distance, c.h)[1] * c.wall_density / c.h
        share = solids.friction[k] * push / c.dt / qd.max(slip.norm(), 1e-12)
    return share


@qd.func
def slow_at_wall(
    v_of: qd.template(),
    calmings: qd.template(),
    lane,
    k,
    first,
    particles: Particles,
    scratch: Scratch,
    solids: SolidSet,
    walls: Walls,
    c: Coefficients,
    on_grid: qd.template(),
):
    """Let wall `k` of the tank slow the particle in a `lane` of the team from number `first` on, if that is near."""
    i = first + lane
    value = plane_distance(solids, k, lift(predicted(particles, i)))
    n, v = vec3(value.x, value.y, value.z), column(v_of, lane)
    towards = n.dot(v)
    slip = v - n * towards
    settles = qd.select(value.w < layer() * c.h, settled(n, towards, calmings[2, lane], c), 0.0)
    share = rubbed(i, k, value.w, slip, scratch, solids, walls, c)
    if qd.static(on_grid):
        squared, in_puddle = slip.norm_sqr(), qd.max(0.0, -n.dot(down(c))) * scratch.puddle[i]
        share += calmed(squared, calmings[2, lane], c) * in_puddle + calmed(squared, calmings[0, lane], c)
    changed = v - n * (towards * settles) - slip * qd.min(solids.grip[k], share)
    is_at = value.w < c.h and is_near(particles.near[i], k, solids) == 1
    for axis in qd.static(range(3)):
        v_of[axis, lane] = qd.select(is_at, changed[axis], v[axis])


@qd.func
def slowed_at_solids(
    v, calmings, i, particles: Particles, scratch: Scratch, solids: SolidSet, walls: Walls, c: Coefficients
):
    """The velocity `v` [m/s] of particle `i` as the solids that it knows leave it; bodies feel what they take."""
    p, left = lift(predicted(particles, i)), v
    for number in range(known(scratch, i)):
        at = place_of(scratch, i, number)
        k, value = scratch.solid[at], facing_at(scratch, at, i, p)
        if value.w < c.h:
            n, moving = vec3(value.x, value.y, value.z), surface_velocity(solids, k, p, c.dt)
            relative = left - moving
            towards = n.dot(relative)
            slip = relative - n * towards
            calming = calmings[2]
            if solids.unit[k] > 0.0:  # a body that is on its way is not held up
                calming = calmings[1] * qd.max(free(), at_rest(moving, c))
            elif value.w < layer() * c.h:
                left -= n * (towards * settled(n, towards, calmings[2], c))
            share = rubbed(i, k, value.w, slip, scratch, solids, walls, c) + calmed(slip.norm_sqr(), calming, c)
            change = slip * qd.min(solids.grip[k], share)
            left -= change
            if solids.unit[k] > 0.0:
                scratch.push[at] -= change * (c.dt / scratch.weight[i])
    return left


@qd.func
def between(i, p, scratch: Scratch, near, solids: SolidSet, c: Coefficients):
    """(share that bodies, share that other solids do not take where water is beside a body and another solid).

    The latter is how surely it is to leave from between: where a body is on its way, and where one of the two lies
    above the other: surfaces that lean by 60 degrees and more do not, below 30 they do. Two bodies do as other solids.
    """
    bodies, total = 0, 0
    on_its_way, above, below = 0.0, 0.0, 0.0
    others = known(scratch, i) if near >> solids.tank_count != 0 else 0
    for number in range(others):
        at = place_of(scratch, i, number)
        k = scratch.solid[at]
        value = facing_at(scratch, at, i, p)
        if value.w < c.h:
            total += 1
            if solids.unit[k] > 0.0:
                bodies += 1
                on_its_way = qd.max(on_its_way, 1.0 - at_rest(surface_velocity(solids, k, p, c.dt), c))
            leans = vec3(value.x, value.y, value.z).dot(down(c))
            above, below = qd.max(above, leans), qd.max(below, -leans)
    if bodies > 0:
        for k in range(solids.tank_count):
            value = plane_distance(solids, k, p)
            if is_near(near, k, solids) == 1 and value.w < c.h:
                total += 1
                leans = vec3(value.x, value.y, value.z).dot(down(c))
                above, below = qd.max(above, leans), qd.max(below, -leans)
    is_between = qd.cast(bodies > 0 and total > 1, qd.f32)
    leaves = qd.max(on_its_way, ramp(above, 0.5, 0.85) * ramp(below, 0.5, 0.85))
    return qd.Vector([is_between * (1.0 if bodies == 1 else leaves), is_between * leaves])


@qd.func
def down(c: Coefficients):
    """Direction of gravity; 0 without."""
    gravity = vec3(c.gravity_x, c.gravity_y, c.gravity_z)
    return gravity / qd.max(gravity.norm(), 1e-9)


@qd.func
def layer():
    """Distance over the support up to which particles lie on a solid."""
    return 0.5


@qd.func
def calmed(squared, calm, c: Coefficients):
    """Share of a speed, `squared` [m^2/s^2], that solids take because it is slow: `calm` of what is very slow."""
    return calm * qd.max(0.0, 1.0 - squared * c.slow_at_solids)


@qd.func
def settled(n, towards, calm, c: Coefficients):
    """Share of a speed [m/s] along the normal `n` of a solid that it takes; what hangs from a ceiling is left alone."""
    return calmed(towards * towards, calm, c) * (1.0 - qd.max(0.0, n.dot(down(c))))


@qd.func
def resting():
    """Inverse square of the speed up to which a body is taken for one at rest, over that of slow sliding."""
    return 36.0


@qd.func
def at_rest(moving, c: Coefficients):
    """How surely a body is at rest whose surface has the velocity `moving` [m/s], from 0 to 1."""
    return qd.max(0.0, 1.0 - moving.norm_sqr() * resting() * c.slow_at_solids)


@qd.func
def free():
    """Share of the calming that is left for a body on its way."""
    return 0.1


@qd.func
def surface_velocity(solids: SolidSet, k, x, dt):
    """Velocity [m/s] of the material point of solid `k` that is at `x` at the end of the substep."""
    at = image_near(solids, k, x)
    own = to_local(solids.position[k], solids.rotation[k], at)
    before = solids.old_position[k] + rotate(solids.old_rotation[k], own)
    return (at - before) / dt

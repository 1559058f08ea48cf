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
from wavetank.device.state import Coefficients, Grid, Particles, Temporaries, Walls
from wavetank.foundation.params import Parameters
from wavetank.physics.boundary import wall_share
from wavetank.physics.broad_phase import Obstacles, is_marked, marked_walls
from wavetank.physics.clusters import chunks, end_cluster, end_of, first_cluster
from wavetank.physics.contact import flattened
from wavetank.physics.near_solids import contact_plane, known_solids, slot_index
from wavetank.physics.pairs import column
from wavetank.physics.plan import Plan
from wavetank.physics.predicted_positions import predicted
from wavetank.physics.pressure.grid import ramp
from wavetank.physics.terms.term import Hook, Term
from wavetank.physics.world import World
from wavetank.solids.distance import SolidSet, image_near, lift, plane_distance, rotate, to_local, vec3


@qd.kernel(fastcache=True)
def slow_at_solids(
    particles: Particles,
    temporaries: Temporaries,
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
    are some. The tank's walls are computed for a cluster at once.
    """
    for chunk in range(chunks(grid, count)):
        for cluster in range(first_cluster(chunk, grid, count), end_cluster(chunk, grid, count)):
            first, end, near = cluster * grid.lanes, end_of(cluster, grid, count), 0
            for i in range(first, end):
                near |= particles.near[i]
            if near != 0:
                slow_cluster(first, end, near, particles, temporaries, grid, solids, walls, c, on_grid, felt)


@qd.func
def slow_cluster(
    first,
    end,
    near,
    particles: Particles,
    temporaries: Temporaries,
    grid: Grid,
    solids: SolidSet,
    walls: Walls,
    c: Coefficients,
    on_grid: qd.template(),
    felt: qd.template(),
):
    """Let the solids that particles `first` to `end` - 1 are `near` slow them."""
    v_of = qd.Matrix.zero(qd.f32, 3, grid.lanes)
    calmings = qd.Matrix.zero(qd.f32, 3, grid.lanes)  # by the tank next to bodies, by bodies, by other solids
    load_velocities(v_of, first, particles)
    find_calming(calmings, first, end, particles, temporaries, solids, c, felt)
    tank = marked_walls(near, solids)
    while tank != 0:
        k = qd.math.ffs(tank) - 1
        for lane in range(grid.lanes):
            slow_at_wall(v_of, calmings, lane, k, first, particles, temporaries, solids, walls, c, on_grid)
        tank &= tank - 1
    for i in range(first, end):
        if particles.near[i] != 0:
            v = column(v_of, i - first)
            if particles.near[i] >> solids.tank_count != 0:
                calming = column(calmings, i - first)
                v = slow_at_obstacles(v, calming, i, particles, temporaries, solids, walls, c)
            particles.v[i] = flattened(v, particles.v[i])


@qd.func
def load_velocities(v_of: qd.template(), first, particles: Particles):
    """Copy the velocities [m/s] of the particles from number `first` on to `v_of`, one column for each."""
    for lane in range(v_of.m):
        v = particles.v[first + lane]
        for axis in qd.static(range(v.n)):
            v_of[axis, lane] = v[axis]


@qd.func
def find_calming(
    calmings: qd.template(),
    first,
    end,
    particles: Particles,
    temporaries: Temporaries,
    solids: SolidSet,
    c: Coefficients,
    felt: qd.template(),
):
    """Find the shares of slow sliding that (tank next to bodies, bodies, solids) take, a column for each particle."""
    for lane in range(calmings.m):
        calmings[1, lane] = c.calming_at_solids
        calmings[2, lane] = c.calming_at_solids
    if qd.static(felt):
        for i in range(first, end):
            found = slit_shares(i, lift(predicted(particles, i)), temporaries, particles.near[i], solids, c)
            calmings[0, i - first] = c.calming_at_solids * (found[0] - found[1])
            calmings[1, i - first] = c.calming_at_solids * (1.0 - found[0])
            calmings[2, i - first] = c.calming_at_solids * (1.0 - found[1])


@qd.func
def coulomb_share(i, k, distance, slip, temporaries: Temporaries, solids: SolidSet, walls: Walls, c: Coefficients):
    """Share of a `slip` [m/s] along solid `k`, at that `distance` [m], that Coulomb's friction takes."""
    share = 0.0
    if solids.friction[k] > 0.0:
        push = (
            temporaries.inverse_mass[i]
            * qd.abs(temporaries.lam[i])
            * wall_share(walls, distance, c.h)[1]
            * c.wall_density
            / c.h
        )
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
    temporaries: Temporaries,
    solids: SolidSet,
    walls: Walls,
    c: Coefficients,
    on_grid: qd.template(),
):
    """Let wall `k` of the tank slow the particle in a `lane` of the cluster from number `first` on, if that is near."""
    i = first + lane
    value = plane_distance(solids, k, lift(predicted(particles, i)))
    n, v = vec3(value.x, value.y, value.z), column(v_of, lane)
    towards = n.dot(v)
    slip = v - n * towards
    settles = qd.select(value.w < layer_distance() * c.h, normal_calming_share(n, towards, calmings[2, lane], c), 0.0)
    share = coulomb_share(i, k, value.w, slip, temporaries, solids, walls, c)
    if qd.static(on_grid):
        squared, in_shallow = slip.norm_sqr(), qd.max(0.0, -n.dot(down(c))) * temporaries.shallow[i]
        on_floor = calming_share(squared, calmings[2, lane], c) * in_shallow
        share += on_floor + calming_share(squared, calmings[0, lane], c)
    changed = v - n * (towards * settles) - slip * qd.min(solids.grip[k], share)
    is_at = value.w < c.h and is_marked(particles.near[i], k, solids) == 1
    for axis in qd.static(range(3)):
        v_of[axis, lane] = qd.select(is_at, changed[axis], v[axis])


@qd.func
def slow_at_obstacles(
    v, calmings, i, particles: Particles, temporaries: Temporaries, solids: SolidSet, walls: Walls, c: Coefficients
):
    """The velocity `v` [m/s] of particle `i` as the solids that it knows leave it; bodies feel what they take."""
    p, left = lift(predicted(particles, i)), v
    for number in range(known_solids(temporaries, i)):
        at = slot_index(temporaries, i, number)
        k, value = temporaries.solid[at], contact_plane(temporaries, at, i, p)
        if value.w < c.h:
            n, moving = vec3(value.x, value.y, value.z), surface_velocity(solids, k, p, c.dt)
            relative = left - moving
            towards = n.dot(relative)
            slip = relative - n * towards
            calming = calmings[2]
            if solids.unit[k] > 0.0:  # a body that is on its way is not held up
                calming = calmings[1] * qd.max(moving_body_calming(), rest_confidence(moving, c))
            elif value.w < layer_distance() * c.h:
                left -= n * (towards * normal_calming_share(n, towards, calmings[2], c))
            rubbed = coulomb_share(i, k, value.w, slip, temporaries, solids, walls, c)
            share = rubbed + calming_share(slip.norm_sqr(), calming, c)
            change = slip * qd.min(solids.grip[k], share)
            left -= change
            if solids.unit[k] > 0.0:
                temporaries.push[at] -= change * (c.dt / temporaries.inverse_mass[i])
    return left


@qd.func
def slit_shares(i, p, temporaries: Temporaries, near, solids: SolidSet, c: Coefficients):
    """(share that bodies, share that other solids do not take where water is beside a body and another solid).

    The latter is how surely it is to leave from between: where a body is on its way, and where one of the two lies
    above the other: surfaces that lean by 60 degrees and more do not, below 30 they do. Two bodies do as other solids.
    """
    bodies, total = 0, 0
    on_its_way, above, below = 0.0, 0.0, 0.0
    others = known_solids(temporaries, i) if near >> solids.tank_count != 0 else 0
    for number in range(others):
        at = slot_index(temporaries, i, number)
        k = temporaries.solid[at]
        value = contact_plane(temporaries, at, i, p)
        if value.w < c.h:
            total += 1
            if solids.unit[k] > 0.0:
                bodies += 1
                on_its_way = qd.max(on_its_way, 1.0 - rest_confidence(surface_velocity(solids, k, p, c.dt), c))
            leans = vec3(value.x, value.y, value.z).dot(down(c))
            above, below = qd.max(above, leans), qd.max(below, -leans)
    if bodies > 0:
        for k in range(solids.tank_count):
            value = plane_distance(solids, k, p)
            if is_marked(near, k, solids) == 1 and value.w < c.h:
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
def layer_distance():
    """Distance over the support up to which particles lie on a solid."""
    return 0.5


@qd.func
def calming_share(squared, calm, c: Coefficients):
    """Share of a speed, `squared` [m^2/s^2], that solids take because it is slow: `calm` of what is very slow."""
    return calm * qd.max(0.0, 1.0 - squared * c.slow_at_solids)


@qd.func
def normal_calming_share(n, towards, calm, c: Coefficients):
    """Share of a speed [m/s] along the normal `n` of a solid that it takes; what hangs from a ceiling is left alone."""
    return calming_share(towards * towards, calm, c) * (1.0 - qd.max(0.0, n.dot(down(c))))


@qd.func
def rest_speed_ratio():
    """Inverse square of the speed up to which a body is taken for one at rest, over that of slow sliding."""
    return 36.0


@qd.func
def rest_confidence(moving, c: Coefficients):
    """How surely a body is at rest whose surface has the velocity `moving` [m/s], from 0 to 1."""
    return qd.max(0.0, 1.0 - moving.norm_sqr() * rest_speed_ratio() * c.slow_at_solids)


@qd.func
def moving_body_calming():
    """Share of the calming that is left for a body on its way."""
    return 0.1


@qd.func
def surface_velocity(solids: SolidSet, k, x, dt):
    """Velocity [m/s] of the material point of solid `k` that is at `x` at the end of the substep."""
    at = image_near(solids, k, x)
    own = to_local(solids.position[k], solids.rotation[k], at)
    before = solids.old_position[k] + rotate(solids.old_rotation[k], own)
    return (at - before) / dt


def apply_friction(world: World, plan: Plan, params: Parameters, c: Coefficients) -> None:
    """Let walls and solids hold back the water that slides along them."""
    on_grid, coupled = int(plan.on_grid), int(plan.obstacles == Obstacles.TWO_WAY)
    slow_at_solids(
        world.particles, world.temporaries, world.grid, world.solids, world.walls, c, world.count, on_grid, coupled
    )


FRICTION = Term("friction", Hook.VELOCITIES, apply_friction, lambda plan: plan.has_friction)

"""Friction between water and solids: Coulomb's, and what lets thin water on a solid come to rest.

A wall that has pushed a particle by delta along its normal in this substep may hold back its sliding by at most
mu delta. The push is that of the wall's share of the density (`boundary.py`): |lambda_i grad rho_wall|.
Position-based friction after Macklin et al. 2014, "Unified Particle Physics" (10.1145/2601097.2601152), Sec. 6.1.

Solids of a scene and bodies also have a static friction: they hold back water that moves slowly along them, as
Coulomb's friction does by a share of the load that lies on them. On steep sides that is a fifth of this at least, about
what the pressure is wrong by where a solid cuts the coarse cells: a layer on a ledge would slide on it for minutes.
What gravity or a wave drives is stronger and hardly feels it. It is an acceleration, so that steps of any length and
tanks of any size feel the same.

No water flows through a wall: of what moves slowly to and fro in the layer at one, as seen from there, `calming` takes
its share; not at solids where a body is near, with which the layer goes that it presses out. It takes its share also of
a puddle that slides on the floor of the tank, a layer at most (`temporaries.shallow`). Without `calming` there is
neither.

    code     symbol    meaning                                           unit
    push     delta     displacement that the wall has given              m
    slip     v_t       velocity along the wall, in the wall's motion     m/s
"""

from wavetank.device.compiler import qd
from wavetank.device.state import Coefficients, Grid, Particles, Temporaries, Walls
from wavetank.foundation.params import Parameters
from wavetank.physics.boundary import wall_share
from wavetank.physics.broad_phase import is_marked, marked_walls
from wavetank.physics.clusters import chunks, end_cluster, end_of, first_cluster
from wavetank.physics.contact import flattened
from wavetank.physics.near_solids import contact_plane, known_solids, slot_index
from wavetank.physics.pairs import column
from wavetank.physics.plan import Plan
from wavetank.physics.predicted_positions import predicted
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
):
    """Reduce the velocities along walls and solids, and slow ones towards them and away.

    Where the step was taken `on_grid`, the floor of the tank lets puddles come to rest. The tank's walls are computed
    for a cluster at once.
    """
    for chunk in range(chunks(grid, count)):
        for cluster in range(first_cluster(chunk, grid, count), end_cluster(chunk, grid, count)):
            first, end, near = cluster * grid.lanes, end_of(cluster, grid, count), 0
            for i in range(first, end):
                near |= particles.near[i]
            if near != 0:
                slow_cluster(first, end, near, particles, temporaries, grid, solids, walls, c, on_grid)


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
):
    """Let the solids that particles `first` to `end` - 1 are `near` slow them."""
    v_of = qd.Matrix.zero(qd.f32, 3, grid.lanes)
    load_velocities(v_of, first, particles)
    tank = marked_walls(near, solids)
    while tank != 0:
        k = qd.math.ffs(tank) - 1
        for lane in range(grid.lanes):
            slow_at_wall(v_of, lane, k, first, particles, temporaries, solids, walls, c, on_grid)
        tank &= tank - 1
    for i in range(first, end):
        if particles.near[i] != 0:
            v = column(v_of, i - first)
            if particles.near[i] >> solids.tank_count != 0:
                v = slow_at_obstacles(v, i, particles, temporaries, solids, walls, c)
            particles.v[i] = flattened(v, particles.v[i])


@qd.func
def load_velocities(v_of: qd.template(), first, particles: Particles):
    """Copy the velocities [m/s] of the particles from number `first` on to `v_of`, one column for each."""
    for lane in range(v_of.m):
        v = particles.v[first + lane]
        for axis in qd.static(range(v.n)):
            v_of[axis, lane] = v[axis]


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
    settles = qd.select(value.w < layer_distance() * c.h, normal_calming_share(n, towards, c), 0.0)
    share = coulomb_share(i, k, value.w, slip, temporaries, solids, walls, c)
    if qd.static(on_grid):
        share += calming_share(slip.norm_sqr(), c) * qd.max(0.0, -n.dot(down(c))) * temporaries.shallow[i]
    changed = v - n * (towards * settles) - slip * qd.min(solids.grip[k], share)
    is_at = value.w < c.h and is_marked(particles.near[i], k, solids) == 1
    for axis in qd.static(range(3)):
        v_of[axis, lane] = qd.select(is_at, changed[axis], v[axis])


@qd.func
def slow_at_obstacles(
    v, i, particles: Particles, temporaries: Temporaries, solids: SolidSet, walls: Walls, c: Coefficients
):
    """The velocity `v` [m/s] of particle `i` as the solids that it knows leave it; bodies feel what they take."""
    p, left, settles = lift(predicted(particles, i)), v, 1.0
    for number in range(known_solids(temporaries, i)):
        at = slot_index(temporaries, i, number)
        if solids.unit[temporaries.solid[at]] > 0.0 and contact_plane(temporaries, at, i, p).w < c.h:
            settles = 0.0
    for number in range(known_solids(temporaries, i)):
        at = slot_index(temporaries, i, number)
        k, value = temporaries.solid[at], contact_plane(temporaries, at, i, p)
        if value.w < c.h:
            n, moving = vec3(value.x, value.y, value.z), surface_velocity(solids, k, p, c.dt)
            relative = left - moving
            towards = n.dot(relative)
            slip = relative - n * towards
            if value.w < layer_distance() * c.h:
                left -= n * (towards * settles * normal_calming_share(n, towards, c))
            share = coulomb_share(i, k, value.w, slip, temporaries, solids, walls, c)
            share += static_share(slip.norm_sqr(), -n.dot(down(c)), c)
            change = slip * qd.min(solids.grip[k], share)
            left -= change
            if solids.unit[k] > 0.0:
                temporaries.push[at] -= change * (c.dt / temporaries.inverse_mass[i])
    return left


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
def least_load():
    """Load that a layer presses a solid with at least, over its own weight."""
    return 0.2


@qd.func
def static_share(squared, load, c: Coefficients):
    """Share of a speed, `squared` [m^2/s^2], that static friction takes below a `load`, over the weight of the layer.

    It takes nothing of what is not slow.
    """
    held = qd.min(1.0, c.static_friction * qd.max(load, least_load()) / qd.sqrt(qd.max(squared, 1e-12)))
    return held * qd.max(0.0, 1.0 - squared * c.slow_at_solids)


@qd.func
def calming_share(squared, c: Coefficients):
    """Share of a speed, `squared` [m^2/s^2], that is taken because it is slow."""
    return c.calming_at_solids * qd.max(0.0, 1.0 - squared * c.slow_at_solids)


@qd.func
def normal_calming_share(n, towards, c: Coefficients):
    """Share of a speed [m/s] along the normal `n` of a solid that it takes; what hangs from a ceiling is left alone."""
    return calming_share(towards * towards, c) * (1.0 - qd.max(0.0, n.dot(down(c))))


@qd.func
def surface_velocity(solids: SolidSet, k, x, dt):
    """Velocity [m/s] of the material point of solid `k` that is at `x` at the end of the substep."""
    at = image_near(solids, k, x)
    own = to_local(solids.position[k], solids.rotation[k], at)
    before = solids.old_position[k] + rotate(solids.old_rotation[k], own)
    return (at - before) / dt


def apply_friction(world: World, plan: Plan, params: Parameters, c: Coefficients) -> None:
    """Let walls and solids hold back the water that slides along them."""
    slow_at_solids(
        world.particles, world.temporaries, world.grid, world.solids, world.walls, c, world.count, int(plan.on_grid)
    )


FRICTION = Term("friction", Hook.VELOCITIES, apply_friction, lambda plan: plan.has_friction)

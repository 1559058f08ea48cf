"""The two ends of a position-based step: predict positions, and read velocities off the corrected ones."""

from wavetank.device.compiler import qd
from wavetank.device.periods import Periods, within
from wavetank.device.state import Coefficients, Grid, Particles
from wavetank.physics.boundary import bodies_around, flattened, kept_in_tank, near_bodies, stopped, walls_near
from wavetank.physics.neighbors import cell_of
from wavetank.physics.predicted_positions import predict_at, predicted
from wavetank.physics.teams import end_team, first_team, turns
from wavetank.solids.distance import SolidSet, lift, vec3


@qd.func
def free_motion(x, v, c: Coefficients):
    """Where a particle is after dt if nothing touches it."""
    return x + c.dt * v


@qd.func
def accelerate(particles: Particles, i, v, c: Coefficients):
    """Give particle i the velocity `v` after its position was predicted, and move the prediction with it.

    Written as a difference of two free motions: a change of velocity below the rounding of a position is then not
    taken for a push when the velocities are read off the positions again.
    """
    x = particles.x[i]
    change = free_motion(x, v, c) - free_motion(x, particles.v[i], c)
    predict_at(particles, i, predicted(particles, i) + change)
    particles.v[i] = v


@qd.func
def mass_of(particles: Particles, i, rows: qd.template()):
    """Mass of particle i over that of the heaviest fluid; before the first step nobody has told."""
    weight = rows[particles.material[i]][0]
    return 1.0 / weight if weight > 0.0 else 1.0


@qd.kernel(fastcache=True)
def predict(
    particles: Particles,
    grid: Grid,
    solids: SolidSet,
    rows: qd.types.ndarray(),
    c: Coefficients,
    count: qd.i32,
    searched: qd.template(),
):
    """Accelerate, move freely (Algorithm 1, lines 2-3), mark what is near, stay out of it, and find the cell.

    With gravity acts the share of the grid's pressure that is carried on (`pressure/correct.py`). Where solids
    are not `searched` there are only the walls of the tank; with 2, bodies feel what they stop. In no time, dt = 0,
    particles stay where they are, wherever that is.
    """
    for turn in range(turns(grid, count)):
        gravity = vec3(c.gravity_x, c.gravity_y, c.gravity_z)
        for team in range(first_team(turn, grid, count), end_team(turn, grid, count)):
            first = team * grid.lanes
            origins = qd.Matrix.zero(qd.f32, 3, grid.lanes)
            targets = qd.Matrix.zero(qd.f32, 3, grid.lanes)
            # What walls are near is computed for a team at once; few particles are so near that they are moved.
            for lane in range(grid.lanes):
                x = particles.x[first + lane]
                v = particles.v[first + lane]
                a = particles.a[first + lane]
                for k in qd.static(range(x.n)):
                    origins[k, lane] = x[k]
                    targets[k, lane] = x[k] + c.dt * (v[k] + c.dt * (gravity[k] + c.carried * a[k]))
            walls = qd.Matrix.zero(qd.i32, 1, grid.lanes)
            nearest = qd.Matrix.zero(qd.f32, 1, grid.lanes) + 1e9
            walls_near(walls, nearest, origins, targets, solids, c.h)
            around = 0
            if qd.static(searched):
                around = bodies_around(origins, targets, solids, c.h)
            for i in range(first, qd.min(first + grid.lanes, count)):
                x = particles.x[i]
                v = particles.v[i]
                for k in qd.static(range(x.n)):
                    v[k] += c.dt * gravity[k]
                if c.dt > 0.0:
                    a = c.carried * particles.a[i]
                    v += c.dt * a
                    particles.a[i] = a
                particles.v[i] = v
                p = free_motion(x, v, c)
                near = walls[0, i - first]
                if nearest[0, i - first] < 1.1 * c.wall_gap and c.dt > 0.0:
                    p = flattened(kept_in_tank(lift(p), near, solids, c.wall_gap), x)
                if qd.static(searched):
                    found = near_bodies(lift(x), lift(p), around, solids, c)
                    near |= found[0]
                    if found[1] == 1 and c.dt > 0.0:
                        mass = mass_of(particles, i, rows) if qd.static(searched == 2) else 0.0
                        p = flattened(stopped(lift(x), lift(p), near, solids, c.wall_gap, mass), x)
                particles.near[i] = near
                if qd.static(grid.periods.axes):
                    inside = x + (within(p, grid.periods) - p)
                    particles.x[i] = inside
                    p = free_motion(inside, v, c) + (p - free_motion(x, v, c))
                predict_at(particles, i, p)
                grid.cell[i] = cell_of(grid, p, c.h)


@qd.kernel(fastcache=True)
def update_velocities(particles: Particles, c: Coefficients, count: qd.i32):
    """Set v = (p - x) / dt, shortened to the speed limit, and x = p: Algorithm 1, lines 21 and 23.

    It is written as a change of the free velocity, so that a particle that nothing touched keeps its velocity to the
    last digit; the difference of two positions would lose what is below their rounding.
    """
    for i in range(count):
        x = particles.x[i]
        v = particles.v[i]
        p = predicted(particles, i)
        v += (p - free_motion(x, v, c)) / c.dt
        particles.x[i] = p
        particles.v[i] = v * qd.min(1.0, c.speed_limit / qd.max(v.norm(), 1e-12))


@qd.kernel(fastcache=True)
def bring_within(particles: Particles, periods: Periods, count: qd.i32):
    """Put what has crossed a seam of the world, x = p, to its image within: at the end of a step."""
    for i in range(count):
        p = within(particles.x[i], periods)
        particles.x[i] = p
        predict_at(particles, i, p)


@qd.kernel(fastcache=True)
def forget_predictions(particles: Particles, grid: Grid, c: Coefficients, count: qd.i32):
    """Set p = x and find the cell, to search neighbours without a step and without solids."""
    for i in range(count):
        p = particles.x[i]
        predict_at(particles, i, p)
        grid.cell[i] = cell_of(grid, p, c.h)

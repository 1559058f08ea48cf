"""The two ends of a position-based step: predict positions, and read velocities off the corrected ones."""

from wavetank.device.compiler import qd
from wavetank.device.periods import Periods, within
from wavetank.device.state import Coefficients, Grid, Particles, Temporaries
from wavetank.physics.broad_phase import mark_obstacles, mark_walls, obstacles_around
from wavetank.physics.clusters import chunks, end_cluster, first_cluster
from wavetank.physics.contact import clamp_to_tank, flattened
from wavetank.physics.neighbors import cell_of
from wavetank.physics.predicted_positions import predict_at, predicted
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


@qd.kernel(fastcache=True)
def predict(
    particles: Particles,
    temporaries: Temporaries,
    grid: Grid,
    solids: SolidSet,
    c: Coefficients,
    count: qd.i32,
    obstacles: qd.template(),
):
    """Accelerate and move freely within the tank (Algorithm 1, lines 2-3), and mark the solids near the path.

    With gravity acts the share of the grid's pressure that is carried on (`pressure/correct.py`). Without
    `obstacles` there are only the walls of the tank. In no time, dt = 0, particles stay where they are,
    wherever that is.
    """
    for chunk in range(chunks(grid, count)):
        gravity = vec3(c.gravity_x, c.gravity_y, c.gravity_z)
        for cluster in range(first_cluster(chunk, grid, count), end_cluster(chunk, grid, count)):
            first = cluster * grid.lanes
            origins = qd.Matrix.zero(qd.f32, 3, grid.lanes)
            targets = qd.Matrix.zero(qd.f32, 3, grid.lanes)
            # What walls are near is computed for a cluster at once; few particles are so near that they are moved.
            for lane in range(grid.lanes):
                x = particles.x[first + lane]
                v = particles.v[first + lane]
                a = particles.a[first + lane]
                for k in qd.static(range(x.n)):
                    origins[k, lane] = x[k]
                    targets[k, lane] = x[k] + c.dt * (v[k] + c.dt * (gravity[k] + c.warm_start * a[k]))
            walls = qd.Matrix.zero(qd.i32, 1, grid.lanes)
            nearest = qd.Matrix.zero(qd.f32, 1, grid.lanes) + 1e9
            mark_walls(walls, nearest, origins, targets, solids, c.h)
            around = 0
            if qd.static(obstacles):
                around = obstacles_around(origins, targets, solids, c.h)
            for i in range(first, qd.min(first + grid.lanes, count)):
                x = particles.x[i]
                v = accelerated(particles, i, gravity, c)
                p = free_motion(x, v, c)
                near = walls[0, i - first]
                if nearest[0, i - first] < 1.1 * c.wall_gap and c.dt > 0.0:
                    p = flattened(clamp_to_tank(lift(p), near, solids, c.wall_gap), x)
                if qd.static(obstacles):
                    found = mark_obstacles(lift(x), lift(p), around, solids, c)
                    near |= found[0]
                    temporaries.touching[i] = found[1] if c.dt > 0.0 else 0
                particles.near[i] = near
                predict_at(particles, i, p)


@qd.func
def accelerated(particles: Particles, i, gravity, c: Coefficients):
    """Accelerate particle `i` by gravity and the carried share of the pressure; return its velocity [m/s]."""
    v = particles.v[i]
    for k in qd.static(range(v.n)):
        v[k] += c.dt * gravity[k]
    if c.dt > 0.0:
        a = c.warm_start * particles.a[i]
        v += c.dt * a
        particles.a[i] = a
    particles.v[i] = v
    return v


@qd.kernel(fastcache=True)
def find_cells(particles: Particles, grid: Grid, c: Coefficients, count: qd.i32):
    """Find the cell of each predicted position; in worlds that repeat, bring it within the world."""
    for i in range(count):
        p = predicted(particles, i)
        if qd.static(grid.periods.axes):
            x, v = particles.x[i], particles.v[i]
            inside = x + (within(p, grid.periods) - p)
            particles.x[i] = inside
            pushed = as_rounded(p - as_rounded(free_motion(x, v, c), grid), grid)
            p = as_rounded(free_motion(inside, v, c), grid) + pushed
            predict_at(particles, i, p)
        grid.cell[i] = cell_of(grid, p, c.h)


@qd.func
def as_rounded(vector, grid: Grid):
    """The `vector` as it is rounded to single precision: sums with it are not rearranged.

    The compiler must not know that nothing changes: `grid.nx` is never negative.
    """
    result = vector
    for k in qd.static(range(vector.n)):
        result[k] = qd.bit_cast(qd.bit_cast(vector[k], qd.i32) ^ qd.cast(grid.nx < 0, qd.i32), qd.f32)
    return result


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
def wrap_positions(particles: Particles, periods: Periods, count: qd.i32):
    """Put what has crossed a seam of the world, x = p, to its image within: at the end of a step."""
    for i in range(count):
        p = within(particles.x[i], periods)
        particles.x[i] = p
        predict_at(particles, i, p)


@qd.kernel(fastcache=True)
def reset_predictions(particles: Particles, grid: Grid, c: Coefficients, count: qd.i32):
    """Set p = x and find the cell, to search neighbours without a step and without solids."""
    for i in range(count):
        p = particles.x[i]
        predict_at(particles, i, p)
        grid.cell[i] = cell_of(grid, p, c.h)

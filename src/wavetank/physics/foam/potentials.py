"""Where water makes foam: trapped air, wave crests and kinetic energy.

Ihmsen, Akinci, Akinci and Teschner 2012, "Unified spray, foam and bubbles for particle-based fluids"
(10.1007/s00371-012-0697-9); equation numbers are theirs.

    code       symbol      meaning                                                              unit
    c_h        g           h times the gradient of the density over rest density                1
    normal     n_i         outward unit normal of the surface, zero inside                      1
    speed      U           sqrt(g L), L the edge of a cube of all the water                     m/s
    trapped    v_i^diff    approach of the neighbours, weighted mean over the support           U
    crest      kappa_i     bend of a convex surface, likewise                                   1
    energy                 v_i^2 / (U^2 times the reluctance of the fluid, see `update.py`)     1
    limited    Phi         ramp from 0 to 1 between two thresholds (Eq. 1)                      1

Where we differ, and why:
- Every potential is a pure number. Sums over neighbours are divided by the integral of their weight, velocities by the
  speed U of water that falls by its own size; births are counted per U / L. So the same splash makes the same foam in a
  cup and in a harbour, and at twice the resolution it makes as many births per particle of the surface.
- The wall's own gradient is part of the normal, so that water on a wall shows no surface towards it.
- Fluids that are too viscous to break up do not foam.
- One amount serves both sources; the paper has a factor for each. Crests count twice, and still bear few.
"""

from wavetank.device.compiler import qd
from wavetank.device.state import Air, Births, Coefficients, Grid, Particles, Walls
from wavetank.device.sums import sum_up
from wavetank.physics.boundary import wall_density
from wavetank.physics.clusters import chunks, end_cluster, end_of, first_cluster
from wavetank.physics.foam.noise import stream, uniform
from wavetank.physics.pairs import add_neighbors, column
from wavetank.physics.predicted_positions import predicted
from wavetank.physics.smoothing import kernel
from wavetank.solids.distance import SolidSet


@qd.func
def limited(value, low, high):
    """Ramp from 0 at `low` to 1 at `high`: Eq. 1."""
    return (qd.min(value, high) - qd.min(value, low)) / (high - low)


@qd.func
def add_approach(sums: qd.template(), r, square, a, b, c: Coefficients, method: qd.template()):
    """Add neighbour j to sum |v_ij| (1 - v_ij^ . x_ij^) W: Eq. 2; twice the speed head-on, nothing for what parts."""
    difference = a - b
    length = qd.sqrt(square)
    apart = difference.dot(r) / qd.max(length, 1e-15)
    sums += (difference.norm() - apart) * qd.max(1.0 - length * c.inverse_h, 0.0)


@qd.func
def add_bend(sums: qd.template(), r, square, a, b, c: Coefficients, method: qd.template()):
    """Add neighbour j to sum (1 - n_i . n_j) W over the surface below the tangent plane: Eq. 4 to 6."""
    if b.norm_sqr() > 0.0 and r.dot(a) > 0.0:
        sums += (1.0 - b.dot(a)) * qd.max(1.0 - qd.sqrt(square) * c.inverse_h, 0.0)


@qd.func
def add_slope(sums: qd.template(), r, square, a, b, c: Coefficients, method: qd.template()):
    """Add neighbour j to the gradient of the density over `gradient_scale`."""
    sums += r * kernel(method, square * c.inverse_h2)[1]


@qd.func
def outward_normal(i, sum, particles: Particles, solids: SolidSet, walls: Walls, c: Coefficients):
    """Unit normal of the water's surface at particle `i`, zero inside the water: the density falls along it."""
    p = predicted(particles, i)
    n = p * 0.0
    for k in qd.static(range(p.n)):
        n[k] = -c.gradient_scale * sum[k]
    if particles.near[i] != 0:
        wall = wall_density(p, particles.near[i], solids, walls, c)
        for k in qd.static(range(p.n)):
            n[k] -= wall[k]
    steepness = n.norm()
    # Half of what a flat surface has; disorder inside the water stays below.
    return n / steepness if c.h * steepness > 0.5 else p * 0.0


@qd.func
def find_normals(
    births: Births,
    cluster,
    particles: Particles,
    grid: Grid,
    solids: SolidSet,
    walls: Walls,
    c: Coefficients,
    a: Air,
    count,
    method: qd.template(),
):
    """Set the normals of the surface at a cluster, except where the water is too slow to matter for a crest."""
    first = cluster * grid.lanes
    last = qd.min(first + grid.lanes, count)
    dim = qd.static(particles.x[cluster].n)
    slow = 0.01 * a.speed * a.speed
    fastest = 0.0
    for i in range(first, last):
        fastest = qd.max(fastest, particles.v[i].norm_sqr())
    sums = qd.Matrix.zero(qd.f32, dim, grid.lanes)
    if fastest > slow:
        add_neighbors(sums, add_slope, cluster, particles, particles.v, grid, c, method)
    for i in range(first, last):
        n = particles.x[i] * 0.0
        if particles.v[i].norm_sqr() > slow:
            n = outward_normal(i, column(sums, i - first), particles, solids, walls, c)
        births.normal[i] = n


@qd.func
def energy(i, births: Births, particles: Particles, a: Air):
    """How agitated water particle `i` is: Phi_k."""
    scale = a.speed * a.speed * births.reluctance[particles.material[i]]
    return limited(particles.v[i].norm_sqr() / scale, 0.05, 0.5)


@qd.func
def is_crest(i, births: Births, particles: Particles):
    """Whether the surface at particle `i` moves outwards: Eq. 7."""
    v = particles.v[i]
    return births.normal[i].dot(v) > 0.6 * v.norm()


@qd.func
def add_potentials(
    sums: qd.template(),
    cluster,
    births: Births,
    particles: Particles,
    grid: Grid,
    c: Coefficients,
    a: Air,
    count,
    method: qd.template(),
):
    """Births of a cluster's particles where one of the most agitated makes one: Phi_k (Phi_ta + 2 Phi_wc), Eq. 8."""
    first = cluster * grid.lanes
    last = qd.min(first + grid.lanes, count)
    agitated = False
    crested = False
    for i in range(first, last):
        if energy(i, births, particles, a) > 0.0:
            agitated = True
            crested = crested or is_crest(i, births, particles)
    trapped = qd.Matrix.zero(qd.f32, 1, grid.lanes)
    crest = qd.Matrix.zero(qd.f32, 1, grid.lanes)
    if agitated:
        add_neighbors(trapped, add_approach, cluster, particles, particles.v, grid, c, method)
    if crested:
        add_neighbors(crest, add_bend, cluster, particles, births.normal, grid, c, method)
    for i in range(first, last):
        share = energy(i, births, particles, a)
        if share > 0.0:
            result = limited(trapped[0, i - first] * a.mean / a.speed, 0.12, 0.5)
            if is_crest(i, births, particles):
                result += 2.0 * limited(crest[0, i - first] * a.mean, 0.2, 0.6)
            sums[0, i - first] += share * result


@qd.kernel(fastcache=True)
def count_births(
    births: Births,
    particles: Particles,
    grid: Grid,
    solids: SolidSet,
    walls: Walls,
    c: Coefficients,
    a: Air,
    room: qd.f32,
    frame: qd.i32,
    count: qd.i32,
    method: qd.template(),
    shared: qd.template(),
) -> qd.i32:
    """Draw how many each water particle bears in an interval, of which the share `room` is wanted; return their sum.

    Threads share the sums where `shared`.
    """
    for chunk in range(chunks(grid, count)):
        for cluster in range(first_cluster(chunk, grid, count), end_cluster(chunk, grid, count)):
            find_normals(births, cluster, particles, grid, solids, walls, c, a, count, method)
    for chunk in range(chunks(grid, count)):
        for cluster in range(first_cluster(chunk, grid, count), end_cluster(chunk, grid, count)):
            potentials = qd.Matrix.zero(qd.f32, 1, grid.lanes)
            add_potentials(potentials, cluster, births, particles, grid, c, a, count, method)
            for i in range(cluster * grid.lanes, end_of(cluster, grid, count)):
                expected = room * a.made * potentials[0, i - cluster * grid.lanes]
                births.first[i] = qd.cast(expected + uniform(stream(a.seed, frame, particles.id[i]), 0), qd.i32)
    sum_up(births.first, births.blocks, count, shared)
    return births.first[count]

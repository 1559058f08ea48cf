"""Conjugate gradients for the velocities of viscous fluids: (1 + dt M^-1 L) v = b, whose damping is `L`.

Hestenes and Stiefel 1952 (10.6028/jres.049.044), in the form of Chronopoulos and Gear 1989
(10.1016/0377-0427(89)90045-9), which needs both products of an iteration at once. The matrix A is symmetric in the
inner product of masses, sum m a . b, and no eigenvalue is below one.

    code        symbol             meaning                                                    unit
    x           x                  velocity so far                                            m/s
    residual    r = b - A x                                                                   m/s
    pulled      A r                                                                           m/s
    direction   p                  where the iteration goes                                   m/s
    slope       A p                                                                           m/s
    gamma       (r, r)             products of all particles, masses over the largest         m^2/s^2
    delta       (r, A r)           likewise                                                   m^2/s^2
    alpha       alpha              how far it goes, between 0 and 1 as A has no smaller one   1
    beta        beta               share of the last direction                                1

It starts at what viscosity did in the last step, and ends where the velocities are right to a part of what it does in
this one. As no eigenvalue is below one, their error squared is at most that of the energy norm, of which an iteration
takes alpha gamma: what the last few took tells what was left before them (Strakos and Tichy 2002, Electronic
Transactions on Numerical Analysis 13, 56).

Ice keeps its velocity, 0: it has no residual, and no equation of its own.

The sums are those of equal slices, in order: they do not depend on threads. Forces between particles cancel in each of
the vectors, so momentum is as exact as that of the start, wherever the iterations end.
"""

import dataclasses
from typing import Any

from wavetank.device.compiler import current_backend, download, qd
from wavetank.device.state import Coefficients, Grid, Particles, Temporaries
from wavetank.physics.clusters import chunks, cluster_count, end_cluster, end_of, first_cluster
from wavetank.physics.pairs import add_kept, column
from wavetank.physics.world import World
from wavetank.solids.distance import vec3, vec4

TOLERANCE = 0.02  # of what viscosity changes in a step
LOOK = 8  # iterations between two looks at the error: over fewer, what is slow to come seems to be there


@dataclasses.dataclass(frozen=True, eq=False)
class Damping:
    """What holds the fluid back: vec4 hold three numbers and one that the kernels of this file do not read."""

    pairs: qd.types.ndarray()  # f32 [8 * places in the lists], Pa s/m^2: mu_ij f(q) / r^2 of each pair, its damper
    drag: qd.types.ndarray()  # vec4 [capacity]: of the walls, and its rate
    normal: qd.types.ndarray()  # vec4 [capacity]: of the wall, if it is one, and the share of the drag along it


@dataclasses.dataclass(frozen=True, eq=False)
class Iterates:
    """The vectors of the iterations, as the table above has them; vec4 [capacity] whose last number is not theirs."""

    x: qd.types.ndarray()
    residual: qd.types.ndarray()
    pulled: qd.types.ndarray()
    direction: qd.types.ndarray()
    slope: qd.types.ndarray()
    products: qd.types.ndarray()  # vec4 [clusters]: of each cluster
    totals: qd.types.ndarray()  # vec4 [2 + slices], see `iterate`


@qd.func
def slices():
    """Slices of the clusters, whose sums are added up in order."""
    return 256


@qd.func
def add_damping(sums: qd.template(), r, damper, a, b, c: Coefficients, method: qd.template()):
    """Add neighbour j to sum_j mu_ij f(q) ((v_j - v_i) . n) n."""
    approach = 0.0
    for k in qd.static(range(r.n)):
        approach += (b[k] - a[k]) * r[k]
    sums += r * (damper * approach)


@qd.func
def along_walls(pull, normal):
    """What is left of the pull of the walls if only a share, behind their `normal`, is left of the part along it."""
    n = vec3(normal.x, normal.y, normal.z)
    return pull - n * (n.dot(pull) * (1.0 - normal.w))


@qd.kernel(fastcache=True)
def start_residual(
    state: Iterates,
    particles: Particles,
    temporaries: Temporaries,
    damping: Damping,
    grid: Grid,
    c: Coefficients,
    rate: qd.f32,
    count: qd.i32,
):
    """Set r = b - A x, where b are the velocities as they are and what moving walls add."""
    for chunk in range(chunks(grid, count)):
        for cluster in range(first_cluster(chunk, grid, count), end_cluster(chunk, grid, count)):
            sums = qd.Matrix.zero(qd.f32, particles.v[cluster].n, grid.lanes)
            add_kept(sums, add_damping, cluster, particles, state.x, damping.pairs, grid, c, 0)
            for i in range(cluster * grid.lanes, end_of(cluster, grid, count)):
                v = particles.v[i]
                own = state.x[i]
                force = column(sums, i - cluster * grid.lanes)
                if particles.near[i] != 0:
                    drag = damping.drag[i]
                    wall = vec3(drag.x, drag.y, drag.z) - vec3(own.x, own.y, own.z) * drag.w
                    wall = along_walls(wall, damping.normal[i])
                    for k in qd.static(range(v.n)):
                        force[k] += wall[k]
                result = own * 0.0
                for k in qd.static(range(v.n)):
                    result[k] = v[k] - own[k] + rate * temporaries.inverse_mass[i] * force[k]
                state.residual[i] = result * (1.0 - particles.frozen[i])


@qd.kernel(fastcache=True)
def multiply(
    state: Iterates,
    particles: Particles,
    temporaries: Temporaries,
    damping: Damping,
    grid: Grid,
    c: Coefficients,
    rate: qd.f32,
    count: qd.i32,
):
    """Set A r, and each cluster's share of (r, r), (r, A r) and (x - b, x - b)."""
    for chunk in range(chunks(grid, count)):
        for cluster in range(first_cluster(chunk, grid, count), end_cluster(chunk, grid, count)):
            sums = qd.Matrix.zero(qd.f32, particles.v[cluster].n, grid.lanes)
            add_kept(sums, add_damping, cluster, particles, state.residual, damping.pairs, grid, c, 0)
            product = vec4(0.0, 0.0, 0.0, 0.0)
            for i in range(cluster * grid.lanes, end_of(cluster, grid, count)):
                r = state.residual[i]
                force = column(sums, i - cluster * grid.lanes)
                if particles.near[i] != 0:
                    wall = along_walls(vec3(r.x, r.y, r.z) * -damping.drag[i].w, damping.normal[i])
                    for k in qd.static(range(force.n)):
                        force[k] += wall[k]
                result = r
                change = 0.0
                for k in qd.static(range(force.n)):
                    result[k] = (r[k] - rate * temporaries.inverse_mass[i] * force[k]) * (1.0 - particles.frozen[i])
                    change += (state.x[i][k] - particles.v[i][k]) ** 2 * (1.0 - particles.frozen[i])
                state.pulled[i] = result
                product += vec4(r.dot(r), r.dot(result), change, 0.0) / temporaries.inverse_mass[i]
            state.products[cluster] = product


@qd.kernel(fastcache=True)
def iterate(state: Iterates, grid: Grid, first: qd.i32, looked: qd.i32, count: qd.i32, shared: qd.template()):
    """Do one iteration: sum the products of all clusters, then update x, residual, direction and slope.

    `first` is 1 in the first iteration, and `looked` where the host has just read the error. Threads share the sums
    where `shared`. `totals` has (gamma, alpha, beta, 0); (decrease of the squared error in the energy norm since the
    host read it, (x - b, x - b), 0, 0); and the sums of the slices.
    """
    qd.loop_config(serialize=not shared)
    for b in range(slices()):
        size = (cluster_count(grid, count) + slices() - 1) // slices()
        total = vec4(0.0, 0.0, 0.0, 0.0)
        for cluster in range(b * size, qd.min(b * size + size, cluster_count(grid, count))):
            total += state.products[cluster]
        state.totals[2 + b] = total
    qd.loop_config(serialize=True)
    for _ in range(1):
        total = vec4(0.0, 0.0, 0.0, 0.0)
        for b in range(slices()):
            total += state.totals[2 + b]
        gamma, delta = total.x, total.y
        before = state.totals[0]
        alpha, beta = 0.0, 0.0
        # What is left may be less than rounding: then it stays where it is.
        if gamma > 0.0 and (first == 1 or before.y > 0.0):
            if first == 0:
                beta = gamma / before.x
                delta -= beta * gamma / before.y
            if delta > 0.5 * gamma:
                alpha = gamma / delta
        state.totals[0] = vec4(gamma, alpha, beta, 0.0)
        gained = alpha * gamma
        if looked == 0:
            gained += state.totals[1].x
        state.totals[1] = vec4(gained, total.z, 0.0, 0.0)
    for i in range(count):
        alpha, beta = state.totals[0].y, state.totals[0].z
        p, q = state.residual[i], state.pulled[i]
        if first == 0:
            p += beta * state.direction[i]
            q += beta * state.slope[i]
        state.direction[i] = p
        state.slope[i] = q
        state.x[i] += alpha * p
        state.residual[i] -= alpha * q


def solve(world: World, damping: Damping, x: Any, c: Coefficients, rate: float, most: int) -> int:
    """Solve the equation above for the velocities `x` [m/s], vec4 [capacity], from the guess that they hold.

    `rate` [1/(Pa s)] is dt B over the largest density (`implicit_viscosity.py`). Return the number of
    iterations, at most `most`.
    """
    particles, temporaries, grid, fluids, count = (
        world.particles,
        world.temporaries,
        world.grid,
        world.fluids,
        world.count,
    )
    names = ("residual", "pulled", "direction", "slope", "products")
    state = fluids.together(Iterates, x, *map(fluids.array, names), fluids.array("totals", 2 + slices.fn()))
    shared = int(current_backend() != "cpu")
    start_residual(state, particles, temporaries, damping, grid, c, rate, count)
    for number in range(most):
        multiply(state, particles, temporaries, damping, grid, c, rate, count)
        iterate(state, grid, int(number == 0), int(number % LOOK == 0), count, shared)
        if (number + 1) % LOOK == 0 and number + 1 < most:
            gained, change = map(float, download(state.totals)[1][:2])
            if gained <= TOLERANCE**2 * change:
                return number + 1
    return most

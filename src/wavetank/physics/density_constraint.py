"""The density constraint C_i = rho_i / rho_0 - 1 and its Jacobi solver.

Macklin and Müller 2013, "Position Based Fluids" (10.1145/2461912.2461984); equation numbers are those of the report,
which follow the paper's from Eq. 3 on.

    code       symbol              meaning                                                   unit
    rho        rho_i / rho_0       density over rest density                                 1
    lam, dlam  lambda_i            multiplier, summed over the iterations; its last change   m^2
    squares                        its denominator, sum_k |grad_pk C_i|^2 + eps              1/m^2
    slope      |grad_pj C_i|       length of a gradient of the constraint, with its sign     1/m
    eps        eps                 constraint force mixing                                   1/m^2
    tensile    k / w(dq)^n         artificial pressure of one iteration                      m^2

Where we differ, and why:
- Densities are relative to the rest lattice, so m and rho_0 cancel and no constant depends on the scale.
- One kernel serves density and gradient by default. Poly6 for one and Spiky for the other is not a gradient of the
  constraint and pumps energy into water at rest; it stays as the preset `paper`.
- The denominators of Eq. 5 are those of the first iteration: the water hardly moves in the others, and a sweep that
  needs densities only takes half the time.
- Multipliers are summed over the iterations and the sum, not each change, is kept from pulling (`attraction` = 0).
  A later iteration can therefore take back what an earlier one pushed too far, as contact solvers do, and the
  deficient sums at a free surface pull nothing together, so that no artificial pressure is needed.
- The iterations form a Chebyshev semi-iteration (`schedule`) instead of plain Jacobi: at equal work the error of deep
  water halves, and the first step is under-relaxed, without which Jacobi overshoots.
- Walls add to density and gradient (`boundary.py`), with the particle's own multiplier only.
- Fluids of different density share the constraint, which counts volumes, not masses (`mixture.py`); their corrections
  are weighted with inverse masses.

Chebyshev for Jacobi solvers of constraints: Wang 2015 (10.1145/2816795.2818063); the projection of the summed
multiplier: Moreau and Jean's projected iteration, as in Tonge et al. 2012 (10.1145/2185520.2185601).
"""

import enum

from wavetank.device.compiler import qd
from wavetank.device.state import Coefficients, Grid, Particles, Temporaries, Walls
from wavetank.physics.broad_phase import Obstacles
from wavetank.physics.clusters import chunks, end_cluster, end_of, first_cluster
from wavetank.physics.contact import clamp_to_tank, flattened
from wavetank.physics.near_solids import accumulate_reaction, find_walls, is_clear
from wavetank.physics.pairs import add_neighbors, column
from wavetank.physics.predicted_positions import predict_at, predicted
from wavetank.physics.smoothing import kernel
from wavetank.solids.distance import SolidSet, lift, vec4


@qd.func
def add_density(sums: qd.template(), r, square, a, b, c: Coefficients, method: qd.template()):
    """Add neighbour j to (sum w, grad_i C, sum_j |grad_j C|^2): Eq. 1 and the denominator of Eq. 4.

    Gradients are over `gradient_scale`, by which a particle's sums are multiplied at the end.
    """
    w = kernel(method, square * c.inverse_h2)
    sums[0] += w[0]
    direction = r * w[1]
    for k in qd.static(range(r.n)):
        sums[1 + k] += direction[k]
    sums[1 + r.n] += w[1] * w[1] * square  # none for the particle itself


@qd.func
def add_weight(sums: qd.template(), r, square, a, b, c: Coefficients, method: qd.template()):
    """Add neighbour j to sum w: Eq. 1."""
    sums[0] += kernel(method, square * c.inverse_h2)[0]


@qd.func
def add_correction(sums: qd.template(), r, square, a, b, c: Coefficients, method: qd.template()):
    """Add neighbour j to the correction of particle i over `gradient_scale`: Eq. 6."""
    sums += r * ((a[0] + b[0]) * kernel(method, square * c.inverse_h2)[1])


@qd.func
def artificial_pressure(w, c: Coefficients, quartic: qd.template()):
    """Return what a pair's kernel `w` adds to its multipliers [m^2] (Eq. 7); `quartic` has the exponent 4, no power."""
    share = (w * w) * (w * w)
    if qd.static(not quartic):
        share = w**c.tensile_exponent
    return -c.tensile * share


@qd.func
def add_tensile_correction(sums: qd.template(), r, square, a, b, c: Coefficients, method: qd.template()):
    """Add neighbour j to the correction of particle i: Eq. 8, Eq. 6 with the artificial pressure of Eq. 7."""
    w = kernel(method, square * c.inverse_h2)
    sums += r * ((a[0] + b[0] + artificial_pressure(w[0], c, False)) * w[1])


@qd.func
def add_quartic_correction(sums: qd.template(), r, square, a, b, c: Coefficients, method: qd.template()):
    """`add_tensile_correction` with the exponent 4."""
    w = kernel(method, square * c.inverse_h2)
    sums += r * ((a[0] + b[0] + artificial_pressure(w[0], c, True)) * w[1])


@qd.func
def add_mixed_tensile_correction(sums: qd.template(), r, square, a, b, c: Coefficients, method: qd.template()):
    """`add_tensile_correction` for fluids of different density: behind the multipliers are the inverse masses.

    The lighter of the two is moved as far as it would be among its like.
    """
    w = kernel(method, square * c.inverse_h2)
    s_corr = artificial_pressure(w[0], c, False) / qd.max(a[1], b[1])
    sums += r * ((a[0] + b[0] + s_corr) * w[1])


@qd.func
def add_mixed_quartic_correction(sums: qd.template(), r, square, a, b, c: Coefficients, method: qd.template()):
    """`add_mixed_tensile_correction` with the exponent 4."""
    w = kernel(method, square * c.inverse_h2)
    s_corr = artificial_pressure(w[0], c, True) / qd.max(a[1], b[1])
    sums += r * ((a[0] + b[0] + s_corr) * w[1])


@qd.func
def add_weighted_density(sums: qd.template(), r, square, a, b, c: Coefficients, method: qd.template()):
    """`add_density` for fluids of different density: squared gradients count with the inverse masses."""
    w = kernel(method, square * c.inverse_h2)
    sums[0] += w[0]
    direction = r * w[1]
    for k in qd.static(range(r.n)):
        sums[1 + k] += direction[k]
    sums[1 + r.n] += b[0] * w[1] * w[1] * square


#: By `mixed`; append only, as `smoothing.KERNELS`.
DENSITIES = (add_density, add_weighted_density)


class Correction(enum.IntEnum):
    """Places of the corrections in CORRECTIONS: of one fluid and, from MIXED on, of fluids of different density."""

    PLAIN = 0  # Eq. 6
    TENSILE = 1  # Eq. 8: with artificial pressure
    QUARTIC = 2  # the same with the exponent 4
    MIXED = 3
    MIXED_TENSILE = 4
    MIXED_QUARTIC = 5

    @property
    def without_pressure(self) -> "Correction":
        """The correction of the same fluids without artificial pressure."""
        return Correction.MIXED if self.is_mixed else Correction.PLAIN

    @property
    def is_mixed(self) -> bool:
        """Whether it is of fluids of different density."""
        return self >= Correction.MIXED

    @property
    def needs_masses(self) -> bool:
        """Whether it reads the inverse masses of pairs."""
        return self > Correction.MIXED


#: By `Correction`; append only, as `smoothing.KERNELS`.
CORRECTIONS = (
    add_correction,
    add_tensile_correction,
    add_quartic_correction,
    add_correction,
    add_mixed_tensile_correction,
    add_mixed_quartic_correction,
)


@qd.func
def store_wall(found: qd.template(), lane, i, near, temporaries: Temporaries):
    """Gradient and density that the solids add at particle `i`, from its lane of `found`; kept if `near` any."""
    wall = vec4(found[0, lane], found[1, lane], found[2, lane], 1.0 - found[3, lane])
    if near != 0:
        temporaries.wall[i] = wall
    return wall


@qd.func
def set_multiplier(i, before, change, temporaries: Temporaries, c: Coefficients):
    """Change the multiplier of particle `i` from what it was `before`; it pushes, and pulls by a share at most."""
    lam = before + change
    if lam > 0.0:
        lam *= c.attraction
    temporaries.dlam[i] = lam - before
    temporaries.lam[i] = lam


@qd.kernel(fastcache=True)
def start_multipliers(
    temporaries: Temporaries,
    particles: Particles,
    grid: Grid,
    solids: SolidSet,
    walls: Walls,
    c: Coefficients,
    count: qd.i32,
    method: qd.template(),
    mixed: qd.template(),
):
    """Find the denominators of all iterations of a substep, and the multipliers of the first (Eq. 1 to 5)."""
    for chunk in range(chunks(grid, count)):
        for cluster in range(first_cluster(chunk, grid, count), end_cluster(chunk, grid, count)):
            dim = qd.static(particles.x[cluster].n)
            sums = qd.Matrix.zero(qd.f32, dim + 2, grid.lanes)
            add_neighbors(
                sums, qd.static(DENSITIES[mixed]), cluster, particles, temporaries.inverse_mass, grid, c, method
            )
            found = qd.Matrix.zero(qd.f32, 4, grid.lanes)
            near = find_walls(found, cluster, particles, temporaries, solids, walls, c)
            for i in range(cluster * grid.lanes, end_of(cluster, grid, count)):
                sum = column(sums, i - cluster * grid.lanes)
                wall = store_wall(found, i - cluster * grid.lanes, i, near, temporaries)
                constraint = c.density_scale * sum[0] + wall.w - 1.0  # Eq. 2
                own = c.eps
                for k in qd.static(range(dim)):
                    own += (c.gradient_scale * sum[1 + k] + wall[k]) ** 2
                if qd.static(mixed):
                    own *= temporaries.inverse_mass[i]
                squares = c.gradient_scale * c.gradient_scale * sum[dim + 1] + own
                temporaries.denominator[i] = squares
                set_multiplier(i, 0.0, -c.relaxation * constraint / squares, temporaries, c)  # Eq. 5


@qd.kernel(fastcache=True)
def solve_multipliers(
    temporaries: Temporaries,
    particles: Particles,
    grid: Grid,
    solids: SolidSet,
    walls: Walls,
    c: Coefficients,
    count: qd.i32,
    method: qd.template(),
):
    """Estimate densities (Eq. 1) and move the multipliers on towards the solution (Eq. 5)."""
    for chunk in range(chunks(grid, count)):
        for cluster in range(first_cluster(chunk, grid, count), end_cluster(chunk, grid, count)):
            sums = qd.Matrix.zero(qd.f32, 1, grid.lanes)
            add_neighbors(sums, add_weight, cluster, particles, temporaries.inverse_mass, grid, c, method)
            found = qd.Matrix.zero(qd.f32, 4, grid.lanes)
            near = find_walls(found, cluster, particles, temporaries, solids, walls, c)
            for i in range(cluster * grid.lanes, end_of(cluster, grid, count)):
                wall = store_wall(found, i - cluster * grid.lanes, i, near, temporaries)
                constraint = c.density_scale * sums[0, i - cluster * grid.lanes] + wall.w - 1.0  # Eq. 2
                change = (
                    -c.relaxation * constraint / temporaries.denominator[i] + c.momentum * temporaries.dlam[i]
                )  # Eq. 5
                set_multiplier(i, temporaries.lam[i], change, temporaries, c)


@qd.func
def largest_move(v, c: Coefficients):
    """Return the way [m] that an iteration may move a particle of the velocity `v`: not past solids marked for it."""
    most = c.largest_correction
    if c.push_limit > 0.0:  # thick fluids: see dynamic_viscosity/implicit_viscosity.py
        most = qd.min(most, c.push_limit + c.push_time * v.norm())
    return most


@qd.func
def touches_solids(
    i,
    before,
    p,
    short,
    particles: Particles,
    temporaries: Temporaries,
    solids: SolidSet,
    walls: Walls,
    c: Coefficients,
    obstacles: qd.template(),
):
    """Return 1 where the path of particle `i` to `p` may touch a solid, else 0; sum up how its density pushes bodies.

    It was at `before`, and the correction is the share `short` of the whole.
    """
    touching, near = 0, particles.near[i]
    if near >> solids.tank_count != 0:
        touching = 1 - qd.cast(is_clear(i, lift(particles.x[i]), p, temporaries, solids, c), qd.i32)
        if qd.static(obstacles == Obstacles.TWO_WAY):
            push, free = temporaries.dlam[i] * short, 1.0 - temporaries.wall[i].w
            if push != 0.0:
                accumulate_reaction(i, before, near, free, push, temporaries, solids, walls, c)
    return touching


@qd.kernel(fastcache=True)
def correct_positions(
    corrected: Particles,
    particles: Particles,
    temporaries: Temporaries,
    changes: qd.types.ndarray(),
    grid: Grid,
    solids: SolidSet,
    walls: Walls,
    c: Coefficients,
    count: qd.i32,
    method: qd.template(),
    correction: qd.template(),
    obstacles: qd.template(),
):
    """Move the predicted positions by the corrections (Eq. 6 or 8, by its `Correction`), inside the tank.

    `changes` are those of the multipliers, `temporaries.dlam`, with inverse masses behind where the correction asks for
    them. Particles that may touch `obstacles` are marked, for `contact.resolve_contacts`.
    """
    for chunk in range(chunks(grid, count)):
        for cluster in range(first_cluster(chunk, grid, count), end_cluster(chunk, grid, count)):
            sums = qd.Matrix.zero(qd.f32, particles.x[cluster].n, grid.lanes)
            add_neighbors(sums, qd.static(CORRECTIONS[correction]), cluster, particles, changes, grid, c, method)
            for i in range(cluster * grid.lanes, end_of(cluster, grid, count)):
                p = predicted(particles, i)
                dp = c.gradient_scale * column(sums, i - cluster * grid.lanes)
                near = particles.near[i]
                if near != 0:
                    for k in qd.static(range(p.n)):
                        dp[k] += temporaries.dlam[i] * temporaries.wall[i][k]
                if qd.static(correction >= Correction.MIXED):
                    dp *= temporaries.inverse_mass[i]
                short = qd.min(1.0, largest_move(particles.v[i], c) / qd.max(dp.norm(), 1e-12))
                before = lift(p)
                p += dp * short
                if near != 0:
                    p = flattened(clamp_to_tank(lift(p), near, solids, c.wall_gap), p)
                if qd.static(obstacles):
                    temporaries.touching[i] = touches_solids(
                        i, before, lift(p), short, particles, temporaries, solids, walls, c, obstacles
                    )
                predict_at(corrected, i, p)


@qd.kernel(fastcache=True)
def measure_density(
    temporaries: Temporaries,
    particles: Particles,
    grid: Grid,
    solids: SolidSet,
    walls: Walls,
    c: Coefficients,
    largest_density: qd.f32,
    count: qd.i32,
    method: qd.template(),
):
    """Estimate the densities [kg/m^3] at the positions p (Eq. 1), walls included."""
    for chunk in range(chunks(grid, count)):
        for cluster in range(first_cluster(chunk, grid, count), end_cluster(chunk, grid, count)):
            sums = qd.Matrix.zero(qd.f32, 1, grid.lanes)
            add_neighbors(sums, add_weight, cluster, particles, temporaries.inverse_mass, grid, c, method)
            found = qd.Matrix.zero(qd.f32, 4, grid.lanes)
            find_walls(found, cluster, particles, temporaries, solids, walls, c)
            for i in range(cluster * grid.lanes, end_of(cluster, grid, count)):
                rho = c.density_scale * sums[0, i - cluster * grid.lanes] + (1.0 - found[3, i - cluster * grid.lanes])
                temporaries.rho[i] = largest_density * rho / temporaries.inverse_mass[i]


def schedule(iterations: int, slowest: float, stiffest: float) -> list[tuple[float, float]]:
    """Return (relaxation, momentum) of each iteration of a Chebyshev semi-iteration.

    It damps all eigenvalues of the Jacobi matrix between `slowest` and `stiffest` as evenly as so many iterations can;
    with `slowest` = 0 it is Jacobi with one relaxation, 2 / `stiffest`. (Saad 2003, "Iterative Methods for Sparse
    Linear Systems", Algorithm 12.1.)
    """
    if slowest <= 0.0 or slowest >= stiffest:
        return [(2.0 / stiffest, 0.0)] * iterations
    theta, delta = 0.5 * (stiffest + slowest), 0.5 * (stiffest - slowest)
    sigma = theta / delta
    rho, result = 1.0 / sigma, [(1.0 / theta, 0.0)]
    for _ in range(iterations - 1):
        following = 1.0 / (2.0 * sigma - rho)
        result.append((2.0 * following / delta, following * rho))
        rho = following
    return result

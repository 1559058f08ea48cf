"""The density constraint C_i = rho_i / rho_0 - 1 and its Jacobi solver.

Macklin and Müller 2013, "Position Based Fluids" (10.1145/2461912.2461984); equation numbers are those of the report,
which follow the paper's from Eq. 3 on.

    code       symbol              meaning                                                   unit
    rho        rho_i / rho_0       density over rest density                                 1
    lam        lambda_i            multiplier                                                m^2
    eps        eps                 constraint force mixing                                   1/m^2
    slope      |grad_pj C_i|       length of a gradient of the constraint, with its sign     1/m
    tensile    k / w(dq)^n         artificial pressure of one iteration                      m^2

Where we differ, and why:
- Densities are relative to the rest lattice, so m and rho_0 cancel and no constant depends on the scale.
- One kernel serves density and gradient by default. Poly6 for one and Spiky for the other is not a gradient of the
  constraint and pumps energy into water at rest; it stays as the preset `paper`.
- Constraints are unilateral by default (`attraction` = 0): only too dense water is corrected, so that the deficient
  sums at a free surface pull nothing together and no artificial pressure is needed.
- Corrections are under-relaxed: plain Jacobi overshoots, because neighbours correct the same overlap twice.
- Walls add to density and gradient (`boundary.py`), with the particle's own multiplier only.
"""

from wavetank.compiler import qd
from wavetank.distance import SolidSet, vec4
from wavetank.physics.boundary import keep_out, wall_density
from wavetank.physics.neighbors import for_each_neighbor
from wavetank.physics.smoothing import kernel
from wavetank.state import Coefficients, Grid, Particles, Scratch, Walls


@qd.func
def add_density(sums: qd.template(), r, i, j, data: qd.template(), c: Coefficients, method: qd.template()):
    """Add neighbour j to (sum w, grad_i C, sum_j |grad_j C|^2): Eq. 1 and the denominator of Eq. 4."""
    length = r.norm()
    w = kernel(method, length / c.h)
    slope = c.gradient_scale * w[1]
    sums[0] += w[0]
    direction = r * (slope / qd.max(length, 1e-12))
    for k in qd.static(range(r.n)):
        sums[1 + k] += direction[k]
    sums[1 + r.n] += slope * slope


@qd.func
def add_correction(sums: qd.template(), r, i, j, lam: qd.template(), c: Coefficients, method: qd.template()):
    """Add neighbour j to the correction of particle i: Eq. 8, with the artificial pressure of Eq. 7."""
    length = r.norm()
    w = kernel(method, length / c.h)
    s_corr = 0.0
    if c.tensile > 0.0:
        s_corr = -c.tensile * w[0] ** c.tensile_exponent
    push = (lam[i] + lam[j] + s_corr) * c.gradient_scale * w[1] / qd.max(length, 1e-12)
    sums += push * r


@qd.kernel(fastcache=True)
def solve_multipliers(
    scratch: Scratch, particles: Particles, grid: Grid, solids: SolidSet, walls: Walls, c: Coefficients,
    count: qd.i32, method: qd.template(),
):  # fmt: skip
    """Estimate densities (Eq. 1) and solve for the multipliers (Eq. 5)."""
    for i in range(count):
        p = particles.p[i]
        dim = qd.static(p.n)
        sums = qd.Vector([0.0] * (dim + 2))
        for_each_neighbor(sums, add_density, i, particles.p, particles.p, grid, c, method)
        rho = c.density_scale * (sums[0] + kernel(method, 0.0)[0])
        own = 0.0
        wall = vec4(0.0, 0.0, 0.0, 0.0)
        if scratch.near[i] != 0:
            wall = wall_density(p, scratch.near[i], solids, walls, c)
        for k in qd.static(range(dim)):
            own += (sums[1 + k] + wall[k]) ** 2
        rho += wall.w
        constraint = rho - 1.0
        if constraint < 0.0:
            constraint *= c.attraction
        scratch.rho[i] = rho
        scratch.lam[i] = -constraint / (sums[dim + 1] + own + c.eps)


@qd.kernel(fastcache=True)
def correct_positions(
    corrected: Particles, particles: Particles, scratch: Scratch, grid: Grid, solids: SolidSet, walls: Walls,
    c: Coefficients, count: qd.i32, method: qd.template(),
):  # fmt: skip
    """Move the predicted positions by the under-relaxed corrections (Eq. 8) and keep them out of the solids."""
    for i in range(count):
        p = particles.p[i]
        dp = p * 0.0
        for_each_neighbor(dp, add_correction, i, particles.p, scratch.lam, grid, c, method)
        if scratch.near[i] == 0:
            corrected.p[i] = p + c.relaxation * dp
        else:
            wall = wall_density(p, scratch.near[i], solids, walls, c)
            for k in qd.static(range(p.n)):
                dp[k] += scratch.lam[i] * wall[k]
            corrected.p[i] = keep_out(particles.x[i], p + c.relaxation * dp, scratch.near[i], solids, c)


@qd.kernel(fastcache=True)
def measure_density(
    scratch: Scratch, particles: Particles, grid: Grid, solids: SolidSet, walls: Walls, c: Coefficients,
    count: qd.i32, rest_density: qd.f32, method: qd.template(),
):  # fmt: skip
    """Estimate the densities [kg/m^3] at the positions p (Eq. 1), walls included."""
    for i in range(count):
        p = particles.p[i]
        sums = qd.Vector([0.0] * (p.n + 2))
        for_each_neighbor(sums, add_density, i, particles.p, particles.p, grid, c, method)
        rho = c.density_scale * (sums[0] + kernel(method, 0.0)[0])
        if scratch.near[i] != 0:
            rho += wall_density(p, scratch.near[i], solids, walls, c).w
        scratch.rho[i] = rest_density * rho

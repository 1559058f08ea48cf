"""XSPH viscosity: velocities drawn towards the mean of the neighbours.

Schechter and Bridson 2012 (10.1145/2185520.2185557), Eq. 11 of the report. Where we differ: the sum is a mean, with
the volume of a particle, so that c has no unit; pairs are weighted alike from both sides, so momentum is kept exactly.
Of two fluids the heavier follows less, by the ratio of the masses: m_i dv_i is antisymmetric, no share exceeds c.
"""

from wavetank.compiler import qd
from wavetank.physics.neighbors import for_each_neighbor
from wavetank.physics.smoothing import kernel
from wavetank.state import Coefficients, Grid, Particles


@qd.func
def add_xsph(sums: qd.template(), r, i, j, v: qd.template(), c: Coefficients, method: qd.template()):
    """Add neighbour j to sum_j (v_j - v_i) w_ij."""
    sums += (v[j] - v[i]) * kernel(method, r.norm() * c.inverse_h)[0]


@qd.func
def add_mixed_xsph(sums: qd.template(), r, i, j, data: qd.template(), c: Coefficients, method: qd.template()):
    """Add neighbour j to sum_j (v_j - v_i) w_ij min(1, m_j / m_i); the inverse masses w are in `data`, behind v."""
    a = data[i]
    b = data[j]
    share = kernel(method, r.norm() * c.inverse_h)[0] * qd.min(1.0, a[r.n] / b[r.n])
    for k in qd.static(range(r.n)):
        sums[k] += (b[k] - a[k]) * share


@qd.kernel(fastcache=True)
def apply_viscosity(
    smoothed: Particles, particles: Particles, grid: Grid, c: Coefficients, count: qd.i32, method: qd.template()
):
    """Smooth the velocities (Eq. 11)."""
    for i in range(count):
        dv = particles.v[i] * 0.0
        for_each_neighbor(dv, add_xsph, i, particles, particles.v, grid, c, method)
        smoothed.v[i] = particles.v[i] + c.viscosity * c.density_scale * dv


@qd.kernel(fastcache=True)
def apply_mixed_viscosity(
    smoothed: Particles, particles: Particles, packed: qd.types.ndarray(), grid: Grid, c: Coefficients, count: qd.i32,
    method: qd.template(),
):  # fmt: skip
    """Smooth the velocities (Eq. 11) of fluids of different density; `packed` as `mixture.pack_weights` leaves it."""
    for i in range(count):
        dv = particles.v[i] * 0.0
        for_each_neighbor(dv, add_mixed_xsph, i, particles, packed, grid, c, method)
        smoothed.v[i] = particles.v[i] + c.viscosity * c.density_scale * dv

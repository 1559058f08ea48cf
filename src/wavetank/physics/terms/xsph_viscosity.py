"""XSPH viscosity, velocities drawn towards the mean of the neighbours; and the vorticity, found in the same sweep.

Schechter and Bridson 2012 (10.1145/2185520.2185557), Eq. 11 of the report; the vorticity is its Eq. 9. Both are of the
velocities before either acts. Where we differ: the sum is a mean, with the volume of a particle, so that c has no unit;
pairs are weighted alike from both sides, so momentum is kept exactly. Of two fluids the heavier follows less, by the
ratio of the masses: m_i dv_i is antisymmetric, no share exceeds c. And c is larger where two particles hardly move past
each other, so that calm water comes to rest: particles of a packing that yields creep for minutes, and now and then one
slips. How slow that is (`coefficients.SLOW`) goes with sqrt(g d); waves that can be seen, and jets, keep Eq. 11's c.

    code     symbol     meaning                                                       unit
    sums                sum_j c_ij (v_j - v_i) w_ij, and behind it omega_i            m/s, 1/s
    omega    omega_i    vorticity; in a 2-D world it points along z                   1/s
"""

from wavetank.device.compiler import qd
from wavetank.device.state import Coefficients, Grid, Particles, Temporaries
from wavetank.physics.clusters import chunks, end_cluster, end_of, first_cluster
from wavetank.physics.pairs import add_neighbors, column
from wavetank.physics.smoothing import kernel
from wavetank.solids.distance import vec3


@qd.func
def share_of_pair(dv, c: Coefficients):
    """Share c of the difference of two velocities that is taken: more where it is small."""
    return qd.max(c.viscosity, c.viscosity + c.calming - (c.calming * c.slow) * dv.norm_sqr())


@qd.func
def add_xsph(sums: qd.template(), r, square, a, b, c: Coefficients, method: qd.template()):
    """Add neighbour j to sum_j c_ij (v_j - v_i) w_ij."""
    dv = b - a
    dv *= share_of_pair(dv, c) * kernel(method, square * c.inverse_h2)[0]
    for k in qd.static(range(r.n)):
        sums[k] += dv[k]


@qd.func
def add_vorticity(sums: qd.template(), r, square, a, b, c: Coefficients, method: qd.template()):
    """Add neighbour j to sum_j c_ij (v_j - v_i) w_ij and to omega_i = sum_j (v_j - v_i) x grad_j W (Eq. 9)."""
    w = kernel(method, square * c.inverse_h2)
    dv = b - a
    share = share_of_pair(dv, c) * w[0]
    for k in qd.static(range(r.n)):
        sums[k] += dv[k] * share
    # grad_j W = -grad_i W, and a x b = -b x a.
    turn = (r * (c.gradient_scale * w[1])).cross(dv)
    if qd.static(r.n == 3):
        for k in qd.static(range(3)):
            sums[3 + k] += turn[k]
    else:
        sums[2] += turn


#: By `with_vorticity`; append only, as `smoothing.KERNELS`.
SUMS = (add_xsph, add_vorticity)


@qd.func
def add_mixed_xsph(sums: qd.template(), r, square, a, b, c: Coefficients, method: qd.template()):
    """Add neighbour j to sum_j c_ij (v_j - v_i) w_ij min(1, m_j / m_i); the inverse masses are in `data`, behind v."""
    dv = 0.0 * r
    for k in qd.static(range(r.n)):
        dv[k] = b[k] - a[k]
    slow = dv / qd.sqrt(qd.max(a[3], b[3]))  # as fast as the heaviest fluid would be with that energy
    share = share_of_pair(slow, c) * kernel(method, square * c.inverse_h2)[0] * qd.min(1.0, a[3] / b[3])
    for k in qd.static(range(r.n)):
        sums[k] += dv[k] * share


@qd.kernel(fastcache=True)
def apply_xsph(
    smoothed: Particles,
    particles: Particles,
    temporaries: Temporaries,
    grid: Grid,
    c: Coefficients,
    count: qd.i32,
    method: qd.template(),
    with_vorticity: qd.template(),
):
    """Smooth the velocities (Eq. 11); where `with_vorticity`, estimate the vorticity (Eq. 9)."""
    for chunk in range(chunks(grid, count)):
        for cluster in range(first_cluster(chunk, grid, count), end_cluster(chunk, grid, count)):
            dim = qd.static(particles.v[cluster].n)
            sums = qd.Matrix.zero(qd.f32, dim + with_vorticity * (2 * dim - 3), grid.lanes)
            add_neighbors(sums, qd.static(SUMS[with_vorticity]), cluster, particles, particles.v, grid, c, method)
            for i in range(cluster * grid.lanes, end_of(cluster, grid, count)):
                sum = column(sums, i - cluster * grid.lanes)
                v = particles.v[i]
                for k in qd.static(range(dim)):
                    v[k] += c.density_scale * sum[k]
                smoothed.v[i] = v
                if qd.static(with_vorticity):
                    if qd.static(dim == 3):
                        temporaries.omega[i] = vec3(sum[3], sum[4], sum[5])
                    else:
                        temporaries.omega[i] = vec3(0.0, 0.0, sum[2])


@qd.kernel(fastcache=True)
def pack_velocities(packed: qd.types.ndarray(), particles: Particles, values: qd.types.ndarray(), count: qd.i32):
    """Put velocities and one more number of each particle side by side, where a visitor finds both with one access."""
    for i in range(count):
        v = particles.v[i]
        row = packed[i]
        for k in qd.static(range(v.n)):
            row[k] = v[k]
        row[3] = values[i]
        packed[i] = row


@qd.kernel(fastcache=True)
def apply_mixed_xsph(
    smoothed: Particles,
    particles: Particles,
    packed: qd.types.ndarray(),
    grid: Grid,
    c: Coefficients,
    count: qd.i32,
    method: qd.template(),
):
    """Smooth the velocities (Eq. 11) of fluids of different density; `packed` holds inverse masses too."""
    for chunk in range(chunks(grid, count)):
        for cluster in range(first_cluster(chunk, grid, count), end_cluster(chunk, grid, count)):
            sums = qd.Matrix.zero(qd.f32, particles.v[cluster].n, grid.lanes)
            add_neighbors(sums, add_mixed_xsph, cluster, particles, packed, grid, c, method)
            for i in range(cluster * grid.lanes, end_of(cluster, grid, count)):
                dv = column(sums, i - cluster * grid.lanes)
                smoothed.v[i] = particles.v[i] + c.density_scale * dv

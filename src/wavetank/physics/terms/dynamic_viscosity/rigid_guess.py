"""The guess that conjugate gradients start at: what viscosity did in the last step, turned with the rotation since.

What holds a spinning drop together points inwards; pointing where it did a step ago it has a torque. That a drop turns
as a whole is the last thing that iterations come to where it is stiff, so the torques of all steps added up: a drop of
10^6 Pa s had 3 to 5 times its energy after two radians. Turned, it has what iterations from rest leave it, within 4 %
(notebook/viscosity.md).

    code      symbol                       meaning                                                     unit
    dv        v_i - v_j                    difference of the velocities that it has moved with since   m/s
    m         r - dt dv / 2                between where neighbours were and where they are            m
    sums      sum_j D m x dv               over the neighbours, D their dampers
              sum_j D m m^T
              sum_j D (m . dv)^2 / h^2     how it strains: nothing where it turns as a whole
    omega                                  what turns m into dv best                                   rad/s

With m in the middle of the way, omega dt / 2 is the tangent of half the angle, and the rotation that Cayley's formula
makes of it is that of a solid body exactly, however far it turns in a step.

Only what turns as a whole is turned. In simple shear half the motion is a rotation too, yet what viscosity does there
stays where it is, and so it does where particles jostle: the angle falls with (strain rate / omega)^2, which is 1 in
simple shear, and is nothing from 1 / `RIGID` on. What else it does to the body while it turns, the start does not know:
it forgets what it has, by 1 / (1 + `FORGET` |omega| dt / 2). Without that the torques left over add up again, slower.

What has been torn off forgets as well, the faster the fewer neighbours it has left: forces that pulled it as a part of
something larger do not sum up to nothing any more, and that a fragment moves as a whole is what iterations come to
last. A lone particle beside a paddle was accelerated by it for ever.
"""

from wavetank.device.compiler import qd
from wavetank.device.state import Coefficients, Grid, Particles
from wavetank.physics.clusters import chunks, end_cluster, end_of, first_cluster
from wavetank.physics.pairs import add_kept, column
from wavetank.solids.distance import lift, vec3

STIFF = 5000.0  # largest eigenvalue from which on it is done: of what is less stiff, iterations come to all modes
RIGID = 10.0
FORGET = 5.0
#: sum D (m . dv)^2 / (h^2 omega^2 sum D m^2) in simple shear: the mean of (2 omega n_x n_y)^2 over directions is
#: omega^2 / 2 in the plane and 4 omega^2 / 15 in space; sum D m^4 / (h^2 sum D m^2) is 3/10 and 4/10.
SHEARED = {2: 0.15, 3: 8 / 75}


# The sums of a particle are 1 (2-D) or 3 numbers, the upper triangle of a symmetric matrix row by row, and one number:
# the element in row k and column n >= k of the matrix stands dim k - k (k + 1) / 2 + n places behind its first.


@qd.func
def add_rotation(sums: qd.template(), r, damper, a, b, c: Coefficients, method: qd.template()):
    """Add neighbour j to the sums that tell the rigid rotation."""
    dim = qd.static(r.n)
    dv, m = r, r
    along = 0.0
    for k in qd.static(range(dim)):
        dv[k] = a[k] - b[k]
        m[k] = r[k] - 0.5 * c.dt * dv[k]
        along += m[k] * dv[k]
    for k in qd.static(range(dim)):
        for n in qd.static(range(k, dim)):
            sums[qd.static((1 if dim == 2 else 3) + dim * k - k * (k + 1) // 2 + n)] += damper * m[k] * m[n]
    sums[qd.static(4 if dim == 2 else 9)] += damper * (along * c.inverse_h) ** 2
    for axis in qd.static(range(2 if dim == 2 else 0, 3)):
        k, n = qd.static((axis + 1) % 3, (axis + 2) % 3)
        sums[qd.static(axis if dim == 3 else 0)] += damper * (m[k] * dv[n] - m[n] * dv[k])


@qd.func
def trace_of(sums):
    """sum_j D m^2 of a particle's sums."""
    dim = qd.static(2 if sums.n == 5 else 3)
    trace = 0.0
    for k in qd.static(range(dim)):
        trace += sums[qd.static((1 if dim == 2 else 3) + dim * k - k * (k - 1) // 2)]
    return trace


@qd.func
def angular_velocity(sums, gate):
    """Angular velocity [rad/s] of the fluid around a particle by its `sums`; 0 where it is sheared, not turned.

    It is reduced by `gate`, which is RIGID / SHEARED, times the strain over the squared angular velocity.
    """
    omega = vec3(0.0, 0.0, 0.0)
    dim = qd.static(2 if sums.n == 5 else 3)
    trace = trace_of(sums)
    if trace > 0.0:
        share = sums / trace
        if qd.static(dim == 2):
            omega[2] = share[0]
        else:
            inertia = qd.Matrix.zero(qd.f32, 3, 3)
            for k in qd.static(range(3)):
                for n in qd.static(range(k, 3)):
                    inertia[k, n] = -share[qd.static(3 + 3 * k - k * (k + 1) // 2 + n)]
                    inertia[n, k] = inertia[k, n]
                inertia[k, k] += 1.0001  # neighbours on a line do not tell how it turns about itself
            omega = inertia.inverse() @ vec3(share[0], share[1], share[2])
        strain = share[qd.static(4 if dim == 2 else 9)] / qd.max(omega.norm_sqr(), 1e-20)
        omega *= qd.max(0.0, 1.0 - gate * strain)
    return omega


@qd.kernel(fastcache=True)
def rotate_guess(
    particles: Particles,
    velocities: qd.types.ndarray(),
    dampers: qd.types.ndarray(),
    grid: Grid,
    c: Coefficients,
    gate: qd.f32,
    forget: qd.f32,
    full: qd.f32,
    count: qd.i32,
):
    """Turn what viscosity did in the last step with the `velocities` that particles have moved with since.

    Behind those stand the viscosities. Whoever has less than half of the `full` sum of weights of neighbours forgets.
    """
    for chunk in range(chunks(grid, count)):
        for cluster in range(first_cluster(chunk, grid, count), end_cluster(chunk, grid, count)):
            sums = qd.Matrix.zero(qd.f32, qd.static(5 if particles.v[cluster].n == 2 else 10), grid.lanes)
            add_kept(sums, add_rotation, cluster, particles, velocities, dampers, grid, c, 0)
            for i in range(cluster * grid.lanes, end_of(cluster, grid, count)):
                turned = particles.viscous[i]
                own = lift(turned)
                a = vec3(own.x, own.y, own.z)
                found = column(sums, i - cluster * grid.lanes)
                half = 0.5 * c.dt * angular_velocity(found, gate)
                a += 2.0 / (1.0 + half.norm_sqr()) * half.cross(a + half.cross(a))
                a *= qd.min(1.0, 2.0 * trace_of(found) / qd.max(velocities[i][3] * full, 1e-20))
                for k in qd.static(range(turned.n)):
                    turned[k] = a[k] / (1.0 + forget * half.norm())
                particles.viscous[i] = turned

"""Vorticity confinement: a force that gives back the rotation which the solver damps.

Macklin and Müller 2013; Eq. 9 and 10 of the report. In a 2-D world the vorticity points along z.

    code     symbol        meaning                                                    unit
    omega    omega_i       vorticity                                                  1/s
    eta      grad |omega|  gradient of its size                                       1/(m s)
    share    s             how far a particle turns as its neighbours do              1

Where we differ, and why: N has length one even where eta is noise, so that Eq. 10 stirs water at rest. Noise differs
from particle to particle, a vortex does not: |sum w omega_j| / sum w |omega_j| is 1 in a vortex and about 1 / sqrt(n)
for n neighbours that turn at random. Below `vorticity_coherence` of it there is no force, nor where the water turns
slower than the smallest waves do (`CALM` in coefficients.py); a coherence of 0 leaves Eq. 10 as it is. The vorticity
itself, Eq. 9, is summed in the sweep of XSPH (`xsph_viscosity.py`).
"""

from wavetank.device.compiler import qd
from wavetank.device.state import Coefficients, Grid, Particles, Temporaries
from wavetank.foundation.params import Parameters
from wavetank.physics.clusters import chunks, end_cluster, first_cluster
from wavetank.physics.pairs import add_neighbors, column
from wavetank.physics.plan import Plan
from wavetank.physics.smoothing import kernel
from wavetank.physics.terms.term import Hook, Term
from wavetank.physics.world import World
from wavetank.solids.distance import lift, vec3


@qd.func
def add_eta(sums: qd.template(), r, square, a, b, c: Coefficients, method: qd.template()):
    """Add neighbour j to (grad |omega|, sum_j w omega_j, sum_j w |omega_j|)."""
    w = kernel(method, square * c.inverse_h2)
    size = b.norm()
    slope = lift(r) * ((size - a.norm()) * c.gradient_scale * w[1])
    for k in qd.static(range(3)):
        sums[k] += slope[k]
        sums[3 + k] += w[0] * b[k]
    sums[6] += w[0] * size


@qd.kernel(fastcache=True)
def confine_vorticity(
    particles: Particles, temporaries: Temporaries, grid: Grid, c: Coefficients, count: qd.i32, method: qd.template()
):
    """Push around every vortex: dv = dt eps_w s (N x omega), N = eta / |eta| (Eq. 10)."""
    for chunk in range(chunks(grid, count)):
        for cluster in range(first_cluster(chunk, grid, count), end_cluster(chunk, grid, count)):
            first = cluster * grid.lanes
            last = qd.min(first + grid.lanes, count)
            fastest = 0.0
            for i in range(first, last):
                fastest = qd.max(fastest, temporaries.omega[i].norm())
            # Calm water, most of a tank, is not asked for its neighbours.
            if c.coherence <= 0.0 or fastest > c.calm:
                sums = qd.Matrix.zero(qd.f32, 7, grid.lanes)
                add_neighbors(sums, add_eta, cluster, particles, temporaries.omega, grid, c, method)
                for i in range(first, last):
                    sum = column(sums, i - first)
                    omega = temporaries.omega[i]
                    for k in qd.static(range(3)):  # without itself
                        sum[3 + k] -= kernel(method, 0.0)[0] * omega[k]
                    sum[6] -= kernel(method, 0.0)[0] * omega.norm()
                    eta = vec3(sum[0], sum[1], sum[2])
                    n = eta / qd.max(eta.norm(), 1e-6)
                    mean = vec3(sum[3], sum[4], sum[5])
                    agreement = mean.norm() / qd.max(sum[6], 1e-12)
                    if mean.dot(omega) < 0.0:
                        agreement = 0.0
                    share = 1.0
                    if c.coherence > 0.0:
                        share = qd.min(qd.max((agreement - c.coherence) / qd.max(1.0 - c.coherence, 1e-3), 0.0), 1.0)
                        share *= qd.min(qd.max(omega.norm() / qd.max(c.calm, 1e-9) - 1.0, 0.0), 1.0)
                    force = share * n.cross(omega)
                    v = particles.v[i]
                    for k in qd.static(range(v.n)):
                        v[k] += c.dt * c.vorticity * force[k]
                    particles.v[i] = v


def apply_confinement(world: World, plan: Plan, params: Parameters, c: Coefficients) -> None:
    """Push around vortices by the vorticity that the sweep of XSPH has found."""
    confine_vorticity(world.particles, world.temporaries, world.grid, c, world.count, plan.method)


VORTICITY = Term(
    "vorticity confinement", Hook.VELOCITIES, apply_confinement, lambda plan: bool(plan.confines_vorticity)
)

"""Vorticity confinement: a force that gives back the rotation which the solver damps.

Macklin and Müller 2013; Eq. 9 and 10 of the report. In a 2-D world the vorticity points along z.

    code     symbol        meaning                                                    unit
    omega    omega_i       vorticity                                                  1/s
    eta      grad |omega|  gradient of its size                                       1/(m s)
"""

from wavetank.compiler import qd
from wavetank.distance import lift, vec3
from wavetank.physics.neighbors import for_each_neighbor
from wavetank.physics.smoothing import kernel
from wavetank.state import Coefficients, Grid, Particles, Scratch


@qd.func
def gradient(r, c: Coefficients, method: qd.template()):
    """V grad_i W(r), as a vector in space [1/m]."""
    length = r.norm()
    return lift(r) * (c.gradient_scale * kernel(method, length / c.h)[1] / qd.max(length, 1e-12))


@qd.func
def add_vorticity(sums: qd.template(), r, i, j, v: qd.template(), c: Coefficients, method: qd.template()):
    """Add neighbour j to omega_i (Eq. 9); v_ij = v_j - v_i, and grad_j W = -grad_i W."""
    sums += lift(v[j] - v[i]).cross(-gradient(r, c, method))


@qd.func
def add_eta(sums: qd.template(), r, i, j, omega: qd.template(), c: Coefficients, method: qd.template()):
    """Add neighbour j to grad |omega|."""
    sums += (omega[j].norm() - omega[i].norm()) * gradient(r, c, method)


@qd.kernel(fastcache=True)
def find_vorticity(
    scratch: Scratch, particles: Particles, grid: Grid, c: Coefficients, count: qd.i32, method: qd.template()
):
    """Estimate the vorticity of every particle (Eq. 9)."""
    for i in range(count):
        omega = vec3(0.0, 0.0, 0.0)
        for_each_neighbor(omega, add_vorticity, i, particles.p, particles.v, grid, c, method)
        scratch.omega[i] = omega


@qd.kernel(fastcache=True)
def confine_vorticity(
    particles: Particles, scratch: Scratch, grid: Grid, c: Coefficients, count: qd.i32, method: qd.template()
):
    """Push around every vortex: dv = dt eps_w (N x omega), N = eta / |eta| (Eq. 10)."""
    for i in range(count):
        eta = vec3(0.0, 0.0, 0.0)
        for_each_neighbor(eta, add_eta, i, particles.p, scratch.omega, grid, c, method)
        n = eta / qd.max(eta.norm(), 1e-6)
        force = n.cross(scratch.omega[i])
        v = particles.v[i]
        for k in qd.static(range(v.n)):
            v[k] += c.dt * c.vorticity * force[k]
        particles.v[i] = v

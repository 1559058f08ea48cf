"""The two ends of a position-based step: predict positions, and read velocities off the corrected ones."""

from wavetank.compiler import qd
from wavetank.distance import SolidSet
from wavetank.physics.boundary import keep_out, mark_near
from wavetank.state import Coefficients, Particles


@qd.kernel(fastcache=True)
def predict(
    particles: Particles, solids: SolidSet, c: Coefficients, count: qd.i32, gravity: qd.types.vector(3, qd.f32)
):
    """Accelerate and move freely, up to the first wall: Algorithm 1, lines 2-3."""
    for i in range(count):
        x = particles.x[i]
        v = particles.v[i]
        for k in qd.static(range(x.n)):
            v[k] += c.dt * gravity[k]
        p = x + c.dt * v
        particles.v[i] = v
        particles.p[i] = keep_out(x, p, mark_near(x, p, solids, c), solids, c)


@qd.kernel(fastcache=True)
def update_velocities(particles: Particles, c: Coefficients, count: qd.i32):
    """Set v = (p - x) / dt: Algorithm 1, line 21."""
    for i in range(count):
        particles.v[i] = (particles.p[i] - particles.x[i]) / c.dt


@qd.kernel(fastcache=True)
def accept_positions(particles: Particles, count: qd.i32):
    """Set x = p: Algorithm 1, line 23."""
    for i in range(count):
        particles.x[i] = particles.p[i]


@qd.kernel(fastcache=True)
def forget_predictions(particles: Particles, count: qd.i32):
    """Set p = x, to measure the particles where they are."""
    for i in range(count):
        particles.p[i] = particles.x[i]

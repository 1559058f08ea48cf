"""Predicted positions: read and written by component.

Their components have arrays of their own, unlike those of other vectors: every pass over pairs reads them, and a
processor that computes eight neighbours at a time reads plain numbers faster than vectors
(notebook/performance.md).
"""

from wavetank.device.compiler import qd
from wavetank.device.periods import nearest_image
from wavetank.device.state import Grid, Particles


@qd.func
def predicted(particles: Particles, i):
    """Predicted position of particle `i`."""
    p = particles.x[i]
    p[0] = particles.px[i]
    p[1] = particles.py[i]
    if qd.static(p.n == 3):
        p[2] = particles.pz[i]
    return p


@qd.func
def apart(particles: Particles, i, j, grid: Grid):
    """Vector r = p_i - p_j [m] from particle `j` to `i`, of their nearest images."""
    return nearest_image(predicted(particles, i) - predicted(particles, j), grid.periods)


@qd.func
def predict_at(particles: Particles, i, p: qd.template()):
    """Write the predicted position of particle `i`."""
    particles.px[i] = p[0]
    particles.py[i] = p[1]
    if qd.static(p.n == 3):
        particles.pz[i] = p[2]

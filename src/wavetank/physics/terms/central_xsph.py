"""XSPH viscosity in the open, where nothing outside holds the water: one that leaves angular momentum alone.

Without a tank water flies, turns and collides freely, and its angular momentum should stay. Two things changed it, and
each pair of neighbours makes up for both here, so that a drop keeps it to some 0.1 % where it lost 0.5 to 1.5 %
(`validate momentum`; notebook/solver.md has the figures, and why tanks keep Eq. 11 as it is):

- Eq. 11 draws velocities together along their difference, which is a torque where water turns. Here they are drawn
  together along the line between the particles, as artificial viscosity does (Monaghan 1992,
  10.1146/annurev.aa.30.090192.002551), dim times as much, so that it is as strong on average.
- The constraint displaces a pair by s along its line as it is at the end of the step; momentum asks for the line at its
  start. A pair that turns feels the torque s v_t. The friction (s / r) v_t takes it back, to first order in the step.

The same goes for the size of the push: at the end of a step it takes energy, at its start it gives some, so half of the
way back is made up for as well. With the friction alone two drops kept 73 % of their energy, with all of the way back
87 %, with half of it 80 %, what they keep by Eq. 11.

    code     symbol    meaning                                                        unit
    packed             velocity and, behind it, lambda_i                              m/s, m^2
    v_n      v_n       velocity of j past i along the line                            m/s
    push     s / r     displacement that the constraint gives the pair, over r        1
    slope    -ds/dr    how it falls with the distance: with Spiky s 2 / (h - r)       1
"""

from wavetank.device.compiler import qd
from wavetank.device.state import Coefficients, Grid, Particles
from wavetank.physics.clusters import chunks, end_cluster, end_of, first_cluster
from wavetank.physics.pairs import add_neighbors, column
from wavetank.physics.smoothing import kernel
from wavetank.physics.terms.xsph_viscosity import share_of_pair


@qd.func
def most():
    """Largest share of a difference of velocities that a pair makes up for: beyond, a step would turn it round."""
    return 0.5


@qd.func
def add_central_xsph(sums: qd.template(), r, square, a, b, c: Coefficients, method: qd.template()):
    """Add neighbour j to what velocities along the line, and the pushes of the step, change in v_i."""
    w = kernel(method, square * c.inverse_h2)
    dv = 0.0 * r
    v_n = 0.0
    for k in qd.static(range(r.n)):
        dv[k] = b[k] - a[k]
        v_n += dv[k] * r[k]
    share = r.n * share_of_pair(dv, c) * w[0] * c.density_scale
    push = qd.max(-most(), qd.min(most(), (a[3] + b[3]) * c.gradient_scale * w[1]))
    slope = 0.0
    if qd.static(method == 0):  # Spiky; with others that part is left out, which is of energy only
        q = qd.sqrt(square) * c.inverse_h
        slope = qd.max(-most(), qd.min(most(), 2.0 * push * q / qd.max(1.0 - q, 0.05)))
    along = (share - push - 0.5 * slope) * v_n / qd.max(square, 1e-20)
    for k in qd.static(range(r.n)):
        sums[k] += along * r[k] + push * dv[k]


@qd.kernel(fastcache=True)
def apply_central_xsph(
    smoothed: Particles,
    particles: Particles,
    packed: qd.types.ndarray(),
    grid: Grid,
    c: Coefficients,
    count: qd.i32,
    method: qd.template(),
):
    """Smooth the velocities along the lines between neighbours, and make up for the torque of the constraint."""
    for chunk in range(chunks(grid, count)):
        for cluster in range(first_cluster(chunk, grid, count), end_cluster(chunk, grid, count)):
            sums = qd.Matrix.zero(qd.f32, particles.v[cluster].n, grid.lanes)
            add_neighbors(sums, add_central_xsph, cluster, particles, packed, grid, c, method)
            for i in range(cluster * grid.lanes, end_of(cluster, grid, count)):
                smoothed.v[i] = particles.v[i] + column(sums, i - cluster * grid.lanes)

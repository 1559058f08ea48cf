"""The density that solids add: walls, obstacles and bodies fill the support of the particles next to them.

A wall at the signed distance s adds I(s) to the relative density, the sum over half a rest lattice that ends there
(`smoothing.half_space`). Several walls leave the share prod_k (1 - I_k) of the support to the water, which is exact
for walls at right angles and a separable kernel, and never counts a corner twice.

    code       symbol       meaning                                                          unit
    s          s            signed distance to a solid, negative inside                      m
    n          grad s       its outward normal                                               1
    share      I(s)         part of rho_0 that the wall contributes                          1
    free       prod(1 - I)  part of the support that is left to the water                    1

Walls as densities: Koschier and Bender 2017, "Density Maps" (10.1145/3099564.3099565); where we differ: a flat wall is
assumed, so that a table of one variable replaces a volume grid for each solid.
"""

from wavetank.device.compiler import qd
from wavetank.device.state import Coefficients, Walls
from wavetank.physics.broad_phase import next_marked
from wavetank.solids.distance import SolidSet, lift, signed_distance, vec3, vec4


@qd.func
def wall_share(walls: Walls, s, h):
    """Pair (I, A): share of rho_0 that a wall at the distance s contributes, and -h dI/ds."""
    last = walls.table.shape[0] - 1
    t = qd.min(qd.max(0.5 * (s / h + 1.0), 0.0), 1.0) * last
    k = qd.min(qd.cast(t, qd.i32), last - 1)
    f = t - k
    return walls.table[k] * (1.0 - f) + walls.table[k + 1] * f


@qd.func
def add_wall(sums: qd.template(), lane, value, walls: Walls, c: Coefficients):
    """Add a solid, (gradient, distance) as `value`, to a lane's (gradient [1/m], share of the support that is free).

    Where it is out of reach the table is zero to the last digit.
    """
    share = wall_share(walls, value.w, c.h) * c.wall_density
    push = sums[3, lane] * share[1] * c.inverse_h
    for k in qd.static(range(3)):
        sums[k, lane] = sums[k, lane] * (1.0 - share[0]) - value[k] * push
    sums[3, lane] *= 1.0 - share[0]


@qd.func
def add_solids(
    sums: qd.template(), lane, p: qd.template(), near, behind, solids: SolidSet, walls: Walls, c: Coefficients
):
    """Add the marked solids behind number `behind`, as `add_wall` does, at the place `p` of a lane."""
    k = next_marked(near, behind, solids)
    while k < solids.count:
        add_wall(sums, lane, signed_distance(solids, k, lift(p)), walls, c)
        k = next_marked(near, k, solids)


@qd.func
def fall(c: Coefficients):
    """Way [m] that all particles have fallen alike, which does not count."""
    return vec3(c.gravity_x, c.gravity_y, c.gravity_z) * c.fallen


@qd.func
def wall_density(x: qd.template(), near, solids: SolidSet, walls: Walls, c: Coefficients):
    """(gradient [1/m], relative density) that the marked solids add at `x`."""
    sums = qd.Matrix([[0.0], [0.0], [0.0], [1.0]])
    add_solids(sums, 0, x, near, -1, solids, walls, c)
    return vec4(sums[0, 0], sums[1, 0], sums[2, 0], 1.0 - sums[3, 0])

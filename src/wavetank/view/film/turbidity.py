"""Fluids that scatter: cloudy ones are participating media, opaque ones matte surfaces.

Scattering is isotropic. The single-scattering albedo follows from the fluid's colour, which is the diffuse reflectance
of an infinite depth of it under a surface that reflects part of the light back (J. Saunderson, "Calculation of the
color of pigmented plastics", J. Opt. Soc. Am. 32 (1942), with the means of Fresnel's equations for n = 1.33), by the
inverse of M. Chiang et al., "Practical and controllable subsurface scattering for production path tracing" (SIGGRAPH
2016 talks). Where the mean free path is shorter than a particle spacing, which cells do not resolve, a fluid counts as
matte.

    code         symbol    meaning                                                             unit
    turbidity    sigma_t   extinction coefficient: scattering and what is absorbed by it       1/m
    color        C         linear colour of the fluid                                          1
    albedo       alpha     single-scattering albedo, per colour                                1
"""

from wavetank.device.compiler import qd
from wavetank.view.film.grid import Grid, downhill
from wavetank.view.lens import vec3, vec4


@qd.func
def turbidity_at(turbidity: qd.template(), grid: Grid, x):
    """(colour times turbidity, turbidity [1/m]) at a point, between the eight cells around it."""
    mx, my, mz = grid.nx // 2, grid.ny // 2, grid.nz // 2
    q = (x - grid.lower) / (2.0 * grid.step) - 0.5
    q = qd.max(qd.min(q, vec3(mx - 1.001, my - 1.001, mz - 1.001)), 0.0)
    i, j, k = qd.cast(q.x, qd.i32), qd.cast(q.y, qd.i32), qd.cast(q.z, qd.i32)
    u, v, w = q.x - i, q.y - j, q.z - k
    total = vec4(0.0, 0.0, 0.0, 0.0)
    for m in range(8):
        share = qd.select(m % 2 == 1, u, 1.0 - u) * qd.select(m // 2 % 2 == 1, v, 1.0 - v)
        share *= qd.select(m // 4 == 1, w, 1.0 - w)
        at = qd.min(i + m % 2, mx - 1) + mx * (qd.min(j + m // 2 % 2, my - 1) + my * (k + m // 4))
        total += share * turbidity[at]
    return total


@qd.func
def color_of(here):
    """Colour of a fluid where `turbidity_at` is `here`."""
    return qd.min(vec3(here[0], here[1], here[2]) / qd.max(here[3], 1e-6), 1.0)


@qd.func
def is_opaque(here, grid: Grid):
    """1 where the mean free path is shorter than a spacing."""
    return qd.select(here[3] * grid.spacing > 1.0, 1, 0)


@qd.func
def albedo_of(color):
    """Single-scattering albedo of a fluid whose infinite depth has that colour, per colour."""
    # 0.066 and 0.472: share of diffuse light that the surface reflects from outside and from inside
    bare = color / ((1.0 - 0.472) * (1.0 - 0.066) + 0.472 * color)
    return 1.0 - qd.exp(bare * (-5.09406 + bare * (2.61188 - 4.31805 * bare)))


@qd.func
def extinction_at(turbidity: qd.template(), grid: Grid, x):
    """The turbidity [1/m] at a point."""
    return turbidity_at(turbidity, grid, x)[3]


@qd.func
def towards_clear(turbidity: qd.template(), grid: Grid, x):
    """Unit vector to where there is less turbidity; zero where it is the same all around."""
    return downhill(extinction_at, turbidity, grid, x, 2.0)

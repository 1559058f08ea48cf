"""Fluids that scatter: cloudy ones are volumes in which light walks about, opaque ones are painted surfaces.

Light is scattered the same to all sides, and what it loses each time follows from the colour: that which an endless
depth of the fluid shows under even light, behind a surface that mirrors part of it back (J. Saunderson, "Calculation of
the color of pigmented plastics", J. Opt. Soc. Am. 32 (1942), with the means of Fresnel's equations for n = 1.33). The
albedo for that is by the inverse of M. Chiang et al., "Practical and controllable subsurface scattering for production
path tracing" (SIGGRAPH 2016 talks). Where the way between two events is shorter than a spacing, no cell of the water
would tell what happens in it, and a fluid counts as matte.

    code      symbol   meaning                                                            unit
    murk      sigma_t  scattering and what it loses, per length                           1/m
    color     C        linear colour of the fluid                                         1
    albedo    alpha    share of the light that goes on when it is scattered, per colour   1
"""

from wavetank.device.compiler import qd
from wavetank.view.film.grid import Grid, downhill
from wavetank.view.lens import vec3, vec4


@qd.func
def murk_at(murk: qd.template(), grid: Grid, x):
    """(colour times murk, murk [1/m]) at a point, between the eight cells around it."""
    mx, my, mz = grid.nx // 2, grid.ny // 2, grid.nz // 2
    q = (x - grid.lower) / (2.0 * grid.step) - 0.5
    q = qd.max(qd.min(q, vec3(mx - 1.001, my - 1.001, mz - 1.001)), 0.0)
    i, j, k = qd.cast(q.x, qd.i32), qd.cast(q.y, qd.i32), qd.cast(q.z, qd.i32)
    u, v, w = q.x - i, q.y - j, q.z - k
    total = vec4(0.0, 0.0, 0.0, 0.0)
    for m in range(8):
        share = qd.select(m % 2 == 1, u, 1.0 - u) * qd.select(m // 2 % 2 == 1, v, 1.0 - v)
        share *= qd.select(m // 4 == 1, w, 1.0 - w)
        total += share * murk[qd.min(i + m % 2, mx - 1) + mx * (qd.min(j + m // 2 % 2, my - 1) + my * (k + m // 4))]
    return total


@qd.func
def color_of(here):
    """Colour of a fluid where `murk_at` is `here`."""
    return qd.min(vec3(here[0], here[1], here[2]) / qd.max(here[3], 1e-6), 1.0)


@qd.func
def is_matte(here, grid: Grid):
    """1 where light is scattered again within a spacing."""
    return qd.select(here[3] * grid.spacing > 1.0, 1, 0)


@qd.func
def albedo_of(color):
    """Share of the light that goes on when it is scattered in an endless depth of that colour, per colour."""
    # 0.066 and 0.472: what the surface mirrors of even light from without and from within
    bare = color / ((1.0 - 0.472) * (1.0 - 0.066) + 0.472 * color)
    return 1.0 - qd.exp(bare * (-5.09406 + bare * (2.61188 - 4.31805 * bare)))


@qd.func
def murk_alone(murk: qd.template(), grid: Grid, x):
    """The murk [1/m] at a point."""
    return murk_at(murk, grid, x)[3]


@qd.func
def thinning(murk: qd.template(), grid: Grid, x):
    """Unit vector to where there is less murk; nought where it is the same all around."""
    return downhill(murk_alone, murk, grid, x, 2.0)


@qd.func
def any_way(u):
    """A direction, each as probable as any other."""
    up, turn = 1.0 - 2.0 * u.x, 6.283185307 * u.y
    flat = qd.sqrt(qd.max(1.0 - up * up, 0.0))
    return vec3(flat * qd.cos(turn), up, flat * qd.sin(turn))

"""Dye: the colour of a particle, and what dyed water does to light."""

from wavetank.device.compiler import qd
from wavetank.view.lens import vec3, vec4
from wavetank.view.optics.bilinear import corners, share_of


@qd.func
def dyed(clear_color, dye):
    """The linear colour of a particle with that dye: strength << 24 | red << 16 | green << 8 | blue, in sRGB."""
    color = clear_color
    if dye != 0:
        own = vec3((dye >> 16) & 255, (dye >> 8) & 255, dye & 255) / 255.0
        color += (own**2.2 - color) * (((dye >> 24) & 127) / 127.0)
    return color


ICE = 127 << 24 | 0xEAF4FB  # what ice is dyed with


@qd.kernel(fastcache=True)
def write_ice(
    own: qd.types.ndarray(), frozen: qd.types.ndarray(), seen: qd.types.ndarray(), ice: qd.i32, count: qd.i32
):
    """Write what is seen, dyes or materials: ice is `ice`, whatever its water was."""
    for i in range(count):
        seen[i] = qd.select(frozen[i] == 1, ice, own[i])


@qd.func
def dye_at(dye: qd.template(), place):
    """(dyed part of the thickness [steps], mean linear colour) at a place in texels, between the four nearest."""
    r, c, r1, c1, v, u = corners(place, dye.shape[0], dye.shape[1], 1.001)
    total = vec4(0.0, 0.0, 0.0, 0.0)
    for k in range(4):
        i, j = qd.select(k // 2 == 1, r1, r), qd.select(k % 2 == 1, c1, c)
        total += share_of(k, v, u) * vec4(dye[i, j, 0], dye[i, j, 1], dye[i, j, 2], dye[i, j, 3])
    part = qd.max(total[0], 1e-6)
    return vec4(total[0], total[1] / part, total[2] / part, total[3] / part)


@qd.func
def dye_in(dye: qd.template(), place, tau):
    """(share of water `tau` [steps] thick that is dyed, linear colour of its dye) at a place in texels."""
    found = dye_at(dye, place)
    color = qd.min(qd.max(vec3(found[1], found[2], found[3]), 0.02), 0.98)
    return vec4(qd.min(found[0] / tau, 1.0), color.x, color.y, color.z)


@qd.func
def swallowed_by(dye, absorption, usual):
    """What water absorbs [1/m] where `dye_in` tells its dye: what the colour lacks.

    Strong dye shows in a layer thinner than is `usual` [m].
    """
    return absorption + dye[0] * (-qd.log(vec3(dye[1], dye[2], dye[3])) * (2.5 / usual) - absorption)

"""What a direction and a surface shine with, in the light of a `Look`."""

from wavetank.device.compiler import qd
from wavetank.view.lens import vec3
from wavetank.view.look import Look


@qd.func
def smoothstep(share):
    """Ease from 0 to 1."""
    within = qd.min(qd.max(share, 0.0), 1.0)
    return within * within * (3.0 - 2.0 * within)


@qd.func
def background(look: Look, direction):
    """Radiance of the empty studio, or of the open sky, in a unit direction."""
    result = look.horizon + (look.zenith - look.horizon) * smoothstep(direction.y * 1.6 + 0.08)
    if look.outdoors == 1:
        result = sky(look, direction)
    return result


@qd.func
def sky(look: Look, direction):
    """Radiance of the sky but for the sun itself: the functions of `sky.terms`; it goes on below the horizon."""
    u = 1.0 - qd.min(qd.max(direction.y, 0.0), 1.0)
    near = 0.5 + 0.5 * direction.dot(look.to_sun)
    low, near = u * u, near * near
    haze, glow = low * low, near * near
    haze, glow = haze * haze, glow * glow
    glare = glow * glow
    glare = glare * glare
    result = look.sky_even + low * look.sky_low + haze * (look.sky_haze + near * look.sky_near_haze)
    return qd.max(result + near * look.sky_near + glow * look.sky_glow + glare * glare * look.sky_glare, 0.0)


@qd.func
def sun_disc(look: Look, direction):
    """Radiance of the sun itself in a unit direction, with a soft edge: wider than it is, as a lens sees it."""
    return (30.0 * look.outdoors * smoothstep((direction.dot(look.to_sun) - 0.9992) / 0.0004)) * look.sun


@qd.func
def surface_radiance(look: Look, albedo, n, seen, share, wrap, gloss):
    """Radiance of a matte surface with a soft highlight, in the sun, the sky and the light from the floor.

    `share` holds the shares of the sun and of the sky that arrive.
    """
    lit = qd.max((n.dot(look.to_sun) + wrap) / (1.0 + wrap), 0.0) * share.x
    ambient = (look.ground + (look.sky - look.ground) * (0.5 + 0.5 * n.y)) * share.y
    result = albedo * (look.sun * lit + ambient)
    if gloss > 0.0:
        half = (look.to_sun + seen).normalized(1e-9)
        result += gloss * share.x * qd.max(n.dot(half), 0.0) ** 40 * look.sun
        result += 0.3 * gloss * share.y * (1.0 - qd.max(n.dot(seen), 0.0)) ** 4 * look.horizon
    return result


@qd.func
def environment(look: Look, direction):
    """Radiance that the water mirrors: the sky, and below the horizon the ground as it is lit."""
    result = background(look, direction)
    if direction.y < 0.0:
        result += smoothstep(-3.0 * direction.y) * (look.below - result)
    return result


@qd.func
def glint(look: Look, cosine, rough):
    """Radiance of the sun's image in the water, by the cosine of the angle that it is missed by.

    `rough` is the variance of the normals that share it: they widen it and take from its height as much (M. Toksvig,
    "Mipmapping normal maps", 2005).
    """
    result = vec3(0.0, 0.0, 0.0)
    if cosine > 0.9:
        wide = 1.0 / (1.0 + 600.0 * rough)
        near = qd.min(20.0 * (cosine - 0.9), 1.0)
        result = (near * qd.min(cosine, 1.0) ** (600.0 * wide) * wide * look.sparkle) * look.sun
    return result

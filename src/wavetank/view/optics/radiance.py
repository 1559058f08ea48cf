"""What a direction and a surface shine with, in the light of a `Look`."""

from wavetank.device.compiler import qd
from wavetank.view.look import Look


@qd.func
def smoothstep(share):
    """Ease from 0 to 1."""
    within = qd.min(qd.max(share, 0.0), 1.0)
    return within * within * (3.0 - 2.0 * within)


@qd.func
def background(look: Look, direction):
    """Radiance of the empty studio in a unit direction."""
    return look.horizon + (look.zenith - look.horizon) * smoothstep(direction.y * 1.6 + 0.08)


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
    """Radiance that the water mirrors: the studio, its ground and its lamps."""
    result = background(look, direction)
    if direction.y < 0.05:
        share = smoothstep((0.05 - direction.y) / 0.25)
        result += share * (look.floor * look.ground * 1.4 - result)
    else:
        # A wide soft lamp overhead, towards the sun: broad streaks of light on every wave.
        u = direction.x / (direction.y + 0.15)
        v = direction.z / (direction.y + 0.15)
        a = smoothstep((0.75 - qd.abs(u + 0.55)) / 0.18) * smoothstep((1.6 - qd.abs(v + 0.3)) / 0.25)
        b = smoothstep((0.22 - qd.abs(u - 0.9)) / 0.12) * smoothstep((1.8 - qd.abs(v)) / 0.3)
        result += look.lamp * (a + 0.6 * b)
    return result


@qd.func
def glint(look: Look, cosine):
    """Radiance of the sun's image in the water, by the cosine of the angle that it is missed by."""
    return qd.min(qd.max(cosine, 0.0), 1.0) ** 600 * look.sparkle * look.sun

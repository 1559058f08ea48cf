"""Light: turns albedo into radiance, and fills what is empty with the background.

code      symbol   meaning                                                 unit
n                  normal of the surface                                   1
seen               direction from the surface to the eye                   1
lit                share of the sun that arrives, its angle included       1
far                share of the background in what is far away             1
"""

from wavetank.device.compiler import qd
from wavetank.view.buffers import Buffers
from wavetank.view.lens import Lens, ray_direction, ray_origin, vec3, vector, view_ray
from wavetank.view.look import Look
from wavetank.view.shot import Shot


def draw(shot: Shot, buffers: Buffers) -> None:
    """Turn `color` into radiance."""
    middle = shot.extent.middle
    light(
        shot.lens, shot.look, vector(middle[0], 0.0, middle[2]), shot.extent.radius, buffers.depth,
        buffers.surface, buffers.normal, buffers.light, buffers.color,
    )  # fmt: skip


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


@qd.kernel(fastcache=True)
def light(
    lens: Lens, look: Look, middle: vec3, size: qd.f32, depth: qd.types.ndarray(), surface: qd.types.ndarray(),
    normal: qd.types.ndarray(), light_share: qd.types.ndarray(), color: qd.types.ndarray(),
):  # fmt: skip
    """Shade every pixel; floor and solids fade into the background far away from the world's `middle`."""
    for row, column in qd.ndrange(depth.shape[0], depth.shape[1]):
        ray = view_ray(lens, row, column)
        direction = ray_direction(lens, ray)
        ahead = direction.normalized()
        what = surface[row, column]
        wrap, gloss, far = look.wrap, look.gloss, 0.0
        if what < 0:  # SOLID or FLOOR; what has no end must not end at a hard horizon
            gloss = qd.select(what == -1, 0.3 * gloss, 0.0)
            wrap = qd.select(what == -1, 0.4 * wrap, 0.0)
            at = ray_origin(lens, ray) + qd.bit_cast(depth[row, column], qd.f32) * direction
            far = smoothstep(((at - middle).norm() / size - 1.5) / 5.0)
        result = vec3(0.0, 0.0, 0.0)
        if what == 0x7FFFFFFF:  # NOTHING
            far = 1.0
        else:
            share = light_share[row, column]
            result = surface_radiance(look, color[row, column], normal[row, column], -ahead, share, wrap, gloss)
        if far > 0.0:
            result += far * (background(look, ahead) - result)
        color[row, column] = result

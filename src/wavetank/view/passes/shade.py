"""Light: turns albedo into radiance, and fills what is empty with the background.

    code      symbol   meaning                                        unit
    n                  normal of the surface
    seen               unit vector from the surface to the eye
    lit                share of the sun that arrives, with the angle
    open_sky           share of the sky that arrives
"""

from wavetank.compiler import qd
from wavetank.view.buffers import Buffers
from wavetank.view.lens import Lens, ray_direction, ray_origin, vec3, view_ray
from wavetank.view.look import Look
from wavetank.view.shot import Shot


def draw(shot: Shot, buffers: Buffers) -> None:
    """Turn `color` into radiance."""
    middle = shot.extent.middle
    light(
        shot.lens, shot.look, vec3(float(middle[0]), 0.0, float(middle[2])), shot.extent.radius, buffers.depth,
        buffers.surface, buffers.normal, buffers.light, buffers.color,
    )  # fmt: skip


@qd.func
def background(look: Look, direction):
    """Radiance of the empty studio in a unit direction."""
    rise = qd.min(qd.max(direction.y * 1.6 + 0.08, 0.0), 1.0)
    return look.horizon + (look.zenith - look.horizon) * (rise * rise * (3.0 - 2.0 * rise))


@qd.func
def surface_radiance(look: Look, albedo, n, seen, sun_share, sky_share, wrap, gloss):
    """Radiance of a matte surface with a soft highlight, in the sun, the sky and the light from the floor."""
    facing = n.dot(look.to_sun)
    lit = qd.max((facing + wrap) / (1.0 + wrap), 0.0) * sun_share
    up = 0.5 + 0.5 * n.y
    ambient = (look.ground + (look.sky - look.ground) * up) * sky_share
    half = (look.to_sun + seen).normalized(1e-9)
    highlight = gloss * qd.max(n.dot(half), 0.0) ** 40 * sun_share
    rim = gloss * (1.0 - qd.max(n.dot(seen), 0.0)) ** 4 * sky_share
    return albedo * (look.sun * lit + ambient) + highlight * look.sun + rim * look.horizon


@qd.kernel(fastcache=True)
def light(
    lens: Lens, look: Look, middle: vec3, size: qd.f32, depth: qd.types.ndarray(), surface: qd.types.ndarray(),
    normal: qd.types.ndarray(), light_share: qd.types.ndarray(), color: qd.types.ndarray(),
):  # fmt: skip
    """Shade every pixel; the floor fades into the background away from the world's `middle`."""
    for row, column in qd.ndrange(depth.shape[0], depth.shape[1]):
        ray = view_ray(lens, row, column)
        direction = ray_direction(lens, ray)
        ahead = direction.normalized()
        what = surface[row, column]
        result = vec3(0.0, 0.0, 0.0)
        if what == 0x7FFFFFFF:  # NOTHING
            result = background(look, ahead)
        else:
            n = normal[row, column]
            share = light_share[row, column]
            albedo = color[row, column]
            if what == -2:  # FLOOR
                at = ray_origin(lens, ray) + qd.bit_cast(depth[row, column], qd.f32) * direction
                away = qd.min(qd.max(((at - middle).norm() / size - 1.5) / 5.0, 0.0), 1.0)
                ground = surface_radiance(look, albedo, n, -ahead, share.x, share.y, 0.0, 0.0)
                behind = background(look, ahead)
                result = ground + (behind - ground) * (away * away * (3.0 - 2.0 * away))
            elif what == -1:  # SOLID
                result = surface_radiance(look, albedo, n, -ahead, share.x, share.y, 0.0, 0.3 * look.gloss)
            else:
                result = surface_radiance(look, albedo, n, -ahead, share.x, share.y, look.wrap, look.gloss)
        color[row, column] = result

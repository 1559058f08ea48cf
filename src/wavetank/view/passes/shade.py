"""Light: turns albedo into radiance, and fills what is empty with the background.

code      symbol   meaning                                                 unit
n                  normal of the surface                                   1
seen               direction from the surface to the eye                   1
lit                share of the sun that arrives, its angle included       1
far                share of the background in what is far away             1
"""

from wavetank.device.compiler import qd
from wavetank.view.buffers import Buffers, Light, Pixels
from wavetank.view.lens import Lens, ray_direction, ray_origin, vec3, vector, view_ray
from wavetank.view.look import Look
from wavetank.view.optics.radiance import background, smoothstep, surface_radiance
from wavetank.view.shot import Shot


def draw(shot: Shot, buffers: Buffers) -> None:
    """Turn `color` into radiance."""
    middle = shot.extent.middle
    shade(
        buffers.pixels,
        buffers.with_light(),
        shot.lens,
        shot.look,
        vector(middle[0], 0.0, middle[2]),
        shot.extent.radius,
    )


@qd.kernel(fastcache=True)
def shade(pixels: Pixels, light: Light, lens: Lens, look: Look, middle: vec3, size: qd.f32):
    """Shade every pixel; floor and solids fade into the background far away from the world's `middle`."""
    for row, column in qd.ndrange(pixels.depth.shape[0], pixels.depth.shape[1]):
        ray = view_ray(lens, row, column)
        direction = ray_direction(lens, ray)
        ahead = direction.normalized()
        what = pixels.surface[row, column]
        wrap, gloss, far = look.wrap, look.gloss, 0.0
        if what < 0:  # SOLID or FLOOR; what has no end must not end at a hard horizon
            gloss = qd.select(what == -1, 0.3 * gloss, 0.0)
            wrap = qd.select(what == -1, 0.4 * wrap, 0.0)
            at = ray_origin(lens, ray) + qd.bit_cast(pixels.depth[row, column], qd.f32) * direction
            far = smoothstep(((at - middle).norm() / size - 1.5) / 5.0)
        result = vec3(0.0, 0.0, 0.0)
        if what == 0x7FFFFFFF:  # NOTHING
            far = 1.0
        else:
            share = light.share[row, column]
            result = surface_radiance(
                look, pixels.color[row, column], pixels.normal[row, column], -ahead, share, wrap, gloss
            )
        if far > 0.0:
            result += far * (background(look, ahead) - result)
        pixels.color[row, column] = result

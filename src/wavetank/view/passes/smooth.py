"""Averages the 4 x 4 pattern out of the light, along rows and then along columns, without crossing edges."""

from wavetank.device.compiler import qd
from wavetank.view.buffers import Buffers, Light, Pixels
from wavetank.view.lens import Lens, pixels_per_metre
from wavetank.view.shot import Shot
from wavetank.view.strips import Strips, strip, strips_of
from wavetank.view.water_buffers import water_of


def draw(shot: Shot, buffers: Buffers) -> None:
    """Average the light on every pixel in place."""
    smooth_light(shot, buffers, buffers.with_light())


def draw_on_backdrop(shot: Shot, buffers: Buffers) -> None:
    """Average the light on what is not water; in a 2-D world it is even."""
    if shot.frame.dim == 3:
        smooth_light(shot, buffers, water_of(buffers, shot).light)


def smooth_light(shot: Shot, buffers: Buffers, light: Light) -> None:
    """Average `light` in place."""
    strips = strips_of(light.share)
    average(light.rough, light.share, buffers.pixels, strips, shot.lens, shot.radius, 0, 1, light.step)
    average(light.share, light.rough, buffers.pixels, strips, shot.lens, shot.radius, 1, 0, light.step)


@qd.kernel(fastcache=True)
def average(
    result: qd.types.ndarray(),
    light: qd.types.ndarray(),
    pixels: Pixels,
    strips: Strips,
    lens: Lens,
    radius: qd.f32,
    down: qd.i32,
    across: qd.i32,
    step: qd.i32,
):
    """Average over four pixels in one direction, those that lie on the same surface."""
    rows, columns = light.shape[0], light.shape[1]
    for task in range(strips.count):
        own_row, first, last = strip(strips, task, rows, columns)
        for own_column in range(first, last):
            row, column = own_row * step, own_column * step
            what = pixels.surface[row, column]
            if what != 0x7FFFFFFF:  # NOTHING
                t = qd.bit_cast(pixels.depth[row, column], qd.f32)
                # Half a radius apart is another particle; wide surfaces at a slant gain depth from pixel to pixel.
                slack = 0.5 * radius
                if what < 0:
                    slack = 8.0 * step / pixels_per_metre(lens, t)
                total, weight = light[own_row, own_column], 1.0
                for k in qd.static((-2, -1, 1)):
                    r = qd.min(qd.max(own_row + k * down, 0), rows - 1)
                    c = qd.min(qd.max(own_column + k * across, 0), columns - 1)
                    if qd.abs(qd.bit_cast(pixels.depth[r * step, c * step], qd.f32) - t) < slack:
                        total += light[r, c]
                        weight += 1.0
                result[own_row, own_column] = total / weight

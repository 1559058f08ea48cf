"""Averages the 4 x 4 pattern out of the light, along rows and then along columns, without crossing edges."""

from typing import Any

from wavetank.device.compiler import qd
from wavetank.view.buffers import Buffers
from wavetank.view.lens import Lens, pixels_per_metre
from wavetank.view.shot import Shot
from wavetank.view.strips import Strips, strip, strips_of


def draw(shot: Shot, buffers: Buffers) -> None:
    """Average `light` in place; `rough_light` is scratch."""
    even(shot, buffers, buffers.light, buffers.rough_light, 1)


def even(shot: Shot, buffers: Buffers, light: Any, scratch: Any, step: int) -> None:
    """Average `light`, which holds every `step`-th row and column, in place."""
    strips = strips_of(light)
    average(strips, shot.lens, shot.radius, 0, 1, step, buffers.depth, buffers.surface, light, scratch)
    average(strips, shot.lens, shot.radius, 1, 0, step, buffers.depth, buffers.surface, scratch, light)


@qd.kernel(fastcache=True)
def average(
    strips: Strips, lens: Lens, radius: qd.f32, down: qd.i32, across: qd.i32, step: qd.i32, depth: qd.types.ndarray(),
    surface: qd.types.ndarray(), light: qd.types.ndarray(), result: qd.types.ndarray(),
):  # fmt: skip
    """Average over four pixels in one direction, those that lie on the same surface."""
    rows, columns = light.shape[0], light.shape[1]
    for task in range(strips.count):
        own_row, first, last = strip(strips, task, rows, columns)
        for own_column in range(first, last):
            row, column = own_row * step, own_column * step
            what = surface[row, column]
            if what != 0x7FFFFFFF:  # NOTHING
                t = qd.bit_cast(depth[row, column], qd.f32)
                # Half a radius apart is another particle; wide surfaces at a slant gain depth from pixel to pixel.
                slack = 0.5 * radius
                if what < 0:
                    slack = 8.0 * step / pixels_per_metre(lens, t)
                total, weight = light[own_row, own_column], 1.0
                for k in qd.static((-2, -1, 1)):
                    r = qd.min(qd.max(own_row + k * down, 0), rows - 1)
                    c = qd.min(qd.max(own_column + k * across, 0), columns - 1)
                    if qd.abs(qd.bit_cast(depth[r * step, c * step], qd.f32) - t) < slack:
                        total += light[r, c]
                        weight += 1.0
                result[own_row, own_column] = total / weight

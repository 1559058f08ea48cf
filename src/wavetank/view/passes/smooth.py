"""Averages the 4 x 4 pattern out of the light, along rows and then along columns, without crossing edges."""

from wavetank.compiler import qd
from wavetank.view.buffers import Buffers
from wavetank.view.shot import Shot


def draw(shot: Shot, buffers: Buffers) -> None:
    """Average `light` in place; `rough_light` is scratch."""
    step = 0.5 * shot.radius
    average(step, 0, 1, buffers.depth, buffers.surface, buffers.light, buffers.rough_light)
    average(step, 1, 0, buffers.depth, buffers.surface, buffers.rough_light, buffers.light)


@qd.kernel(fastcache=True)
def average(
    step: qd.f32, down: qd.i32, across: qd.i32, depth: qd.types.ndarray(), surface: qd.types.ndarray(),
    light: qd.types.ndarray(), result: qd.types.ndarray(),
):  # fmt: skip
    """Average over four pixels in one direction, those that lie on the same surface."""
    rows, columns = depth.shape[0], depth.shape[1]
    for row, column in qd.ndrange(rows, columns):
        if surface[row, column] != 0x7FFFFFFF:  # NOTHING
            t = qd.bit_cast(depth[row, column], qd.f32)
            # A surface seen at a slant gains depth from pixel to pixel.
            slack = step + 0.02 * t
            total, weight = light[row, column], 1.0
            for k in qd.static((-2, -1, 1)):
                r = qd.min(qd.max(row + k * down, 0), rows - 1)
                c = qd.min(qd.max(column + k * across, 0), columns - 1)
                if qd.abs(qd.bit_cast(depth[r, c], qd.f32) - t) < slack:
                    total += light[r, c]
                    weight += 1.0
            result[row, column] = total / weight

"""Averages the 4 x 4 pattern out of the light, along rows and then along columns, without crossing edges."""

from wavetank.compiler import qd
from wavetank.view.buffers import Buffers
from wavetank.view.lens import Lens, pixels_per_metre
from wavetank.view.shot import Shot


def draw(shot: Shot, buffers: Buffers) -> None:
    """Average `light` in place; `rough_light` is scratch."""
    average(shot.lens, shot.radius, 0, 1, buffers.depth, buffers.surface, buffers.light, buffers.rough_light)
    average(shot.lens, shot.radius, 1, 0, buffers.depth, buffers.surface, buffers.rough_light, buffers.light)


@qd.kernel(fastcache=True)
def average(
    lens: Lens, radius: qd.f32, down: qd.i32, across: qd.i32, depth: qd.types.ndarray(),
    surface: qd.types.ndarray(), light: qd.types.ndarray(), result: qd.types.ndarray(),
):  # fmt: skip
    """Average over four pixels in one direction, those that lie on the same surface."""
    rows, columns = depth.shape[0], depth.shape[1]
    for row, column in qd.ndrange(rows, columns):
        what = surface[row, column]
        if what != 0x7FFFFFFF:  # NOTHING
            t = qd.bit_cast(depth[row, column], qd.f32)
            # Half a radius apart is another particle; wide surfaces at a slant gain depth from pixel to pixel.
            slack = 0.5 * radius
            if what < 0:
                slack = 8.0 / pixels_per_metre(lens, t)
            total, weight = light[row, column], 1.0
            for k in qd.static((-2, -1, 1)):
                r = qd.min(qd.max(row + k * down, 0), rows - 1)
                c = qd.min(qd.max(column + k * across, 0), columns - 1)
                if qd.abs(qd.bit_cast(depth[r, c], qd.f32) - t) < slack:
                    total += light[r, c]
                    weight += 1.0
            result[row, column] = total / weight

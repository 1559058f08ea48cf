"""Ambient occlusion: how much of the sky every visible point sees past its neighbours in the picture.

M. McGuire, B. Osman, M. Bukowski, P. Hennessy, "The Alchemy screen-space ambient obscurance algorithm" (2011), Eq. 10,
with the probes of `probes.py`.

    code      symbol   meaning                                       unit
    at        C        the point, in view coordinates                m
    n         n        its normal, in view coordinates
    v         v_i      way to the surface seen at a probe            m
    reach     r        radius of the neighbourhood                   m
"""

from typing import Any

from wavetank.device.compiler import qd
from wavetank.view.buffers import Buffers
from wavetank.view.lens import Lens, from_view, pixels_per_metre, point_at, vec3, vector
from wavetank.view.passes.probes import pattern_turn, spiral, turned
from wavetank.view.shot import Shot
from wavetank.view.strips import Strips, strip, strips_of


def draw(shot: Shot, buffers: Buffers) -> None:
    """Fill the second component of `light`."""
    look(shot, buffers, buffers.light, 1)


def look(shot: Shot, buffers: Buffers, light: Any, step: int) -> None:
    """Fill the second component of `light`, which holds every `step`-th row and column."""
    reach = max(5.0 * shot.radius, 0.05 * shot.extent.radius)
    lower, upper = vector(*shot.extent.lower), vector(*shot.extent.upper)
    look_around(
        strips_of(light), shot.lens, lower, upper, reach, shot.look.shade_depth, buffers.probes, step, buffers.depth,
        buffers.surface, buffers.normal, light,
    )  # fmt: skip


@qd.kernel(fastcache=True)
def look_around(
    strips: Strips, lens: Lens, lower: vec3, upper: vec3, reach: qd.f32, strength: qd.f32, probes: qd.template(),
    step: qd.i32, depth: qd.types.ndarray(), surface: qd.types.ndarray(), normal: qd.types.ndarray(),
    light: qd.types.ndarray(),
):  # fmt: skip
    """Sum up what stands in the way of the sky around every visible point."""
    rows, columns = depth.shape[0], depth.shape[1]
    for task in range(strips.count):
        own_row, first, last = strip(strips, task, light.shape[0], light.shape[1])
        for own_column in range(first, last):
            row, column = own_row * step, own_column * step
            what = surface[row, column]
            t = qd.min(qd.bit_cast(depth[row, column], qd.f32), 1e4)
            at = point_at(lens, row, column, t)
            near = what != 0x7FFFFFFF  # NOTHING
            if what == -2:  # FLOOR: open but close to the world
                there = lens.eye + from_view(lens, at)
                outside = qd.max(lower - there, there - upper)
                near = qd.max(outside.x, outside.z) < reach
            if near:
                world = normal[row, column]
                n = vec3(lens.right.dot(world), lens.up.dot(world), lens.forward.dot(world))
                spread = qd.min(reach * pixels_per_metre(lens, t), 0.25 * rows)
                turn = pattern_turn(own_row, own_column)
                hidden = 0.0
                for k in qd.static(range(probes)):
                    offset = spread * turned(turn, spiral(k, probes))
                    r = qd.min(qd.max(qd.cast(row + 0.5 + offset.y, qd.i32), 0), rows - 1)
                    c = qd.min(qd.max(qd.cast(column + 0.5 + offset.x, qd.i32), 0), columns - 1)
                    v = point_at(lens, r, c, qd.min(qd.bit_cast(depth[r, c], qd.f32), 1e4)) - at
                    square = v.dot(v) / (reach * reach)
                    # Nothing beyond the neighbourhood counts, or a far wall would darken a near edge.
                    fade = qd.max(1.0 - square, 0.0)
                    hidden += fade * qd.max(v.dot(n) - 0.002 * t, 0.0) / (square + 0.01)
                light[own_row, own_column].y = qd.max(1.0 - strength * hidden / (probes * reach), 0.0)

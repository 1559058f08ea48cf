"""Ambient occlusion: how much of the sky every visible point sees past its neighbours in the picture.

M. McGuire, B. Osman, M. Bukowski, P. Hennessy, "The Alchemy screen-space ambient obscurance algorithm" (2011), Eq. 10,
with the probes of `optics/probes.py`.

    code      symbol   meaning                                       unit
    at        C        the point, in view coordinates                m
    n         n        its normal, in view coordinates
    v         v_i      way to the surface seen at a probe            m
    reach     r        radius of the neighbourhood                   m
"""

from wavetank.device.compiler import qd
from wavetank.view.buffers import Buffers, Light, Pixels
from wavetank.view.lens import Lens, from_view, pixels_per_metre, point_at, vec3
from wavetank.view.optics.probes import pattern_turn, spiral, turned
from wavetank.view.optics.rays import Box
from wavetank.view.shot import Shot
from wavetank.view.strips import Strips, strip, strips_of
from wavetank.view.water_buffers import water_of


def draw(shot: Shot, buffers: Buffers) -> None:
    """Fill the sky's share of the light on every pixel."""
    fill(shot, buffers, buffers.with_light())


def draw_on_backdrop(shot: Shot, buffers: Buffers) -> None:
    """Fill the sky's share of the light on what is not water; a 2-D world is in full light."""
    if shot.frame.dim == 3:
        fill(shot, buffers, water_of(buffers, shot).light)


def fill(shot: Shot, buffers: Buffers, light: Light) -> None:
    """Fill the second component of `light`."""
    reach = max(5.0 * shot.radius, 0.05 * shot.extent.radius)
    gather_occlusion(
        light, buffers.pixels, strips_of(light.share), shot.lens, shot.box, reach, shot.look.shade_depth, buffers.probes
    )


@qd.kernel(fastcache=True)
def gather_occlusion(
    light: Light,
    pixels: Pixels,
    strips: Strips,
    lens: Lens,
    world: Box,
    reach: qd.f32,
    strength: qd.f32,
    probes: qd.template(),
):
    """Sum up what stands in the way of the sky around every visible point."""
    rows, columns = pixels.depth.shape[0], pixels.depth.shape[1]
    for task in range(strips.count):
        own_row, first, last = strip(strips, task, light.share.shape[0], light.share.shape[1])
        for own_column in range(first, last):
            row, column = own_row * light.step, own_column * light.step
            what = pixels.surface[row, column]
            t = qd.min(qd.bit_cast(pixels.depth[row, column], qd.f32), 1e4)
            at = point_at(lens, row, column, t)
            near = what != 0x7FFFFFFF  # NOTHING
            if what == -2:  # FLOOR: open but close to the world
                there = lens.eye + from_view(lens, at)
                outside = qd.max(world.lower - there, there - world.upper)
                near = qd.max(outside.x, outside.z) < reach
            if near:
                normal = pixels.normal[row, column]
                n = vec3(lens.right.dot(normal), lens.up.dot(normal), lens.forward.dot(normal))
                spread = qd.min(reach * pixels_per_metre(lens, t), 0.25 * rows)
                turn = pattern_turn(own_row, own_column)
                hidden = 0.0
                for k in qd.static(range(probes)):
                    offset = spread * turned(turn, spiral(k, probes))
                    r = qd.min(qd.max(qd.cast(row + 0.5 + offset.y, qd.i32), 0), rows - 1)
                    c = qd.min(qd.max(qd.cast(column + 0.5 + offset.x, qd.i32), 0), columns - 1)
                    v = point_at(lens, r, c, qd.min(qd.bit_cast(pixels.depth[r, c], qd.f32), 1e4)) - at
                    square = v.dot(v) / (reach * reach)
                    # Nothing beyond the neighbourhood counts, or a far wall would darken a near edge.
                    fade = qd.max(1.0 - square, 0.0)
                    hidden += fade * qd.max(v.dot(n) - 0.002 * t, 0.0) / (square + 0.01)
                light.share[own_row, own_column].y = qd.max(1.0 - strength * hidden / (probes * reach), 0.0)

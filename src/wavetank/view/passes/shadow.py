"""The sun's depth map, and how much of the sun every visible point receives.

Shadows soften with the distance between what casts and what receives them (R. Fernando, "Percentage-closer soft
shadows", 2005): a few probes find the mean distance of what is in the way, a few more, spread as wide as the sun then
looks, count what is hidden. The probes lie on a spiral that is turned from pixel to pixel in a 4 x 4 pattern; the
smooth pass averages that pattern away.

    code      symbol   meaning                                              unit
    c                  the point in the sun's view: right, up, depth        m
    gap                depth of the point below what the sun sees first     m
    spread             radius of the probes                                 texels
    away, lift         way along the normal that avoids self-shadow         m
"""

from typing import Any

from wavetank.device.compiler import qd
from wavetank.view.buffers import FARTHEST, Buffers
from wavetank.view.lens import Lens, from_view, point_at, to_pixel, to_view, vec2, vec3
from wavetank.view.passes import solids, spheres
from wavetank.view.passes.probes import pattern_turn, spiral, turned
from wavetank.view.shot import Shot
from wavetank.view.strips import Strips, strip, strips_of


def draw(shot: Shot, buffers: Buffers) -> None:
    """Fill the first component of `light` with the shadows of particles and solids; a 2-D world has none."""
    if shot.frame.dim == 2:
        fill(buffers.with_light())
        return
    buffers.sun_depth.fill(FARTHEST)
    frame = shot.frame
    spheres.splat(frame.x, frame.count, shot.radius, shot.sun, float(buffers.texels), buffers.sun_depth)
    cast(shot, buffers)
    fall(shot, buffers, buffers.with_light(), 1)


def draw_solids(shot: Shot, buffers: Buffers) -> None:
    """Fill the first component of `light` with the shadows of solids alone."""
    if shot.frame.dim == 2:
        fill(buffers.with_light())
    else:
        buffers.sun_depth.fill(FARTHEST)
        cast(shot, buffers)
        fall(shot, buffers, buffers.with_light(), 1)


def cast(shot: Shot, buffers: Buffers) -> None:
    """Add the solids to the sun's depth map."""
    solids.lower_depth(shot, buffers, shot.sun, buffers.sun_depth, 0)


def fall(shot: Shot, buffers: Buffers, light: Any, step: int) -> None:
    """Fill `light`, which holds every `step`-th row and column, from the sun's depth map."""
    receive(
        strips_of(light), shot.lens, shot.sun, shot.look.to_sun, shot.look.sun_size, 0.3 * shot.radius,
        buffers.probes, step, buffers.sun_depth, buffers.depth, buffers.surface, buffers.normal, light,
    )  # fmt: skip


@qd.kernel(fastcache=True)
def fill(light: qd.types.ndarray()):
    """Full sun everywhere."""
    for row, column in qd.ndrange(light.shape[0], light.shape[1]):
        light[row, column] = vec2(1.0, 1.0)


@qd.func
def gap_at(sun_depth: qd.template(), place, depth):
    """Way [m] that a point at `depth` lies below what the sun sees first; negative outside of the map."""
    row, column = qd.cast(qd.floor(place.y), qd.i32), qd.cast(qd.floor(place.x), qd.i32)
    gap = -1e9
    if row >= 0 and column >= 0 and row < sun_depth.shape[0] and column < sun_depth.shape[1]:
        gap = depth - qd.bit_cast(sun_depth[row, column], qd.f32)
    return gap


@qd.kernel(fastcache=True)
def receive(
    strips: Strips, lens: Lens, sun: Lens, to_sun: vec3, sun_size: qd.f32, lift: qd.f32, probes: qd.template(),
    step: qd.i32, sun_depth: qd.types.ndarray(), depth: qd.types.ndarray(), surface: qd.types.ndarray(),
    normal: qd.types.ndarray(), light: qd.types.ndarray(),
):  # fmt: skip
    """Compare visible points with the sun's depth map: those of every `step`-th row and column."""
    texels = sun_depth.shape[0]
    for task in range(strips.count):
        own_row, first, last = strip(strips, task, light.shape[0], light.shape[1])
        for own_column in range(first, last):
            row, column = own_row * step, own_column * step
            share = 0.0  # what faces away from the sun is dark without a look
            if surface[row, column] != 0x7FFFFFFF and normal[row, column].dot(to_sun) > -0.4:  # NOTHING
                share = 1.0
                t = qd.bit_cast(depth[row, column], qd.f32)
                at = lens.eye + from_view(lens, point_at(lens, row, column, t))
                # The more a surface turns from the sun, the deeper it is within one texel of the map.
                away = (1.75 - 1.25 * normal[row, column].dot(to_sun)) / sun.focal
                if surface[row, column] >= 0:
                    away += lift
                c = to_view(sun, at + away * normal[row, column])
                place = to_pixel(sun, c)
                # The cone in which something as high as a few tenths of the map could stand in the way.
                wide = 0.25 * sun_size * texels
                if qd.min(place.x, place.y) > -wide and qd.max(place.x, place.y) < texels + wide:
                    share = sun_share(
                        sun, sun_size, wide, probes, c.z, place, pattern_turn(own_row, own_column), sun_depth
                    )
            light[own_row, own_column] = vec2(share, 1.0)


@qd.func
def sun_share(sun: Lens, sun_size, wide, probes: qd.template(), depth, place, turn, sun_depth: qd.template()):
    """Share 0 to 1 of the sun that is seen from a point at `depth` that the map shows at `place`."""
    below, casters = 0.0, 0
    for k in qd.static(range(5)):
        gap = gap_at(sun_depth, place + wide * turned(turn, spiral(k, 5)), depth)
        if gap > 0.0:
            below += gap
            casters += 1
    share = 1.0
    if casters == 5:
        share = 0.0
    elif casters > 0:
        spread = qd.min(qd.max(sun_size * below / casters * sun.focal, 1.0), wide)
        for k in qd.static(range(probes)):
            if gap_at(sun_depth, place + spread * turned(turn, spiral(k, probes)), depth) > 0.0:
                share -= 1.0 / probes
    return qd.max(share, 0.0)

"""Solids by sphere tracing: step along the ray by the distance to the solid until it is reached.

Each ray looks only at solids whose bounding ball it meets, and no farther than what is already there. What has no
end, a half-space, is cut off at the tank; a 2-D world shows the cut through its plane, moved in front of the
particles, which are balls around that plane and would cover the rim of every solid.

    code         symbol   meaning                                       unit
    t                     depth along the ray                           m
    pace                  way per metre of depth, the ray's length      m/m
    mirror       F        share of light that a wall of glass mirrors   1
    first, last           depths between which a solid may be met       m
    raised                way towards the eye that a cut is moved       m
"""

import dataclasses
from typing import Any

import numpy as np

from wavetank.device.compiler import qd
from wavetank.device.state import interned
from wavetank.solids.distance import SolidSet, around, grain, signed_distance
from wavetank.view.buffers import Buffers, Pixels
from wavetank.view.lens import Lens, box_of_ball, ray_direction, ray_origin, to_view, vec2, vec3, vec4, view_ray
from wavetank.view.look import Look
from wavetank.view.optics.radiance import environment, glint
from wavetank.view.optics.rays import Box, box, box_interval
from wavetank.view.paints import Finish, colors_of, finishes_of, traced_colors
from wavetank.view.shot import Shot
from wavetank.view.strips import Strips, strip, strips_of
from wavetank.view.water_buffers import water_of

UNBOUNDED = 1e4  # m


@dataclasses.dataclass(frozen=True, eq=False)
class Window:
    """Where solids are drawn, on the device."""

    inside: Box  # every solid
    endless: Box  # and those without end
    raised: qd.f32  # m


def draw(shot: Shot, buffers: Buffers) -> None:
    """Draw the solids that are not walls of the tank, in front of or behind what is there."""
    lower_depth(shot, buffers, shot.lens, buffers.pixels.depth, 1)


def draw_from_sun(shot: Shot, buffers: Buffers) -> None:
    """Draw the solids into the sun's depth map, likewise."""
    if shot.frame.dim == 3:
        lower_depth(shot, buffers, shot.sun, buffers.sun_depth, 0)


def draw_glass(shot: Shot, buffers: Buffers) -> None:
    """Lay solids of glass over the finished picture, by the depth of what it shows: thin walls that bend no light."""
    is_glass = finishes_of(shot) == Finish.GLASS
    if shot.frame.dim == 3 and is_glass.any():
        paints = np.where(is_glass[:, None], traced_colors(shot), np.float32(-1.0))
        composite_glass(
            buffers.pixels,
            water_of(buffers, shot).surface.nearest,
            buffers.solid_box,
            strips_of(buffers.pixels.depth),
            shot.frame.solids,
            window(shot),
            shot.lens,
            shot.look,
            buffers.glass_paints.of(paints),
        )


def lower_depth(shot: Shot, buffers: Buffers, lens: Lens, depth: Any, is_seen: int) -> None:
    """Lower `depth` to the solids that `lens` sees; with `is_seen` (1 or 0) draw them into the picture."""
    solids = shot.frame.solids
    if solids.count > solids.tank_count:
        paints = buffers.paints.of(colors_of(shot))
        trace(depth, buffers.pixels, buffers.solid_box, strips_of(depth), solids, window(shot), lens, paints, is_seen)


def window(shot: Shot) -> Window:
    """Return where the solids of this world are drawn."""
    flat = shot.frame.dim == 2
    wide = np.array([UNBOUNDED, UNBOUNDED, 0.0 if flat else UNBOUNDED])
    inside = box(-wide, wide)
    endless = inside if shot.frame.scene.tank is None else shot.box
    return interned(Window(inside=inside, endless=endless, raised=shot.radius if flat else 0.0))


@qd.func
def ball_interval(origin, direction, center, r):
    """Depths at which a ray enters and leaves a ball; enters after leaving where it misses."""
    square = direction.dot(direction)
    nearest = (center - origin).dot(direction) / square
    miss = center - origin - nearest * direction
    half = r * r - miss.dot(miss)
    interval = vec2(1.0, -1.0)
    if half >= 0.0:
        reach = qd.sqrt(half / square)
        interval = vec2(nearest - reach, nearest + reach)
    return interval


@qd.func
def meet(solids: SolidSet, k, origin, direction, first, last, bevel):
    """(normal, depth) where a ray meets solid `k` between two depths; depth -1 where it does not.

    The cut face is rounded off towards its rim over `bevel` [m]; where that is negative there is none, and a ray that
    begins in the solid leaves it first. The slope of a grid jumps from cell to cell: there the
    normal is that between six places around the hit. All distances are asked for in one place, because every copy of
    that code takes seconds to compile.
    """
    pace, reach = direction.norm(), grain(solids, k)
    t, inner, steps, probe = first, first, 0, -1  # probe: which of the six places is asked for, -1 on the way there
    hit, n = vec4(0.0, 0.0, 0.0, -1.0), vec3(0.0, 0.0, 0.0)
    # Of a ray that begins in the solid and leaves it, or in a container: its near side is left away, so that what it
    # holds is seen. It is left until it is surely out of it, by more than what counts as met.
    leaving = (bevel < 0.0 and first < 1e-4) or solids.reach[k] >= around()
    is_going = True
    while is_going:
        side = vec3(0.0, 0.0, 0.0)
        if probe >= 0:
            sign = 1.0 - 2.0 * (probe % 2)
            for axis in qd.static(range(3)):
                side[axis] = qd.select(probe // 2 == axis, sign, 0.0)
        value = signed_distance(solids, k, origin + t * direction + reach * side)
        if probe >= 0:
            n += value.w * side
            probe += 1
            if probe == 6:
                n = n.normalized(1e-9)
                hit = vec4(n.x, n.y, n.z, t)
                is_going = False
        elif leaving and t == inner and value.w <= 2e-4 * t + 2e-6:
            t += qd.max(-value.w, 1e-4 * t + 1e-6) / pace
            inner = t
            steps += 1
            is_going = steps < 128 and t <= last
        elif steps == 0 and value.w <= 0.0:
            tilt = qd.max(1.0 + value.w / qd.max(bevel, 1e-9), 0.0)
            toward = (vec3(value.x, value.y, value.z) * tilt - direction / pace).normalized(1e-9)
            hit = vec4(toward.x, toward.y, toward.z, t)
            is_going = False
        elif value.w < 1e-4 * t + 1e-6:
            hit = vec4(value.x, value.y, value.z, t)
            is_going = reach > 0.0
            probe = 0
        else:
            t += value.w / pace
            steps += 1
            # A ray that grazes a surface creeps; after so many steps it counts as a miss.
            is_going = steps < 128 and t <= last
    return hit


@qd.func
def nearest_solid(solids: SolidSet, window: Window, lens: Lens, paints: qd.template(), row, column, far):
    """(normal, depth, number) of the first solid in a pixel nearer than `far`; depth -1 where there is none.

    What has a negative paint is left away: glass.
    """
    ray = view_ray(lens, row, column)
    origin, direction = ray_origin(lens, ray), ray_direction(lens, ray)
    best, which = vec4(0.0, 0.0, 0.0, -1.0), 0
    last = qd.min(far, 1e4) + window.raised
    for k in range(solids.tank_count, solids.count):
        bound = ball_interval(origin, direction, solids.position[k], 1.001 * solids.reach[k] + 1e-4)
        first, end = qd.max(lens.near + window.raised, bound[0]), qd.min(last, bound[1])
        if first <= end and paints[k].x >= 0.0:
            inside = box_interval(origin, direction, window.inside)
            if solids.reach[k] > 1e4:
                inside = box_interval(origin, direction, window.endless)
            first, end = qd.max(first, inside[0]), qd.min(end, inside[1])
        if first <= end and paints[k].x >= 0.0:
            hit = meet(solids, k, origin, direction, first, end, window.raised)
            if hit.w >= 0.0:
                best, which = hit, k
                last = hit.w
    return qd.Vector([best.x, best.y, best.z, best.w - window.raised, qd.cast(which, qd.f32)])


@qd.func
def in_box(box: qd.template(), row, column):
    """Whether a pixel lies in a box of pixels (first and last column, first and last row)."""
    return column >= box[0] and column <= box[1] and row >= box[2] and row <= box[3]


@qd.func
def find_box(box: qd.template(), solids: SolidSet, lens: Lens, rows, columns):
    """Write the box of pixels (first and last column, first and last row) in which any solid can be."""
    whole = qd.Vector([columns, -1, rows, -1])
    for k in range(solids.tank_count, solids.count):
        c, r = to_view(lens, solids.position[k]), 1.001 * solids.reach[k] + 1e-4
        part = qd.Vector([0, columns - 1, 0, rows - 1])
        if r < 1e4 and (c.z > r + lens.near or lens.perspective < 0.5):
            part = box_of_ball(lens, c, r, rows, columns)
        if part[0] <= part[1]:
            whole[0], whole[1] = qd.min(whole[0], part[0]), qd.max(whole[1], part[1])
            whole[2], whole[3] = qd.min(whole[2], part[2]), qd.max(whole[3], part[3])
    for k in qd.static(range(4)):
        box[k] = whole[k]


@qd.kernel(fastcache=True)
def trace(
    depth: qd.types.ndarray(),
    pixels: Pixels,
    box: qd.types.ndarray(),
    strips: Strips,
    solids: SolidSet,
    window: Window,
    lens: Lens,
    paints: qd.types.ndarray(),
    is_seen: qd.i32,
):
    """Lower `depth` to that of the nearest solid; with `is_seen` it is that of `pixels`, where the solid is drawn.

    One kernel for eye and sun, because tracing takes long to compile.
    """
    for _ in range(1):
        find_box(box, solids, lens, depth.shape[0], depth.shape[1])
    for task in range(strips.count):
        row, first, last = strip(strips, task, depth.shape[0], depth.shape[1])
        for column in range(first, last):
            if in_box(box, row, column):
                hit = nearest_solid(solids, window, lens, paints, row, column, qd.bit_cast(depth[row, column], qd.f32))
                if hit[3] > 0.0:
                    depth[row, column] = qd.bit_cast(hit[3], qd.i32)
                    if is_seen == 1:
                        pixels.surface[row, column] = -1  # SOLID
                        pixels.normal[row, column] = vec3(hit[0], hit[1], hit[2])
                        pixels.color[row, column] = paints[qd.cast(hit[4], qd.i32)]


@qd.kernel(fastcache=True)
def composite_glass(
    pixels: Pixels,
    nearest: qd.types.ndarray(),
    box: qd.types.ndarray(),
    strips: Strips,
    solids: SolidSet,
    window: Window,
    lens: Lens,
    look: Look,
    paints: qd.types.ndarray(),
):
    """Lay what has no negative paint over the picture, where nothing stands before it.

    What is seen passes two faces of the wall, is coloured more where it passes aslant, and both faces mirror.
    """
    for _ in range(1):
        find_box(box, solids, lens, nearest.shape[0], nearest.shape[1])
    for task in range(strips.count):
        row, first, last = strip(strips, task, nearest.shape[0], nearest.shape[1])
        for column in range(first, last):
            if in_box(box, row, column):
                far = qd.bit_cast(nearest[row, column], qd.f32)
                hit = nearest_solid(solids, window, lens, paints, row, column, far)
                if hit[3] > 0.0 and hit[3] < far:
                    ahead = ray_direction(lens, view_ray(lens, row, column)).normalized()
                    n = vec3(hit[0], hit[1], hit[2])
                    cosi = qd.min(qd.max(-n.dot(ahead), 0.02), 1.0)
                    face = 0.04 + 0.96 * (1.0 - cosi) ** 5
                    mirror = 2.0 * face / (1.0 + face)
                    tint = paints[qd.cast(hit[4], qd.i32)]
                    slant = qd.min(1.0 / cosi, 4.0)
                    shown = pixels.color[row, column] * qd.exp(slant * qd.log(qd.max(tint, 0.01)))
                    shown += mirror * (environment(look, ahead + 2.0 * cosi * n) - shown)
                    pixels.color[row, column] = shown + glint(look, n.dot((look.to_sun - ahead).normalized(1e-9)), 0.0)

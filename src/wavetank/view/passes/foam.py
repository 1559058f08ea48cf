"""Spray, foam and bubbles: soft bright discs over the picture, thicker where there are more of them.

Every particle adds its optical depth to the pixels it covers, and the part of it that the sun reaches. Sums of whole
numbers do not depend on the order of threads, and no sorting by depth is needed: what is added is all of one white
stuff. The sums are kept per pixel of the picture, not per sample, which is enough for soft things.

    code      symbol   meaning                                                              unit
    tau                optical depth of what lies over a pixel, in 1/256                    1
    lit                tau weighted with the share of the sun that arrives                  1
    r, wide            radius of a particle, and as drawn: no smaller than the pixel grid   px
    behind             how far a particle is behind the surface that the pixel shows        m

The pass reads depth, camera and sun and knows nothing of how the water was drawn: what is a little behind the surface
shows through it, what is far behind does not. In a 2-D world everything lies in one plane: foam lies on the water, in
full light, and what flies over white paper is a pale blue.
"""

from typing import Any

import numpy as np

from wavetank.device.compiler import qd
from wavetank.device.state import Diffuse
from wavetank.solids.distance import lift
from wavetank.view.buffers import Buffers
from wavetank.view.colormaps import rgb_of, to_linear
from wavetank.view.lens import Lens, pixels_per_metre, to_pixel, to_view, vec3, vector
from wavetank.view.passes.tank import line_cover, slack
from wavetank.view.shot import Shot
from wavetank.view.water_buffers import water_of

SHOW_THROUGH = 1.0  # d: depth below the surface at which foam shows with 1/e of its strength
LARGEST = 0.05  # of the picture's height: radius up to which a particle is drawn at its size
SIZE = {2: 1.7, 3: 1.0}  # of the drawn particles: a plane has fewer of them
IN_FRONT = 1e9  # m: what shows through everything
SHADE = vector(0.80, 0.68, 0.55)  # of the sun's light, lost in the shadow: the sky leaves foam a little blue
PALE = vector(*to_linear(np.array(rgb_of("#6fa8d2"))))


def draw(shot: Shot, buffers: Buffers) -> None:
    """Lay spray, foam and bubbles over the radiance in `color`, by the depth that the picture shows."""
    lay(shot, buffers, buffers.depth, IN_FRONT)


def draw_over_water(shot: Shot, buffers: Buffers) -> None:
    """Do the same where the water is not part of the picture's depth but lies in front of it."""
    if shot.frame.foam_count > 0:
        lay(shot, buffers, water_of(buffers, shot).spare, 0.25 * shot.extent.spacing)


def lay(shot: Shot, buffers: Buffers, depth: Any, sunk: float) -> None:
    """Lay spray, foam and bubbles over whatever lies at `depth`; solids hide what is `sunk` [m] behind them."""
    frame, d, flat = shot.frame, shot.extent.spacing, shot.frame.dim == 2
    if frame.diffuse is None or frame.foam_count == 0:
        return
    clear(buffers.foam)
    through = IN_FRONT if flat else SHOW_THROUGH * d
    splat(
        frame.diffuse, frame.foam_count, SIZE[frame.dim] * d, through, shot.lens, shot.sun, buffers.supersample,
        max(LARGEST * buffers.rows / buffers.supersample, 1.0), depth, buffers.depth, sunk, buffers.sun_depth,
        buffers.foam,
    )  # fmt: skip
    white, shade = vector(*(shot.look.sun + shot.look.sky)), vector(*(SHADE * shot.look.sun * (not flat)))
    blend(
        white, PALE if flat else white, shade, buffers.supersample, buffers.foam,
        shot.look.line_strength if frame.scene.tank else 0.0, slack(shot), buffers.lines, depth, buffers.color,
    )  # fmt: skip


@qd.kernel(fastcache=True)
def clear(foam: qd.types.ndarray()):
    """No foam anywhere."""
    for row, column in qd.ndrange(foam.shape[0], foam.shape[1]):
        foam[row, column, 0] = 0
        foam[row, column, 1] = 0


@qd.func
def size_and_strength(kind, share, number):
    """Radius [d] and optical depth of a particle that has lived the `share` of its life."""
    radius, strength = 0.10, 0.9  # spray
    if kind == 2:
        radius, strength = 0.22, 0.75
    elif kind == 3:
        radius, strength = 0.13, 0.5
    # A spread of sizes that stays with the particle.
    radius *= 0.6 + 0.8 * qd.cast((number * 40503) & 0xFFFF, qd.f32) / 65536.0
    return radius, strength * qd.min(1.0, 0.4 + 12.0 * share) * (1.0 - share * share)


@qd.func
def sunlit(sun: Lens, sun_depth: qd.template(), x, slack):
    """1 where the sun sees the point `x`, 0 where something is in the way."""
    c = to_view(sun, x)
    place = to_pixel(sun, c)
    row, column = qd.cast(qd.floor(place.y), qd.i32), qd.cast(qd.floor(place.x), qd.i32)
    share = 1.0
    if row >= 0 and column >= 0 and row < sun_depth.shape[0] and column < sun_depth.shape[1]:
        if c.z - slack > qd.bit_cast(sun_depth[row, column], qd.f32):
            share = 0.0
    return share


@qd.kernel(fastcache=True)
def splat(
    diffuse: Diffuse, count: qd.i32, d: qd.f32, through: qd.f32, lens: Lens, sun: Lens, samples: qd.i32,
    largest: qd.f32, depth: qd.types.ndarray(), solid_depth: qd.types.ndarray(), sunk: qd.f32,
    sun_depth: qd.types.ndarray(), foam: qd.types.ndarray(),
):  # fmt: skip
    """Add the optical depth of every particle of about the size `d` [m] to the pixels it covers."""
    for i in range(count):
        x = lift(diffuse.x[i])
        c = to_view(lens, x)
        if c.z > lens.near:
            radius, strength = size_and_strength(diffuse.kind[i], diffuse.age[i] / diffuse.life[i], diffuse.id[i])
            r = qd.min(radius * d * pixels_per_metre(lens, c.z) / samples, largest)
            wide = qd.max(r, 0.8)
            # What is smaller than a pixel is as faint as it is small.
            strength *= 256.0 * (r / wide) ** 2
            middle = to_pixel(lens, c) / samples
            low_row = qd.max(qd.cast(qd.ceil(qd.max(middle.y - wide - 0.5, -1.0)), qd.i32), 0)
            low_column = qd.max(qd.cast(qd.ceil(qd.max(middle.x - wide - 0.5, -1.0)), qd.i32), 0)
            end_row = qd.cast(qd.min(qd.max(middle.y + wide + 0.5, 0.0), foam.shape[0] * 1.0), qd.i32)
            end_column = qd.cast(qd.min(qd.max(middle.x + wide + 0.5, 0.0), foam.shape[1] * 1.0), qd.i32)
            light = -1.0
            for row in range(low_row, end_row):
                for column in range(low_column, end_column):
                    away = (row + 0.5 - middle.y) ** 2 + (column + 0.5 - middle.x) ** 2
                    rest = 1.0 - away / (wide * wide)
                    at = qd.bit_cast(depth[row * samples + samples // 2, column * samples + samples // 2], qd.f32)
                    behind = c.z - at - radius * d
                    wall = qd.bit_cast(
                        solid_depth[row * samples + samples // 2, column * samples + samples // 2], qd.f32
                    )
                    if rest > 0.0 and behind < 4.0 * through and c.z - radius * d < wall + sunk:
                        if light < 0.0:
                            light = sunlit(sun, sun_depth, x, 2.0 * d)
                        tau = qd.cast(strength * rest * qd.exp(-qd.max(behind, 0.0) / through) + 0.5, qd.i32)
                        if tau > 0:
                            qd.atomic_add(foam[row, column, 0], tau)
                            if light > 0.5:
                                qd.atomic_add(foam[row, column, 1], tau)


@qd.kernel(fastcache=True)
def blend(
    white: vec3, in_air: vec3, shade: vec3, samples: qd.i32, foam: qd.types.ndarray(), line_strength: qd.f32,
    slack: qd.f32, lines: qd.types.ndarray(), depth: qd.types.ndarray(), color: qd.types.ndarray(),
):  # fmt: skip
    """Lay the sums over the picture: `white` or, over nothing, `in_air`, less `shade` where the sun is hidden."""
    for foam_row, foam_column in qd.ndrange(foam.shape[0], foam.shape[1]):
        tau = foam[foam_row, foam_column, 0]
        if tau > 0:
            hidden = shade * (1.0 - foam[foam_row, foam_column, 1] / qd.cast(tau, qd.f32))
            most = 1.0 - qd.exp(-tau / 256.0)
            for row in range(foam_row * samples, foam_row * samples + samples):
                for column in range(foam_column * samples, foam_column * samples + samples):
                    light, cover = white - hidden, most
                    if depth[row, column] == 0x7F000000:  # FARTHEST
                        light = in_air - hidden
                    if line_strength > 0.0:  # the tank's edges stay in front
                        here = qd.bit_cast(depth[row, column], qd.f32)
                        cover *= 1.0 - line_strength * line_cover(lines[row, column], here, slack)
                    before = color[row, column]
                    color[row, column] = before + cover * (light - before)  # += would be atomic

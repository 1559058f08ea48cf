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

import dataclasses
from typing import Any

import numpy as np

from wavetank.device.compiler import qd
from wavetank.device.state import Diffuse, remembered
from wavetank.solids.distance import lift
from wavetank.view.buffers import Buffers, Pixels
from wavetank.view.colormaps import rgb_of, to_linear
from wavetank.view.lens import Lens, pixels_per_metre, to_pixel, to_view, vec3, vector
from wavetank.view.optics.glass import line_cover, slack
from wavetank.view.optics.maps import gap_at
from wavetank.view.shot import Shot
from wavetank.view.water_buffers import water_of

SHOW_THROUGH = 1.0  # d: depth below the surface at which foam shows with 1/e of its strength
LARGEST = 0.05  # of the picture's height: radius up to which a particle is drawn at its size
SIZE = {2: 1.7, 3: 1.0}  # of the drawn particles: a plane has fewer of them
IN_FRONT = 1e9  # m: what shows through everything
SHADE = vector(0.80, 0.68, 0.55)  # of the sun's light, lost in the shadow: the sky leaves foam a little blue
PALE = vector(*to_linear(np.array(rgb_of("#6fa8d2"))))


@dataclasses.dataclass(frozen=True, eq=False)
class Froth:
    """How spray, foam and bubbles look, on the device."""

    size: qd.f32  # m: about that of a particle
    through: qd.f32  # m: depth below the surface at which foam shows with 1/e of its strength
    sunk: qd.f32  # m: how far behind a solid it is still seen
    largest: qd.f32  # px: radius up to which a particle is drawn at its size
    white: vec3  # radiance
    in_air: vec3  # the same over nothing
    shade: vec3  # radiance that is lost in the shadow
    line_strength: qd.f32  # share of what is behind an edge of the tank that the edge hides
    slack: qd.f32  # m: depth by which an edge wins
    samples: qd.i32  # computed pixels per pixel of the picture, in each direction


def draw(shot: Shot, buffers: Buffers) -> None:
    """Lay spray, foam and bubbles over the radiance in `color`, by the depth that the picture shows."""
    lay(shot, buffers, buffers.pixels.depth, IN_FRONT)


def draw_over_water(shot: Shot, buffers: Buffers) -> None:
    """Do the same where the water is not part of the picture's depth but lies in front of it."""
    if shot.frame.foam_count > 0:
        lay(shot, buffers, water_of(buffers, shot).surface.nearest, 0.25 * shot.extent.spacing)


def lay(shot: Shot, buffers: Buffers, depth: Any, sunk: float) -> None:
    """Lay spray, foam and bubbles over whatever lies at `depth`; solids hide what is `sunk` [m] behind them."""
    frame, pixels = shot.frame, buffers.pixels
    if frame.diffuse is None or frame.foam_count == 0:
        return
    froth = froth_of(shot, buffers, sunk)
    clear(buffers.foam)
    splat(
        buffers.foam, frame.diffuse, depth, pixels.depth, buffers.sun_depth, shot.lens, shot.sun, froth,
        frame.foam_count,
    )  # fmt: skip
    blend(pixels, buffers.foam, depth, froth)


def froth_of(shot: Shot, buffers: Buffers, sunk: float) -> Froth:
    """Return how spray, foam and bubbles look in a picture."""
    frame, look, d, flat = shot.frame, shot.look, shot.extent.spacing, shot.frame.dim == 2
    white = vector(*(look.sun + look.sky))
    return remembered(Froth(
        size=SIZE[frame.dim] * d, through=IN_FRONT if flat else SHOW_THROUGH * d, sunk=sunk,
        largest=max(LARGEST * buffers.rows / buffers.supersample, 1.0), white=white, in_air=PALE if flat else white,
        shade=vector(*(SHADE * look.sun * (not flat))),
        line_strength=look.line_strength if frame.scene.tank else 0.0, slack=slack(shot), samples=buffers.supersample,
    ))  # fmt: skip


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
    return qd.select(gap_at(sun_depth, to_pixel(sun, c), c.z - slack) > 0.0, 0.0, 1.0)


@qd.kernel(fastcache=True)
def splat(
    foam: qd.types.ndarray(), diffuse: Diffuse, depth: qd.types.ndarray(), solid_depth: qd.types.ndarray(),
    sun_depth: qd.types.ndarray(), lens: Lens, sun: Lens, froth: Froth, count: qd.i32,
):  # fmt: skip
    """Add the optical depth of every particle to the pixels it covers."""
    d, samples = froth.size, froth.samples
    for i in range(count):
        x = lift(diffuse.x[i])
        c = to_view(lens, x)
        if c.z > lens.near:
            radius, strength = size_and_strength(diffuse.kind[i], diffuse.age[i] / diffuse.life[i], diffuse.id[i])
            r = qd.min(radius * d * pixels_per_metre(lens, c.z) / samples, froth.largest)
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
                    down, across = row * samples + samples // 2, column * samples + samples // 2
                    behind = c.z - qd.bit_cast(depth[down, across], qd.f32) - radius * d
                    wall = qd.bit_cast(solid_depth[down, across], qd.f32)
                    if rest > 0.0 and behind < 4.0 * froth.through and c.z - radius * d < wall + froth.sunk:
                        if light < 0.0:
                            light = sunlit(sun, sun_depth, x, 2.0 * d)
                        tau = qd.cast(strength * rest * qd.exp(-qd.max(behind, 0.0) / froth.through) + 0.5, qd.i32)
                        if tau > 0:
                            qd.atomic_add(foam[row, column, 0], tau)
                            if light > 0.5:
                                qd.atomic_add(foam[row, column, 1], tau)


@qd.kernel(fastcache=True)
def blend(pixels: Pixels, foam: qd.types.ndarray(), depth: qd.types.ndarray(), froth: Froth):
    """Lay the sums over the picture: white or, over nothing, what it is in air, less where the sun is hidden."""
    samples = froth.samples
    for foam_row, foam_column in qd.ndrange(foam.shape[0], foam.shape[1]):
        tau = foam[foam_row, foam_column, 0]
        if tau > 0:
            hidden = froth.shade * (1.0 - foam[foam_row, foam_column, 1] / qd.cast(tau, qd.f32))
            most = 1.0 - qd.exp(-tau / 256.0)
            for row in range(foam_row * samples, foam_row * samples + samples):
                for column in range(foam_column * samples, foam_column * samples + samples):
                    light, cover = froth.white - hidden, most
                    if depth[row, column] == 0x7F000000:  # FARTHEST
                        light = froth.in_air - hidden
                    if froth.line_strength > 0.0:  # the tank's edges stay in front
                        here = qd.bit_cast(depth[row, column], qd.f32)
                        cover *= 1.0 - froth.line_strength * line_cover(pixels.lines[row, column], here, froth.slack)
                    before = pixels.color[row, column]
                    pixels.color[row, column] = before + cover * (light - before)  # += would be atomic

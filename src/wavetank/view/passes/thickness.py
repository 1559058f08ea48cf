"""Water along every line of sight: the sum of the particles' volumes, spread over smooth discs.

    code      symbol   meaning                                                       unit
    disc               radius of a particle's disc, `DISC`                          m
    peak               thickness in its middle: 3 d^3 / (pi disc^2)                  steps of d / 4096
    coarse             pixels of the picture per texel, in each direction            1

The disc (1 - q^2)^2 is wide enough that a lattice of particles adds up to an even thickness. Sums are whole numbers,
so they repeat bit for bit. The picture's map is at half its resolution, or coarser where a particle is large: a disc
never touches more than some twenty texels.
"""

import math
from typing import Any

from wavetank.device.compiler import qd, threads
from wavetank.view.buffers import Buffers
from wavetank.view.lens import Lens, pixels_per_metre, to_pixel, to_view, vec2, vec3, vec4
from wavetank.view.passes.spheres import dyed
from wavetank.view.shot import Shot
from wavetank.view.strips import Strips, strip, strips_of
from wavetank.view.water_buffers import UNIT, WaterBuffers, water_of

DISC = {2: 6.0, 3: 1.5}  # d; wide in a plane, where it shades from the rim to the depth
TEXELS = 2.0  # of a map per spacing, at most


def draw(shot: Shot, buffers: Buffers) -> None:
    """Fill the thickness as the eye sees it."""
    water, disc = water_of(buffers, shot), DISC[shot.frame.dim] * shot.extent.spacing
    count, coarse, tall = shot.frame.count, float(coarseness(shot)), peak(shot.frame.dim)
    add_up(water.cells.x, count, shot.lens, coarse, disc, tall, water.sums, water.thickness)
    add_dye(shot, water, shot.lens, coarse, water.dye)


def add_dye(shot: Shot, water: WaterBuffers, lens: Lens, coarse: float, dye: Any) -> None:
    """Fill the map `dye` with the discs of coloured particles, and `water.stained`."""
    frame, disc = shot.frame, DISC[shot.frame.dim] * shot.extent.spacing
    stain(
        water.cells.x, water.cells.order, frame.dye, frame.material, water.stains, frame.count, lens, coarse, disc,
        peak(frame.dim), dye, water.stained,
    )  # fmt: skip


def coarseness(shot: Shot) -> int:
    """Pixels per texel of the thickness map, at least 2."""
    lens, extent = shot.lens, shot.extent
    scale = float(lens.focal)
    if float(lens.perspective) > 0.5:
        distance = float((extent.middle - lens.eye) @ lens.forward)
        scale /= max(distance, 0.5 * extent.radius)
    return max(2, min(64, round(scale * extent.spacing * DISC[extent.dim] / (DISC[3] * TEXELS))))


def peak(dim: int) -> float:
    """Thickness in the middle of a disc [steps]; water in a plane counts as a sheet one spacing thick."""
    return 3.0 / (math.pi * DISC[dim] ** 2) * UNIT


def add_up(x: Any, count: int, lens: Lens, coarse: float, disc: float, tall: float, sums: Any, thickness: Any) -> None:
    """Fill the map `thickness` with every particle's disc; the texel (r, c) holds the pixels from coarse r, c on."""
    parts = int(sums.shape[0]) // int(thickness.shape[0] * thickness.shape[1])
    add(strips_of(thickness), x, count, lens, coarse, disc, tall, parts, sums, thickness, int(threads() > 0))


@qd.func
def disc_of(lens: Lens, x, coarse, disc, peak, rows, columns):
    """(column, row, 1 / radius^2, thickness in the middle) of a particle's disc in texels, and the box of those it
    covers: first and last row, first and last column; none where it is not before the eye.
    """
    c, box = to_view(lens, x), qd.Vector([0, -1, 0, -1])
    place, inverse, tall = vec2(0.0, 0.0), 1.0, 0.0
    if c.z > lens.near + 0.3 * disc:
        place = to_pixel(lens, c) / coarse
        # A disc next to the eye would fill the map; it counts as much farther away.
        wide, tall = qd.min(pixels_per_metre(lens, c.z) * disc / coarse, 24.0), peak
        if wide < 0.75:  # smaller than a texel: keep the volume
            tall = peak * wide * wide / 0.5625
            wide = 0.75
        inverse = qd.min(1.0 / (wide * wide), 2.0)  # the bound keeps the compiler from dividing at every texel
        box[0] = qd.max(qd.cast(qd.ceil(qd.max(place.y - wide - 0.5, 0.0)), qd.i32), 0)
        box[1] = qd.min(qd.cast(qd.floor(qd.min(place.y + wide - 0.5, rows - 1.0)), qd.i32), rows - 1)
        box[2] = qd.max(qd.cast(qd.ceil(qd.max(place.x - wide - 0.5, 0.0)), qd.i32), 0)
        box[3] = qd.min(qd.cast(qd.floor(qd.min(place.x + wide - 0.5, columns - 1.0)), qd.i32), columns - 1)
    return vec4(place.x, place.y, inverse, tall), box


@qd.func
def thickness_in(at, row, column):
    """Thickness of a disc `at` its place, as `disc_of` has it, in the middle of a texel."""
    away = (row + 0.5 - at.y) ** 2 + (column + 0.5 - at.x) ** 2
    near = qd.max(1.0 - away * at.z, 0.0)
    return at.w * near * near


@qd.kernel(fastcache=True)
def add(
    strips: Strips, x: qd.types.ndarray(), count: qd.i32, lens: Lens, coarse: qd.f32, disc: qd.f32, peak: qd.f32,
    parts: qd.i32, sums: qd.types.ndarray(), thickness: qd.types.ndarray(), shared_out: qd.template(),
):  # fmt: skip
    """Add up every particle's disc.

    Where the particles are `shared_out`, each of their `parts` has sums of its own, and no thread waits for another.
    """
    rows, columns = thickness.shape[0], thickness.shape[1]
    if qd.static(shared_out):
        for turn in range(512 * parts):
            if turn & 511 == 0:  # the compiler gives a thread 512 turns at least
                part = turn >> 9
                for k in range(part * rows * columns, (part + 1) * rows * columns):
                    sums[k] = 0
                # In runs that take turns, because some parts of the water are nearer than others.
                for run in range((count + 63) // 64):
                    if run % parts == part:
                        for i in range(64 * run, qd.min(64 * run + 64, count)):
                            at, box = disc_of(lens, x[i], coarse, disc, peak, rows, columns)
                            for row in range(box[0], box[1] + 1):
                                begin = (part * rows + row) * columns
                                for column in range(box[2], box[3] + 1):
                                    more = qd.cast(thickness_in(at, row, column) + 0.5, qd.i32)
                                    sums[begin + column] = sums[begin + column] + more  # += would be atomic
        for task in range(strips.count):
            row, first, last = strip(strips, task, rows, columns)
            for column in range(first, last):
                total = 0
                for part in range(parts):
                    total += sums[(part * rows + row) * columns + column]
                thickness[row, column] = total
    else:
        for row, column in qd.ndrange(rows, columns):
            thickness[row, column] = 0
        for i in range(count):
            at, box = disc_of(lens, x[i], coarse, disc, peak, rows, columns)
            for row in range(box[0], box[1] + 1):
                for column in range(box[2], box[3] + 1):
                    more = qd.cast(thickness_in(at, row, column) + 0.5, qd.i32)
                    if more > 0:
                        qd.atomic_add(thickness[row, column], more)


@qd.kernel(fastcache=True)
def stain(
    x: qd.types.ndarray(), order: qd.types.ndarray(), dyes: qd.types.ndarray(), materials: qd.types.ndarray(),
    stains: qd.types.ndarray(), count: qd.i32, lens: Lens, coarse: qd.f32, disc: qd.f32, peak: qd.f32,
    dye: qd.types.ndarray(), stained: qd.types.ndarray(),
):  # fmt: skip
    """Add up the discs of coloured particles, as strong as their dye, alone and times its colour.

    A fluid with a colour of its own is dyed with it where nothing else dyes it. `stained` tells whether any is; where
    none is, `dye` holds nothing of use.
    """
    for k in range(stained.shape[0]):
        stained[k] = 0
    for a in range(count):
        if dyes[a] != 0 or stains[materials[a]] != 0:
            stained[0] = 1
    for row, column in qd.ndrange(dye.shape[0], dye.shape[1]):
        if stained[0] == 1:
            for k in qd.static(range(4)):
                dye[row, column, k] = 0
    for a in range(count):
        own = 0
        if stained[0] == 1:
            own = dyes[order[a]]
            if own == 0:
                own = stains[materials[order[a]]]
        if own != 0:
            strength = peak * ((own >> 24) & 127) / 127.0
            at, box = disc_of(lens, x[a], coarse, disc, strength, dye.shape[0], dye.shape[1])
            color = dyed(vec3(0.0, 0.0, 0.0), own | (127 << 24))
            for row in range(box[0], box[1] + 1):
                for column in range(box[2], box[3] + 1):
                    share = thickness_in(at, row, column)
                    qd.atomic_add(dye[row, column, 0], qd.cast(share + 0.5, qd.i32))
                    for k in qd.static(range(3)):
                        qd.atomic_add(dye[row, column, k + 1], qd.cast(share * color[k] + 0.5, qd.i32))


@qd.func
def dye_at(dye: qd.template(), place):
    """(dyed part of the thickness [steps], mean linear colour) at a place in texels, between the four nearest."""
    x = qd.min(qd.max(place.x - 0.5, 0.0), dye.shape[1] - 1.001)
    y = qd.min(qd.max(place.y - 0.5, 0.0), dye.shape[0] - 1.001)
    c, r = qd.cast(x, qd.i32), qd.cast(y, qd.i32)
    u, v = x - c, y - r
    c1, r1 = qd.min(c + 1, dye.shape[1] - 1), qd.min(r + 1, dye.shape[0] - 1)
    total = vec4(0.0, 0.0, 0.0, 0.0)
    for k in qd.static(range(4)):
        top = dye[r, c, k] * (1.0 - u) + dye[r, c1, k] * u
        total[k] = top + ((dye[r1, c, k] * (1.0 - u) + dye[r1, c1, k] * u) - top) * v
    part = qd.max(total[0], 1e-6)
    return vec4(total[0], total[1] / part, total[2] / part, total[3] / part)


@qd.func
def dye_in(dye: qd.template(), place, tau):
    """(share of water `tau` [steps] thick that is dyed, linear colour of its dye) at a place in texels."""
    found = dye_at(dye, place)
    color = qd.min(qd.max(vec3(found[1], found[2], found[3]), 0.02), 0.98)
    return vec4(qd.min(found[0] / tau, 1.0), color.x, color.y, color.z)


@qd.func
def swallowed_by(dye, absorption, usual):
    """What water absorbs [1/m] where `dye_in` tells its dye: what the colour lacks.

    Strong dye shows in a layer thinner than is `usual` [m].
    """
    return absorption + dye[0] * (-qd.log(vec3(dye[1], dye[2], dye[3])) * (2.5 / usual) - absorption)


@qd.func
def thickness_at(thickness: qd.template(), place, scale):
    """Thickness at a place (column, row) in texels, between the four nearest; `scale` is in m per step."""
    rows, columns = thickness.shape[0], thickness.shape[1]
    x = qd.min(qd.max(place.x - 0.5, 0.0), columns - 1.001)
    y = qd.min(qd.max(place.y - 0.5, 0.0), rows - 1.001)
    c, r = qd.cast(x, qd.i32), qd.cast(y, qd.i32)
    u, v = x - c, y - r
    c1, r1 = qd.min(c + 1, columns - 1), qd.min(r + 1, rows - 1)
    top = thickness[r, c] * (1.0 - u) + thickness[r, c1] * u
    low = thickness[r1, c] * (1.0 - u) + thickness[r1, c1] * u
    return (top * (1.0 - v) + low * v) * scale

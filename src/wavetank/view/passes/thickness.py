"""Water along every line of sight: the sum of the particles' volumes, spread over smooth discs.

    code      symbol   meaning                                                       unit
    disc               radius of a particle's disc, `DISC`                          m
    peak               thickness in its middle: 3 d^3 / (pi disc^2)                  steps of d / 4096
    coarse             pixels of the picture per texel, in each direction            1

The disc (1 - q^2)^2 is wide enough that a lattice of particles adds up to an even thickness. Sums are whole numbers,
so they repeat bit for bit. The picture's map is at half its resolution, or coarser where a particle is large: a disc
never touches more than some twenty texels.
"""

import dataclasses
import math

from wavetank.device.compiler import qd, threads
from wavetank.device.state import interned
from wavetank.view.buffers import Buffers
from wavetank.view.cells import Cells
from wavetank.view.lens import (
    Lens,
    pixels_between,
    pixels_per_metre,
    ray_direction,
    ray_origin,
    to_pixel,
    to_view,
    vec2,
    vec3,
    vec4,
    view_ray,
)
from wavetank.view.optics.dyes import dyed
from wavetank.view.optics.fluid import DISC, coarseness, fineness
from wavetank.view.optics.rays import Box, box_interval
from wavetank.view.shot import Shot
from wavetank.view.strips import Strips, strip, strips_of
from wavetank.view.water_buffers import UNIT, Thickness, WaterBuffers, water_of

FRONT = 3.0  # d: how deep what counts as being in front may lie
WIDE = 2.0  # d: radius of the discs that tell what is in front


@dataclasses.dataclass(frozen=True, eq=False)
class Disc:
    """A particle's disc in a map, on the device."""

    radius: qd.f32  # m
    peak: qd.f32  # steps
    coarse: qd.f32  # pixels per texel
    lone: qd.i32  # 1 where lone particles count, 0 where they are drops of their own


def draw(shot: Shot, buffers: Buffers) -> None:
    """Fill the thickness as the eye sees it."""
    water = water_of(buffers, shot)
    add_up(shot, water, water.thickness, shot.lens, float(coarseness(shot)), lone=shot.frame.dim == 2)
    if water.thickness.fluids:
        d, dim, lone = shot.extent.spacing, shot.frame.dim, int(shot.frame.dim == 2)
        disc = interned(Disc(radius=WIDE * d, peak=peak(3), coarse=float(fineness(shot)), lone=lone))
        begin(water.thickness.edge, water.surface.depth, shot.lens, shot.walls, fineness(shot))
        part_front(
            water.thickness,
            water.cells,
            water.ellipsoids.lone,
            shot.frame.material,
            shot.lens,
            disc,
            (1.0 if dim == 3 else 0.0) / (FRONT * d),
            shot.frame.count,
        )


def draw_from_sun(shot: Shot, buffers: Buffers) -> None:
    """Fill the thickness as the sun sees it; a 2-D world has no shadows."""
    if shot.frame.dim == 3:
        water = water_of(buffers, shot)
        add_up(shot, water, water.sun_thickness, shot.water_sun, 1.0, lone=True)


def add_up(shot: Shot, water: WaterBuffers, thickness: Thickness, lens: Lens, coarse: float, lone: bool) -> None:
    """Fill maps with the discs of particles; the texel (r, c) holds the pixels from coarse r, c on."""
    frame, cells = shot.frame, water.cells
    disc = interned(
        Disc(radius=DISC[frame.dim] * shot.extent.spacing, peak=peak(frame.dim), coarse=coarse, lone=int(lone))
    )
    rows, columns = thickness.water.shape
    parts = int(thickness.sums.shape[0]) // int(rows * columns)
    alone = water.ellipsoids.lone
    if threads() > 0:
        add_in_parts(thickness, cells.x, alone, strips_of(thickness.water), lens, disc, parts, frame.count)
    else:
        add_at_once(thickness, cells.x, alone, lens, disc, frame.count)
    if shot.dyed:
        stain(thickness, cells, water.ellipsoids.lone, frame.dye, lens, disc, frame.count)
    else:
        thickness.stained.fill(0)
    if thickness.fluids:
        part(thickness, cells, water.ellipsoids.lone, frame.material, lens, disc, frame.count)


def peak(dim: int) -> float:
    """Thickness in the middle of a disc [steps]; water in a plane counts as a sheet one spacing thick."""
    return 3.0 / (math.pi * DISC[dim] ** 2) * UNIT


@qd.func
def disc_of(lens: Lens, disc: Disc, x, peak, rows, columns):
    """(column, row, 1 / radius^2, thickness in the middle) of a particle's disc in texels, and the box of those it
    covers: first and last row, first and last column; none where it is not before the eye.
    """
    c, box = to_view(lens, x), qd.Vector([0, -1, 0, -1])
    place, inverse, tall = vec2(0.0, 0.0), 1.0, 0.0
    if c.z > lens.near + 0.3 * disc.radius:
        place = to_pixel(lens, c) / disc.coarse
        # A disc next to the eye would fill the map; it counts as much farther away.
        wide, tall = qd.min(pixels_per_metre(lens, c.z) * disc.radius / disc.coarse, 24.0), peak
        if wide < 0.75:  # smaller than a texel: keep the volume
            tall = peak * wide * wide / 0.5625
            wide = 0.75
        inverse = qd.min(1.0 / (wide * wide), 2.0)  # the bound keeps the compiler from dividing at every texel
        box[0], box[1] = pixels_between(place.y - wide - 0.5, place.y + wide - 0.5, rows)
        box[2], box[3] = pixels_between(place.x - wide - 0.5, place.x + wide - 0.5, columns)
    return vec4(place.x, place.y, inverse, tall), box


@qd.func
def thickness_in(at, row, column):
    """Thickness of a disc `at` its place, as `disc_of` has it, in the middle of a texel."""
    away = (row + 0.5 - at.y) ** 2 + (column + 0.5 - at.x) ** 2
    near = qd.max(1.0 - away * at.z, 0.0)
    return at.w * near * near


@qd.func
def disc_seen(x: qd.template(), alone: qd.template(), lens: Lens, disc: Disc, i, rows, columns):
    """As `disc_of` has it, for particle `i`; its box is empty where it is left to the drops."""
    at, box = disc_of(lens, disc, x[i], disc.peak, rows, columns)
    if alone[i] > disc.lone:
        box[1] = -1
    return at, box


@qd.kernel(fastcache=True)
def add_in_parts(
    thickness: Thickness,
    x: qd.types.ndarray(),
    alone: qd.types.ndarray(),
    strips: Strips,
    lens: Lens,
    disc: Disc,
    parts: qd.i32,
    count: qd.i32,
):
    """Add up every particle's disc: each of the `parts` of them has sums of its own, so that no thread waits."""
    rows, columns = thickness.water.shape[0], thickness.water.shape[1]
    for turn in range(512 * parts):
        if turn & 511 == 0:  # the compiler gives a thread 512 turns at least
            add_part(thickness.sums, x, alone, lens, disc, turn >> 9, parts, rows, columns, count)
    for task in range(strips.count):
        row, first, last = strip(strips, task, rows, columns)
        for column in range(first, last):
            total = 0
            for part in range(parts):
                total += thickness.sums[(part * rows + row) * columns + column]
            thickness.water[row, column] = total


@qd.func
def add_part(
    sums: qd.template(),
    x: qd.template(),
    alone: qd.template(),
    lens: Lens,
    disc: Disc,
    part,
    parts,
    rows,
    columns,
    count,
):
    """Add up the discs of one part of the particles: runs of 64 in turn, as some parts of the water are nearer."""
    for k in range(part * rows * columns, (part + 1) * rows * columns):
        sums[k] = 0
    for run in range((count + 63) // 64):
        if run % parts == part:
            for i in range(64 * run, qd.min(64 * run + 64, count)):
                at, box = disc_seen(x, alone, lens, disc, i, rows, columns)
                for row in range(box[0], box[1] + 1):
                    begin = (part * rows + row) * columns
                    for column in range(box[2], box[3] + 1):
                        more = qd.cast(thickness_in(at, row, column) + 0.5, qd.i32)
                        sums[begin + column] = sums[begin + column] + more  # += would be atomic


@qd.kernel(fastcache=True)
def add_at_once(
    thickness: Thickness, x: qd.types.ndarray(), alone: qd.types.ndarray(), lens: Lens, disc: Disc, count: qd.i32
):
    """Add up every particle's disc in one map."""
    rows, columns = thickness.water.shape[0], thickness.water.shape[1]
    for row, column in qd.ndrange(rows, columns):
        thickness.water[row, column] = 0
    for i in range(count):
        at, box = disc_seen(x, alone, lens, disc, i, rows, columns)
        for row in range(box[0], box[1] + 1):
            for column in range(box[2], box[3] + 1):
                more = qd.cast(thickness_in(at, row, column) + 0.5, qd.i32)
                if more > 0:
                    qd.atomic_add(thickness.water[row, column], more)


@qd.kernel(fastcache=True)
def stain(
    thickness: Thickness,
    cells: Cells,
    alone: qd.types.ndarray(),
    dyes: qd.types.ndarray(),
    lens: Lens,
    disc: Disc,
    count: qd.i32,
):
    """Add up the discs of dyed particles, as strong as their dye, alone and times its colour.

    `thickness.stained` tells whether any is; where none is, `thickness.dye` holds nothing of use.
    """
    rows, columns = thickness.dye.shape[0], thickness.dye.shape[1]
    for k in range(thickness.stained.shape[0]):
        thickness.stained[k] = 0
    for a in range(count):
        if dyes[a] != 0:
            thickness.stained[0] = 1
    for row, column in qd.ndrange(rows, columns):
        if thickness.stained[0] == 1:
            for k in qd.static(range(4)):
                thickness.dye[row, column, k] = 0
    for a in range(count):
        own = 0
        if thickness.stained[0] == 1:
            own = dyes[cells.order[a]]
        if own != 0 and alone[a] <= disc.lone:
            strength = disc.peak * ((own >> 24) & 127) / 127.0
            at, box = disc_of(lens, disc, cells.x[a], strength, rows, columns)
            color = dyed(vec3(0.0, 0.0, 0.0), own | (127 << 24))
            for row in range(box[0], box[1] + 1):
                for column in range(box[2], box[3] + 1):
                    share = thickness_in(at, row, column)
                    qd.atomic_add(thickness.dye[row, column, 0], qd.cast(share + 0.5, qd.i32))
                    for k in qd.static(range(3)):
                        qd.atomic_add(thickness.dye[row, column, k + 1], qd.cast(share * color[k] + 0.5, qd.i32))


@qd.kernel(fastcache=True)
def part(
    thickness: Thickness,
    cells: Cells,
    alone: qd.types.ndarray(),
    materials: qd.types.ndarray(),
    lens: Lens,
    disc: Disc,
    count: qd.i32,
):
    """Add up the discs of each fluid's particles."""
    rows, columns = thickness.shares.shape[0], thickness.shares.shape[1]
    for row, column in qd.ndrange(rows, columns):
        for k in range(thickness.fluids):
            thickness.shares[row, column, k] = 0
    for a in range(count):
        if alone[a] <= disc.lone:
            kind = materials[cells.order[a]]
            at, box = disc_of(lens, disc, cells.x[a], disc.peak, rows, columns)
            for row in range(box[0], box[1] + 1):
                for column in range(box[2], box[3] + 1):
                    more = qd.cast(thickness_in(at, row, column) + 0.5, qd.i32)
                    qd.atomic_add(thickness.shares[row, column, kind], more)


@qd.kernel(fastcache=True)
def begin(edge: qd.types.ndarray(), depth: qd.types.ndarray(), lens: Lens, walls: Box, fine: qd.i32):
    """Fill the depth [m] at which each texel's water begins: its surface, or the pane before it."""
    for row, column in qd.ndrange(edge.shape[0], edge.shape[1]):
        r, c = qd.min(row * fine + fine // 2, depth.shape[0] - 1), qd.min(column * fine + fine // 2, depth.shape[1] - 1)
        ray = view_ray(lens, r, c)
        ends = box_interval(ray_origin(lens, ray), ray_direction(lens, ray), walls)
        z = qd.bit_cast(depth[r, c], qd.f32)
        edge[row, column] = qd.max(qd.select(z < 1e30, z, 0.0), ends[0])


@qd.kernel(fastcache=True)
def part_front(
    thickness: Thickness,
    cells: Cells,
    alone: qd.types.ndarray(),
    materials: qd.types.ndarray(),
    lens: Lens,
    disc: Disc,
    per_depth: qd.f32,
    count: qd.i32,
):
    """Add up each fluid's discs in what lies next behind the surface."""
    rows, columns = thickness.front.shape[0], thickness.front.shape[1]
    for row, column in qd.ndrange(rows, columns):
        for k in range(thickness.fluids):
            thickness.front[row, column, k] = 0
    for a in range(count):
        if alone[a] <= disc.lone:
            kind, z = materials[cells.order[a]], to_view(lens, cells.x[a]).z
            at, box = disc_of(lens, disc, cells.x[a], disc.peak, rows, columns)
            for row in range(box[0], box[1] + 1):
                for column in range(box[2], box[3] + 1):
                    near = 1.0 - qd.max((z - thickness.edge[row, column]) * per_depth, 0.0)
                    if near > 0.0:
                        more = qd.cast(near * near * thickness_in(at, row, column) + 0.5, qd.i32)
                        qd.atomic_add(thickness.front[row, column, kind], more)

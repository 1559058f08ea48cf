"""Neighbour search: a list of neighbours for every eight particles, from cells of edge h that they are sorted into.

Cells are numbered x + nx (y + ny z) modulo their count, for any whole numbers x, y, z. The numbering therefore covers
all of space with as many cells as there is room for: in a tank every cell has its own number, in the open two far
cells may share one, which costs a few more distance tests and changes no result. A row of three cells along x is
always three consecutive numbers, and the rows around a particle never overlap as long as nx, ny and nz are at least 3.

Eight particles that follow each other in sorted order (`sorting.py`) fill a piece of a row about as long as it is wide.
Such a group has one list, of all who are within h of any of the eight, itself included; `pairs.py` walks it. That is
three times as long as the list of one, so that lists of all take two fifths of the room.

Building a list tests the candidates of a row without a branch, a block of them against eight places into the bits of
one word, and then walks over the bits that are set. Measured: notebook/performance.md.
"""

import dataclasses
import math
from typing import Any

import numpy as np

from wavetank.device.compiler import lanes, qd, threads
from wavetank.device.periods import NONE, Periods, nearest_along, within_along
from wavetank.device.state import Coefficients, Grid, Particles, integers, nowhere
from wavetank.device.sums import blocks_of, many_threads, share_of
from wavetank.foundation.errors import WavetankError
from wavetank.physics.clusters import chunks_over, end_of_part, first_of_part, groups
from wavetank.physics.predicted_positions import predicted

PARTS = 8  # of a pass for each thread: enough to even out what takes longer
MAX_ENTRIES = 2**31 - 1  # of a device array: the compiler counts them, and computes places in them, with 32 bits


@qd.func
def cell_of(grid: Grid, x: qd.template(), h):
    """Number of the cell around the point `x`."""
    c = qd.Vector([0, 0, 0])
    for k in qd.static(range(x.n)):
        if qd.static(grid.periods.axes >> k & 1):
            lower = qd.Vector([grid.periods.x0, grid.periods.y0, grid.periods.z0])[k]
            period = qd.Vector([grid.periods.x, grid.periods.y, grid.periods.z])[k]
            number = qd.Vector([grid.nx, grid.ny, grid.nz])[k]
            share = (within_along(x[k], k, grid.periods) - lower) / period
            c[k] = qd.min(qd.cast(qd.floor(share * number), qd.i32), number - 1)
        else:
            c[k] = qd.cast(qd.floor(x[k] / h), qd.i32)
    return cell_number(grid, c)


@qd.func
def remainder(number, size):
    """Python's modulo, never negative; most numbers are less than `size`, and are not divided."""
    rest = number
    if number < 0 or number >= size:
        rest = number % size
    return rest


@qd.func
def cell_number(grid: Grid, c):
    """Number of the cell with the whole coordinates `c`."""
    number = 0
    if qd.static(grid.periods.axes):
        number = remainder(c[0], grid.nx) + grid.nx * (remainder(c[1], grid.ny) + grid.ny * remainder(c[2], grid.nz))
    else:
        layer = remainder(c[1] + grid.ny * remainder(c[2], grid.nz), grid.ny * grid.nz)
        number = remainder(c[0] + grid.nx * layer, grid.cells)
    return number


@qd.func
def row_block(dim: qd.template()):
    """Particles of a row that are tested without a branch: as many as a full row has, and some more."""
    return qd.static(32 if dim == 3 else 16)


@qd.func
def row_offset(grid: Grid, row, dim: qd.template()):
    """How far the cells of a row are from those of the middle one: of 3 rows in 2-D, of 9 in 3-D."""
    offset = grid.nx * (row % 3 - 1)
    if qd.static(dim == 3):
        offset += grid.nx * grid.ny * (row // 3 - 1)
    return offset


@qd.func
def first_around(grid: Grid, cell, row, dim: qd.template()):
    """Number of the first of the cells of a `row` around a cell: the one before it, or before one of its neighbours."""
    low = 0
    if qd.static(grid.periods.axes):
        layer = cell // grid.nx
        y = remainder(layer % grid.ny + row % 3 - 1, grid.ny)
        z = layer // grid.ny
        if qd.static(dim == 3):
            z = remainder(z + row // 3 - 1, grid.nz)
        low = remainder(cell % grid.nx - 1, grid.nx) + grid.nx * (y + grid.ny * z)
    else:
        low = remainder(cell + row_offset(grid, row, dim) - 1, grid.cells)
    return low


@qd.func
def first_of_ring(grid: Grid, low):
    """Number of the cell at which a row from number `low` on goes on behind the last one."""
    first = 0
    if qd.static(grid.periods.axes):
        first = low - low % grid.nx
    return first


@qd.func
def beyond_last(grid: Grid, low, cells):
    """How many of so many cells from number `low` on are beyond the last cell: the row goes on at the first one."""
    beyond = 0
    if qd.static(grid.periods.axes):
        beyond = qd.max(low % grid.nx + cells - grid.nx, 0)
    else:
        beyond = qd.max(low + cells - grid.cells, 0)
    return beyond


@qd.func
def goes_on(grid: Grid, cell, first, cells):
    """Whether a run of so many `cells`, with one on each side, from the cell `first` on goes on to a `cell`."""
    follows = cell - first <= qd.min(cells, grid.nx - 3)
    if qd.static(grid.periods.axes):
        follows = follows and cell // grid.nx == first // grid.nx
    return follows


@qd.func
def piece_of_row(grid: Grid, low, cells, piece):
    """The particles, from and to, of a piece of a row of so many cells: of those up to the last cell, or beyond it."""
    over = beyond_last(grid, low, cells)
    span = qd.Vector([grid.start[low], grid.start[low + cells - over]])
    if piece == 1:
        first = first_of_ring(grid, low)
        span = qd.Vector([grid.start[first], grid.start[first + over]])
    return span


@qd.func
def list_group(group, particles: Particles, grid: Grid, h2, count):
    """Write the neighbours of a group and return their number, even if it had no room."""
    room = grid.room
    dim = qd.static(particles.x[group].n)
    block = qd.static(row_block(dim))
    first = 8 * group
    last = qd.min(first + 8, count)
    n = 0
    begin_run = first
    while begin_run < last:
        # A run: particles in cells that follow each other, so that the rows around them are one as well.
        low_cell = grid.cell[grid.order[begin_run]]
        cells = 3
        end_run = begin_run + 1
        going = True
        while end_run < last and going:
            cell = grid.cell[grid.order[end_run]]
            going = goes_on(grid, cell, low_cell, cells)
            if going:
                cells = cell - low_cell + 3
                end_run += 1
        run = places_of(particles, first, begin_run, end_run)
        earlier = places_of(particles, first, first, begin_run)
        for row in range(qd.static(9 if dim == 3 else 3)):
            low = first_around(grid, low_cell, row, dim)
            for piece in range(1 + qd.min(beyond_last(grid, low, cells), 1)):
                span = piece_of_row(grid, low, cells, piece)
                begin, end = span[0], span[1]
                while begin < end:
                    length = qd.min(end - begin, block)
                    hits = new_bits(particles, run, earlier, begin_run > first, begin, length, h2, grid)
                    while hits != qd.u32(0):
                        grid.list[group * room + qd.min(n, room - 1)] = begin + qd.math.ffs(hits) - 1
                        hits &= hits - qd.u32(1)
                        n += 1
                    begin += block
        begin_run = end_run
    grid.number[group] = n
    for k in range(n, qd.min(n + 3, room)):
        grid.list[group * room + k] = grid.nowhere
    return n


@qd.kernel(fastcache=True)
def list_neighbors(particles: Particles, grid: Grid, c: Coefficients, count: qd.i32) -> qd.i32:
    """Write the neighbours of every group and return the largest number found, even if it had no room."""
    most = 0
    for chunk in range(chunks_over(groups(count), grid.parts, grid.lanes)):
        begin = first_of_part(chunk, groups(count), grid.parts, grid.lanes)
        for group in range(begin, end_of_part(chunk, groups(count), grid.parts, grid.lanes)):
            found = list_group(group, particles, grid, c.h * c.h, count)
            if qd.static(grid.lanes > 1):
                qd.atomic_max(most, found)
    if qd.static(grid.lanes == 1):
        for thread in range(many_threads()):
            found = 0
            for k in range(share_of(thread, groups(count))):
                found = qd.max(found, grid.number[thread + many_threads() * k])
            qd.atomic_max(most, found)
    return most


@qd.func
def places_of(particles: Particles, first, begin, end):
    """Places of the eight particles from `first` on, as columns; those outside of `begin` to `end` - 1 are nowhere."""
    places = qd.Matrix.zero(qd.f32, particles.x[first].n, 8)
    for k in range(8):
        p = predicted(particles, first + k)
        inside = first + k >= begin and first + k < end
        for axis in qd.static(range(p.n)):
            places[axis, k] = p[axis] if inside else nowhere()
    return places


@qd.func
def near_bits(particles: Particles, places: qd.template(), begin, length, h2, grid: Grid, whole: qd.template()):
    """Bits of the particles from `begin` on, at most a block, that are within the root of `h2` of any of `places`.

    Vectors want a `whole` block, whose number of turns the compiler knows: the bits of what is too many are cut off.
    """
    hits = qd.u32(0)
    for k in range(row_block(places.n) if qd.static(whole) else length):
        p = predicted(particles, begin + k)
        nearest = 2.0 * h2
        for column in qd.static(range(places.m)):
            square = 0.0
            for axis in qd.static(range(places.n)):
                square += nearest_along(p[axis] - places[axis, column], axis, grid.periods) ** 2
            nearest = qd.min(nearest, square)
        hits |= qd.cast(nearest < h2, qd.u32) << qd.cast(k, qd.u32)
    return hits & (qd.u32(0xFFFFFFFF) >> qd.cast(32 - length, qd.u32))


@qd.func
def new_bits(
    particles: Particles, run: qd.template(), earlier: qd.template(), has_earlier, begin, length, h2, grid: Grid
):
    """Bits of the particles from `begin` on that are near one of a `run`, and near none of `earlier` if there are any.

    One call of `near_bits` serves both, as each is inlined and compiled.
    """
    hits = qd.u32(0xFFFFFFFF)
    for known in range(2 if has_earlier else 1):
        places = run
        if known == 1:
            places = earlier
        bits = near_bits(particles, places, begin, length, h2, grid, grid.lanes > 1)
        hits &= bits if known == 0 else ~bits
    return hits


@qd.func
def for_each_row_around(sums: qd.template(), visit: qd.template(), point, particles: Particles, grid: Grid, h):
    """Call ``visit(sums, point, begin, end, particles, grid, h)`` for every row of particles in cells around `point`.

    The particles of a row are those from `begin` to `end` - 1; some of them are farther away than h.
    """
    cell = cell_of(grid, point, h)
    for row in range(qd.static(9 if point.n == 3 else 3)):
        low = first_around(grid, cell, row, point.n)
        for piece in range(1 + qd.min(beyond_last(grid, low, 3), 1)):
            span = piece_of_row(grid, low, 3, piece)
            visit(sums, point, span[0], span[1], particles, grid, h)


def new_grid(
    dim: int, capacity: int, size: tuple[float, ...] | None, h: float, room: int, periods: Periods = NONE
) -> Grid:
    """Allocate a grid for `capacity` particles.

    `size` [m] is that of the tank, or None in the open. The number of cells follows the tank as long as that is not
    much more than there are particles. Raises `WavetankError` for more particles than lists have room for.
    """
    entries = _new_list(capacity, room)
    limit = max(4 * capacity, 4096)
    cells = np.full(3, 3, np.int64)
    if size is None:
        cells[:dim] = max(3, math.ceil(limit ** (1.0 / dim)))
    else:
        # One layer of cells more on each side, for particles on a wall.
        cells[:dim] = [min(max(3, math.ceil(edge / h) + 2), 2**20) for edge in size]
        # Along an axis that repeats they divide the tank, and none is shorter than the support.
        rings = [axis for axis in range(dim) if periods.axes >> axis & 1]
        cells[rings] = [min(max(3, math.floor(size[axis] / h * (1.0 - 1e-6))), 2**20) for axis in rings]
    while cells.prod() > max(limit, 27):
        cells[int(np.argmax(cells))] = max(3, cells.max() // 2)
    total = int(cells.prod())
    return Grid(
        cell=integers(capacity),
        start=integers(total + 1),
        fill=integers(total),
        blocks=integers(blocks_of(total)),
        order=integers(capacity),
        number=integers(_groups(capacity)),
        list=entries,
        room=room,
        lanes=lanes(),
        parts=PARTS * max(threads(), 1),
        nowhere=capacity,
        nx=int(cells[0]),
        ny=int(cells[1]),
        nz=int(cells[2]),
        cells=total,
        periods=periods,
    )


def list_room(dim: int, support: float) -> int:
    """Places of a list at the start, in cache lines: those near a cube (2-D: a square) of four particles, and more."""
    edge = 4.0 ** (1.0 / dim)
    near = edge**2 + 4.0 * edge * support + math.pi * support**2
    if dim == 3:
        near = edge**3 + 6.0 * edge**2 * support + math.pi * support**2 * (3.0 * edge + 4.0 / 3.0 * support)
    return 16 * math.ceil(near / 16) + 16


def find_neighbors(particles: Particles, grid: Grid, c: Coefficients, count: int) -> Grid:
    """List the neighbours of sorted particles; return the grid, with larger lists where there was too little room."""
    most = int(list_neighbors(particles, grid, c, count))
    if most >= grid.room:
        room = _rounded(most)
        grid = dataclasses.replace(grid, room=room, list=_new_list(grid.order.shape[0], room))
        list_neighbors(particles, grid, c, count)
    return grid


def _new_list(capacity: int, room: int) -> Any:
    """Allocate `room` places for each of `capacity` particles, or say how many particles there may be."""
    if _groups(capacity) * room > MAX_ENTRIES:
        raise WavetankError(
            f"{capacity:,} particles with room for {room} neighbours of every eight are too many: lists have at most "
            f"{MAX_ENTRIES:,} places, enough for {MAX_ENTRIES // room * 8:,} particles; use a larger spacing or less "
            "fluid."
        )
    return integers(_groups(capacity) * room)


def _groups(capacity: int) -> int:
    return -(-capacity // 8)


def _rounded(most: int) -> int:
    return -(-most * 5 // 4 // 16) * 16

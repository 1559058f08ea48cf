"""Sums over the neighbours of every particle, eight particles at a time.

A pass over pairs runs over clusters (`clusters.py`): particles that follow each other in sorted order and share a
neighbour list (`neighbors.py`), eight on a processor and one on a graphics card. Each neighbour is read once for the
cluster, and the loop over lanes becomes vector instructions. A cluster's list is three times as long as a particle's,
and is walked in half the time (notebook/performance.md). A pass looks like this:

    for chunk in range(chunks(grid, count)):
        for cluster in range(first_cluster(chunk, grid, count), end_cluster(chunk, grid, count)):
            sums = qd.Matrix.zero(qd.f32, 1, grid.lanes)
            add_neighbors(sums, visit, cluster, particles, data, grid, c, method)
            for i in range(cluster * grid.lanes, end_of(cluster, grid, count)):
                ... sums[0, i - cluster * grid.lanes] ...

Cluster pair lists for vector units: Páll and Hess 2013, "A flexible algorithm for calculating pair interactions on SIMD
architectures" (10.1016/j.cpc.2013.06.003).
"""

from typing import Any

import numpy as np

from wavetank.device.compiler import download, qd
from wavetank.device.state import Coefficients, Grid, Particles, integers
from wavetank.physics.clusters import chunks, end_cluster, end_of, first_cluster, group_of, place_in_group
from wavetank.physics.predicted_positions import apart


@qd.func
def add_neighbors(
    sums: qd.template(),
    visit: qd.template(),
    cluster,
    particles: Particles,
    data: qd.template(),
    grid: Grid,
    c: Coefficients,
    method: qd.template(),
):
    """Add up what ``visit(sum, r, square, a, b, c, method)`` adds for each neighbour j of each i of a cluster.

    `sums` has a column for each of the cluster's particles, r = p_i - p_j [m] has the `square` |r|^2 [m^2], a and b are
    what `data` holds of i and j, as vectors. `visit` is called for others than neighbours as well and adds nothing
    where |r| >= h; it is called for the particle itself, with r = 0 and a = b.
    """
    _add(sums, visit, cluster, particles, data, data, False, grid, c, method)


@qd.func
def add_kept(
    sums: qd.template(),
    visit: qd.template(),
    cluster,
    particles: Particles,
    data: qd.template(),
    kept: qd.template(),
    grid: Grid,
    c: Coefficients,
    method: qd.template(),
):
    """Add up like `add_neighbors`, where `visit` is given what `keep_pairs` kept of a pair instead of its `square`."""
    _add(sums, visit, cluster, particles, data, kept, True, grid, c, method)


@qd.func
def keep_pairs(
    kept: qd.template(),
    strength: qd.template(),
    cluster,
    particles: Particles,
    data: qd.template(),
    grid: Grid,
    c: Coefficients,
):
    """Keep ``strength(square, a, b, c)`` of each neighbour j of each i of a cluster, for several sums by `add_kept`.

    `kept` has room for `grid.room` numbers of each particle. What follows from a distance takes a root and divisions;
    from the second sum on it takes less to read it.
    """
    lanes = qd.static(grid.lanes)
    first = cluster * lanes
    own = _own(data, first, lanes)
    begin = group_of(first) * grid.room
    found = qd.Matrix.zero(qd.f32, 4, lanes)  # what was stored at once might be one of the arrays that are read
    for turn in range((grid.number[group_of(first)] + 3) // 4):  # as far as visits in twos and fours come
        n = begin + 4 * turn
        for lane in range(lanes):
            for k in qd.static(range(4)):
                j = grid.list[n + k]
                r = apart(particles, first + lane, j, grid)
                found[k, lane] = strength(r.norm_sqr(), column(own, lane), _row(data, j), c)
        for k in qd.static(range(4)):
            for lane in range(lanes):
                kept[_place(n + k, first, lanes) + lane] = found[k, lane]


@qd.func
def _add(
    sums: qd.template(),
    visit: qd.template(),
    cluster,
    particles: Particles,
    data: qd.template(),
    kept: qd.template(),
    is_kept: qd.template(),
    grid: Grid,
    c: Coefficients,
    method: qd.template(),
):
    """Add up as `add_kept` does where `is_kept`, else as `add_neighbors`."""
    lanes = qd.static(sums.m)
    first = cluster * lanes
    own = _own(data, first, lanes)
    begin = group_of(first) * grid.room
    end = begin + grid.number[group_of(first)]
    # A short loop over lanes would be unrolled before it can be computed as vectors: its visits come in twos or fours.
    size, dim = qd.static(sums.n, particles.x[first].n)
    pace = qd.static(1 if size > 3 else 4 if dim == 2 and size == 1 else 2)
    # Each of them has sums of its own: in which order more than two numbers are added is the compiler's choice.
    others = qd.Matrix.zero(qd.f32, size * (pace - 1 if pace > 1 else 1), lanes)
    for turn in range((end - begin + pace - 1) // pace):
        for lane in range(lanes):
            for k in qd.static(range(pace)):
                n = begin + pace * turn + k
                j = grid.list[n]
                r = apart(particles, first + lane, j, grid)
                part = qd.Vector([0.0] * size)
                if qd.static(is_kept):
                    given = kept[_place(n, first, lanes) + lane]
                    visit(part, r, given, column(own, lane), _row(data, j), c, method)
                else:
                    visit(part, r, r.norm_sqr(), column(own, lane), _row(data, j), c, method)
                for m in qd.static(range(size)):
                    if qd.static(k == 0):
                        sums[m, lane] += part[m]
                    else:
                        others[(k - 1) * size + m, lane] += part[m]
    for k in qd.static(range(pace - 1)):
        for lane in range(lanes):
            for m in qd.static(range(size)):
                sums[m, lane] += others[k * size + m, lane]


@qd.func
def _own(data: qd.template(), first, lanes: qd.template()):
    """What `data` holds of a cluster's particles, a column for each."""
    own = qd.Matrix.zero(qd.f32, qd.static(_width(data)), lanes)
    for lane in range(lanes):
        a = _row(data, first + lane)
        for k in qd.static(range(own.n)):
            own[k, lane] = a[k]
    return own


@qd.func
def _place(n, first, lanes: qd.template()):
    """Where what is kept of the entry `n` of a list begins, for the cluster that begins with particle `first`."""
    place = 8 * n
    if qd.static(lanes == 1):
        place += place_in_group(first)
    return place


def _width(data: Any) -> int:
    """Numbers in an element of a device array."""
    return int((data.element_shape() or (1,))[0])


@qd.func
def _row(data: qd.template(), i):
    """Element `i` of a device array, as a vector."""
    if qd.static(len(data.element_shape()) == 0):
        return qd.Vector([data[i]])
    return data[i]


@qd.func
def column(sums: qd.template(), lane):
    """Sums of one particle of a cluster, as a vector."""
    result = qd.Vector([0.0] * sums.n)
    for k in qd.static(range(sums.n)):
        result[k] = sums[k, lane]
    return result


@qd.func
def add_one(sums: qd.template(), r, square, a, b, c: Coefficients, method: qd.template()):
    """Count neighbour j."""
    if square < c.h * c.h:
        sums[0] += 1.0


@qd.kernel(fastcache=True)
def write_numbers(number: qd.types.ndarray(), particles: Particles, grid: Grid, c: Coefficients, count: qd.i32):
    """Write how many neighbours every particle has."""
    for chunk in range(chunks(grid, count)):
        for cluster in range(first_cluster(chunk, grid, count), end_cluster(chunk, grid, count)):
            sums = qd.Matrix.zero(qd.f32, 1, grid.lanes)
            add_neighbors(sums, add_one, cluster, particles, particles.x, grid, c, 0)
            for i in range(cluster * grid.lanes, end_of(cluster, grid, count)):
                number[i] = qd.cast(sums[0, i - cluster * grid.lanes], qd.i32) - 1  # without itself


def count_neighbors(particles: Particles, grid: Grid, c: Coefficients, count: int) -> np.ndarray:
    """Return how many neighbours within h every particle has, int32 [count], in device order."""
    number = integers(count)
    write_numbers(number, particles, grid, c, count)
    return np.array(download(number)[:count])

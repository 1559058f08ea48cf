"""Particles to a level-set field of the water: smooth where there is much of it, ellipsoids where it is thin.

Two fields are blended. The first is the liquid fraction around a node, a sum of (1 - q^2)^3 over the particles, blurred
until the lattice of particles disappears; its value of one half is the surface (J. Monaghan, "Smoothed particle
hydrodynamics", 2005, Eq. 2.7 for the sum). It is smooth over deep water, and loses thin sheets. The second is the union
of the ellipsoids that all pictures show (`passes/ellipsoids.py`), which keeps sheets and threads. In deep water the
ellipsoids are inset, so that their bumps stay below the first field. The smooth maximum of both is the water.

Sums and maxima are taken of whole numbers, so that they do not depend on threads. At panes the field is mirrored; into
solids it is extended, so that the surface meets them at a right angle and without a gap.

    code         symbol   meaning                                                        unit
    fraction     s        liquid fraction                                                1
    reach        R        radius of the kernel, 1.75 d                                   m
    bulk                  liquid fraction in a wider neighbourhood                       1
    inset                 by how much ellipsoids are shrunk                              m
"""

import dataclasses
import math
from typing import Any

import numpy as np

from wavetank.device.compiler import qd
from wavetank.device.state import interned
from wavetank.solids.distance import SolidSet, around, signed_distance
from wavetank.view.film.grid import Field, Grid, node_at, value_at
from wavetank.view.lens import vec3, vector
from wavetank.view.optics.rays import box
from wavetank.view.shot import Shot
from wavetank.view.water_buffers import Ellipsoids, WaterBuffers

NODES_A_SPACING, MOST_NODES = 2.0, 48_000_000
REACH = 1.75  # d
UNIT = 65536.0  # fixed-point steps of a liquid fraction, and of a level in units of a node
SURFACE_BLURS, BULK_BLURS = 6, 5  # binomial blurs of the surface, and further ones of the bulk
INSET = 0.16  # d
MARGIN = 4  # nodes of air in the open and above


@dataclasses.dataclass(eq=False)
class FieldArrays:
    """Temporaries of a field on one grid, on the device."""

    grid: Grid
    sums: Any  # i32 [nodes]: fixed-point sums of the kernel, then the union of ellipsoids
    one: Any  # f32 [nodes]
    two: Any  # f32 [nodes]
    level: Any  # f32 [nodes], m
    skip: Any  # i32 [cells]
    near: Any  # i32 [cells]: 1 where there are balls


def grid_around(shot: Shot, reach: float) -> Grid:
    """Return the grid for the water of a picture, with a margin of `reach` [m] for motion."""
    d, frame, tank = shot.extent.spacing, shot.frame, shot.frame.scene.tank
    x = frame.positions if frame.count else np.array([shot.extent.middle])
    low, high = x.min(axis=0) - reach, x.max(axis=0) + reach
    lower, upper = np.array(shot.extent.lower, float), np.array(shot.extent.upper, float)
    step = d / NODES_A_SPACING
    margin = (MARGIN + NODES_A_SPACING * 1.5) * step
    if tank is None:
        lower, upper = low - margin, high + margin
    upper[1] = max(high[1] + margin, lower[1] + 4.0 * step)
    upper[1] = min(upper[1], lower[1] + 4.0 * max(float(shot.extent.upper[1] - lower[1]), 8.0 * d))
    size = upper - lower
    step *= max(1.0, (float(np.prod(size / step)) / MOST_NODES) ** (1.0 / 3.0))
    count = [max(4, 2 * round(float(length) / (2.0 * step))) for length in size]
    return interned(
        Grid(
            lower=vector(*lower),
            upper=vector(*upper),
            box=box(lower, upper),
            step=vector(*(size / count)),
            nx=count[0],
            ny=count[1],
            nz=count[2],
            spacing=d,
            walled=int(tank is not None),
        )
    )


def allocate(grid: Grid) -> FieldArrays:
    """Allocate the temporaries of a field on that grid."""
    nodes = grid.nx * grid.ny * grid.nz
    real = [qd.ndarray(qd.f32, shape=(nodes,)) for _ in range(3)]
    cells = [qd.ndarray(qd.i32, shape=(nodes // 8,)) for _ in range(2)]
    return FieldArrays(grid, qd.ndarray(qd.i32, shape=(nodes,)), *real, *cells)


def rest_sum() -> float:
    """Return the mean sum of the kernel over the particles of full water."""
    return REACH**3 * 4.0 * math.pi * 16.0 / 315.0


def build(arrays: FieldArrays, water: WaterBuffers, shot: Shot) -> Field:
    """Return the field of the particles that `water` has sorted and fitted ellipsoids to."""
    grid, count, d = arrays.grid, shot.frame.count, shot.extent.spacing
    arrays.sums.fill(0)
    splat_particles(arrays.sums, water.cells.x, grid, REACH * d, UNIT / rest_sum(), count)
    solids = shot.frame.solids
    divide_by_free_share(arrays.one, arrays.sums, solids, grid, REACH * d, 1.0 / UNIT)
    given, taken = arrays.one, arrays.two
    if solids.count > solids.tank_count:
        extend_into_solids(taken, given, solids, grid, 0.6 * d)
        given, taken = taken, given
    for _ in range(SURFACE_BLURS):
        for axis in range(3):
            blur(taken, given, grid, axis)
            given, taken = taken, given
    arrays.level.copy_from(given)
    for _ in range(BULK_BLURS):
        for axis in range(3):
            blur(taken, given, grid, axis)
            given, taken = taken, given
    arrays.sums.fill(-(1 << 30))
    add_ellipsoids(arrays.sums, water.ellipsoids, grid, UNIT / float(grid.step[0]), count)
    # Standard deviation of the whole blur along an axis: the slope of what a plane becomes.
    wide = math.sqrt((REACH * d) ** 2 / 11.0 + SURFACE_BLURS * float(np.max(grid.step)) ** 2)
    blend_fields(
        arrays.level, arrays.sums, given, grid, math.sqrt(2.0 * math.pi) * wide, INSET * d, float(grid.step[0]) / UNIT
    )
    mark_cells(arrays.skip, arrays.level, arrays.near, grid)
    for axis in range(3):
        measure_skip(arrays.near, arrays.skip, grid, axis)
        arrays.skip, arrays.near = arrays.near, arrays.skip
    return Field(grid=grid, level=arrays.level, skip=arrays.skip)


@qd.func
def mirrored_index(i, count, walled):
    """Index of a node, mirrored at panes; -1 outside of the grid where there is none."""
    result = i
    if i < 0:
        result = qd.select(walled == 1, -1 - i, -1)
    elif i >= count:
        result = qd.select(walled == 1, 2 * count - 1 - i, -1)
    return qd.select(result < count, result, -1)


@qd.kernel(fastcache=True)
def splat_particles(
    sums: qd.types.ndarray(), x: qd.types.ndarray(), grid: Grid, reach: qd.f32, unit: qd.f32, count: qd.i32
):
    """Add the kernel of every particle to the nodes around it, in fixed point."""
    for a in range(count):
        p = x[a]
        first = qd.cast(qd.floor((p - reach - grid.lower) / grid.step - 0.5), qd.i32)
        last = qd.cast(qd.ceil((p + reach - grid.lower) / grid.step - 0.5), qd.i32)
        for k in range(first.z, last.z + 1):
            kk = mirrored_index(k, grid.nz, grid.walled)
            for j in range(first.y, last.y + 1):
                jj = qd.select(j >= grid.ny, -1, mirrored_index(j, grid.ny, grid.walled))
                for i in range(first.x, last.x + 1):
                    ii = mirrored_index(i, grid.nx, grid.walled)
                    r = grid.lower + (vec3(i, j, k) + 0.5) * grid.step - p
                    q = 1.0 - r.dot(r) / (reach * reach)
                    if qd.min(qd.min(ii, jj), kk) >= 0 and q > 0.0:
                        qd.atomic_add(sums[node_at(grid, ii, jj, kk)], qd.cast(unit * q * q * q + 0.5, qd.i32))


@qd.func
def nearest_wall(solids: SolidSet, x, far):
    """(gradient, distance) of the nearest solid but the tank; a distance of `far` where none is nearer."""
    best = qd.Vector([0.0, 1.0, 0.0, far])
    for k in range(solids.tank_count, solids.count):
        off = x - solids.position[k]
        reach = solids.reach[k] + far
        if solids.reach[k] < around() and (solids.reach[k] > 1e4 or off.dot(off) < reach * reach):
            value = signed_distance(solids, k, x)
            if value.w < best[3]:
                best = qd.Vector([value.x, value.y, value.z, value.w])
    return best


@qd.func
def free_share(q):
    """Share of the kernel on the free side of a plane `q` reaches away: the integral of (1 - z^2)^4."""
    z = qd.min(qd.max(q, -1.0), 1.0)
    s = z * z
    return 0.5 + 1.23046875 * z * (1.0 + s * (-1.3333333 + s * (1.2 + s * (-0.5714286 + s * 0.1111111))))


@qd.kernel(fastcache=True)
def divide_by_free_share(
    fraction: qd.types.ndarray(), sums: qd.types.ndarray(), solids: SolidSet, grid: Grid, reach: qd.f32, per: qd.f32
):
    """Turn sums into liquid fractions, without the share of the kernel that solids cut off."""
    for n in range(grid.nx * grid.ny * grid.nz):
        s = sums[n] * per
        if s > 0.0 and solids.count > solids.tank_count:
            x = grid.lower + (vec3(n % grid.nx, n // grid.nx % grid.ny, n // (grid.nx * grid.ny)) + 0.5) * grid.step
            q = nearest_wall(solids, x, reach)[3] / reach
            s /= qd.max(free_share(q), 0.4)
        fraction[n] = qd.min(s, 1.0)


@qd.kernel(fastcache=True)
def extend_into_solids(
    fraction: qd.types.ndarray(), before: qd.types.ndarray(), solids: SolidSet, grid: Grid, keep: qd.f32
):
    """Extend the water into solids: nearer than `keep` [m] to them, and inside, it is as at that distance."""
    for n in range(grid.nx * grid.ny * grid.nz):
        x = grid.lower + (vec3(n % grid.nx, n // grid.nx % grid.ny, n // (grid.nx * grid.ny)) + 0.5) * grid.step
        wall = nearest_wall(solids, x, keep)
        s = before[n]
        if wall[3] < keep and wall[3] > -8.0 * keep:
            s = value_at(before, grid, x + (keep - wall[3]) * vec3(wall[0], wall[1], wall[2]))
        fraction[n] = s


@qd.kernel(fastcache=True)
def blur(fraction: qd.types.ndarray(), before: qd.types.ndarray(), grid: Grid, axis: qd.i32):
    """Blur along an axis by 1 4 6 4 1, a standard deviation of one node."""
    for n in range(grid.nx * grid.ny * grid.nz):
        i, j, k = n % grid.nx, n // grid.nx % grid.ny, n // (grid.nx * grid.ny)
        at, count, by = i, grid.nx, 1
        if axis == 1:
            at, count, by = j, grid.ny, grid.nx
        elif axis == 2:
            at, count, by = k, grid.nz, grid.nx * grid.ny
        total = 0.375 * before[n]
        for m in qd.static(range(4)):
            off = qd.static((-2, -1, 1, 2)[m])
            there = at + off
            if there < 0:
                there = -1 - there
            if there >= count:
                there = 2 * count - 1 - there
            total += qd.static((0.0625, 0.25, 0.25, 0.0625)[m]) * before[n + (there - at) * by]
        fraction[n] = total


@qd.kernel(fastcache=True)
def add_ellipsoids(sums: qd.types.ndarray(), ellipsoids: Ellipsoids, grid: Grid, unit: qd.f32, count: qd.i32):
    """Raise every node to its depth in the ellipsoids around it; lone particles are drawn as balls instead."""
    for a in range(count):
        size = ellipsoids.size[a]
        if not (size > 0.0 and ellipsoids.lone[a] == 0):
            continue
        c = ellipsoids.center[a]
        m, o = ellipsoids.axes[a], ellipsoids.mixed[a]
        # The inverse of B^2 by its cofactors.
        p, q, s = m.y * m.z - o.z * o.z, o.y * o.z - o.x * m.z, o.x * o.z - o.y * m.y
        determinant = m.x * p + o.x * q + o.y * s
        if not determinant > 0.0:
            continue
        per = 1.0 / determinant
        diagonal = per * vec3(p, m.x * m.z - o.y * o.y, m.x * m.y - o.x * o.x)
        others = per * vec3(q, s, o.x * o.y - m.x * o.z)  # xy, xz, yz
        reach = size + 2.0 * grid.step.max()
        first = qd.cast(qd.ceil((c - reach - grid.lower) / grid.step - 0.5), qd.i32)
        last = qd.cast(qd.floor((c + reach - grid.lower) / grid.step - 0.5), qd.i32)
        for k in range(qd.max(first.z, 0), qd.min(last.z, grid.nz - 1) + 1):
            for j in range(qd.max(first.y, 0), qd.min(last.y, grid.ny - 1) + 1):
                for i in range(qd.max(first.x, 0), qd.min(last.x, grid.nx - 1) + 1):
                    r = grid.lower + (vec3(i, j, k) + 0.5) * grid.step - c
                    depth = depth_in_ellipsoid(diagonal, others, r, size)
                    if depth > -2.5 * grid.step.max():
                        qd.atomic_max(sums[node_at(grid, i, j, k)], qd.cast(depth * unit, qd.i32))


@qd.func
def depth_in_ellipsoid(diagonal, others, r, size):
    """Approximate depth [m] at `r` from the middle of an ellipsoid r^T A r = 1, of which `size` is the largest radius.

    `diagonal` is that of the symmetric matrix A, `others` its elements xy, xz, yz.
    """
    g = diagonal * r + vec3(
        others.x * r.y + others.y * r.z, others.x * r.x + others.z * r.z, others.y * r.x + others.z * r.y
    )
    far = qd.sqrt(qd.max(r.dot(g), 0.0))
    depth = (1.0 - far) * far / qd.max(g.norm(), 1e-12)
    if far < 0.05:
        depth = 0.5 * size
    return depth


@qd.kernel(fastcache=True)
def blend_fields(
    level: qd.types.ndarray(),
    union: qd.types.ndarray(),
    bulk: qd.types.ndarray(),
    grid: Grid,
    slope: qd.f32,
    inset: qd.f32,
    unit: qd.f32,
):
    """Blend the two fields into `level`, which holds the liquid fraction before."""
    for n in range(grid.nx * grid.ny * grid.nz):
        smooth = (level[n] - 0.5) * slope
        much = qd.min(qd.max((bulk[n] - 0.26) / 0.14, 0.0), 1.0)
        thin = qd.max(union[n] * unit - inset * much * much * (3.0 - 2.0 * much), -2.0 * slope)
        blend = qd.max(inset - qd.abs(smooth - thin), 0.0)
        level[n] = qd.max(smooth, thin) + 0.25 * blend * blend / inset


@qd.kernel(fastcache=True)
def mark_cells(skip: qd.types.ndarray(), level: qd.types.ndarray(), near: qd.types.ndarray(), grid: Grid):
    """Write 0 for cells that hold a surface or balls, 99 for others."""
    for c in range(grid.nx // 2 * (grid.ny // 2) * (grid.nz // 2)):
        x, y, z = c % (grid.nx // 2), c // (grid.nx // 2) % (grid.ny // 2), c // (grid.nx // 2 * (grid.ny // 2))
        low, high = 1e9, -1e9
        for m in range(64):
            i = qd.min(qd.max(2 * x - 1 + m % 4, 0), grid.nx - 1)
            j = qd.min(qd.max(2 * y - 1 + m // 4 % 4, 0), grid.ny - 1)
            k = qd.min(qd.max(2 * z - 1 + m // 16, 0), grid.nz - 1)
            here = level[node_at(grid, i, j, k)]
            low, high = qd.min(low, here), qd.max(high, here)
        skip[c] = qd.select((low < 0.0 and high > 0.0) or near[c] == 1, 0, 99)


@qd.kernel(fastcache=True)
def measure_skip(skip: qd.types.ndarray(), before: qd.types.ndarray(), grid: Grid, axis: qd.i32):
    """Extend the distance to the nearest marked cell (Chebyshev, up to 12 cells) by one more axis."""
    for c in range(grid.nx // 2 * (grid.ny // 2) * (grid.nz // 2)):
        mx, my, mz = grid.nx // 2, grid.ny // 2, grid.nz // 2
        at, count, by = c % mx, mx, 1
        if axis == 1:
            at, count, by = c // mx % my, my, mx
        elif axis == 2:
            at, count, by = c // (mx * my), mz, mx * my
        best = 12
        for off in range(-11, 12):
            there = at + off
            if there >= 0 and there < count:
                best = qd.min(best, qd.max(qd.abs(off), before[c + off * by]))
        skip[c] = best

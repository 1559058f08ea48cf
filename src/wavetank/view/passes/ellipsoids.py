"""Particles as ellipsoids that follow the shape of the water around them: flat on a surface, long in a thread.

J. Yu, G. Turk, "Reconstructing surfaces of particle-based fluids using anisotropic kernels", ACM Transactions on
Graphics 32 (2013), doi:10.1145/2421636.2421641: Eq. 6 (smoothed centres), Eq. 9 (weighted covariance).

    code      symbol   meaning                                                        unit
    reach     r_i      radius of the neighbourhood, 2.2 d                             m
    w         w_ij     weight of a neighbour, 1 - (|r| / r_i)^2                        1
    mean               weighted mean of the neighbours, from the particle             m
    C         C_i      weighted covariance around that mean over that of full water   1
    B         G^-1     symmetric matrix that maps the unit ball onto the ellipsoid    m
    shape     B^2      what the splat needs, packed as xx, yy, zz and xy, xz, yz      m^2

Where we differ: no eigenvalues are taken. B = a + b C^2 has the axes of C, a lower bound on its radii (which is what
the paper clamps for) and flattens like the paper's C, without a decomposition per particle. Centres at a surface move
only by what they stick out of it or lie too deep, judged by how far off the mean is, so that water keeps its volume.
Few neighbours fade to a ball, so that a drop is round. Walls are not a surface: what touches one reaches through it.
Particles deep inside are not drawn: cells whose neighbours are all well filled are left out.
"""

import dataclasses

from wavetank.device.compiler import qd
from wavetank.device.state import interned
from wavetank.view.buffers import Buffers
from wavetank.view.cells import Cells, sort
from wavetank.view.lens import vec3
from wavetank.view.optics.panes import share_before_wall
from wavetank.view.optics.rays import Box
from wavetank.view.shot import Shot
from wavetank.view.water_buffers import REACH, Ellipsoids, water_of

BALL = 0.58  # d: radius of a lone particle, a little more than that of its volume
LEAST = 0.36  # d: radius across a sheet
WIDEST = {2: 1.9, 3: 1.15}  # d: radius in full water; a plane can afford smoother outlines
BEYOND = 1.3  # d: how far what touches a pane reaches through it
MIRRORED = 3.2  # d: how near a pane the surface has a mirror image behind it
DEPTH_2D = 0.75  # d: half thickness of a 2-D world's water
#: Sum of the weights from which on a particle is not drawn: 0.93 of a lattice's, which the particles a spacing and
#: more below a surface reach; a 2-D world shows all of its water.
FULL = {2: 1e9, 3: 0.93 * 16.9}


@dataclasses.dataclass(frozen=True, eq=False)
class Shape:
    """Sizes of ellipsoids, on the device."""

    spacing: qd.f32  # m
    reach: qd.f32  # m
    least: qd.f32  # m: radius across a sheet
    growth: qd.f32  # m: from there to the radius in full water
    ball: qd.f32  # m: radius of a lone particle
    beyond: qd.f32  # m: how far what touches a pane reaches through it
    mirrored: qd.f32  # m: how near a pane there is a mirror image behind it
    depth_2d: qd.f32  # m: half thickness of a 2-D world's water
    full: qd.f32  # sum of the weights from which on a particle is not drawn


def draw(shot: Shot, buffers: Buffers) -> None:
    """Find the ellipsoids of a frame; they hold for every eye."""
    water, frame = water_of(buffers, shot), shot.frame
    sort(frame, water.cells)
    fit(water.ellipsoids, water.cells, shot.walls, shape(frame.dim, shot.extent.spacing), frame.dim, frame.count)


def shape(dim: int, d: float) -> Shape:
    """Return the sizes of the ellipsoids of particles with the spacing `d` [m]."""
    return interned(
        Shape(
            spacing=d,
            reach=REACH * d,
            least=LEAST * d,
            growth=(WIDEST[dim] - LEAST) * d,
            ball=BALL * d,
            beyond=BEYOND * d,
            mirrored=MIRRORED * d,
            depth_2d=DEPTH_2D * d,
            full=FULL[dim],
        )
    )


#: Weighted sums over the neighbours of a particle, of their places from it.
Moments = qd.types.struct(
    weight=qd.f32,  # sum of the weights
    mean=vec3,  # m
    square=vec3,  # m^2: xx, yy, zz
    mixed=vec3,  # m^2: xy, xz, yz
)


@qd.kernel(fastcache=True)
def fit(ellipsoids: Ellipsoids, cells: Cells, walls: Box, shape: Shape, dim: qd.template(), count: qd.i32):
    """Fit an ellipsoid to the neighbourhood of every particle that may be seen."""
    for k in range(cells.cells):
        cells.fill[k] = 0
        if qd.static(dim == 3):  # a 2-D world shows all of its water
            if cells.own == 1 and cells.start[k + 1] > cells.start[k]:
                cells.fill[k] = deep(cells, k, walls)
    for a in range(count):
        ellipsoids.outward[a] = vec3(0.0, 0.0, 0.0)
        ellipsoids.size[count + a] = -1.0
        ellipsoids.lone[a], ellipsoids.lone[count + a] = 0, 0
        p = cells.x[a]
        cell = cells.cell[cells.order[a]]
        if cells.fill[cell] == 1:
            # Full water all around: a ball, seen through a wall if at all.
            touch, to_wall = near_walls(p, walls, shape.spacing, dim)
            ball_there = (shape.least + shape.growth) * vec3(1.0, 1.0, 1.0)
            put_inside(
                ellipsoids, a, p, touch, to_wall, joined(ball_there, touch, to_wall, shape.beyond), shape.spacing
            )
        else:
            fit_to_neighbours(ellipsoids, cells, walls, shape, a, cell, dim, count)


@qd.func
def fit_to_neighbours(
    ellipsoids: Ellipsoids, cells: Cells, walls: Box, shape: Shape, a, cell, dim: qd.template(), count
):
    """Fit an ellipsoid to what is around the particle at the sorted place `a`."""
    p, scale = cells.x[a], 1.0 / (shape.reach * shape.reach)
    moments = moments_around(cells, p, cell, scale, dim)
    weight = qd.max(moments.weight, 1e-6)
    mean = moments.mean / weight
    # In units of the variance along an axis of full water, 1/7 (3-D) or 1/6 (2-D) of the square of the reach.
    unit = qd.static(7.0 if dim == 3 else 6.0) * scale
    diagonal = qd.max((moments.square / weight - mean * mean) * unit, 0.0)
    side = (moments.mixed / weight - vec3(mean.x * mean.y, mean.x * mean.z, mean.y * mean.z)) * unit
    n, o = squared(diagonal, side)
    few = qd.static(2.0 if dim == 3 else 1.5)
    trust = qd.min(qd.max((weight - few) / qd.static(3.5 if dim == 3 else 1.5), 0.0), 1.0)
    diagonal = trust * (shape.least + shape.growth * n) + (1.0 - trust) * shape.ball
    side = trust * shape.growth * o
    touch, to_wall = near_walls(p, walls, shape.spacing, dim)
    if qd.static(dim == 3):
        if weight < 3.0:  # no more than two next to it, or some farther off; walls are not neighbours
            ellipsoids.lone[a] = 1
    free, share = 1.0 - touch, 1.0
    for k in qd.static(range(dim)):
        share *= share_before_wall(qd.abs(to_wall[k]) / shape.reach)
    diagonal = joined(diagonal, touch, to_wall, shape.beyond)
    side *= vec3(free.x * free.y, free.x * free.z, free.y * free.z)
    mean *= free
    if qd.static(dim == 2):
        diagonal.z = trust * shape.depth_2d + (1.0 - trust) * shape.ball
    if weight > shape.full * share:
        put_inside(ellipsoids, a, p, touch, to_wall, diagonal, shape.spacing)
    else:
        out = mean.norm()
        flat = qd.static(0.31 if dim == 3 else 0.34) * shape.reach  # out of a particle in a flat surface
        at_surface = qd.min(qd.max((out / flat - 0.5) / 0.35, 0.0), 1.0)
        pull = 0.9 * trust * at_surface * (1.0 - flat / qd.max(out, 0.3 * flat))
        ellipsoids.center[a] = p + touch * to_wall + pull * mean
        ellipsoids.outward[a] = -trust * mean / shape.reach
        ellipsoids.axes[a], ellipsoids.mixed[a] = squared(diagonal, side)
        ellipsoids.size[a] = qd.max(diagonal.x, diagonal.y, diagonal.z) + side.norm()
        if qd.static(dim == 3):
            ellipsoids.lone[count + a] = ellipsoids.lone[a]
            mirror(ellipsoids, a, count + a, p, walls, shape.mirrored)


@qd.func
def moments_around(cells: Cells, p, cell, scale, dim: qd.template()):
    """Add up what lies in the cells around the point `p` in a cell; `scale` [1/m^2] is that of the weights."""
    result = Moments(weight=0.0, mean=vec3(0.0, 0.0, 0.0), square=vec3(0.0, 0.0, 0.0), mixed=vec3(0.0, 0.0, 0.0))
    for row in range(qd.static(9 if dim == 3 else 3)):
        layer = cells.nx * (row % 3 - 1)
        if qd.static(dim == 3):
            layer += cells.nx * cells.ny * (row // 3 - 1)
        low = (cell + layer - 1) % cells.cells
        over = qd.max(low + 3 - cells.cells, 0)  # cells of the row that are numbered from 0 again
        for part in range(1 + qd.min(over, 1)):
            begin = qd.select(part == 0, cells.start[low], 0)
            end = cells.start[qd.select(part == 0, low + 3 - over, over)]
            for b in range(begin, end):
                r = cells.x[b] - p
                w = qd.max(1.0 - r.dot(r) * scale, 0.0)
                s = w * r
                result.weight += w
                result.mean += s
                result.square += s * r
                result.mixed += vec3(s.x * r.y, s.x * r.z, s.y * r.z)
    return result


@qd.func
def deep(cells: Cells, k, walls: Box):
    """1 where cell `k` of a tank and all around it hold four particles and more; what lies behind a wall counts."""
    last = qd.cast(qd.ceil((walls.upper - walls.lower) / cells.edge), qd.i32) - 1
    rest = (walls.upper - walls.lower) / cells.edge - last  # share of the last cell that lies in the tank
    here = qd.Vector([k % cells.nx, k // cells.nx % cells.ny, k // (cells.nx * cells.ny)])
    result = 1
    for n in range(27):
        j, least, inside = 0, 4.0, 1
        for axis in qd.static(range(3)):
            c = here[axis] + n // qd.static(3**axis) % 3 - 1
            if qd.static(axis == 0):
                j += c
            elif qd.static(axis == 1):
                j += c * cells.nx
            else:
                j += c * cells.nx * cells.ny
            if c < 0:
                inside = 0
            if qd.static(axis != 1):  # there is no ceiling
                if c > last[axis] or (c == last[axis] and rest[axis] < 0.3):
                    inside = 0
                elif c == last[axis]:
                    least *= rest[axis]
        if inside == 1:
            if cells.start[j + 1] - cells.start[j] < least:
                result = 0
    return result


@qd.func
def near_walls(p, walls: Box, spacing, dim: qd.template()):
    """How much a particle touches the walls of each axis, 0 to 1, and the way [m] to the nearer; no ceiling."""
    touch, way = vec3(0.0, 0.0, 0.0), vec3(0.0, 0.0, 0.0)
    for k in qd.static(range(dim)):
        way[k] = walls.lower[k] - p[k]
        if qd.static(k != 1):
            if walls.upper[k] - p[k] < p[k] - walls.lower[k]:
                way[k] = walls.upper[k] - p[k]
        touch[k] = qd.min(qd.max((1.5 - qd.abs(way[k]) / spacing) / 0.8, 0.0), 1.0)
    return touch, way


@qd.func
def joined(diagonal, touch, way, beyond):
    """Half lengths of an ellipsoid that is centred on the wall it touches, as if joined with its mirror image.

    As far as its looks are concerned water goes on behind a wall: through panes it reaches well beyond.
    """
    half = qd.abs(way) + vec3(qd.max(diagonal.x, beyond), diagonal.y, qd.max(diagonal.z, beyond))
    return diagonal + touch * (half - diagonal)


@qd.func
def put_inside(ellipsoids: Ellipsoids, a, p, touch, way, diagonal, spacing):
    """Draw a particle in full water only where it touches a wall; a pane need not be covered more than once."""
    half, shift = (0.8 + 0.2 * touch) * diagonal, touch * way
    ellipsoids.center[a] = p + shift
    ellipsoids.axes[a], ellipsoids.mixed[a] = half * half, vec3(0.0, 0.0, 0.0)
    ellipsoids.size[a] = qd.select(touch.max() > 0.0, half.max(), -1.0)
    if touch.max() == touch.sum():  # by one wall alone: hidden from behind
        ellipsoids.outward[a] = shift / spacing


@qd.func
def mirror(ellipsoids: Ellipsoids, a, b, p, walls: Box, reach):
    """Put the mirror image of ellipsoid `a` behind the nearest pane, if that is within `reach`, into place `b`."""
    lower, upper = walls.lower, walls.upper
    x, z = qd.min(p.x - lower.x, upper.x - p.x), qd.min(p.z - lower.z, upper.z - p.z)
    if qd.min(x, z) < reach:
        turn, wall = vec3(-1.0, 1.0, 1.0), qd.select(p.x - lower.x > x, upper, lower)
        if z < x:
            turn, wall = vec3(1.0, 1.0, -1.0), qd.select(p.z - lower.z > z, upper, lower)
        c = ellipsoids.center[a]
        ellipsoids.center[b] = qd.select(turn < 0.0, 2.0 * wall - c, c)
        ellipsoids.outward[b] = turn * ellipsoids.outward[a]
        ellipsoids.axes[b] = ellipsoids.axes[a]
        ellipsoids.mixed[b] = vec3(turn.x * turn.y, turn.x * turn.z, turn.y * turn.z) * ellipsoids.mixed[a]
        ellipsoids.size[b] = ellipsoids.size[a]


@qd.func
def squared(diagonal, side):
    """Square of a symmetric matrix: its diagonal, and its xy, xz, yz."""
    d, s = diagonal, side
    return (
        vec3(d.x * d.x + s.x * s.x + s.y * s.y, d.y * d.y + s.x * s.x + s.z * s.z, d.z * d.z + s.y * s.y + s.z * s.z),
        vec3(s.x * (d.x + d.y) + s.y * s.z, s.y * (d.x + d.z) + s.x * s.z, s.z * (d.y + d.z) + s.x * s.y),
    )

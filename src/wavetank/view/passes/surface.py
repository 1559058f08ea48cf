"""The surface of the water: the nearest depth of its ellipsoids, and panes where it lies against the glass.

An ellipsoid is splatted as in M. Zwicker et al., "EWA splatting" (2002): sheared so that the ray through its centre
runs along the depth axis, it covers an ellipse whose rows are filled from end to end, and its front is a closed form.
As with the particles, depths meet in an integer minimum, so the order of threads is irrelevant.

    code      symbol   meaning                                                        unit
    c                  centre in view coordinates                                     m
    m                  shape matrix in view coordinates, sheared: xx, yy, zz          m^2
    o                  the same: xy, xz, yz                                           m^2
    pxx ...   P^-1     inverse of the part across the view                            1/m^2
    g                  slope of the plane through the ellipsoid's outline             1
    s2                 square of its half thickness over that plane                   m^2

Within an ellipsoid rays count as parallel; at a distance of a hundred radii that moves its rim by a hundredth.
"""

from typing import Any

import numpy as np

from wavetank.compiler import qd
from wavetank.view.buffers import Buffers
from wavetank.view.lens import (
    Lens,
    from_view,
    pixels_per_metre,
    plane_position,
    ray_direction,
    ray_origin,
    to_view,
    vec3,
    vector,
    view_ray,
)
from wavetank.view.passes.solids import box_interval
from wavetank.view.passes.spheres import clear_depth
from wavetank.view.shot import Shot
from wavetank.view.water_buffers import Ellipsoids, water_of

LARGEST = 0.25  # of the picture's height: radius up to which an ellipsoid is drawn
AWAY = 0.12  # how much an ellipsoid faces away that no eye can see


def draw(shot: Shot, buffers: Buffers) -> None:
    """Fill the water's depth; flat against the panes of a tank."""
    see(shot, buffers, shot.lens, water_of(buffers, shot).depth)


def see(shot: Shot, buffers: Buffers, lens: Lens, depth: Any) -> None:
    """Fill `depth` with the water as `lens` sees it."""
    clear_depth(depth)
    largest = max(LARGEST * depth.shape[0], 2.0)
    splat(water_of(buffers, shot).ellipsoids, shot.frame.count, lens, largest, AWAY, depth)
    if shot.frame.scene.tank is None:
        return
    if shot.frame.dim == 2:
        # The plane itself is what is kept: a box around it, as deep as the water is drawn.
        thick = np.array([0.0, 0.0, 10.0 * shot.extent.spacing])
        cut(lens, vector(*(shot.extent.lower - thick)), vector(*(shot.extent.upper + thick)), depth)
    else:
        press(lens, vector(*shot.extent.lower), vector(*shot.extent.upper), shot.extent.spacing, depth)


@qd.kernel(fastcache=True)
def splat(
    ellipsoids: Ellipsoids, count: qd.i32, lens: Lens, largest: qd.f32, away: qd.f32, depth: qd.types.ndarray()
):  # fmt: skip
    """Lower `depth` to the front of every ellipsoid that may be seen."""
    rows, columns = depth.shape[0], depth.shape[1]
    for n in range(count):
        # Sorted by place: the end that is nearer goes first and hides the rest.
        i = n
        if lens.forward.dot(ellipsoids.center[0] - ellipsoids.center[count - 1]) > 0.0:
            i = count - 1 - n
        c = to_view(lens, ellipsoids.center[i])
        size = ellipsoids.size[i]
        look = c.x * lens.right + c.y * lens.up + c.z * lens.forward
        if lens.perspective < 0.5:
            look = lens.forward
        hidden = look.dot(ellipsoids.outward[i]) > away * look.norm()
        if size > 0.0 and c.z > lens.near + size and not hidden:
            scale = pixels_per_metre(lens, c.z)
            fill_ellipse(lens, c, scale, qd.min(1.0, largest / (size * scale)), ellipsoids.axes[i],
                         ellipsoids.mixed[i], rows, columns, depth)  # fmt: skip


@qd.func
def fill_ellipse(lens: Lens, c, scale, shrink, axes, mixed, rows, columns, depth: qd.template()):
    """Lower `depth` to that of one ellipsoid; `scale` is in pixels per metre."""
    # Rotated into the view ...
    a, b, f = lens.right, lens.up, lens.forward
    if lens.perspective > 0.5:  # ... and sheared: x' = x - (c.x / c.z) z
        a = a - (c.x / c.z) * f
        b = b - (c.y / c.z) * f
    ma, mb, mf = times(axes, mixed, a), times(axes, mixed, b), times(axes, mixed, f)
    s = shrink * shrink
    xx, yy, zz = s * a.dot(ma), s * b.dot(mb), s * f.dot(mf)
    xy, xz, yz = s * a.dot(mb), s * a.dot(mf), s * b.dot(mf)
    area = qd.max(xx * yy - xy * xy, 1e-30)
    pxx, pyy, pxy = yy / area, xx / area, -xy / area
    gx, gy = pxx * xz + pxy * yz, pxy * xz + pyy * yz
    half = qd.sqrt(qd.max(zz - gx * xz - gy * yz, 0.0))
    size = 1.0 / scale
    middle = lens.middle
    if lens.perspective > 0.5:
        middle += lens.focal * qd.Vector([c.x / c.z, -c.y / c.z])
    else:
        middle += lens.focal * qd.Vector([c.x, -c.y])
    tall = qd.sqrt(yy) * scale
    first = qd.max(qd.cast(qd.ceil(qd.max(middle.y - tall - 0.5, 0.0)), qd.i32), 0)
    last = qd.min(qd.cast(qd.floor(qd.min(middle.y + tall - 0.5, rows - 1.0)), qd.i32), rows - 1)
    for row in range(first, last + 1):
        v = (middle.y - row - 0.5) * size
        # p(u, v) = pxx u^2 + 2 pxy u v + pyy v^2 <= 1 between the two ends of this row.
        center = -pxy * v / pxx
        reach = 1.0 - v * v * (pyy - pxy * pxy / pxx)
        if reach > 0.0:
            wide = qd.sqrt(reach / pxx) * scale
            at = middle.x + center * scale - 0.5
            left = qd.max(qd.cast(qd.ceil(qd.max(at - wide, 0.0)), qd.i32), 0)
            right = qd.min(qd.cast(qd.floor(qd.min(at + wide, columns - 1.0)), qd.i32), columns - 1)
            for column in range(left, right + 1):
                u = (column - at) * size  # from the middle of the row
                front = c.z + gx * (center + u) + gy * v - half * qd.sqrt(qd.max(reach - pxx * u * u, 0.0))
                key = qd.bit_cast(front, qd.i32) & ~1  # the last bit is for `press`
                if key > 0 and key < depth[row, column]:
                    qd.atomic_min(depth[row, column], key)


@qd.func
def times(axes, mixed, v):
    """Symmetric matrix times vector."""
    return vec3(
        axes.x * v.x + mixed.x * v.y + mixed.y * v.z,
        mixed.x * v.x + axes.y * v.y + mixed.z * v.z,
        mixed.y * v.x + mixed.z * v.y + axes.z * v.z,
    )


@qd.kernel(fastcache=True)
def cut(lens: Lens, lower: vec3, upper: vec3, depth: qd.types.ndarray()):
    """Leave out what reaches through a wall of a 2-D world."""
    for row, column in qd.ndrange(depth.shape[0], depth.shape[1]):
        if depth[row, column] < 0x7F000000:  # FARTHEST
            ray = view_ray(lens, row, column)
            panes = box_interval(ray_origin(lens, ray), ray_direction(lens, ray), lower, upper)
            if panes[0] > panes[1]:
                depth[row, column] = 0x7F000000


@qd.kernel(fastcache=True)
def press(lens: Lens, lower: vec3, upper: vec3, spacing: qd.f32, depth: qd.types.ndarray()):
    """Move water that lies against a pane onto it, where it is flat, and leave out what reaches through."""
    for row, column in qd.ndrange(depth.shape[0], depth.shape[1]):
        key = depth[row, column]
        if key < 0x7F000000:  # FARTHEST
            flat = 0
            ray = view_ray(lens, row, column)
            origin, direction = ray_origin(lens, ray), ray_direction(lens, ray)
            z = qd.bit_cast(key, qd.f32)
            panes = box_interval(origin, direction, lower, upper)
            enter = panes[0]
            if z > panes[1] or panes[0] > panes[1]:  # an ellipsoid reaches through a wall
                depth[row, column] = 0x7F000000  # FARTHEST
            elif enter > lens.near:
                at = origin + enter * direction
                side = qd.min(qd.abs(at.x - lower.x), qd.abs(at.x - upper.x))
                front = qd.min(qd.abs(at.z - lower.z), qd.abs(at.z - upper.z))
                if qd.min(side, front) < 1e-3 * spacing:  # not through the open top
                    slope = qd.abs(direction.x) if side < front else qd.abs(direction.z)
                    into = (z - enter) * slope / spacing  # way from the pane, along its normal
                    ease = qd.min(qd.max((into - 0.25) / 0.35, 0.0), 1.0)
                    z = enter + (z - enter) * ease * ease * (3.0 - 2.0 * ease)
                    flat = qd.cast(z <= enter, qd.i32)
                z = qd.max(z, enter)
                # The last bit of a depth says that it lies on a pane: there nothing needs to be smoothed.
                depth[row, column] = (qd.bit_cast(z, qd.i32) & ~1) | flat


@qd.func
def rise_along(row, column, down, across, z, limit, depth: qd.template()):
    """Change of depth [m] to the next pixel of a row or column, taken more from the side where it is less."""
    total, weight = 0.0, 1e-30
    for side in qd.static((-1, 1)):
        r = qd.min(qd.max(row + side * down, 0), depth.shape[0] - 1)
        c = qd.min(qd.max(column + side * across, 0), depth.shape[1] - 1)
        rise = qd.bit_cast(depth[r, c], qd.f32) - z
        if qd.abs(rise) < limit:
            w = 1.0 / (rise * rise + 1e-4 * limit * limit)
            total += w * side * rise
            weight += w
    return total / weight


@qd.func
def normal_at(lens: Lens, row, column, z, limit, depth: qd.template()):
    """Unit normal, in the world and towards the eye, of the surface that `depth` holds."""
    uv = plane_position(lens, row, column) * lens.perspective
    wide = lens.pixel * (1.0 + lens.perspective * (z - 1.0))
    right = rise_along(row, column, 0, 1, z, limit, depth)
    below = rise_along(row, column, 1, 0, z, limit, depth)
    # Cross product of the ways along the surface: (wide + u right, v right, right), (u below, v below - wide, below).
    n = vec3(right, -below, -wide - uv.x * right + uv.y * below)
    return from_view(lens, n).normalized(1e-20)

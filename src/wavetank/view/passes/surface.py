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

import dataclasses
import enum
from typing import Any

from wavetank.device.compiler import qd, threads
from wavetank.device.state import interned
from wavetank.view.buffers import Buffers
from wavetank.view.lens import Lens, pixels_between, pixels_per_metre, to_view, vec2, vec3
from wavetank.view.optics.edge_coverage import rim_key, rim_mark
from wavetank.view.optics.rays import Box
from wavetank.view.shot import Shot
from wavetank.view.strips import Strips, strip, strips_of
from wavetank.view.water_buffers import Ellipsoids, water_of

LARGEST = 0.25  # of the picture's height: radius up to which an ellipsoid is drawn
GAP = 2.0  # d: what an outline stands before by more, it stands out from
AWAY = 0.12  # how much an ellipsoid faces away that no eye can see


class Part(enum.IntEnum):
    """Which pixels of an ellipse are filled."""

    ALL = 0  # those whose centres lie inside
    WHOLE = 1  # those that are covered as a whole
    OUTLINE = 2  # those that are covered in part


@dataclasses.dataclass(frozen=True, eq=False)
class Limits:
    """What of an ellipsoid is drawn, on the device."""

    largest: qd.f32  # px: radius up to which it is
    away: qd.f32  # how much one faces away that no eye can see
    lone: qd.i32  # 1 where lone particles count, 0 where they are drops of their own
    gap: qd.f32  # m: what an outline stands before by more, it stands out from


def draw(shot: Shot, buffers: Buffers) -> None:
    """Fill the water's depth and its outlines, as if the water went on behind the panes."""
    water = water_of(buffers, shot)
    if shot.hasty:
        water.surface.rim.fill(0)
    splat_surface(
        shot, water.ellipsoids, shot.lens, water.surface.depth, None if shot.hasty else water.surface.rim, False
    )


def draw_from_sun(shot: Shot, buffers: Buffers) -> None:
    """Fill the depth at which the sun's rays meet the water, likewise."""
    if shot.frame.dim == 3:
        water = water_of(buffers, shot)
        splat_surface(shot, water.ellipsoids, shot.water_sun, water.sunlit.depth, None, False)


def splat_surface(shot: Shot, ellipsoids: Ellipsoids, lens: Lens, depth: Any, rim: Any, lone: bool) -> None:
    """Fill `depth` with the water as `lens` sees it, and `rim`, if any, with what its outlines cover in part.

    Without `lone` particles these are left to the drops.
    """
    count, turns = shot.frame.count, max(threads(), 1)
    limits = interned(
        Limits(largest=max(LARGEST * depth.shape[0], 2.0), away=AWAY, lone=int(lone), gap=GAP * shot.extent.spacing)
    )
    splat(
        depth,
        depth if rim is None else rim,
        ellipsoids,
        strips_of(depth),
        lens,
        shot.walls,
        limits,
        int(rim is not None),
        turns,
        -(-count // turns),
        count,
    )


@qd.kernel(fastcache=True)
def splat(
    depth: qd.types.ndarray(),
    rim: qd.types.ndarray(),
    ellipsoids: Ellipsoids,
    strips: Strips,
    lens: Lens,
    walls: Box,
    limits: Limits,
    soft: qd.template(),
    turns: qd.i32,
    run: qd.i32,
    count: qd.i32,
):
    """Lower `depth` to the front of every ellipsoid that may be seen, and of its mirror image.

    Threads take turns, so that each begins at the near end: ellipsoids are sorted by place, and what is near hides
    the rest.
    """
    for task in range(strips.count):
        row, first, last = strip(strips, task, depth.shape[0], depth.shape[1])
        for column in range(first, last):
            depth[row, column] = 0x7F000000  # FARTHEST
            if qd.static(soft):
                rim[row, column] = 0
    for n in range(turns * run):
        i = n % run * turns + n // run
        if i < count:
            if lens.forward.dot(ellipsoids.center[0] - ellipsoids.center[count - 1]) > 0.0:
                i = count - 1 - i
            for image in range(2):
                j = i + image * count
                ellipsoids.edge[j] = 0
                if ellipsoids.size[j] > 0.0 and ellipsoids.lone[j] <= limits.lone:
                    if may_be_seen(ellipsoids, j, image, lens, walls, limits.away):
                        ellipsoids.edge[j] = fill_ellipse(
                            depth, rim, ellipsoids, j, lens, limits, qd.static(Part.WHOLE if soft else Part.ALL)
                        )
    # What stands out from nothing in the finished depth has no outline, whatever the order of the threads.
    for n in range(2 * count):
        if qd.static(soft):
            if ellipsoids.edge[n] == 1:
                fill_ellipse(depth, rim, ellipsoids, n, lens, limits, qd.static(Part.OUTLINE))
    # Pixels that only outlines cover get their depth.
    for task in range(strips.count):
        row, first, last = strip(strips, task, depth.shape[0], depth.shape[1])
        if qd.static(soft):
            for column in range(first, last):
                if rim[row, column] > 0 and depth[row, column] == 0x7F000000:  # FARTHEST
                    depth[row, column] = rim_key(rim[row, column])


@qd.func
def may_be_seen(ellipsoids: Ellipsoids, i, image, lens: Lens, walls: Box, away):
    """Whether an ellipsoid lies before the eye and does not face away from it."""
    c = to_view(lens, ellipsoids.center[i])
    look = lens.forward
    if lens.perspective > 0.5:
        look = c.x * lens.right + c.y * lens.up + c.z * lens.forward
    hidden = look.dot(ellipsoids.outward[i]) > away * look.norm()
    if image == 1:  # before a pane it would hide what it is the image of
        outside = vec3(0.0, 0.0, 0.0)
        for k in qd.static((0, 2)):
            x = ellipsoids.center[i][k]
            outside[k] = qd.cast(x > walls.upper[k], qd.f32) - qd.cast(x < walls.lower[k], qd.f32)
        hidden = look.dot(outside) <= 0.0
    return c.z > lens.near + ellipsoids.size[i] and not hidden


#: An ellipsoid as the eye sees it: an ellipse of pixels, and its front over them.
Ellipse = qd.types.struct(
    middle=vec2,  # px
    tall=qd.f32,  # px: half its height, outline included
    curve=qd.f32,  # 1/px^2: P^-1 along a row, pxx
    cross=qd.f32,  # 1/px^2: pxy
    steep=qd.f32,  # 1/px^2: pyy
    per=qd.f32,  # 1 / pxx
    lean=qd.f32,  # by how much the middle of a row moves from row to row
    fall=qd.f32,  # 1/px^2: p in the middle of a row, per square of its height
    slope=vec2,  # m/px: of the plane through the outline
    half=qd.f32,  # m: half thickness over that plane
    depth=qd.f32,  # m: of its centre
    nearest=qd.i32,  # bits of its least depth [m]
    inner=qd.f32,  # p is at least 1 - inner half a pixel inside the outline
    outer=qd.f32,  # and at most this half a pixel outside of it
    narrow=qd.f32,  # px: its lesser radius
)


@qd.func
def ellipse_of(ellipsoids: Ellipsoids, i, lens: Lens, limits: Limits, outlined: qd.template()):
    """Ellipse of pixels that an ellipsoid covers; where it is `outlined` its outline is half a pixel wide on each side.

    p(u, v) = pxx u^2 + 2 pxy u v + pyy v^2 is 1 on the outline.
    """
    c, size = to_view(lens, ellipsoids.center[i]), ellipsoids.size[i]
    scale = pixels_per_metre(lens, c.z)
    shrink = qd.min(1.0, limits.largest / (size * scale))
    axes, mixed = ellipsoids.axes[i], ellipsoids.mixed[i]
    # Rotated into the view ...
    a, b, f = lens.right, lens.up, lens.forward
    middle = lens.middle
    if lens.perspective > 0.5:  # ... and sheared: x' = x - (c.x / c.z) z
        a = a - (c.x / c.z) * f
        b = b - (c.y / c.z) * f
        middle += lens.focal * qd.Vector([c.x / c.z, -c.y / c.z])
    else:
        middle += lens.focal * qd.Vector([c.x, -c.y])
    a, b = (shrink * scale) * a, (shrink * scale) * b  # across the view in pixels
    f = shrink * f
    ma, mb, mf = times(axes, mixed, a), times(axes, mixed, b), times(axes, mixed, f)
    xx, yy, zz = a.dot(ma), b.dot(mb), f.dot(mf)
    xy, xz, yz = a.dot(mb), a.dot(mf), b.dot(mf)
    area = qd.max(xx * yy - xy * xy, 1e-12)
    pxx, pyy, pxy = yy / area, xx / area, -xy / area
    gx, gy = pxx * xz + pxy * yz, pxy * xz + pyy * yz
    half = qd.sqrt(qd.max(zz - gx * xz - gy * yz, 0.0))
    inner, outer, narrow = 0.0, 1.0, 1.0
    if qd.static(outlined):
        narrow = qd.sqrt(qd.max(0.5 * (xx + yy) - qd.sqrt(0.25 * (xx - yy) ** 2 + xy * xy), 0.04))
        rest = qd.max(1.0 - 0.5 / narrow, 0.0)
        inner, outer = 1.0 - rest * rest, (1.0 + 0.5 / narrow) ** 2
    return Ellipse(
        middle=middle,
        tall=qd.sqrt(yy * outer),
        curve=pxx,
        cross=pxy,
        steep=pyy,
        per=1.0 / pxx,
        lean=-pxy / pxx,
        fall=pyy - pxy * pxy / pxx,
        slope=vec2(gx, gy),
        half=half,
        depth=c.z,
        nearest=qd.bit_cast(qd.max(c.z - qd.sqrt(zz), 1e-6), qd.i32),
        inner=inner,
        outer=outer,
        narrow=narrow,
    )


@qd.func
def fill_ellipse(
    depth: qd.template(), rim: qd.template(), ellipsoids: Ellipsoids, i, lens: Lens, limits: Limits, part: qd.template()
):
    """Lower `depth` to that of one ellipsoid, or raise `rim` to the share of a pixel that its outline covers.

    Part `Part.ALL` takes the pixels whose centres lie inside; `Part.WHOLE` those that are covered as a whole, as if the
    outline were straight, and returns 1 where it may have left others to `Part.OUTLINE`, else 0.
    """
    left_over = 0
    ellipse = ellipse_of(ellipsoids, i, lens, limits, qd.static(part != Part.ALL))
    middle, lean = ellipse.middle, ellipse.lean
    first, last = pixels_between(middle.y - ellipse.tall - 0.5, middle.y + ellipse.tall - 0.5, depth.shape[0])
    for row in range(first, last + 1):
        v = middle.y - row - 0.5
        reach = 1.0 - v * v * ellipse.fall
        room = (reach + ellipse.outer - 1.0) * ellipse.per
        if room > 0.0:
            wide = qd.sqrt(room)
            at = middle.x + lean * v - 0.5  # column of the middle of the row
            left, right = pixels_between(at - wide, at + wide, depth.shape[1])
            if qd.static(part == Part.OUTLINE):
                # What an outline covers in part lies at both ends of a row.
                solid = qd.sqrt(qd.max((reach - ellipse.inner) * ellipse.per, 0.0))
                before = qd.min(qd.cast(qd.floor(qd.max(at - solid, left - 2.0)), qd.i32) + 1, right)
                after = qd.max(qd.cast(qd.floor(qd.min(at + solid, right + 1.0)), qd.i32), before + 1)
                for side in range(2):
                    begin, end = qd.select(side == 0, left, after), qd.select(side == 0, before, right)
                    for column in range(begin, end + 1):
                        left_over |= fill_pixel(depth, rim, ellipse, limits, row, column, at, v, reach, part)
            else:
                for column in range(left, right + 1):
                    left_over |= fill_pixel(depth, rim, ellipse, limits, row, column, at, v, reach, part)
    return left_over


@qd.func
def fill_pixel(
    depth: qd.template(),
    rim: qd.template(),
    ellipse: qd.template(),
    limits: Limits,
    row,
    column,
    at,
    v,
    reach,
    part: qd.template(),
):
    """Fill one pixel of a row whose middle lies at the column `at`, `v` pixels above that of the ellipse."""
    left_over, u = 0, column - at
    inside = reach - ellipse.curve * u * u  # 1 - p
    tried = depth[row, column] > ellipse.nearest
    if qd.static(part == Part.OUTLINE):
        tried = inside < ellipse.inner
    if tried:
        base = ellipse.depth + (ellipse.slope.x * ellipse.lean + ellipse.slope.y) * v
        front = base + ellipse.slope.x * u - ellipse.half * qd.sqrt(qd.max(inside, 0.0))
        key = qd.bit_cast(front, qd.i32)
        if key > 0 and key < depth[row, column]:
            cover = 1.0
            if qd.static(part != Part.ALL):
                if inside < ellipse.inner:
                    # Distance to the outline [px]: p - 1 over its gradient.
                    slope = 2.0 * vec2(ellipse.curve * u, ellipse.cross * (u + ellipse.lean * v) + ellipse.steep * v)
                    cover = qd.min(0.5 + qd.min(inside / qd.max(slope.norm(), 1e-6), ellipse.narrow), 1.0)
            if cover >= 1.0:
                if qd.static(part != Part.OUTLINE):
                    qd.atomic_min(depth[row, column], key)
            elif cover > 0.0 and qd.bit_cast(depth[row, column], qd.f32) > front + limits.gap:
                left_over = 1
                if qd.static(part == Part.OUTLINE):
                    qd.atomic_max(rim[row, column], rim_mark(cover, key))
    return left_over


@qd.func
def times(axes, mixed, v):
    """Symmetric matrix times vector."""
    return vec3(
        axes.x * v.x + mixed.x * v.y + mixed.y * v.z,
        mixed.x * v.x + axes.y * v.y + mixed.z * v.z,
        mixed.y * v.x + mixed.z * v.y + axes.z * v.z,
    )

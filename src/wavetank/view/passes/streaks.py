"""Drops while the shutter is open: each is a streak along its own way.

A drop that flies some pixels while the shutter is open covers each of them for a share of that time: what it hides is
as faint as that, and what it shows is the mean of it over the chord that has passed. Shares are in closed form, so that
a streak has no instants that could be told apart. The shutter opens and closes gradually, as in `shutter.py`.

    code      symbol   meaning                                                        unit
    long      L        way while the shutter opens, and while it closes              px
    u, w               place of a pixel from the drop's middle, along the way, across  px
    half      h        half of the chord of the drop at w                             px
    cover              share of the time for which it is there                        1
    tau                about -log(1 - cover): of several streaks these add up         1 / 4096

Streaks that overlap are laid over the picture as one of their mean colour, so that no order matters: sums are whole
numbers, per pixel of the picture. `foam.sums` and `surface.rim` hold them meanwhile.
"""

from wavetank.device.compiler import qd
from wavetank.view.buffers import Buffers, FoamMaps, Pixels
from wavetank.view.cells import Cells
from wavetank.view.lens import Lens, pixels_between, pixels_per_metre, to_pixel, to_view, vec2, vec3, vec4
from wavetank.view.look import Look
from wavetank.view.optics.drop import drop_of, drop_radiance, motion_of, rough_of, way_of
from wavetank.view.optics.fluid import Optics, optics_of
from wavetank.view.optics.glass import line_cover
from wavetank.view.shot import Shot
from wavetank.view.strips import Strips, strip, strips_of
from wavetank.view.water_buffers import Drops, WaterSurface, water_of
from wavetank.view.weights import under_water


def draw(shot: Shot, buffers: Buffers) -> None:
    """Lay the streaks over the picture. A closed shutter and an eye in the water see none.

    Drops that hardly move are left to `drops`.
    """
    frame = shot.frame
    if frame.dim == 2 or frame.count == 0 or shot.shutter <= 0.0 or under_water(shot, buffers):
        return
    water, sums, seen = water_of(buffers, shot), buffers.foam, buffers.streak_box
    if not water.may_have_drops(frame.count):
        return
    drops, optics = water.drops(frame), optics_of(shot, buffers.supersample)
    motion = motion_of(shot.shutter, buffers.supersample)
    find_box(seen, sums, drops, water.cells, shot.lens, optics, motion, frame.count)
    composite_streaks(
        buffers.pixels,
        sums,
        water.surface,
        seen,
        strips_of(sums.sums),
        drops,
        water.cells,
        shot.lens,
        shot.look,
        optics,
        motion,
        frame.count,
    )


@qd.func
def longest(sums: FoamMaps, samples):
    """Half of a streak is not longer [computed px]: 0.08 of the picture's height."""
    return 0.08 * sums.sums.shape[0] * samples


@qd.func
def share_before(x):
    """Share of the light that a shutter has let in at the time `x`, from -1 where it begins to open to 1."""
    t = qd.min(qd.max(x, -1.0), 1.0)
    return 0.5 + t - 0.5 * t * qd.abs(t)


@qd.kernel(fastcache=True)
def find_box(
    seen: qd.types.ndarray(),
    sums: FoamMaps,
    drops: Drops,
    cells: Cells,
    lens: Lens,
    optics: Optics,
    motion: vec4,
    count: qd.i32,
):
    """Find the box of the picture outside of which there is no streak; `motion` is that of `motion_of`."""
    samples, rows, columns = optics.samples, sums.sums.shape[0], sums.sums.shape[1]
    for k in range(4):
        seen[k] = qd.select(k == 0, columns, qd.select(k == 2, rows, -1))
    for a in range(count):
        if drops.lone[a] == 1:
            way, c = way_of(lens, drops, cells, a, motion[2]), to_view(lens, cells.x[a])
            # A drop, and what it is torn into, lie within 2.2 spacings of the particle, 1.6 in depth.
            near = c.z - 1.6 * optics.spacing
            if way.norm() > motion[3] and c.z + 1.6 * optics.spacing > lens.near:
                left, right, top, bottom = 0.0, 1.0 * columns, 0.0, 1.0 * rows
                if near > 2.0 * lens.near:
                    middle = to_pixel(lens, c)
                    wide = 2.2 * optics.spacing * pixels_per_metre(lens, near) + 2.0 * samples
                    wide += qd.min(way.norm(), longest(sums, samples))
                    wide += lens.perspective * (middle - lens.middle).norm() * 1.6 * optics.spacing / near
                    left, right = (middle.x - wide) / samples, (middle.x + wide) / samples
                    top, bottom = (middle.y - wide) / samples, (middle.y + wide) / samples
                if right >= 0.0 and bottom >= 0.0 and left < columns and top < rows:
                    qd.atomic_min(seen[0], qd.cast(qd.max(left, 0.0), qd.i32))
                    qd.atomic_max(seen[1], qd.cast(qd.min(right, columns - 1.0), qd.i32))
                    qd.atomic_min(seen[2], qd.cast(qd.max(top, 0.0), qd.i32))
                    qd.atomic_max(seen[3], qd.cast(qd.min(bottom, rows - 1.0), qd.i32))


@qd.func
def strip_seen(strips: Strips, task, seen: qd.template(), rows, columns):
    """As `strip` has it, but only what lies in the box."""
    row, first, last = strip(strips, task, rows, columns)
    first, last = qd.max(first, seen[0]), qd.min(last, seen[1] + 1)
    if row < seen[2] or row > seen[3]:
        last = first
    return row, first, last


@qd.kernel(fastcache=True)
def composite_streaks(
    pixels: Pixels,
    sums: FoamMaps,
    surface: WaterSurface,
    seen: qd.types.ndarray(),
    strips: Strips,
    drops: Drops,
    cells: Cells,
    lens: Lens,
    look: Look,
    optics: Optics,
    motion: vec4,
    count: qd.i32,
):
    """Add up the streaks of every pixel, and lay their sum over it; `motion` is that of `motion_of`."""
    samples, rows, columns = optics.samples, sums.sums.shape[0], sums.sums.shape[1]
    for task in range(strips.count):
        row, first, last = strip_seen(strips, task, seen, rows, columns)
        for column in range(first, last):
            surface.rim[row * samples, column * samples] = 0
            for k in qd.static(range(3)):
                sums.sums[row, column, k] = 0
    for a in range(count):
        if drops.lone[a] == 1:
            way = way_of(lens, drops, cells, a, motion[2])
            if way.norm() > motion[3]:
                low, mid, high = vec3(0.0, 0.0, 0.0), vec3(0.0, 0.0, 0.0), vec3(0.0, 0.0, 0.0)
                for k in range(6):
                    drop = drop_of(drops, cells, a, k, optics.spacing, motion[0], motion[1])
                    if k == 0:  # what it is torn into shows the same
                        low, mid, high = radiance_lines(pixels, surface, drops, cells, lens, look, optics, a, drop, way)
                    if drop[3] > 0.0:
                        add_streak(
                            pixels, sums, surface, drops, cells, lens, look, optics, a, drop, way, low, mid, high
                        )
    for task in range(strips.count):
        row, first, last = strip_seen(strips, task, seen, rows, columns)
        for column in range(first, last):
            tau = surface.rim[row * samples, column * samples]
            if tau > 0:
                shown = vec3(sums.sums[row, column, 0], sums.sums[row, column, 1], sums.sums[row, column, 2]) / tau
                cover = 1.0 - qd.exp(-tau / 4096.0)
                for k in range(samples * samples):
                    r, c = row * samples + k // samples, column * samples + k % samples
                    before = pixels.color[r, c]
                    pixels.color[r, c] = before + cover * (shown - before)


@qd.func
def columns_near(row, samples, middle, along, wide, left, right):
    """First and last pixel of a row that lie within `wide` of the line through `middle` `along` the way."""
    begin, end = left, right
    if qd.abs(along.y) > 0.1:
        down = (row + 0.5) * samples - middle.y
        across, reach = middle.x + down * along.x / along.y, wide / qd.abs(along.y)
        begin = qd.max(left, qd.cast(qd.floor((across - reach) / samples), qd.i32))
        end = qd.min(right, qd.cast(qd.ceil((across + reach) / samples), qd.i32))
    return begin, end


@qd.func
def radiance_lines(
    pixels: Pixels,
    surface: WaterSurface,
    drops: Drops,
    cells: Cells,
    lens: Lens,
    look: Look,
    optics: Optics,
    a,
    drop,
    way,
):
    """Mean radiance of a drop along three lines that go its way: at its left, through its middle, at its right.

    What a long streak shows changes across it alone.
    """
    c, r = to_view(lens, vec3(drop[0], drop[1], drop[2])), drop[3]
    low, mid, high = vec3(0.0, 0.0, 0.0), vec3(0.0, 0.0, 0.0), vec3(0.0, 0.0, 0.0)
    if c.z > lens.near + 2.0 * r:
        wide, along = pixels_per_metre(lens, c.z) * r, way.normalized(1e-6)
        for n in range(9):
            side = 0.85 * (n // 3 - 1)
            place = to_pixel(lens, c) - 0.5 + wide * side * vec2(-along.y, along.x)
            place += (0.85 * (n % 3 - 1) * wide * qd.sqrt(1.0 - side * side)) * along
            seen = (
                drop_radiance(pixels, surface, drops, cells, lens, look, optics, a, place.y, place.x, c, r, 0.3) / 3.0
            )
            if n < 3:
                low += seen
            elif n < 6:
                mid += seen
            else:
                high += seen
    return low, mid, high


@qd.func
def add_streak(
    pixels: Pixels,
    sums: FoamMaps,
    surface: WaterSurface,
    drops: Drops,
    cells: Cells,
    lens: Lens,
    look: Look,
    optics: Optics,
    a,
    drop,
    way,
    low,
    mid,
    high,
):
    """Add a drop to the pixels of the picture that it passes; `low`, `mid`, `high` are what `radiance_lines` found."""
    c, r, samples = to_view(lens, vec3(drop[0], drop[1], drop[2])), drop[3], optics.samples
    if c.z > lens.near + 2.0 * r:
        scale = pixels_per_metre(lens, c.z)  # computed pixels per metre
        middle, long = to_pixel(lens, c), way.norm()
        along = way / long
        long = qd.min(long, longest(sums, samples))
        wide = qd.max(r * scale, 0.75 * samples)
        faint, key = (r * scale / wide) ** 2, c.z - r
        # The box of both ends.
        reach = vec2(qd.abs(along.x), qd.abs(along.y)) * long + wide + 0.5 * samples
        top, bottom = pixels_between(
            (middle.y - reach.y) / samples - 0.5, (middle.y + reach.y) / samples - 0.5, sums.sums.shape[0]
        )
        left, right = pixels_between(
            (middle.x - reach.x) / samples - 0.5, (middle.x + reach.x) / samples - 0.5, sums.sums.shape[1]
        )
        rough, flat = rough_of(wide / samples), long > 0.4 * wide
        for row in range(top, bottom + 1):
            begin, end = columns_near(row, samples, middle, along, wide + samples, left, right)
            for column in range(begin, end + 1):
                place = (vec2(column, row) + 0.5) * samples
                off = place - middle
                u, w = off.dot(along), off.y * along.x - off.x * along.y
                half = qd.sqrt(qd.max(wide * wide - w * w, 0.25 * samples * samples))
                cover = qd.min((wide - qd.abs(w)) / samples + 0.5, 1.0) * faint
                cover *= share_before((u + half) / long) - share_before((u - half) / long)
                down, across = qd.cast(place.y, qd.i32), qd.cast(place.x, qd.i32)
                behind = qd.min(surface.depth[down, across], pixels.depth[down, across])
                if cover > 0.01 and key < qd.bit_cast(behind, qd.f32):
                    side = qd.min(qd.max(w / (0.85 * wide), -1.0), 1.0)
                    seen = mid + qd.max(side, 0.0) * (high - mid) + qd.max(-side, 0.0) * (low - mid)
                    if not flat:
                        # Where the drop is when the pixel sees the middle of what it sees of it.
                        moved = 0.5 * (qd.max(u - half, -long) + qd.min(u + half, long)) / scale
                        there = vec3(c.x + moved * along.x, c.y - moved * along.y, c.z)
                        seen = drop_radiance(
                            pixels,
                            surface,
                            drops,
                            cells,
                            lens,
                            look,
                            optics,
                            a,
                            place.y - 0.5,
                            place.x - 0.5,
                            there,
                            wide / scale,
                            rough + (qd.min(half, long) / wide) ** 2 / 3.0,
                        )
                    cover *= 1.0 - look.line_strength * line_cover(pixels.lines[down, across], c.z, optics.slack)
                    tau = 4096.0 * cover * (6.0 - cover) / (6.0 - 4.0 * cover)
                    qd.atomic_add(surface.rim[row * samples, column * samples], qd.cast(tau + 0.5, qd.i32))
                    for n in qd.static(range(3)):
                        qd.atomic_add(sums.sums[row, column, n], qd.cast(tau * qd.min(seen[n], 4.0) + 0.5, qd.i32))

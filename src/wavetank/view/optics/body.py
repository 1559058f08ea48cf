"""A tank as a body of water: the bent ray from where it enters to where it leaves, or meets the floor.

Between flat panes the way of a ray has a closed form: it ends at the nearest of them, of the floor and of the surface.
Seen from within, panes and surface mirror totally what meets them at more than 48.6 degrees from their normal, which is
nearly every ray that came in through a pane beside (Snell). The surface is the one that the sun sees (`SunlitWater`):
where the end of a straight piece does not lie below it, the place where it does is found by halving.

    code      symbol   meaning                                                        unit
    under              depth of a point below the surface along the sun's rays        m
    p, ahead           where a straight piece begins, and its direction               m, 1
    s                  its length                                                     m
    n                  normal of what it ends at, out of the water                    1
    k         cos^2    of the angle outside; negative: total reflection               1
"""

from wavetank.device.compiler import qd
from wavetank.view.lens import Lens, to_pixel, to_view, vec3, vec4
from wavetank.view.look import Look
from wavetank.view.optics.fluid import Optics
from wavetank.view.optics.maps import margins_inside, picture_at
from wavetank.view.optics.normals import normal_of, rise_at
from wavetank.view.optics.radiance import environment, smoothstep
from wavetank.view.optics.rays import Box


@qd.func
def depth_below(sun: Lens, first: qd.template(), at):
    """How far [m] the point `at` lies below the surface along the sun's rays, between four texels; -1 outside of it."""
    c = to_view(sun, at)
    place = to_pixel(sun, c) - 0.5
    column, row = qd.cast(qd.floor(place.x), qd.i32), qd.cast(qd.floor(place.y), qd.i32)
    result = -1.0
    if row >= 0 and column >= 0 and row < first.shape[0] - 1 and column < first.shape[1] - 1:
        total, weight = 0.0, 0.0
        for k in qd.static(range(4)):
            z = qd.bit_cast(first[row + k // 2, column + k % 2], qd.f32)
            share = (1.0 - qd.abs(column + k % 2 - place.x)) * (1.0 - qd.abs(row + k // 2 - place.y))
            if z < 1e30:
                total += share * z
                weight += share
        if weight > 0.25:
            result = c.z - total / weight
    return result


@qd.func
def normal_above(sun: Lens, first: qd.template(), at, spacing):
    """Normal of the surface at the point `at` on it, out of the water, between four texels of the sun's map."""
    place = to_pixel(sun, to_view(sun, at)) - 0.5
    n = 1e-6 * -sun.forward
    for k in qd.static(range(4)):
        row = qd.min(qd.max(qd.cast(qd.floor(place.y), qd.i32) + k // 2, 0), first.shape[0] - 1)
        column = qd.min(qd.max(qd.cast(qd.floor(place.x), qd.i32) + k % 2, 0), first.shape[1] - 1)
        z = qd.bit_cast(first[row, column], qd.f32)
        if z < 1e30:
            share = qd.max(1.0 - qd.abs(column - place.x), 0.0) * qd.max(1.0 - qd.abs(row - place.y), 0.0)
            n += share * normal_of(sun, row, column, z, rise_at(row, column, z, 3.0 * spacing, first))
    return n.normalized(1e-12)


@qd.func
def texel_normal(sun: Lens, first: qd.template(), at, spacing):
    """The same of the nearest texel, in a quarter of the time: for what is seen through water."""
    place = to_pixel(sun, to_view(sun, at))
    row = qd.min(qd.max(qd.cast(place.y, qd.i32), 0), first.shape[0] - 1)
    column = qd.min(qd.max(qd.cast(place.x, qd.i32), 0), first.shape[1] - 1)
    z = qd.bit_cast(first[row, column], qd.f32)
    n = vec3(0.0, 1.0, 0.0)
    if z < 1e30:
        n = normal_of(sun, row, column, z, rise_at(row, column, z, 3.0 * spacing, first))
    return n


@qd.func
def is_wet(sun: Lens, first: qd.template(), walls: Box, at, spacing):
    """Whether the point `at` lies in the water, judged a spacing off panes and floor, where the map has an edge."""
    inset = vec3(spacing, spacing, spacing)
    inner = qd.max(at, walls.lower + inset)
    inner = qd.min(inner, vec3(walls.upper.x - spacing, walls.upper.y, walls.upper.z - spacing))
    return depth_below(sun, first, inner) > 0.0


@qd.func
def about_wet(sun: Lens, first: qd.template(), walls: Box, at, spacing):
    """The same to the nearest texel, for what is seldom near the surface."""
    inset = vec3(spacing, spacing, spacing)
    inner = qd.max(at, walls.lower + inset)
    inner = qd.min(inner, vec3(walls.upper.x - spacing, walls.upper.y, walls.upper.z - spacing))
    c = to_view(sun, inner)
    place = to_pixel(sun, c)
    row = qd.min(qd.max(qd.cast(place.y, qd.i32), 0), first.shape[0] - 1)
    column = qd.min(qd.max(qd.cast(place.x, qd.i32), 0), first.shape[1] - 1)
    return c.z > qd.bit_cast(first[row, column], qd.f32)


@qd.func
def seen_at(depth: qd.template(), picture: qd.template(), lens: Lens, z, at, usual):
    """Radiance that the picture shows at the point `at`, and towards its margins and beyond it what is `usual` there.

    What stands before the water, nearer than `z` [m], is not behind it.
    """
    result = usual
    c = to_view(lens, at)
    if c.z > lens.near:
        there = to_pixel(lens, c)
        inside = margins_inside(depth, there, 0.08)
        if inside > 0.0:
            shown = qd.bit_cast(depth[qd.cast(there.y, qd.i32), qd.cast(there.x, qd.i32)], qd.f32)
            if shown > z and shown < 1e30:
                result += smoothstep(inside) * (picture_at(picture, there) - result)
    return result


@qd.func
def wall_ahead(walls: Box, p, ahead):
    """(outward normal, way [m]) of the wall, the floor or the open top that a ray from a point in the tank meets."""
    way, axis = 1e9, 0
    for k in qd.static(range(3)):
        if qd.abs(ahead[k]) > 1e-6:
            edge = qd.select(ahead[k] > 0.0, walls.upper[k], walls.lower[k])
            t = (edge - p[k]) / ahead[k]
            if t < way:
                way, axis = t, k
    n = vec3(0.0, 0.0, 0.0)
    for k in qd.static(range(3)):
        if axis == k:
            n[k] = qd.select(ahead[k] > 0.0, 1.0, -1.0)
    return vec4(n.x, n.y, n.z, qd.max(way, 0.0))


@qd.func
def through_body(
    depth: qd.template(), picture: qd.template(), first: qd.template(), lens: Lens, sun: Lens, look: Look,
    optics: Optics, walls: Box, z, at, bent,
):  # fmt: skip
    """(radiance at its end, way through the water) of a ray that has entered the water of a tank at `at`.

    The way is negative where there is no body of water: less than two spacings of it.
    """
    shown, total, done = vec3(0.0, 0.0, 0.0), 0.0, 0
    p, ahead = qd.min(qd.max(at, walls.lower), walls.upper), bent
    if not about_wet(sun, first, walls, p + 2.0 * optics.spacing * ahead, optics.spacing):
        total, done = -1.0, 1
    for bounce in range(3):
        if done == 0:
            wall = wall_ahead(walls, p, ahead)
            n, s = vec3(wall[0], wall[1], wall[2]), wall[3]
            if not about_wet(sun, first, walls, p + 0.999 * s * ahead, optics.spacing):
                low = 0.0
                for _ in range(5):
                    middle = 0.5 * (low + s)
                    if is_wet(sun, first, walls, p + middle * ahead, optics.spacing):
                        low = middle
                    else:
                        s = middle
                n = texel_normal(sun, first, p + s * ahead, optics.spacing)
            total += s
            p += s * ahead
            cosi = ahead.dot(n)
            k = 1.0 - 1.7689 * (1.0 - cosi * cosi)
            if n.y < -0.5:
                dimly = look.below * qd.exp(-0.6 * optics.usual * optics.absorption)
                shown, done = seen_at(depth, picture, lens, z, p, dimly), 1
            elif k > 0.0 or cosi <= 0.0:
                out = ahead
                if cosi > 0.0:
                    out = 1.33 * ahead + (qd.sqrt(k) - 1.33 * cosi) * n
                shown, done = environment(look, out), 1
                if out.y < -1e-3:
                    shown = seen_at(depth, picture, lens, z, p + (qd.max(p.y, 0.0) / -out.y) * out, shown)
            else:
                ahead -= 2.0 * cosi * n
    if done == 0:
        shown = optics.glow
    return vec4(shown.x, shown.y, shown.z, total)

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

Solids in the tank are met on the way by their distances, and so are those that the surface mirrors; what the picture
shows of them is taken from it.
"""

import dataclasses

from wavetank.device.compiler import qd
from wavetank.solids.distance import SolidSet, signed_distance
from wavetank.view.lens import Lens, to_pixel, to_view, vec2, vec3, vec4
from wavetank.view.look import Look
from wavetank.view.optics.fluid import Optics
from wavetank.view.optics.maps import margins_inside, picture_at, share_of
from wavetank.view.optics.normals import normal_of, rise_at
from wavetank.view.optics.radiance import environment, smoothstep, surface_radiance
from wavetank.view.optics.rays import Box


@dataclasses.dataclass(frozen=True, eq=False)
class Inside:
    """What a ray in a tank may meet, on the device."""

    walls: Box
    solids: SolidSet
    paints: qd.types.ndarray()  # vec3 [solids]: their albedo
    column: qd.types.ndarray()  # i32 [texels, texels]: water along the sun's rays, see `Thickness`
    shade: qd.types.ndarray()  # i32 [finer texels]: bits of the depth [m] at which they meet solids


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
def depth_at(sun: Lens, first: qd.template(), walls: Box, at, spacing):
    """Depth [m] of the point `at` below the surface, judged a spacing off panes and floor, where the map has edges."""
    inset = vec3(spacing, spacing, spacing)
    inner = qd.max(at, walls.lower + inset)
    inner = qd.min(inner, vec3(walls.upper.x - spacing, walls.upper.y, walls.upper.z - spacing))
    return depth_below(sun, first, inner)


@qd.func
def about_wet(sun: Lens, first: qd.template(), walls: Box, at, spacing):
    """Whether the point `at` lies in the water, to the nearest texel, for what is seldom near the surface."""
    inset = vec3(spacing, spacing, spacing)
    inner = qd.max(at, walls.lower + inset)
    inner = qd.min(inner, vec3(walls.upper.x - spacing, walls.upper.y, walls.upper.z - spacing))
    c = to_view(sun, inner)
    place = to_pixel(sun, c)
    row = qd.min(qd.max(qd.cast(place.y, qd.i32), 0), first.shape[0] - 1)
    column = qd.min(qd.max(qd.cast(place.x, qd.i32), 0), first.shape[1] - 1)
    return c.z > qd.bit_cast(first[row, column], qd.f32)


@qd.func
def seen_at(depth: qd.template(), picture: qd.template(), lens: Lens, z, at, usual, solid: qd.template()):
    """Radiance that the picture shows at the point `at`, and towards its margins and beyond it what is `usual` there.

    What stands before the water, nearer than `z` [m], is not behind it; where rays meet each `solid` by themselves,
    neither is one that hides the point from the eye.
    """
    result = usual
    c = to_view(lens, at)
    if c.z > lens.near:
        there = to_pixel(lens, c)
        inside = margins_inside(depth, there, 0.08)
        if inside > 0.0:
            shown = qd.bit_cast(depth[qd.cast(there.y, qd.i32), qd.cast(there.x, qd.i32)], qd.f32)
            if qd.static(solid):
                if shown < 0.97 * c.z:
                    shown = 0.0
            if shown > z and shown < 1e30:
                result += smoothstep(inside) * (picture_at(picture, there) - result)
    return result


@qd.func
def wholeness(sun: Lens, first: qd.template(), column: qd.template(), walls: Box, at, spacing, unit):
    """How much of a body the water around the point `at` is, 0 to 1: broken water leaves air in the sun's way.

    It is 0 where there is none.
    """
    inset = vec3(1.5 * spacing, 0.0, 1.5 * spacing)  # next to a wall the column's discs are cut
    inner = qd.min(qd.max(at, walls.lower + inset), walls.upper - inset)
    c = to_view(sun, inner)
    # Both maps between the same four texels.
    place = to_pixel(sun, c) - 0.5
    left = qd.min(qd.max(qd.cast(place.x, qd.i32), 0), first.shape[1] - 2)
    top = qd.min(qd.max(qd.cast(place.y, qd.i32), 0), first.shape[0] - 2)
    u, v = place.x - left, place.y - top
    begins, water, weight = 0.0, 0.0, 1e-6
    for k in qd.static(range(4)):
        z = qd.bit_cast(first[top + k // 2, left + k % 2], qd.f32)
        share = share_of(k, v, u)
        water += share * column[top + k // 2, left + k % 2]
        if z < 1e30:
            begins += share * z
            weight += share
    under, result = c.z - begins / weight, 0.0
    if under > 0.0 and weight > 0.25:
        length = qd.min(wall_ahead(walls, inner, sun.forward)[3] + under, 1e3)
        result = smoothstep((water * unit / length - 0.3) / 0.45)
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
def solid_ahead(solids: SolidSet, paints: qd.template(), p, ahead, far, coarse):
    """(normal, way [m], number) of the first solid that a ray meets within `far` [m]; a way of -1 where it meets none.

    Solids are met to within `coarse` [m], and what a ray begins in is left first; glass is not met. All distances are
    asked for in one place, because every copy of that code takes seconds to compile.
    """
    hit, which, last = vec4(0.0, 0.0, 0.0, -1.0), -1, far
    for k in range(solids.tank_count, solids.count):
        middle = solids.position[k] - p
        along = middle.dot(ahead)
        reach = 1.001 * solids.reach[k] + coarse
        miss = middle.dot(middle) - along * along
        t, end = 0.0, last
        if solids.reach[k] < 1e4:
            half = qd.sqrt(qd.max(reach * reach - miss, 0.0))
            t, end = qd.max(along - half, 0.0), qd.min(last, along + half)
            if miss > reach * reach:
                end = -1.0
        if paints[k].x < 0.0:
            end = -1.0
        steps, outside = 0, 0
        while steps < 40 and t <= end:
            value = signed_distance(solids, k, p + t * ahead)
            if value.w > coarse:
                outside = 1
            if outside == 1 and value.w <= coarse:
                hit, which, last = vec4(value.x, value.y, value.z, t), k, t
                steps = 40
            t += qd.max(qd.abs(value.w), 0.5 * coarse)
            steps += 1
    return hit, which


@qd.func
def solid_radiance(
    depth: qd.template(), picture: qd.template(), paints: qd.template(), lens: Lens, look: Look, at, n, seen, k, sunny,
    spacing,
):  # fmt: skip
    """Radiance of solid `k` at its point `at`: as the picture shows it, and where that hides it in plain light."""
    result = surface_radiance(look, paints[k], n, seen, vec2(sunny, 0.8), 0.4 * look.wrap, 0.0)
    c = to_view(lens, at)
    if c.z > lens.near:
        there = to_pixel(lens, c)
        inside = margins_inside(depth, there, 0.02)
        if inside > 0.0:
            shown = qd.bit_cast(depth[qd.cast(there.y, qd.i32), qd.cast(there.x, qd.i32)], qd.f32)
            off = qd.abs(shown - c.z) / (2.0 * spacing)
            result += smoothstep(inside) * smoothstep(2.0 - off) * (picture_at(picture, there) - result)
    return result


@qd.func
def through_body(
    depth: qd.template(), picture: qd.template(), first: qd.template(), lens: Lens, sun: Lens, look: Look,
    optics: Optics, inside: Inside, z, at, bent, mirrored, solid: qd.template(),
):  # fmt: skip
    """(radiance at its end, way through the water) of a ray that has entered the water of a tank at `at`, (radiance,
    share) of the solid that the ray which is `mirrored` there meets, and how much of a body the water is.

    The way is negative where there is none: less than two spacings of it, or more air than water; nothing is found
    then but what is mirrored; nothing is where `mirrored` is nought.
    """
    shown, total, done = vec3(0.0, 0.0, 0.0), 0.0, 0
    seen_above = vec4(0.0, 0.0, 0.0, 0.0)
    p, ahead = qd.min(qd.max(at, inside.walls.lower), inside.walls.upper), bent
    begun = p + 2.0 * optics.spacing * ahead
    whole = wholeness(sun, first, inside.column, inside.walls, begun, optics.spacing, optics.unit)
    if whole <= 0.0:
        total, done = -1.0, 1
    # Within, then where solids stand in the way of what leaves, and of what is mirrored.
    leaves = 0
    for bounce in range(qd.static(5 if solid else 3)):
        above = 0
        if qd.static(solid):
            if bounce == 4 and mirrored.y != 0.0:
                p, ahead, above, leaves = at, mirrored, 1, 0
        if (done == 0 and (bounce < 3 or leaves == 1)) or above == 1:
            n, s = vec3(0.0, 1.0, 0.0), 1e3
            if above + leaves == 0:
                wall = wall_ahead(inside.walls, p, ahead)
                n, s = vec3(wall[0], wall[1], wall[2]), wall[3]
                if not about_wet(sun, first, inside.walls, p + 0.999 * s * ahead, optics.spacing):
                    # Three halvings, and between their ends as if the surface were straight.
                    low, over, deep = 0.0, 0.0, 0.0
                    for _ in range(3):
                        middle = 0.5 * (low + s)
                        found = depth_at(sun, first, inside.walls, p + middle * ahead, optics.spacing)
                        if found > 0.0:
                            low, deep = middle, found
                        else:
                            s, over = middle, found
                    if deep > 0.0 and over < 0.0:
                        s = low + (s - low) * deep / (deep - qd.max(over, -deep))
                    else:
                        s = 0.5 * (low + s)
                    n = texel_normal(sun, first, p + s * ahead, optics.spacing)
            met = 0
            if qd.static(solid):
                hit, k = solid_ahead(inside.solids, inside.paints, p, ahead, s, 0.1 * optics.spacing)
                if k >= 0:
                    met, place = 1, p + hit.w * ahead
                    normal = vec3(hit.x, hit.y, hit.z)
                    deep = qd.max(depth_below(sun, first, place), 0.0)
                    sunny = qd.select(above + leaves > 0, 1.0, qd.exp(-0.6 * deep * optics.absorption.y))
                    radiance = solid_radiance(
                        depth, picture, inside.paints, lens, look, place, normal, -ahead, k, sunny, optics.spacing
                    )
                    if above == 1:
                        seen_above = vec4(radiance.x, radiance.y, radiance.z, 1.0)
                    else:
                        shown, done = radiance, 1
                        if leaves == 0:
                            total += hit.w
            if met == 0 and leaves == 1:
                shown, done = environment(look, ahead), 1
                if ahead.y < -1e-3:
                    shown = seen_at(depth, picture, lens, z, p + (qd.max(p.y, 0.0) / -ahead.y) * ahead, shown, solid)
            elif met == 0 and above == 0:
                total += s
                p += s * ahead
                cosi = ahead.dot(n)
                k = 1.0 - 1.7689 * (1.0 - cosi * cosi)
                if n.y < -0.5:
                    dimly = look.below * qd.exp(-0.6 * optics.usual * optics.absorption)
                    shown, done = seen_at(depth, picture, lens, z, p, dimly, solid), 1
                elif k > 0.0 or cosi <= 0.0:
                    out = ahead
                    if cosi > 0.0:
                        out = 1.33 * ahead + (qd.sqrt(k) - 1.33 * cosi) * n
                    if qd.static(solid):
                        leaves, ahead = 1, out
                    else:
                        shown, done = environment(look, out), 1
                        if out.y < -1e-3:
                            shown = seen_at(
                                depth, picture, lens, z, p + (qd.max(p.y, 0.0) / -out.y) * out, shown, solid
                            )
                else:
                    ahead -= 2.0 * cosi * n
    if done == 0:
        shown = optics.glow
    return vec4(shown.x, shown.y, shown.z, total), seen_above, whole

"""A tank as a body of water: the bent ray from where it enters to where it leaves, or meets the floor.

Between flat panes the way of a ray has a closed form: it ends at the nearest of them, of the floor and of the surface.
Seen from within, panes and surface mirror totally what meets them at more than 48.6 degrees from their normal, which is
nearly every ray that came in through a pane beside (Snell). Where one leaves it is followed outside, and what is
mirrored there as well, so that the border of what is mirrored totally is as soft as it is (Fresnel). The surface is the
one that the sun sees (`SunlitWater`): where the end of a straight piece does not lie below it, the place where it does
is found by halving.

    code      symbol   meaning                                                        unit
    under              depth of a point below the surface along the sun's rays        m
    p, ahead           where a straight piece begins, and its direction               m, 1
    s                  its length                                                     m
    n                  normal of what it ends at, out of the water                    1
    share     F        of the light that is mirrored where a ray leaves               1
    left               radiance and way of what leaves there                          1, m

Solids in the tank are met on the way by their distances, and so are those that the surface mirrors; what the picture
shows of them is taken from it.
"""

import dataclasses

from wavetank.device.compiler import qd
from wavetank.solids.distance import SolidSet, signed_distance
from wavetank.view.lens import Lens, to_pixel, to_view, vec2, vec3, vec4
from wavetank.view.look import Look
from wavetank.view.optics.bilinear import share_of
from wavetank.view.optics.fluid import Optics
from wavetank.view.optics.interface import bent as crossed
from wavetank.view.optics.interface import index_of_water
from wavetank.view.optics.interface import mirrored as reflected
from wavetank.view.optics.normals import normal_of, rise_at
from wavetank.view.optics.radiance import environment, smoothstep, surface_radiance
from wavetank.view.optics.rays import Box
from wavetank.view.optics.screen_hit import seen_at


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
        for k in range(4):
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
def depth_at(sun: Lens, first: qd.template(), walls: Box, at, spacing):
    """Depth [m] of the point `at` below the surface, judged a spacing off panes and floor, where the map has edges."""
    inset = vec3(spacing, spacing, spacing)
    inner = qd.max(at, walls.lower + inset)
    inner = qd.min(inner, vec3(walls.upper.x - spacing, walls.upper.y, walls.upper.z - spacing))
    return depth_below(sun, first, inner)


@qd.func
def about_depth(sun: Lens, first: qd.template(), walls: Box, at, spacing):
    """The same to the nearest texel, for what is seldom near the surface; where there is no water far below zero."""
    inset = vec3(spacing, spacing, spacing)
    inner = qd.max(at, walls.lower + inset)
    inner = qd.min(inner, vec3(walls.upper.x - spacing, walls.upper.y, walls.upper.z - spacing))
    c = to_view(sun, inner)
    place = to_pixel(sun, c)
    row = qd.min(qd.max(qd.cast(place.y, qd.i32), 0), first.shape[0] - 1)
    column = qd.min(qd.max(qd.cast(place.x, qd.i32), 0), first.shape[1] - 1)
    return c.z - qd.bit_cast(first[row, column], qd.f32)


@qd.func
def wholeness(sun: Lens, first: qd.template(), inside: Inside, optics: Optics, at, bent):
    """How much of a body the water is, 0 to 1, that a `bent` ray has entered at `at`, two spacings farther; and how
    much of one it is where its surface is calm, see `calm`.

    Broken water leaves air in the sun's way. It is 0 where there is none. A block that ends before the tank does
    leaves air there as well: below a calm surface no more is asked for than eight spacings of water.
    """
    begun = qd.min(qd.max(at, inside.walls.lower), inside.walls.upper) + 2.0 * optics.spacing * bent
    inset = 1.5 * optics.spacing * vec3(1.0, 0.0, 1.0)  # next to a wall the column's discs are cut
    inner = qd.min(qd.max(begun, inside.walls.lower + inset), inside.walls.upper - inset)
    c = to_view(sun, inner)
    # Both maps between the same four texels.
    place = to_pixel(sun, c) - 0.5
    left = qd.min(qd.max(qd.cast(place.x, qd.i32), 0), first.shape[1] - 2)
    top = qd.min(qd.max(qd.cast(place.y, qd.i32), 0), first.shape[0] - 2)
    u, v = place.x - left, place.y - top
    begins, water, weight = 0.0, 0.0, 1e-6
    for k in range(4):
        z = qd.bit_cast(first[top + k // 2, left + k % 2], qd.f32)
        share = share_of(k, v, u)
        water += share * inside.column[top + k // 2, left + k % 2]
        if z < 1e30:
            begins += share * z
            weight += share
    under, result = c.z - begins / weight, vec2(0.0, 0.0)
    if under > 0.0 and weight > 0.25:
        length = qd.min(wall_ahead(inside.walls, inner, sun.forward)[3] + under, 1e3)
        found = water * optics.unit
        result.x = smoothstep((found / length - 0.3) / 0.45)
        result.y = smoothstep((found / qd.min(length, 8.0 * optics.spacing) - 0.3) / 0.45)
    return result


@qd.func
def calm(uneven):
    """How calm a surface is, 0 to 1, whose normals have the standard deviation `uneven`."""
    return 1.0 - smoothstep((uneven - 0.1) / 0.3)


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
def solid_ahead(solids: SolidSet, paints: qd.template(), p, ahead, far, coarse, wide):
    """(normal, way [m]), number and share of the first solid that a ray meets within `far` [m]; a share of 0 is none.

    Where it meets none, one that it passes within a cone of the slope `wide` has a share of it. Solids are met to
    within `coarse` [m], and what a ray begins in is left first; glass is not met. All distances are asked for in one
    place, because every copy of that code takes seconds to compile.
    """
    hit, which, last = vec4(0.0, 0.0, 0.0, -1.0), -1, far
    passed, beside, off = hit, -1, 1.0
    for k in range(solids.tank_count, solids.count):
        middle = solids.position[k] - p
        along = middle.dot(ahead)
        reach = 1.001 * solids.reach[k] + coarse + wide * qd.min(qd.max(along, 0.0), far)
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
                if outside == 1 and value.w - coarse < off * wide * t:
                    passed, beside, off = vec4(value.x, value.y, value.z, t), k, (value.w - coarse) / (wide * t)
                outside = 1
            if outside == 1 and value.w <= coarse:
                hit, which, last = vec4(value.x, value.y, value.z, t), k, t
                steps = 40
            t += qd.max(qd.abs(value.w), 0.5 * coarse)
            steps += 1
    cover = 1.0
    if which < 0:
        hit, which, cover = passed, beside, smoothstep(1.0 - off)
    return hit, which, cover


@qd.func
def faint():
    """Share of what leaves the water up to which what is mirrored there is not followed."""
    return 0.05


@qd.func
def crossed_about(ahead, n, spread):
    """(direction outside, share that is mirrored) of rays out of the water that spread around one of them.

    What Snell and Fresnel say of one is blurred where the square of the cosine outside lies near 0. By the angle it
    changes by 1.75 per radian there, and 0.45 of the blur's half width is its standard deviation; `spread` [rad] is
    that of the rays. However broken the surface is, none leave along its normal that would be mirrored as a whole.
    """
    cosi, wide = ahead.dot(n), qd.min(3.9 * spread, 0.8)
    k = 1.0 - 1.7689 * (1.0 - cosi * cosi)
    ray, soft = ahead, wide > 1e-3 and qd.abs(k) < wide
    if soft:
        # As if the angle were one that lets it out.
        steep = qd.sqrt(1.0 - (1.0 - qd.max(k, 0.5 * wide)) / 1.7689)
        ray = steep * n + qd.sqrt(1.0 - steep * steep) * (ahead - cosi * n).normalized(1e-9)
    result = crossed(ray, -n, index_of_water())
    if soft:
        result[3] = 1.0 - smoothstep(0.5 + 0.5 * k / wide) * (1.0 - result[3])
    return result


@qd.func
def surface_before(sun: Lens, first: qd.template(), walls: Box, p, ahead, far, above, spacing):
    """(normal out of the water, way [m]) of the surface, where a ray from a point in the water meets it before it has
    come `far` [m]; where it does not that is its way. What it meets there may lie `above` [m] the surface.
    """
    result = vec4(0.0, 0.0, 0.0, far)
    if about_depth(sun, first, walls, p + 0.999 * far * ahead, spacing) <= -above:
        # Three halvings, and between their ends as if the surface were straight.
        low, over, deep, s = 0.0, 0.0, 0.0, far
        for _ in range(3):
            middle = 0.5 * (low + s)
            found = depth_at(sun, first, walls, p + middle * ahead, spacing)
            if found > 0.0:
                low, deep = middle, found
            else:
                s, over = middle, found
        if deep > 0.0 and over < 0.0:
            s = low + (s - low) * deep / (deep - qd.max(over, -deep))
        else:
            s = 0.5 * (low + s)
        n = normal_above(sun, first, p + s * ahead, spacing)
        result = vec4(n.x, n.y, n.z, s)
    return result


@qd.func
def through_body(
    depth: qd.template(),
    picture: qd.template(),
    first: qd.template(),
    lens: Lens,
    sun: Lens,
    look: Look,
    optics: Optics,
    inside: Inside,
    at,
    bent,
    mirrored,
    whole,
    uneven,
    solid: qd.template(),
):
    """(radiance at its end, way through the water) of a ray that has entered the water of a tank at `at`, and
    (radiance, share) of the solid that the ray which is `mirrored` there meets, and (column, row, kind) of the place
    of the picture that is all it shows; where rays beside it have the same kind, their places lie between. A kind of 0
    is none.

    The way is negative where the water is no body, by `wholeness`; nothing is found then but what is mirrored; nothing
    is where `mirrored` is nought. The standard deviation of the normals where it entered is `uneven`: rays that enter
    around it spread about as much.

    All that a straight piece may meet, and all that it may show, is asked for in one place: compilers copy each
    function to wherever it is called, and the time that they take grows faster than what they get.
    """
    shown, total, seen_above = vec3(0.0, 0.0, 0.0), 0.0, vec4(0.0, 0.0, 0.0, 0.0)
    lead = vec3(0.0, 0.0, 0.0)
    p, ahead = qd.min(qd.max(at, inside.walls.lower), inside.walls.upper), bent
    # Where a ray leaves that is mirrored as well, what leaves first is kept, and what is mirrored there goes on.
    left, share, waits, turned, again = vec4(0.0, 0.0, 0.0, 0.0), 0.0, 0, p, ahead
    # A piece of 0 is in the water, of 1 outside where it has left, of 2 outside where it was mirrored at first; where a
    # solid has a share of it, it is looked at again, past that one.
    piece, past, within, done = 0, 0, 0, 0
    if whole <= 0.0:
        total, done = -1.0, 1
    for _ in range(qd.static(7 if solid else 5)):
        if done == 1 and waits == 1:
            left = vec4(shown.x, shown.y, shown.z, total)
            p, ahead, waits, piece, done = turned, again, 0, 0, 0
        if done == 0 and piece == 0 and within == 3:
            shown, done = optics.glow, 1
        if qd.static(solid):
            if done == 1 and piece < 2 and mirrored.y != 0.0:
                p, ahead, piece, done = at, mirrored, 2, 0
        if done == 0:
            n, s = vec3(0.0, 1.0, 0.0), 1e3
            if piece == 0:
                met = wall_ahead(inside.walls, p, ahead)
                n, s = vec3(met[0], met[1], met[2]), met[3]
            # What it shows: `usual`, or what the picture shows at a `place`, of a solid within `near` of it.
            shows, place, usual, near, cover = 0, p, vec3(0.0, 0.0, 0.0), 0.0, 0.0
            hit, k = vec4(0.0, 0.0, 0.0, 0.0), 0
            if qd.static(solid):
                if past == 0:
                    hit, k, found = solid_ahead(
                        inside.solids,
                        inside.paints,
                        p,
                        ahead,
                        s,
                        0.1 * optics.spacing,
                        qd.select(piece == 2, 0.0, uneven),
                    )
                    cover = found
                    if share > 0.0:
                        cover = qd.select(cover > 0.5, 1.0, 0.0)
            if piece == 0:
                # The surface before a solid is one that is on the way to the wall and to the solid: the way ends in the
                # ground beside a lake, and above a solid that sticks out there is no water, either. At a shore both
                # are in one place, and the solid is met unless it is clearly above.
                # What has just come in is below the surface, however the sun's map of it and the eye's differ.
                least = qd.select(within == 0, 0.2, 0.0) * optics.spacing
                far, met = qd.select(cover > 0.0, hit[3], s), vec4(0.0, 0.0, 0.0, s)
                for search in range(2):
                    if search == 0 or (cover > 0.0 and met[3] < far):
                        end, above = qd.select(search == 0, s, far), qd.select(search == 0, least, optics.spacing)
                        met = surface_before(sun, first, inside.walls, p, ahead, end, above, optics.spacing)
                if met[3] < far:
                    n, s, cover = vec3(met[0], met[1], met[2]), met[3], 0.0
            if qd.static(solid):
                if past == 0:
                    if cover > 0.0:
                        shows, place, near, s = 1, p + hit.w * ahead, 2.0 * optics.spacing, hit.w
                        # On it, not as far before it as it is met.
                        place -= 0.1 * optics.spacing * vec3(hit.x, hit.y, hit.z)
                        sunny = 1.0
                        if piece == 0:
                            deep = about_depth(sun, first, inside.walls, place, optics.spacing)
                            sunny = qd.exp(-0.6 * qd.max(deep, 0.0) * optics.absorption.y)
                        usual = surface_radiance(
                            look,
                            inside.paints[k],
                            vec3(hit.x, hit.y, hit.z),
                            -ahead,
                            vec2(sunny, 0.8),
                            0.4 * look.wrap,
                            0.0,
                        )
                past = 0
            ends = 1
            if cover == 0.0 and piece == 1:
                usual = environment(look, ahead)
                if ahead.y < -1e-3:
                    shows, place = 1, p + (qd.max(p.y, 0.0) / -ahead.y) * ahead
            elif cover == 0.0 and piece == 0:
                within += 1
                total += s
                p += s * ahead
                if n.y < -0.5:
                    shows, place = 1, p
                    usual = look.below * qd.exp(-0.6 * optics.usual * optics.absorption)
                else:
                    ends = 0
                    out = crossed_about(ahead, n, uneven)
                    if ahead.dot(n) <= 0.0:  # the normal of a bent surface, which is turned away from the ray
                        out = vec4(ahead.x, ahead.y, ahead.z, 0.0)
                    ahead = reflected(ahead, -n)
                    if out[3] < qd.select(share == 0.0, 1.0, 0.5):  # divided before, it takes the way of most of it
                        turned, again, piece = p, ahead, 1
                        ahead = vec3(out[0], out[1], out[2])
                        if share == 0.0:
                            share = qd.max(out[3] - faint(), 0.0) / (1.0 - faint())
                            waits = qd.select(share > 0.0, 1, 0)
            if ends == 1:
                there = vec3(0.0, 0.0, 0.0)
                if shows == 1:
                    usual, there = seen_at(depth, picture, lens, place, usual, near, solid)
                way = total + qd.select(cover > 0.0 and piece == 0, s, 0.0)
                if piece == 2:
                    done = 1
                    if cover > 0.0:
                        seen_above = vec4(usual.x, usual.y, usual.z, 1.0)
                elif cover > 0.0 and cover < 1.0:
                    left, share, past = vec4(usual.x, usual.y, usual.z, way), 1.0 - cover, 1
                else:
                    shown, total, done = usual, way, 1
                    if there.z > 0.999 and cover == 0.0:
                        lead = vec3(there.x, there.y, 1.0 + piece + 2.0 * within)
    if done == 0:
        shown = optics.glow
    if share > 0.0:
        # One way for both, with what each of them is swallowed less or more on its own.
        way = share * total + (1.0 - share) * left[3]
        shown = share * qd.exp((way - total) * optics.absorption) * shown
        shown += (1.0 - share) * qd.exp((way - left[3]) * optics.absorption) * vec3(left[0], left[1], left[2])
        total = way
    if share > 0.0 or seen_above[3] > 0.0:
        lead.z = 0.0
    return vec4(shown.x, shown.y, shown.z, total), seen_above, lead

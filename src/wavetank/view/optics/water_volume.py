"""The water in a tank as a volume: the bent ray from where it enters to where it leaves, or meets the floor.

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
    for k in range(4):  # one copy of the code to compile
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
def volume_confidence(sun: Lens, first: qd.template(), inside: Inside, optics: Optics, at, bent):
    """How much of a body the water is, 0 to 1, that a `bent` ray has entered at `at`, two spacings farther; and how
    much of one it is where its surface is calm, see `calmness`.

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
def calmness(uneven):
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
def refract_out_blurred(ahead, n, spread):
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


#: A ray on its way through the water and out of it.
Path = qd.types.struct(
    p=vec3,  # m: where its next straight piece begins
    ahead=vec3,  # unit: its direction
    outside=qd.i32,  # 1 where that piece is outside, after it has left the water
    above=qd.i32,  # 1 where that piece is outside, of the ray that was mirrored where the first one entered
    past=qd.i32,  # 1 where the piece is followed again, past a solid that has a share of it
    bounces=qd.i32,  # pieces in the water so far
    done=qd.i32,  # 1 where it shows something
    shown=vec3,  # radiance of that
    way=qd.f32,  # m: through the water
    waits=qd.i32,  # 1 where what is mirrored at the place that the ray has left is still to be followed:
    turned=vec3,  # m: from there
    again=vec3,  # unit: in this direction
    share=qd.f32,  # share of the light that comes from there, or from past a solid
    left=vec4,  # radiance and way of the rest
    mirrored=vec4,  # radiance and share of a solid above the water
    place=vec3,  # (column, row, kind) of what it shows
)

#: A straight piece of a ray, and what it ends at.
Piece = qd.types.struct(
    length=qd.f32,  # m
    normal=vec3,  # of the wall or the surface that it ends at, out of the water
    hit=vec4,  # normal of a solid, and the way [m] to it
    solid=qd.i32,  # number of that solid
    cover=qd.f32,  # share of it that the solid has
)

#: What a piece shows at its end: `usual`, or what the picture shows at a point.
Ending = qd.types.struct(
    usual=vec3,  # radiance
    at=vec3,  # m
    in_picture=qd.i32,  # 1 where the picture may show the point
    near=qd.f32,  # m: within which depth of it the picture has to show a solid; 0 for anything
    goes_on=qd.i32,  # 1 where the ray does not end there
)


@qd.func
def trace_water_volume(
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
    confidence,
    uneven,
    solids: qd.template(),
):
    """(radiance at its end, way through the water) of a ray that has entered the water of a tank at `at`, and
    (radiance, share) of the solid that the ray which is `mirrored` there meets, and (column, row, kind) of the place
    of the picture that is all it shows; where neighbouring rays have the same kind, their places lie between. A kind of
    0 is none.

    The way is negative where the water is not a body, by its `confidence`; nothing is found then but what is mirrored;
    nothing is where `mirrored` is zero. The standard deviation of the normals where it entered is `uneven`: rays that
    enter around it spread about as much.

    All that a straight piece may meet, and all that it may show, is asked for in one place: compilers copy each
    function to wherever it is called, and the time that they take grows faster than what they get.
    """
    path = begin_path(inside.walls, at, bent, confidence)
    for _ in range(qd.static(7 if solids else 5)):
        resume(path, optics, at, mirrored, solids)
        if path.done == 0:
            piece = follow_piece(path, sun, first, optics, inside, uneven, solids)
            ending = Ending(usual=vec3(0.0, 0.0, 0.0), at=path.p, in_picture=0, near=0.0, goes_on=0)
            if qd.static(solids):
                if path.past == 0 and piece.cover > 0.0:
                    show_solid(ending, piece, path, sun, first, look, optics, inside)
                path.past = 0
            if piece.cover == 0.0 and path.outside == 1:
                show_surroundings(ending, path, look)
            elif piece.cover == 0.0 and path.above == 0:
                cross_boundary(ending, path, piece, look, optics, uneven)
            if ending.goes_on == 0:
                end_piece(path, piece, ending, depth, picture, lens, solids)
    if path.done == 0:
        path.shown = optics.glow
    if path.share > 0.0:
        join_shares(path, optics)
    if path.share > 0.0 or path.mirrored[3] > 0.0:
        path.place.z = 0.0
    return vec4(path.shown.x, path.shown.y, path.shown.z, path.way), path.mirrored, path.place


@qd.func
def begin_path(walls: Box, at, bent, confidence):
    """A ray that enters the water at `at` [m]; it is done at once where the water is not a body."""
    start, absent = qd.min(qd.max(at, walls.lower), walls.upper), confidence <= 0.0
    nothing = vec3(0.0, 0.0, 0.0)
    return Path(
        p=start,
        ahead=bent,
        outside=0,
        above=0,
        past=0,
        bounces=0,
        done=qd.cast(absent, qd.i32),
        shown=nothing,
        way=qd.select(absent, -1.0, 0.0),
        waits=0,
        turned=start,
        again=bent,
        share=0.0,
        left=vec4(0.0, 0.0, 0.0, 0.0),
        mirrored=vec4(0.0, 0.0, 0.0, 0.0),
        place=nothing,
    )


@qd.func
def resume(path: qd.template(), optics: Optics, at, mirrored, solids: qd.template()):
    """Go on with what waits: what was mirrored where the ray left, then what is `mirrored` at `at` where it entered."""
    if path.done == 1 and path.waits == 1:
        path.left = vec4(path.shown.x, path.shown.y, path.shown.z, path.way)
        path.p, path.ahead = path.turned, path.again
        path.waits, path.outside, path.done = 0, 0, 0
    if path.done == 0 and path.outside + path.above == 0 and path.bounces == 3:
        path.shown, path.done = optics.glow, 1
    if qd.static(solids):
        if path.done == 1 and path.above == 0 and mirrored.y != 0.0:
            path.p, path.ahead = at, mirrored
            path.outside, path.above, path.done = 0, 1, 0


@qd.func
def follow_piece(
    path: qd.template(), sun: Lens, first: qd.template(), optics: Optics, inside: Inside, uneven, solids: qd.template()
):
    """The straight piece of a ray from where it is on, as far as it comes."""
    piece = Piece(length=1e3, normal=vec3(0.0, 1.0, 0.0), hit=vec4(0.0, 0.0, 0.0, 0.0), solid=0, cover=0.0)
    in_water = path.outside + path.above == 0
    if in_water:
        met = wall_ahead(inside.walls, path.p, path.ahead)
        piece.normal, piece.length = vec3(met[0], met[1], met[2]), met[3]
    if qd.static(solids):
        if path.past == 0:
            spread = qd.select(path.above == 1, 0.0, uneven)
            hit, k, cover = solid_ahead(
                inside.solids, inside.paints, path.p, path.ahead, piece.length, 0.1 * optics.spacing, spread
            )
            if path.share > 0.0:
                cover = qd.select(cover > 0.5, 1.0, 0.0)
            piece.hit, piece.solid, piece.cover = hit, k, cover
    if in_water:
        meet_surface(piece, path, sun, first, optics, inside.walls)
    return piece


@qd.func
def meet_surface(
    piece: qd.template(), path: qd.template(), sun: Lens, first: qd.template(), optics: Optics, walls: Box
):
    """End a piece in the water at the surface, where it meets that before a wall or a solid.

    The surface before a solid is one that is on the way to the wall and to the solid: the way ends in the ground next
    to a lake, and above a solid that sticks out there is no water, either. At a shore both are in one place, and the
    solid is met unless it is clearly above. What has just come in is below the surface, however the sun's map of it and
    the eye's differ.
    """
    least = qd.select(path.bounces == 0, 0.2, 0.0) * optics.spacing
    far, met = qd.select(piece.cover > 0.0, piece.hit[3], piece.length), vec4(0.0, 0.0, 0.0, piece.length)
    for search in range(2):
        if search == 0 or (piece.cover > 0.0 and met[3] < far):
            end, above = qd.select(search == 0, piece.length, far), qd.select(search == 0, least, optics.spacing)
            met = surface_before(sun, first, walls, path.p, path.ahead, end, above, optics.spacing)
    if met[3] < far:
        piece.normal, piece.length, piece.cover = vec3(met[0], met[1], met[2]), met[3], 0.0


@qd.func
def show_solid(
    ending: qd.template(),
    piece: qd.template(),
    path: qd.template(),
    sun: Lens,
    first: qd.template(),
    look: Look,
    optics: Optics,
    inside: Inside,
):
    """End a piece at the solid that it meets: a point of its surface, in the light that the water leaves."""
    n = vec3(piece.hit.x, piece.hit.y, piece.hit.z)
    ending.in_picture, ending.near, piece.length = 1, 2.0 * optics.spacing, piece.hit.w
    ending.at = path.p + piece.hit.w * path.ahead
    # On it, not as far before it as it is met.
    ending.at -= 0.1 * optics.spacing * n
    sunny = 1.0
    if path.outside + path.above == 0:
        deep = about_depth(sun, first, inside.walls, ending.at, optics.spacing)
        sunny = qd.exp(-0.6 * qd.max(deep, 0.0) * optics.absorption.y)
    ending.usual = surface_radiance(
        look, inside.paints[piece.solid], n, -path.ahead, vec2(sunny, 0.8), 0.4 * look.wrap, 0.0
    )


@qd.func
def show_surroundings(ending: qd.template(), path: qd.template(), look: Look):
    """End a piece that has left the water, at the floor or in the sky."""
    ending.usual = environment(look, path.ahead)
    if path.ahead.y < -1e-3:
        ending.in_picture = 1
        ending.at = path.p + (qd.max(path.p.y, 0.0) / -path.ahead.y) * path.ahead


@qd.func
def cross_boundary(
    ending: qd.template(), path: qd.template(), piece: qd.template(), look: Look, optics: Optics, uneven
):
    """End a piece in the water at the floor, or let it leave, be mirrored, or be divided, at a pane or the surface."""
    path.bounces += 1
    path.way += piece.length
    path.p += piece.length * path.ahead
    if piece.normal.y < -0.5:
        ending.in_picture, ending.at = 1, path.p
        ending.usual = look.below * qd.exp(-0.6 * optics.usual * optics.absorption)
    else:
        ending.goes_on = 1
        out = refract_out_blurred(path.ahead, piece.normal, uneven)
        if path.ahead.dot(piece.normal) <= 0.0:  # the normal of a bent surface, which is turned away from the ray
            out = vec4(path.ahead.x, path.ahead.y, path.ahead.z, 0.0)
        path.ahead = reflected(path.ahead, -piece.normal)
        if out[3] < qd.select(path.share == 0.0, 1.0, 0.5):  # divided before, it takes the way of most of it
            path.turned, path.again, path.outside = path.p, path.ahead, 1
            path.ahead = vec3(out[0], out[1], out[2])
            if path.share == 0.0:
                path.share = qd.max(out[3] - faint(), 0.0) / (1.0 - faint())
                path.waits = qd.select(path.share > 0.0, 1, 0)


@qd.func
def end_piece(
    path: qd.template(),
    piece: qd.template(),
    ending: qd.template(),
    depth: qd.template(),
    picture: qd.template(),
    lens: Lens,
    solids: qd.template(),
):
    """Note what a piece shows at its end; where a solid has a share of it, the piece is followed again past that."""
    there = vec3(0.0, 0.0, 0.0)
    if ending.in_picture == 1:
        ending.usual, there = seen_at(depth, picture, lens, ending.at, ending.usual, ending.near, solids)
    seen, in_water = ending.usual, path.outside + path.above == 0
    way = path.way + qd.select(piece.cover > 0.0 and in_water, piece.length, 0.0)
    if path.above == 1:
        path.done = 1
        if piece.cover > 0.0:
            path.mirrored = vec4(seen.x, seen.y, seen.z, 1.0)
    elif piece.cover > 0.0 and piece.cover < 1.0:
        path.left, path.share, path.past = vec4(seen.x, seen.y, seen.z, way), 1.0 - piece.cover, 1
    else:
        path.shown, path.way, path.done = seen, way, 1
        if there.z > 0.999 and piece.cover == 0.0:
            path.place = vec3(there.x, there.y, 1.0 + path.outside + 2.0 * path.bounces)


@qd.func
def join_shares(path: qd.template(), optics: Optics):
    """Add up what both parts of a divided ray show, over one way: of each is absorbed less or more on its own."""
    way = path.share * path.way + (1.0 - path.share) * path.left[3]
    first = vec3(path.left[0], path.left[1], path.left[2])
    path.shown = path.share * qd.exp((way - path.way) * optics.absorption) * path.shown
    path.shown += (1.0 - path.share) * qd.exp((way - path.left[3]) * optics.absorption) * first
    path.way = way

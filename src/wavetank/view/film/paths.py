"""The paths of light, followed from the eye: J. T. Kajiya, "The rendering equation" (1986).

A path ends at the sky or after three matte surfaces. At smooth surfaces of water it goes one way, by chance as Fresnel
has it; within the water it is dimmed (Beer-Lambert), and scattered where that is not clear (`murk.py`). At a matte
surface the sun is looked for by one shadow ray, and what light the water brings there is taken from the photons; the
path goes on in a direction by its cosine. One loop follows both paths and shadow rays, so that what meets rays is
compiled once.

What is carried along a path is radiance over the square of the refractive index, which surfaces leave as it is
(E. Veach, "Robust Monte Carlo methods for light transport simulation" (1997), 5.2); photons carry power, so that what
they bring is divided by that square where it is seen in the water.

    code      symbol   meaning                                                        unit
    value     T        share of the light at the end of the path that the eye gets    1
    radiance  L        light found so far                                             1
    matte              matte surfaces on the path so far                              1
    dull               1 from one on, or from where it was scattered; 2 from metal on    1
    within             whether it was scattered since the last matte surface          1
    gate               where the path came into the water                             m
    smooth             whether the eye sees this place by smooth surfaces alone       1
    waits              light that a shadow ray decides on                             1
"""

import dataclasses

from wavetank.device.compiler import qd
from wavetank.view.film.light import Photons, floor_light, light_within, solid_light
from wavetank.view.film.march import World, first_hit, past
from wavetank.view.film.medium import Medium, absorbed_at, cell_near, through_water
from wavetank.view.film.metal import facet, mirror_of, towards_lamp, unhidden
from wavetank.view.film.murk import albedo_of, any_way, color_of, is_matte, murk_at, thinning
from wavetank.view.film.sampling import around, disc, pair, towards
from wavetank.view.lens import Lens, ray_direction, ray_origin, vec2, vec3, view_ray
from wavetank.view.look import Look
from wavetank.view.optics.hash_noise import scrambled
from wavetank.view.optics.interface import bent, index_of_water, mirrored, through_drop
from wavetank.view.optics.radiance import background, smoothstep, sun_disc
from wavetank.view.optics.rays import Box
from wavetank.view.passes.floor import joint_cover, sand, stone


@dataclasses.dataclass(frozen=True, eq=False)
class Film:
    """What the samples of every pixel have come to, [rows, columns], on the device."""

    mean: qd.types.ndarray()  # vec3: radiance
    half: qd.types.ndarray()  # vec3: what it was when half of the samples were there
    albedo: qd.types.ndarray()  # vec3: of the first matte surface, however it is seen
    shape: qd.types.ndarray()  # vec4: normal of the first surface, and the inverse of its distance


@dataclasses.dataclass(frozen=True, eq=False)
class Setting:
    """What surrounds the water, and how it is looked at, on the device."""

    fill: vec3  # what matte surfaces get of the sky, over what the sky looks like
    middle: vec3  # m: middle of the world, on the floor
    size: qd.f32  # m: radius of the world
    tank: Box  # m: its edges; empty where there is none
    edge: qd.f32  # m: half the width of a line along the tank's edges
    aperture: qd.f32  # m: radius of the lens
    focus: qd.f32  # m: depth that is sharp
    under: qd.i32  # 1 where the eye is in the water
    brightest: qd.f32  # radiance that a sample is bent to, so that none stands out
    sky: (
        qd.types.ndarray()
    )  # vec3 [rows, columns]: a picture in the place of the sky, see `panorama.py`; [1, 1] without
    hung: qd.i32  # 1 where there is one


@qd.kernel(fastcache=True)
def trace(
    film: Film,
    world: World,
    photons: Photons,
    lens: Lens,
    look: Look,
    medium: Medium,
    setting: Setting,
    first: qd.i32,
    samples: qd.i32,
    half: qd.i32,
):
    """Add `samples` samples to every pixel, which has had `first` of them; `half` is half of all that will be."""
    for row, column in qd.ndrange(film.mean.shape[0], film.mean.shape[1]):
        for sample in range(first, first + samples):
            seed = scrambled(qd.cast(row * 16384 + column, qd.u32) ^ qd.u32(0x2545F491))
            place = pair(seed, sample, 0)
            ray = view_ray(lens, row + place.y - 0.5, column + place.x - 0.5)
            p, ahead = ray_origin(lens, ray), ray_direction(lens, ray)
            at_focus = p + setting.focus * ahead
            if setting.aperture > 0.0:
                off = setting.aperture * disc(pair(seed, sample, 1))
                p += off.x * lens.right + off.y * lens.up
            ahead = (at_focus - p).normalized(1e-12)
            light, albedo, shape, smooth = follow(world, photons, lens, look, medium, setting, seed, sample, p, ahead)
            bright = light.max()
            if bright > 1.0 and smooth > 0:
                # What is much brighter than white counts as a little less, or single samples would stand out.
                light *= (1.0 + (bright - 1.0) / (1.0 + (bright - 1.0) / setting.brightest)) / bright
            share = 1.0 / (sample + 1)
            before = film.mean[row, column]
            guide, form = film.albedo[row, column], film.shape[row, column]
            if sample == 0:
                before, guide, form = light, albedo, shape
            film.mean[row, column] = before + share * (light - before)
            if sample < half:
                film.half[row, column] = film.mean[row, column]
            film.albedo[row, column] = guide + share * (albedo - guide)
            film.shape[row, column] = form + share * (shape - form)


@qd.func
def follow(
    world: World,
    photons: Photons,
    lens: Lens,
    look: Look,
    medium: Medium,
    setting: Setting,
    seed,
    sample,
    begin,
    direction,
):
    """Radiance along a ray; the albedo at its first matte surface, what its first surface is, how many it has met."""
    light, value, waits = vec3(0.0, 0.0, 0.0), vec3(1.0, 1.0, 1.0), vec3(0.0, 0.0, 0.0)
    albedo, shape = vec3(0.0, 0.0, 0.0), qd.Vector([0.0, 0.0, 0.0, 0.0])
    p, ahead, wet = begin, direction, setting.under
    after, after_wet = direction, 0  # how the path goes on behind a shadow ray
    bounce, matte, glossy, shadow, going, way = 0, 0, 0, 0, 1, 0.0
    guided = 0
    gate, gate_normal, fresh = begin, -direction, 0  # where the path came into the water, and whether just now
    dull, within, scattered, glazed, begun = 0, 0, 0, 0, begin
    while going == 1:
        hit, what, which, was_wet = first_hit(world, p, ahead, wet, 1)
        n = vec3(hit.x, hit.y, hit.z)
        if shadow == 1:
            if what == 2 and world.finish[which] == 2:
                waits *= through_glass(world.paints[which], n, ahead)
                p += (hit.w + past(hit.w, n, ahead)) * ahead
                glazed += 1
            else:
                if what == 0 or (what == 1 and hit.w > 1e6):
                    light += waits
                ahead, wet, shadow, p = after, after_wet, 0, begun
            if glazed > 16:
                going = 0
        else:
            at, reached = p + hit.w * ahead, qd.min(hit.w, 1e6)
            chance = pair(seed, sample, 2 + 3 * bounce)
            color, ember = vec3(0.0, 0.0, 0.0), vec3(0.0, 0.0, 0.0)
            left, added = vec3(1.0, 1.0, 1.0), vec3(0.0, 0.0, 0.0)
            if was_wet == 1:
                patience = -qd.log(qd.max(1.0 - chance.y, 1e-7))
                reached = qd.min(hit.w, 1e3)
                left, added, reached = through_water(medium, world.field.grid, p, ahead, reached, patience)
                if reached < qd.min(hit.w, 1e3):
                    what, at = 7, p + reached * ahead
            elif what == 4 and medium.murky == 1:
                if chance.x >= bent(ahead, n, 1.0 / index_of_water()).w:
                    murk = murk_at(medium.murk, world.field.grid, at)[3]
                    if chance.y > qd.exp(-1.33 * world.motes.ball[which].w * murk):
                        what = 6
            if what >= 6:
                here = murk_at(medium.murk, world.field.grid, at)
                color, ember = color_of(here), medium.ember[cell_near(world.field.grid, at)]
                if what == 7 and is_matte(here, world.field.grid) == 1:
                    # At the surface where the path came in, or at the border to a clear fluid.
                    what = 6
                    if fresh == 1 and reached < 2.5 * world.field.grid.spacing:
                        at, n, was_wet = gate, gate_normal, 0
                    else:
                        n = thinning(medium.murk, world.field.grid, at)
                        if n.norm() < 0.5:
                            n = -ahead
            light += value * added
            value *= left
            if dull == 0:
                cover = line_on_way(setting, p, ahead, reached)
                if cover > 0.0:
                    light += value * look.line_strength * cover * look.line
                    albedo += value.max() * look.line_strength * cover * look.line
                    value *= 1.0 - look.line_strength * cover
            way += reached
            if guided == 0:
                guided = 1
                shape = qd.Vector([n.x, n.y, n.z, setting.size / (setting.size + reached)])
            far = 0.0
            if what == 1:
                far = smoothstep(((at - setting.middle).norm() * (1.0 / setting.size) - 1.5) * 0.2)
            if what == 0 or far > 0.0:
                sky = sky_at(look, setting, ahead)
                if ahead.y < 0.0 and what == 0:
                    sky = look.below
                if dull == 1:
                    sky *= setting.fill
                elif dull == 0:
                    if what == 0 and glossy == 0:
                        sky += sun_disc(look, ahead)
                    if what == 0 and glossy > 0:
                        sky += lamp(look, ahead)
                share = qd.select(what == 0, 1.0, far)
                light += value * share * sky
                if dull == 0:
                    albedo += share * value.max() * vec3(1.0, 1.0, 1.0)
                value *= 1.0 - share
                if what == 0 or far > 0.999:
                    going = 0
            if going == 1 and what == 3:
                inward = qd.select(n.dot(ahead) > 0.0, -n, n)
                eta = index_of_water()
                if was_wet == 0:
                    eta = 1.0 / eta
                through = bent(ahead, inward, eta)
                glossy += 1
                entered = 0
                if chance.x < through.w:
                    ahead = mirrored(ahead, inward)
                    p = at + 1e-3 * world.field.grid.step.x * inward
                    wet = was_wet
                else:
                    ahead = vec3(through.x, through.y, through.z)
                    p = at - 1e-3 * world.field.grid.step.x * inward
                    wet = 1 - was_wet
                    gate, gate_normal, entered = at, inward, wet
                fresh = entered
            elif going == 1 and what == 4:
                ball = world.motes.ball[which]
                through = bent(ahead, n, 1.0 / index_of_water())
                glossy += 1
                if chance.x < through.w:
                    ahead = mirrored(ahead, n)
                    p = at + 1e-4 * ball.w * n
                else:
                    inner = vec3(through.x, through.y, through.z)
                    out, ahead = through_drop(ball, at, n, inner, ahead)
                    p = vec3(out.x, out.y, out.z)
                    value *= qd.exp(-out.w * absorbed_at(medium, world.field.grid, at))
                wet = 0
            elif going == 1 and what == 2 and world.finish[which] == 2:
                if n.dot(ahead) > 0.0:
                    n = -n
                mirror = bent(ahead, n, 0.667).w
                if was_wet == 0 and chance.x < 2.0 * mirror / (1.0 + mirror):
                    ahead = mirrored(ahead, n)
                    p = at + 1e-4 * world.field.grid.spacing * n
                    glossy += 1
                else:
                    value *= through_glass(world.paints[which], n, ahead)
                    p = at + past(hit.w, n, ahead) * ahead
                wet, fresh = was_wet, 0
            elif going == 1 and what == 7:
                if dull == 0:
                    albedo += value.max() * color
                if within == 0:  # the photons have been through all that lies behind the first event
                    brought = light_within(photons, world.field, at) / index_of_water() ** 2
                    light += value * (ember + albedo_of(color) * look.sun * brought)
                value *= albedo_of(color)
                p, ahead, wet = at, any_way(pair(seed, sample, 3 + 3 * bounce)), 1
                dull, within, fresh = 1, 1, 0
                scattered += 1
                if scattered > 40:
                    light += 0.5 * value * look.sky
                    going = 0
            elif going == 1:
                if what == 5:
                    color = vec3(0.92, 0.93, 0.94)  # froth
                brought = vec3(0.0, 0.0, 0.0)
                if n.dot(ahead) > 0.0:
                    n = -n
                if what == 1:
                    color = floor_albedo(look, at, way * lens.pixel, -ahead.y, dull)
                    brought = floor_light(photons, at)
                else:
                    if what == 2:
                        color = world.paints[which]
                    brought = solid_light(photons, world.field.grid, at, n)
                if was_wet == 1:
                    brought /= index_of_water() ** 2
                if dull == 0:
                    albedo += value.max() * color
                light += value * (ember + color * look.sun * brought)
                before, metal = value, 0
                value *= color
                matte += 1
                dull, within, fresh = 1, 0, 0
                p = at + 2e-4 * setting.size * n
                spread = pair(seed, sample, 3 + 3 * bounce)
                after, after_wet, wet, begun = around(n, spread), was_wet, was_wet, p
                if what == 2 and world.finish[which] == 1:
                    metal, dull = 1, 2
                    h = facet(n, -ahead, spread)
                    after = mirrored(ahead, h)
                    value = before * mirror_of(color, -h.dot(ahead)) * unhidden(after.dot(n))
                    if after.dot(n) <= 0.0:
                        value = vec3(0.0, 0.0, 0.0)
                facing = n.dot(look.to_sun)
                if was_wet == 0 and facing > -look.sun_size:
                    to_lamp = towards(look.to_sun, look.sun_size, pair(seed, sample, 4 + 3 * bounce))
                    waits = before * color * look.sun * qd.max(n.dot(to_lamp), 0.0)
                    if metal == 1:
                        waits = before * look.sun * towards_lamp(color, n, -ahead, to_lamp)
                    if n.dot(to_lamp) > 0.0:
                        shadow = 1
                        ahead = to_lamp
                if shadow == 0:
                    ahead = after
                if matte > 2:
                    # What further surfaces would bring is taken as even light.
                    light += 0.5 * value * look.sky
                    if shadow == 0:
                        going = 0
                    value = vec3(0.0, 0.0, 0.0)
            bounce += 1
        if bounce >= 24 + 60 * medium.murky or (shadow == 0 and value.max() < 1e-3):
            going = 0
    return light, albedo, shape, glossy + dull


@qd.func
def sky_at(look: Look, setting: Setting, ahead):
    """Radiance of the sky in a direction, between four pixels where it is a picture."""
    result = vec3(0.0, 0.0, 0.0)
    if setting.hung == 0:
        result = background(look, ahead)
    else:
        rows, columns = setting.sky.shape[0], setting.sky.shape[1]
        x = (qd.atan2(ahead.x, -ahead.z) * 0.159154943 + 0.5) * columns - 0.5
        y = (0.5 - qd.asin(qd.min(qd.max(ahead.y, -1.0), 1.0)) * 0.318309886) * rows - 0.5
        left, top = qd.floor(x), qd.floor(y)
        for k in range(4):
            share = (1.0 - qd.abs(left + k % 2 - x)) * (1.0 - qd.abs(top + k // 2 - y))
            column = (qd.cast(left, qd.i32) + k % 2 + columns) % columns
            row = qd.min(qd.max(qd.cast(top, qd.i32) + k // 2, 0), rows - 1)
            result += share * setting.sky[row, column]
    return result


@qd.func
def through_glass(color, n, ahead):
    """Share of the light that a wall of glass lets through, per colour: less where it is crossed aslant."""
    return color ** (1.0 / qd.max(qd.abs(n.dot(ahead)), 0.25))


@qd.func
def lamp(look: Look, ahead):
    """Radiance of the sun as smooth surfaces show it: as wide as it is when it casts shadows, in a studio too."""
    wide = qd.max(look.sun_size, 0.02)
    away = (ahead - look.to_sun).norm() / wide
    bright = qd.min(1.0 / (wide * wide), 60.0) * look.sparkle / 3.0
    return bright * smoothstep(4.0 * (1.1 - away)) * look.sun


@qd.func
def floor_albedo(look: Look, at, wide, steep, dull):
    """Albedo of the floor at a point seen by a ray that is `wide` there; plain where the eye does not see it."""
    share = 1.0
    if dull != 1 and look.tile > 0.0:
        per = 1.0 / look.tile
        grain = 0.5 * per * wide / qd.sqrt(qd.max(steep, 1e-3))
        place = vec2(at.x, at.z) * per
        if look.paving == 1:
            joint = joint_cover(place.x, grain) + joint_cover(place.y, grain)
            share = 1.0 - 0.45 * qd.min(joint, 1.0)
        elif look.paving == 2:
            share = stone(place, grain)
        elif look.paving == 3:
            share = sand(place, grain)
    return qd.min(share * look.floor, 1.0)


@qd.func
def line_on_way(setting: Setting, p, ahead, far):
    """1 where a ray meets an edge of the tank nearer than `far`: twelve round bars, by the nearest way to each."""
    met = 0.0
    if setting.edge > 0.0:
        for axis in qd.static(range(3)):
            b, c = qd.static((axis + 1) % 3), qd.static((axis + 2) % 3)
            square = qd.max(ahead[b] * ahead[b] + ahead[c] * ahead[c], 1e-12)
            for corner in range(4):
                y, z = setting.tank.lower[b], setting.tank.lower[c]
                if corner % 2 == 1:
                    y = setting.tank.upper[b]
                if corner // 2 == 1:
                    z = setting.tank.upper[c]
                t = ((y - p[b]) * ahead[b] + (z - p[c]) * ahead[c]) / square
                off_y, off_z = p[b] + t * ahead[b] - y, p[c] + t * ahead[c] - z
                along = p[axis] + t * ahead[axis]
                if t > 0.0 and t < far + setting.edge and off_y * off_y + off_z * off_z < setting.edge * setting.edge:
                    if along > setting.tank.lower[axis] and along < setting.tank.upper[axis]:
                        met = 1.0
    return met

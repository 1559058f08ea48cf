"""The paths of light, traced from the eye: J. T. Kajiya, "The rendering equation" (1986).

A path ends at the sky or after three matte surfaces. At smooth surfaces of water it is reflected or refracted, by
chance as Fresnel's equations say; within the water it is dimmed (Beer-Lambert), and scattered where that is turbid
(`turbidity.py`). At a matte surface one shadow ray looks for the sun, and the light that came through the water is
taken from the photon maps; the path goes on in a cosine-distributed direction. One loop traces both paths and shadow
rays, so that the intersection with the world is compiled once.

What a path carries is radiance over the square of the refractive index, which refraction leaves as it is (E. Veach,
"Robust Monte Carlo methods for light transport simulation" (1997), 5.2); photons carry power, so that what they bring
is divided by that square where it is seen in the water.

    code         symbol   meaning                                                    unit
    throughput   T        share of the light at the end of the path that is seen     1
    radiance     L        light found so far                                         1
"""

import dataclasses

from wavetank.device.compiler import qd
from wavetank.view.film.light import Photons, floor_light, light_within, solid_light
from wavetank.view.film.march import Hit, World, cross_water, first_hit, past
from wavetank.view.film.medium import Medium, absorption_at, cell_near, through_water
from wavetank.view.film.metal import facet, mirror_of, towards_lamp, unhidden
from wavetank.view.film.sampling import cosine_direction, disc, lamp_direction, pair, uniform_direction
from wavetank.view.film.turbidity import albedo_of, color_of, is_opaque, towards_clear, turbidity_at
from wavetank.view.lens import Lens, ray_direction, ray_origin, vec2, vec3, vec4, view_ray
from wavetank.view.look import Look
from wavetank.view.optics.hash_noise import scrambled
from wavetank.view.optics.interface import bent, index_of_water, mirrored, through_drop
from wavetank.view.optics.radiance import background, smoothstep, sun_disc
from wavetank.view.optics.rays import Box
from wavetank.view.paints import Finish
from wavetank.view.passes.floor import joint_cover, sand, stone


@dataclasses.dataclass(frozen=True, eq=False)
class Film:
    """Means of the samples of every pixel, [rows, columns], on the device."""

    mean: qd.types.ndarray()  # vec3: radiance
    half: qd.types.ndarray()  # vec3: the mean of the first half of the samples
    albedo: qd.types.ndarray()  # vec3: of the first matte surface, seen directly or through smooth surfaces
    shape: qd.types.ndarray()  # vec4: normal of the first surface, and its inverse distance


@dataclasses.dataclass(frozen=True, eq=False)
class Setting:
    """What surrounds the water, and how it is looked at, on the device."""

    fill: vec3  # sky light on matte surfaces, over the sky's own radiance
    middle: vec3  # m: middle of the world, on the floor
    size: qd.f32  # m: radius of the world
    tank: Box  # m: its edges; empty where there is none
    edge: qd.f32  # m: half the width of a line along the tank's edges
    aperture: qd.f32  # m: radius of the lens
    focus: qd.f32  # m: depth that is sharp
    under: qd.i32  # 1 where the eye is in the water
    brightest: qd.f32  # radiance that bright samples are bent to, so that single ones do not stand out
    sky: qd.types.ndarray()  # vec3 [rows, columns]: a panorama, see `panorama.py`; [1, 1] without
    has_panorama: qd.i32  # 1 where there is a panorama


@qd.dataclass
class Path:
    """The state of a path of light that is traced from the eye; flags are 0 or 1."""

    radiance: vec3
    throughput: vec3
    albedo: vec3  # of the first matte surface, through smooth ones
    shape: vec4  # normal of the first surface, and its inverse distance
    has_shape: qd.i32
    p: vec3  # m: origin of the present ray
    ahead: vec3  # its unit direction
    in_water: qd.i32  # whether it begins in the water
    travelled: qd.f32  # m: length of the path so far
    bounces: qd.i32
    matte: qd.i32  # matte surfaces so far
    smooth: qd.i32  # smooth surfaces so far
    scatterings: qd.i32  # scattering events so far
    indirect: qd.i32  # whether it has left a matte or metal surface or was scattered
    diffuse: qd.i32  # whether the last of those was not metal
    within: qd.i32  # whether it was scattered since the last matte surface
    going: qd.i32
    entry: vec3  # m: where it came into the water
    entry_normal: vec3
    just_entered: qd.i32  # whether that was the last surface it met
    is_shadow: qd.i32  # whether the present ray is a shadow ray
    sunlight: vec3  # radiance that the shadow ray decides on
    panes: qd.i32  # glass that shadow rays have crossed
    next_p: vec3  # m: where and how the path goes on after the shadow ray
    next_ahead: vec3
    next_in_water: qd.i32


@qd.dataclass
class Vertex:
    """Where a ray of a path ends; flags are 0 or 1."""

    kind: qd.i32  # one of `march.Hit`
    which: qd.i32  # number of the solid or the ball
    at: vec3  # m
    n: vec3  # unit normal
    way: qd.f32  # m: length of the ray to the surface
    reached: qd.f32  # m: length of the ray, which may have been scattered before
    was_wet: qd.i32  # whether the ray ran in the water
    color: vec3
    emission: vec3  # radiance of turbid fluids that glow


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
            light, albedo, shape, smooth = trace_path(
                world, photons, lens, look, medium, setting, seed, sample, p, ahead
            )
            bright = light.max()
            if bright > 1.0 and smooth > 0:
                # What is much brighter than white counts as a little less, or single samples would stand out.
                light *= (1.0 + (bright - 1.0) / (1.0 + (bright - 1.0) / setting.brightest)) / bright
            add_sample(film, row, column, sample, half, light, albedo, shape)


@qd.func
def add_sample(film: Film, row, column, sample, half, light, albedo, shape):
    """Let the means of a pixel include its sample number `sample`."""
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
def trace_path(
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
    """Radiance along a ray; the albedo at its first matte surface; normal and inverse distance of its first surface;
    and whether (above 0) it met anything but one sky.
    """
    path = begun_path(begin, direction, setting.under)
    while path.going == 1:
        hit, what, which, was_wet = first_hit(world, path.p, path.ahead, path.in_water, 1)
        n = vec3(hit.x, hit.y, hit.z)
        if path.is_shadow == 1:
            follow_shadow_ray(path, world, n, hit.w, what, which)
        else:
            dark = vec3(0.0, 0.0, 0.0)
            vertex = Vertex(
                kind=what,
                which=which,
                at=path.p + hit.w * path.ahead,
                n=n,
                way=hit.w,
                reached=qd.min(hit.w, 1e6),
                was_wet=was_wet,
                color=dark,
                emission=dark,
            )
            chance = pair(seed, sample, 2 + 3 * path.bounces)
            cross_medium(path, vertex, world, medium, chance)
            cross_tank_edges(path, setting, look, vertex.reached)
            path.travelled += vertex.reached
            if path.has_shape == 0:
                path.has_shape = 1
                n = vertex.n
                path.shape = qd.Vector([n.x, n.y, n.z, setting.size / (setting.size + vertex.reached)])
            add_sky(path, vertex, look, setting)
            if path.going == 1:
                if vertex.kind == Hit.SURFACE:
                    cross_surface(path, vertex, world, chance)
                elif vertex.kind == Hit.DROP:
                    cross_drop(path, vertex, world, medium, chance)
                elif vertex.kind == Hit.SOLID and world.finish[vertex.which] == Finish.GLASS:
                    cross_glass(path, vertex, world, chance)
                elif vertex.kind == Hit.SCATTERING:
                    scatter(path, vertex, world, photons, look, pair(seed, sample, 3 + 3 * path.bounces))
                else:
                    reflect(path, vertex, world, photons, lens, look, setting, seed, sample)
            path.bounces += 1
        if path.bounces >= 24 + 60 * medium.is_turbid or (path.is_shadow == 0 and path.throughput.max() < 1e-3):
            path.going = 0
    return path.radiance, path.albedo, path.shape, path.smooth + path.indirect


@qd.func
def begun_path(begin, direction, in_water):
    """A path that begins at a point in a direction."""
    dark, white = vec3(0.0, 0.0, 0.0), vec3(1.0, 1.0, 1.0)
    return Path(
        radiance=dark,
        throughput=white,
        albedo=dark,
        shape=qd.Vector([0.0, 0.0, 0.0, 0.0]),
        has_shape=0,
        p=begin,
        ahead=direction,
        in_water=in_water,
        travelled=0.0,
        bounces=0,
        matte=0,
        smooth=0,
        scatterings=0,
        indirect=0,
        diffuse=0,
        within=0,
        going=1,
        entry=begin,
        entry_normal=-direction,
        just_entered=0,
        is_shadow=0,
        sunlight=dark,
        panes=0,
        next_p=begin,
        next_ahead=direction,
        next_in_water=0,
    )


@qd.func
def follow_shadow_ray(path: qd.template(), world: World, n, way, what, which):
    """Let a shadow ray through glass, and end it at the sky, where the sun counts, or at anything else."""
    if what == Hit.SOLID and world.finish[which] == Finish.GLASS:
        path.sunlight *= through_glass(world.paints[which], n, path.ahead)
        path.p += (way + past(way, n, path.ahead)) * path.ahead
        path.panes += 1
    else:
        if what == Hit.SKY or (what == Hit.FLOOR and way > 1e6):
            path.radiance += path.sunlight
        path.ahead, path.in_water, path.is_shadow = path.next_ahead, path.next_in_water, 0
        path.p = path.next_p
    if path.panes > 16:
        path.going = 0


@qd.func
def cross_medium(path: qd.template(), vertex: qd.template(), world: World, medium: Medium, chance):
    """Dim a path along its ray in the water; end the ray where turbid water scatters it, or in a drop that does."""
    transmittance, added = vec3(1.0, 1.0, 1.0), vec3(0.0, 0.0, 0.0)
    if vertex.was_wet == 1:
        free_depth = -qd.log(qd.max(1.0 - chance.y, 1e-7))
        vertex.reached = qd.min(vertex.way, 1e3)
        transmittance, added, vertex.reached = through_water(
            medium, world.field.grid, path.p, path.ahead, vertex.reached, free_depth
        )
        if vertex.reached < qd.min(vertex.way, 1e3):
            vertex.kind, vertex.at = Hit.SCATTERING, path.p + vertex.reached * path.ahead
    elif vertex.kind == Hit.DROP and medium.is_turbid == 1:
        if chance.x >= bent(path.ahead, vertex.n, 1.0 / index_of_water()).w:
            extinction = turbidity_at(medium.turbidity, world.field.grid, vertex.at)[3]
            if chance.y > qd.exp(-1.33 * world.balls.ball[vertex.which].w * extinction):
                vertex.kind = Hit.OPAQUE
    if vertex.kind >= Hit.OPAQUE:
        paint_turbid(path, vertex, world, medium)
    path.radiance += path.throughput * added
    path.throughput *= transmittance


@qd.func
def paint_turbid(path: qd.template(), vertex: qd.template(), world: World, medium: Medium):
    """Set colour and emission where a turbid fluid scatters; an opaque one counts as a matte surface."""
    here = turbidity_at(medium.turbidity, world.field.grid, vertex.at)
    vertex.color, vertex.emission = color_of(here), medium.emission[cell_near(world.field.grid, vertex.at)]
    if vertex.kind == Hit.SCATTERING and is_opaque(here, world.field.grid) == 1:
        # At the surface where the path came in, or at the border to a clear fluid.
        vertex.kind = Hit.OPAQUE
        if path.just_entered == 1 and vertex.reached < 2.5 * world.field.grid.spacing:
            vertex.at, vertex.n, vertex.was_wet = path.entry, path.entry_normal, 0
        else:
            vertex.n = towards_clear(medium.turbidity, world.field.grid, vertex.at)
            if vertex.n.norm() < 0.5:
                vertex.n = -path.ahead


@qd.func
def cross_tank_edges(path: qd.template(), setting: Setting, look: Look, far):
    """Lay the lines along the tank's edges over what is seen directly or through smooth surfaces."""
    if path.indirect == 0:
        cover = tank_edge_cover(setting, path.p, path.ahead, far)
        if cover > 0.0:
            path.radiance += path.throughput * look.line_strength * cover * look.line
            path.albedo += path.throughput.max() * look.line_strength * cover * look.line
            path.throughput *= 1.0 - look.line_strength * cover


@qd.func
def add_sky(path: qd.template(), vertex: qd.template(), look: Look, setting: Setting):
    """Add the sky where a ray reaches it, or fades into it on a far floor; end the path where that is all."""
    far, is_sky = 0.0, vertex.kind == Hit.SKY
    if vertex.kind == Hit.FLOOR:
        far = smoothstep(((vertex.at - setting.middle).norm() * (1.0 / setting.size) - 1.5) * 0.2)
    if is_sky or far > 0.0:
        sky = sky_at(look, setting, path.ahead)
        if path.ahead.y < 0.0 and is_sky:
            sky = look.below
        if path.diffuse == 1:
            sky *= setting.fill
        elif path.indirect == 0 and is_sky:
            if path.smooth == 0:
                sky += sun_disc(look, path.ahead)
            else:
                sky += sun_in_mirror(look, path.ahead)
        share = qd.select(is_sky, 1.0, far)
        path.radiance += path.throughput * share * sky
        if path.indirect == 0:
            path.albedo += share * path.throughput.max() * vec3(1.0, 1.0, 1.0)
        path.throughput *= 1.0 - share
        if is_sky or far > 0.999:
            path.going = 0


@qd.func
def cross_surface(path: qd.template(), vertex: qd.template(), world: World, chance):
    """Reflect or refract a path at the surface of the water."""
    ahead, p, wet, inward = cross_water(
        path.ahead, vertex.at, vertex.n, vertex.was_wet, chance.x, world.field.grid.step.x
    )
    path.smooth += 1
    path.just_entered = 0
    if wet != vertex.was_wet:
        path.entry, path.entry_normal, path.just_entered = vertex.at, inward, wet
    path.ahead, path.p, path.in_water = ahead, p, wet


@qd.func
def cross_drop(path: qd.template(), vertex: qd.template(), world: World, medium: Medium, chance):
    """Reflect a path at a drop, or send it through."""
    ball = world.balls.ball[vertex.which]
    through = bent(path.ahead, vertex.n, 1.0 / index_of_water())
    path.smooth += 1
    if chance.x < through.w:
        path.ahead = mirrored(path.ahead, vertex.n)
        path.p = vertex.at + 1e-4 * ball.w * vertex.n
    else:
        inner = vec3(through.x, through.y, through.z)
        out, ahead = through_drop(ball, vertex.at, vertex.n, inner, path.ahead)
        path.ahead = ahead
        path.p = vec3(out.x, out.y, out.z)
        path.throughput *= qd.exp(-out.w * absorption_at(medium, world.field.grid, vertex.at))
    path.in_water = 0


@qd.func
def cross_glass(path: qd.template(), vertex: qd.template(), world: World, chance):
    """Reflect a path at a wall of glass, both faces together, or send it straight through."""
    n = vertex.n
    if n.dot(path.ahead) > 0.0:
        n = -n
    mirror = bent(path.ahead, n, 0.667).w
    if vertex.was_wet == 0 and chance.x < 2.0 * mirror / (1.0 + mirror):
        path.ahead = mirrored(path.ahead, n)
        path.p = vertex.at + 1e-4 * world.field.grid.spacing * n
        path.smooth += 1
    else:
        path.throughput *= through_glass(world.paints[vertex.which], n, path.ahead)
        path.p = vertex.at + past(vertex.way, n, path.ahead) * path.ahead
    path.in_water, path.just_entered = vertex.was_wet, 0


@qd.func
def scatter(path: qd.template(), vertex: qd.template(), world: World, photons: Photons, look: Look, u):
    """Scatter a path in a turbid fluid, the same to all sides."""
    if path.indirect == 0:
        path.albedo += path.throughput.max() * vertex.color
    if path.within == 0:  # the photons have been through all that lies behind the first event
        brought = light_within(photons, world.field, vertex.at) / index_of_water() ** 2
        path.radiance += path.throughput * (vertex.emission + albedo_of(vertex.color) * look.sun * brought)
    path.throughput *= albedo_of(vertex.color)
    path.p, path.ahead, path.in_water = vertex.at, uniform_direction(u), 1
    path.indirect, path.diffuse, path.within, path.just_entered = 1, 1, 1, 0
    path.scatterings += 1
    if path.scatterings > 40:
        path.radiance += 0.5 * path.throughput * look.sky
        path.going = 0


@qd.func
def reflect(
    path: qd.template(),
    vertex: qd.template(),
    world: World,
    photons: Photons,
    lens: Lens,
    look: Look,
    setting: Setting,
    seed,
    sample,
):
    """Light a matte or metal surface by photons and a shadow ray, and let the path go on from it."""
    ahead = path.ahead
    if vertex.n.dot(ahead) > 0.0:
        vertex.n = -vertex.n
    n, color = vertex.n, surface_color(path, vertex, world, lens, look)
    brought = light_brought(vertex, world, photons)
    if path.indirect == 0:
        path.albedo += path.throughput.max() * color
    path.radiance += path.throughput * (vertex.emission + color * look.sun * brought)
    before = path.throughput
    path.throughput *= color
    path.matte += 1
    path.indirect, path.diffuse, path.within, path.just_entered = 1, 1, 0, 0
    spread = pair(seed, sample, 3 + 3 * path.bounces)
    path.p = vertex.at + 2e-4 * setting.size * n
    path.next_p, path.next_ahead = path.p, cosine_direction(n, spread)
    path.in_water, path.next_in_water = vertex.was_wet, vertex.was_wet
    is_metal = vertex.kind == Hit.SOLID and world.finish[vertex.which] == Finish.METAL
    if is_metal:
        path.diffuse = 0
        h = facet(n, -ahead, spread)
        path.next_ahead = mirrored(ahead, h)
        path.throughput = before * mirror_of(color, -h.dot(ahead)) * unhidden(path.next_ahead.dot(n))
        if path.next_ahead.dot(n) <= 0.0:
            path.throughput = vec3(0.0, 0.0, 0.0)
    if vertex.was_wet == 0 and n.dot(look.to_sun) > -look.sun_size:
        to_lamp = lamp_direction(look.to_sun, look.sun_size, pair(seed, sample, 4 + 3 * path.bounces))
        path.sunlight = before * color * look.sun * qd.max(n.dot(to_lamp), 0.0)
        if is_metal:
            path.sunlight = before * look.sun * towards_lamp(color, n, -ahead, to_lamp)
        if n.dot(to_lamp) > 0.0:
            path.is_shadow = 1
            path.ahead = to_lamp
    if path.is_shadow == 0:
        path.ahead = path.next_ahead
    if path.matte > 2:
        # What further surfaces would bring is taken as even light.
        path.radiance += 0.5 * path.throughput * look.sky
        if path.is_shadow == 0:
            path.going = 0
        path.throughput = vec3(0.0, 0.0, 0.0)


@qd.func
def surface_color(path: qd.template(), vertex: qd.template(), world: World, lens: Lens, look: Look):
    """Albedo of the surface that a ray has met."""
    color = vertex.color
    if vertex.kind == Hit.FROTH:
        color = vec3(0.92, 0.93, 0.94)
    if vertex.kind == Hit.FLOOR:
        color = floor_albedo(look, vertex.at, path.travelled * lens.pixel, -path.ahead.y, path.diffuse)
    elif vertex.kind == Hit.SOLID:
        color = world.paints[vertex.which]
    return color


@qd.func
def light_brought(vertex: qd.template(), world: World, photons: Photons):
    """Light on a surface that came by the water, per colour, over that of the bare sun."""
    brought = vec3(0.0, 0.0, 0.0)
    if vertex.kind == Hit.FLOOR:
        brought = floor_light(photons, vertex.at)
    else:
        brought = solid_light(photons, world.field.grid, vertex.at, vertex.n)
    if vertex.was_wet == 1:
        brought /= index_of_water() ** 2
    return brought


@qd.func
def sky_at(look: Look, setting: Setting, ahead):
    """Radiance of the sky in a direction, between four pixels where it is a picture."""
    result = vec3(0.0, 0.0, 0.0)
    if setting.has_panorama == 0:
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
def sun_in_mirror(look: Look, ahead):
    """Radiance of the sun as smooth surfaces show it: as wide as it is when it casts shadows, in a studio too."""
    wide = qd.max(look.sun_size, 0.02)
    away = (ahead - look.to_sun).norm() / wide
    bright = qd.min(1.0 / (wide * wide), 60.0) * look.sparkle / 3.0
    return bright * smoothstep(4.0 * (1.1 - away)) * look.sun


@qd.func
def floor_albedo(look: Look, at, wide, steep, diffuse):
    """Albedo of the floor seen by a ray that is `wide` [m] there; without its pattern for `diffuse` paths."""
    share = 1.0
    if diffuse != 1 and look.tile > 0.0:
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
def tank_edge_cover(setting: Setting, p, ahead, far):
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

"""The water itself: what it reflects, what shines through it, what it swallows and what it gives back.

B. Walter et al., "Microfacet models for refraction" (2007) for the directions; Schlick 1994 for Fresnel; Beer-Lambert
for the absorption. Refraction follows the ray into the water for as far as the water is thick (the exit point of
W. van der Laan, S. Green, M. Sainz, "Screen space fluid rendering with curvature flow", 2009, taken one step on) and
takes the finished backdrop where that point is seen.

Up to three surfaces share a pixel, its layers: 0 where the water begins at a pane, 1 its surface in the tank, 2 an
outline that stands before it.

    code      symbol   meaning                                                         unit
    n                  normal of the surface, towards the eye                          1
    cosi               cosine between it and the line of sight                         1
    bent               direction of the ray within the water                           1
    share              of a pixel that a layer covers                                  1
"""

from wavetank.device.compiler import qd
from wavetank.device.state import interned
from wavetank.view.buffers import Buffers, Pixels
from wavetank.view.lens import Lens, ray_direction, ray_origin, vec2, vec3, vec4, vector, view_ray
from wavetank.view.look import Look
from wavetank.view.optics.adaptive_sampling import UniformPixel, uniform_pixel
from wavetank.view.optics.edge_coverage import rim_cover, rim_key
from wavetank.view.optics.fluid import Optics, optics_of, refracted
from wavetank.view.optics.glass import line_cover
from wavetank.view.optics.normals import neighbour_near_depth, normal_of, rise_at, unevenness
from wavetank.view.optics.panes import share_behind, tank_interval
from wavetank.view.optics.ray_interpolation import (
    GROUP,
    group_size,
    no_ray,
    no_shading,
    radiance_between,
    rays_agree,
    shadings_agree,
)
from wavetank.view.optics.rays import box
from wavetank.view.optics.shading import WaterFeatures, radiance_from_within, sheet_radiance, water_radiance
from wavetank.view.optics.water_volume import Inside, calmness, trace_water_volume, volume_confidence
from wavetank.view.paints import colors_of
from wavetank.view.shot import Shot
from wavetank.view.strips import Strips, strip, strips_of
from wavetank.view.water_buffers import Backdrop, SunlitWater, Thickness, WaterSurface, water_of
from wavetank.view.weights import under_water

#: The layers of a sample, and the line of sight through it.
Layers = qd.types.struct(
    shares=vec3,  # of the pixel that each of them covers
    front=qd.f32,  # m: depth at which the water begins, at the pane or its surface
    edge=qd.f32,  # m: depth of the outline
    surface=qd.f32,  # m: depth of the surface
    there=qd.f32,  # share of the pixel that shows water at all
    wall=vec3,  # normal of the wall through which the line of sight comes in
    rise=vec2,  # m: change of depth of the surface to the next column and row, where that has been found
    risen=qd.i32,  # 1 where it has
)

#: What the rays of a group of pixels have found.
Group = qd.types.struct(
    rays_agree=qd.i32,  # 1 where both ends show what has what is between them in between, else 0; -1 not known yet
    shadings_agree=qd.i32,  # the same for how they are shaded
    dry=qd.i32,  # 1 where no pixel of it shows water
)


def draw(shot: Shot, buffers: Buffers) -> None:
    """Lay the water over the backdrop."""
    water, pixels, walls = water_of(buffers, shot), buffers.pixels, shot.walls
    if under_water(shot, buffers):
        shade_from_within(pixels, water.surface, water.thickness.water, water.backdrop, shot.lens, optics_of(shot))
        return
    if shot.frame.dim == 2:  # as deep as the water is drawn
        thick = vector(0.0, 0.0, 10.0 * shot.extent.spacing)
        walls = box(walls.lower - thick, walls.upper + thick)
    features = features_of(shot, water.thickness, buffers.supersample)
    solids = shot.frame.solids
    paints = buffers.paints.of(colors_of(shot)) if features.volume and features.solids else buffers.paints.device
    inside = water.same(Inside, walls, solids, paints, water.sun_thickness.water, buffers.sun_depth)
    shade_water(
        pixels,
        water.surface,
        water.thickness,
        water.backdrop,
        water.sunlit,
        strips_of(pixels.depth, GROUP * buffers.supersample, buffers.supersample),
        shot.lens,
        shot.water_sun,
        shot.look,
        optics_of(shot, buffers.supersample, buffers.supersample),
        inside,
        features,
    )


def features_of(shot: Shot, thickness: Thickness, samples: int) -> WaterFeatures:
    """Return what the water of a picture has; in the open it is not a volume, and rays meet no solids in it."""
    frame, planar = shot.frame, shot.frame.dim == 2
    volume = not planar and frame.scene.tank is not None
    return interned(
        WaterFeatures(
            planar=planar,
            volume=volume,
            solids=frame.solids.count > frame.solids.tank_count and (planar or volume),
            mixed=thickness.fluids > 0,
            dyed=shot.dyed,
            supersampled=samples > 1,
        )
    )


@qd.kernel(fastcache=True)
def shade_from_within(
    pixels: Pixels, surface: WaterSurface, thickness: qd.types.ndarray(), backdrop: Backdrop, lens: Lens, optics: Optics
):
    """Dim the backdrop for an eye in the water, which sees no surface straight on."""
    for row, column in qd.ndrange(pixels.depth.shape[0], pixels.depth.shape[1]):
        key, behind = pixels.depth[row, column], backdrop.behind[row, column]
        back = qd.bit_cast(key, qd.f32)
        pixels.color[row, column] = radiance_from_within(thickness, lens, optics, row, column, back, behind)
        surface.nearest[row, column] = qd.min(0x7F000000, key)  # FARTHEST


@qd.kernel(fastcache=True)
def shade_water(
    pixels: Pixels,
    surface: WaterSurface,
    thickness: Thickness,
    backdrop: Backdrop,
    sunlit: SunlitWater,
    strips: Strips,
    lens: Lens,
    sun: Lens,
    look: Look,
    optics: Optics,
    inside: Inside,
    features: WaterFeatures,
):
    """Shade every pixel that shows water, and copy the backdrop to the others; `surface.nearest` is filled with the
    nearer of its depth and the backdrop's.

    What is seen through a body of water is found once for all samples of a pixel, or of two pixels of one sample, and
    not at all where it lies between the ends of two groups of pixels (`optics/ray_interpolation.py`).
    """
    for task in range(strips.count):
        band, begin, last = strip(strips, task, pixels.depth.shape[0] // optics.tall, pixels.depth.shape[1])
        start, across = begin - optics.turn, optics.samples
        wide = across * group_size()
        groups = qd.select(last > begin, (last - start + wide - 1) // wide + 1, 0)
        kept, first_ray, last_ray = no_ray(), no_ray(), no_ray()
        first_shading, last_shading = no_shading(), no_shading()
        state = Group(rays_agree=-1, shadings_agree=-1, dry=0)
        uniform = UniformPixel(found=0, at_pane=0, depth=0.0, normal=vec3(0.0, 0.0, 0.0))
        for number in range(groups):
            leading = (number - 1) * group_size()  # number of the first pixel of a group
            first_ray, first_shading = last_ray, last_shading
            last_ray.layer, last_ray.pixel, last_shading.passed.x, kept.pixel = -1, -1, -1.0, -1
            state.rays_agree, state.shadings_agree = -1, -1
            state.dry = copy_if_dry(
                pixels, surface, backdrop.behind, optics, band, start + leading * across, leading, begin, last
            )
            # The last pixel of a group comes first; the last of the group before the first comes by itself.
            for place in range(qd.select(number == 0, 1, group_size())):
                pixel = leading + qd.select(place == 0, group_size() - 1, place - 1)
                column, row = start + pixel * across, band * optics.tall
                seen = state.dry == 0 and column >= 0 and column < pixels.depth.shape[1]
                if qd.static(features.supersampled):
                    if seen:
                        uniform = uniform_pixel(
                            pixels, surface, lens, look, optics, inside.walls, row, column, qd.static(features.planar)
                        )
                parts = qd.select(seen, qd.select(uniform.found > 0, 1, across * optics.tall), 0)
                for part in range(parts):
                    shade_sample(
                        pixels,
                        surface,
                        thickness,
                        backdrop,
                        sunlit,
                        lens,
                        sun,
                        look,
                        optics,
                        inside,
                        features,
                        row + part // across,
                        column + part % across,
                        pixel,
                        begin,
                        last,
                        place == 0,
                        uniform,
                        kept,
                        first_ray,
                        last_ray,
                        first_shading,
                        last_shading,
                        state,
                    )


@qd.func
def copy_if_dry(
    pixels: Pixels, surface: WaterSurface, behind: qd.template(), optics: Optics, band, first, leading, begin, last
):
    """Copy the backdrop to a group of pixels, from the column `first` on, if no water is seen there, and return whether
    that is so (1 or 0); those from `begin` to `last` are written.
    """
    low, high = qd.max(first, 0), qd.min(first + optics.samples * group_size(), pixels.depth.shape[1])
    dry = 0
    if leading >= 0:
        least = 0x7F000000  # FARTHEST
        for row in range(band * optics.tall, (band + 1) * optics.tall):
            for column in range(low, high):
                least = qd.min(least, surface.depth[row, column])
        dry = qd.cast(qd.bit_cast(least, qd.f32) >= 1e30, qd.i32)
    if dry == 1:
        for row in range(band * optics.tall, (band + 1) * optics.tall):
            for column in range(qd.max(low, begin), qd.min(high, last)):
                pixels.color[row, column] = behind[row, column]
                surface.nearest[row, column] = qd.min(0x7F000000, pixels.depth[row, column])  # FARTHEST
    return dry


@qd.func
def shade_sample(
    pixels: Pixels,
    surface: WaterSurface,
    thickness: Thickness,
    backdrop: Backdrop,
    sunlit: SunlitWater,
    lens: Lens,
    sun: Lens,
    look: Look,
    optics: Optics,
    inside: Inside,
    features: WaterFeatures,
    row,
    column,
    pixel,
    begin,
    last,
    at_end,
    uniform: qd.template(),
    kept: qd.template(),
    first_ray: qd.template(),
    last_ray: qd.template(),
    first_shading: qd.template(),
    last_shading: qd.template(),
    state: qd.template(),
):
    """Shade one sample of a pixel, or all of a `uniform` one, and write what lies between the columns `begin` and
    `last`; `kept` and the rays and shadings at both ends of the group are brought up to date.
    """
    middle = vec2(column + 0.5, row + 0.5)
    result, front = backdrop.behind[row, column], 1.7e38
    z, back = qd.bit_cast(surface.depth[row, column], qd.f32), qd.bit_cast(pixels.depth[row, column], qd.f32)
    if uniform.found > 0:
        middle += 0.5 * (vec2(optics.samples, optics.tall) - 1.0)
        z = uniform.depth
    if z < 1e30:
        ray = view_ray(lens, middle.y - 0.5, middle.x - 0.5)
        origin, direction = ray_origin(lens, ray), ray_direction(lens, ray)
        ends, turns, wall = tank_interval(lens, origin, direction, inside.walls)
        if ends[0] <= ends[1] and qd.max(z, ends[0]) < back:
            layers = split_layers(surface, lens, optics, features, row, column, z, ends, turns, wall, uniform)
            result *= 1.0 - (layers.shares[0] + layers.shares[1] + layers.shares[2])
            traced = inside.walls.upper.x < 1e5
            if qd.static(not features.solids):  # without bent rays to meet them no solid is in the way
                traced = traced and back > 0.999 * ends[1]
            for layer in range(3):
                share, at = layers.shares[0], layers.front
                if layer == 1:
                    share = layers.shares[1]
                elif layer == 2:
                    share, at = layers.shares[2], layers.edge
                if qd.static(features.planar):
                    if share > 0.0:
                        result += share * sheet_radiance(
                            pixels,
                            thickness,
                            backdrop,
                            sunlit,
                            lens,
                            sun,
                            look,
                            optics,
                            inside,
                            features,
                            middle,
                            at,
                            origin,
                            direction,
                        )
                elif share > 0.0:
                    result = shade_layer(
                        result,
                        pixels,
                        surface,
                        thickness,
                        backdrop,
                        sunlit,
                        lens,
                        sun,
                        look,
                        optics,
                        inside,
                        features,
                        row,
                        column,
                        middle,
                        origin,
                        direction,
                        layer,
                        share,
                        at,
                        layers,
                        uniform,
                        pixel,
                        at_end,
                        traced,
                        kept,
                        first_ray,
                        last_ray,
                        first_shading,
                        last_shading,
                        state,
                    )
            front = layers.front
            line = line_cover(pixels.lines[row, column], front, optics.slack)
            result += look.line_strength * layers.there * line * (look.line - result)
            if layers.there < 0.5:
                front = 1.7e38
    if column >= begin and column < last:  # what lies in other strips is only followed
        key = qd.select(front < 1e30, qd.bit_cast(front, qd.i32), 0x7F000000)  # FARTHEST
        for r in range(row, row + qd.select(uniform.found > 0, optics.tall, 1)):
            for c in range(column, column + qd.select(uniform.found > 0, optics.samples, 1)):
                pixels.color[r, c] = result
                surface.nearest[r, c] = qd.min(key, pixels.depth[r, c])


@qd.func
def split_layers(
    surface: WaterSurface,
    lens: Lens,
    optics: Optics,
    features: WaterFeatures,
    row,
    column,
    z,
    ends,
    turns,
    wall,
    uniform: qd.template(),
):
    """The layers of a sample whose surface lies at the depth `z` [m] on a line of sight that is in the tank between
    both `ends` [m].
    """
    at_front, there, cover, edge, rise, risen = 0.0, 1.0, 0.0, z, vec2(0.0, 0.0), 0
    if uniform.found > 0:
        at_front = qd.cast(uniform.at_pane, qd.f32)
    elif qd.static(not features.planar):
        at_pane = ends[0] > lens.near and wall.y == 0.0  # not through the open top
        if at_pane and z < ends[0] - optics.spacing:
            at_front = 1.0
        elif (at_pane and z < ends[0] + optics.spacing) or z > ends[1] - optics.spacing:
            rise, risen = rise_at(row, column, z, 3.0 * optics.spacing, surface.depth), 1
            if at_pane and z < ends[0] + optics.spacing:
                at_front = 1.0 - share_behind(z, ends[0], rise, vec2(turns.x, turns.y))
            if z > ends[1] - optics.spacing:
                there = 1.0 - share_behind(z, ends[1], rise, vec2(turns.z, turns.w))
    rim = surface.rim[row, column]
    if rim > 0:
        edge = qd.bit_cast(rim_key(rim), qd.f32)
        cover = rim_cover(rim)
        if edge + optics.spacing > z:
            there *= qd.select(at_front < 1.0, cover, 1.0)
            cover = 0.0
        else:
            stands = qd.min((z - edge) / optics.spacing - 1.0, 1.0)
            cover *= qd.select(edge > ends[0], stands, 0.0)
    shares = vec3(there * (1.0 - cover) * at_front, there * (1.0 - cover) * (1.0 - at_front), cover)
    return Layers(
        shares=shares, front=qd.max(z, ends[0]), edge=edge, surface=z, there=there, wall=wall, rise=rise, risen=risen
    )


@qd.func
def shade_layer(
    radiance,
    pixels: Pixels,
    surface: WaterSurface,
    thickness: Thickness,
    backdrop: Backdrop,
    sunlit: SunlitWater,
    lens: Lens,
    sun: Lens,
    look: Look,
    optics: Optics,
    inside: Inside,
    features: WaterFeatures,
    row,
    column,
    middle,
    origin,
    direction,
    layer,
    share,
    at,
    layers: qd.template(),
    uniform: qd.template(),
    pixel,
    at_end,
    traced,
    kept: qd.template(),
    first_ray: qd.template(),
    last_ray: qd.template(),
    first_shading: qd.template(),
    last_shading: qd.template(),
    state: qd.template(),
):
    """Radiance of a sample to which a layer at the depth `at` [m] adds its share."""
    result = radiance
    number = (pixel + 2 * group_size()) >> qd.cast(optics.samples == 1, qd.i32)  # of those that share a ray
    fresh, between, is_between, is_shaded_between = False, 0.0, False, False
    seen_between = vec4(0.0, 0.0, 0.0, -1.0)
    if qd.static(features.volume):
        if traced:
            # Less than half of the water shows what the rest did.
            minor = share < 0.5 * (layers.shares[0] + layers.shares[1] + layers.shares[2])
            fresh, between, is_between = reuse_ray(
                kept, first_ray, last_ray, state, optics, at, layer, number, middle.x, minor, at_end
            )
        if is_between:
            seen_between = radiance_between(backdrop.behind, first_ray, last_ray, between)
            if share == 1.0:
                if state.shadings_agree < 0:
                    state.shadings_agree = qd.cast(shadings_agree(first_shading, last_shading), qd.i32)
                is_shaded_between = state.shadings_agree == 1
    if is_shaded_between:
        passed = first_shading.passed + between * (last_shading.passed - first_shading.passed)
        result = passed * vec3(seen_between[0], seen_between[1], seen_between[2])
        result += first_shading.added + between * (last_shading.added - first_shading.added)
    else:
        n = normal_of_layer(surface.depth, lens, optics, row, column, layer, layers, uniform)
        half = (look.to_sun - direction.normalized()).normalized(1e-9)
        shiny = layer == 1 and n.dot(half) > 0.9
        ahead, point = direction.normalized(), origin + at * direction
        cosi = qd.max(-n.dot(ahead), 0.05)
        bent, found = refracted(ahead, n, cosi), vec2(0.0, 0.0)
        if qd.static(features.volume):
            if fresh:
                found = volume_confidence(sun, sunlit.depth, inside, optics, point, bent)
        if layer == 1 and (found.y > 0.0 or shiny):
            kept.uneven = unevenness(
                lens, inside.walls, row, column, layers.surface, n, direction, optics.spacing, surface.depth
            )
        else:
            kept.uneven = unevenness_between(kept, first_ray, last_ray, between, is_between, fresh)
        ray, is_end = no_ray(), fresh and at_end and share > 0.5
        if qd.static(features.volume):
            if fresh:
                mirrored = qd.select(cosi < 0.6, ahead + 2.0 * cosi * n, 0.0)
                kept.confidence = found.x + calmness(kept.uneven) * (found.y - found.x)
                kept.depth, kept.layer, kept.pixel, kept.column = at, layer, number, middle.x
                kept.seen, kept.mirrored, kept.place = trace_water_volume(
                    pixels.depth,
                    backdrop.behind,
                    sunlit.depth,
                    lens,
                    sun,
                    look,
                    optics,
                    inside,
                    point,
                    bent,
                    mirrored,
                    kept.confidence,
                    kept.uneven,
                    qd.static(features.solids),
                )
            if is_end:
                last_ray = kept
            ray = shown_ray(kept, first_ray, last_ray, between, seen_between, is_between, traced)
        shone, passed = water_radiance(
            pixels,
            thickness,
            backdrop,
            sunlit,
            lens,
            sun,
            look,
            optics,
            inside,
            features,
            middle,
            at,
            n,
            origin,
            direction,
            ray,
            qd.select(shiny, kept.uneven * kept.uneven, 0.0),
        )
        result += share * shone
        if is_end and ray.confidence > 0.999 and not shiny:
            last_shading.passed = passed
            last_shading.added = shone - passed * vec3(ray.seen[0], ray.seen[1], ray.seen[2])
    return result


@qd.func
def unevenness_between(
    kept: qd.template(), first_ray: qd.template(), last_ray: qd.template(), between, is_between, fresh
):
    """Unevenness of a surface that is not measured: none of a fresh ray, else what lies between, or what it was."""
    result = kept.uneven
    if fresh:
        result = 0.0
    elif is_between:
        result = first_ray.uneven + between * (last_ray.uneven - first_ray.uneven)
    return result


@qd.func
def shown_ray(
    kept: qd.template(), first_ray: qd.template(), last_ray: qd.template(), between, seen_between, is_between, traced
):
    """The ray that a layer shows: the `kept` one, one that lies between the ends of its group, or none."""
    ray = no_ray()
    if is_between:
        ray.seen = seen_between
        ray.mirrored = first_ray.mirrored + between * (last_ray.mirrored - first_ray.mirrored)
        ray.confidence = first_ray.confidence + between * (last_ray.confidence - first_ray.confidence)
    elif traced:
        ray = kept
    ray.uneven = kept.uneven
    return ray


@qd.func
def reuse_ray(
    kept: qd.template(),
    first_ray: qd.template(),
    last_ray: qd.template(),
    state: qd.template(),
    optics: Optics,
    at,
    layer,
    number,
    column,
    minor,
    at_end,
):
    """(whether a layer at the depth `at` [m] needs a ray of its own; share of the way from the first ray of its group
    to the last; whether what it shows lies between these). Else it shows what the `kept` ray did.
    """
    if number == last_ray.pixel and kept.pixel != number:
        kept = last_ray
    between, is_between = 0.0, False
    if not at_end and layer == first_ray.layer and layer == last_ray.layer:
        between = (column - first_ray.column) / (last_ray.column - first_ray.column)
        off = qd.abs(at - first_ray.depth - between * (last_ray.depth - first_ray.depth))
        if state.rays_agree < 0:
            state.rays_agree = qd.cast(rays_agree(first_ray, last_ray, optics.apart), qd.i32)
        is_between = off < 0.3 * optics.spacing and state.rays_agree == 1
    near = qd.abs(at - kept.depth) < 0.3 * optics.spacing
    is_known = minor and qd.abs(kept.pixel - number) <= 1
    fresh = (number != kept.pixel or layer != kept.layer or not near) and not is_between and not is_known
    return fresh, between, is_between


@qd.func
def normal_of_layer(
    depth: qd.template(), lens: Lens, optics: Optics, row, column, layer, layers: qd.template(), uniform: qd.template()
):
    """Normal of a layer: of the pane, of the surface, or of what a neighbouring pixel shows of an outline."""
    n = layers.wall
    if layer == 1 and uniform.found > 0:
        n = uniform.normal
    elif layer > 0:
        spot, z, rise = qd.Vector([row, column, 1]), layers.surface, layers.rise
        if layer == 2:
            spot, n = neighbour_near_depth(depth, row, column, layers.edge, optics.spacing), -lens.forward
            z = qd.bit_cast(depth[spot[0], spot[1]], qd.f32)
        if spot[2] == 1:
            if layer == 2 or layers.risen == 0:
                rise = rise_at(spot[0], spot[1], z, 3.0 * optics.spacing, depth)
            n = normal_of(lens, spot[0], spot[1], z, rise)
    return n

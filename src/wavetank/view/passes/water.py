"""The water itself: what it reflects, what shines through it, what it swallows and what it gives back.

B. Walter et al., "Microfacet models for refraction" (2007) for the directions; Schlick 1994 for Fresnel; Beer-Lambert
for the absorption. Refraction follows the ray into the water for as far as the water is thick (the exit point of
W. van der Laan, S. Green, M. Sainz, "Screen space fluid rendering with curvature flow", 2009, taken one step on) and
takes the finished backdrop where that point is seen.

    code      symbol   meaning                                                         unit
    n                  normal of the surface, towards the eye                          1
    cosi               cosine between it and the line of sight                         1
    bent               direction of the ray within the water                           1
"""

from wavetank.device.compiler import qd
from wavetank.view.buffers import Buffers, Pixels
from wavetank.view.lens import Lens, ray_direction, ray_origin, vec2, vec3, vec4, vector, view_ray
from wavetank.view.look import Look
from wavetank.view.optics.adaptive_sampling import even_pixel
from wavetank.view.optics.edge_coverage import rim_cover, rim_key
from wavetank.view.optics.fluid import Optics, optics_of, refracted
from wavetank.view.optics.glass import line_cover
from wavetank.view.optics.normals import normal_beside, normal_of, rise_at, unevenness
from wavetank.view.optics.panes import share_behind, tank_interval
from wavetank.view.optics.ray_interpolation import GROUP, alike, group, seen_between, shaded_alike
from wavetank.view.optics.rays import box
from wavetank.view.optics.shading import from_within, shine
from wavetank.view.optics.water_volume import Inside, calm, through_body, wholeness
from wavetank.view.paints import colors_of
from wavetank.view.shot import Shot
from wavetank.view.strips import Strips, strip, strips_of
from wavetank.view.water_buffers import Backdrop, SunlitWater, Thickness, WaterSurface, water_of
from wavetank.view.weights import under_water


def draw(shot: Shot, buffers: Buffers) -> None:
    """Lay the water over the backdrop."""
    water, pixels, walls = water_of(buffers, shot), buffers.pixels, shot.walls
    if shot.frame.dim == 2:  # as deep as the water is drawn
        thick = vector(0.0, 0.0, 10.0 * shot.extent.spacing)
        walls = box(walls.lower - thick, walls.upper + thick)
    solids = shot.frame.solids
    # Solids are met by bent rays in a tank only: in the open there is no body of water.
    world, among = shot.frame.dim, solids.count > solids.tank_count
    if among and (world == 2 or shot.frame.scene.tank):
        world = {2: 1, 3: 4}[world]
    paints = buffers.paints.of(colors_of(shot)) if world == 4 else buffers.paints.device
    inside = water.same(Inside, walls, solids, paints, water.sun_thickness.water, buffers.sun_depth)
    lay(
        pixels,
        water.surface,
        water.thickness,
        water.backdrop,
        water.sunlit,
        strips_of(pixels.depth, GROUP * buffers.supersample, buffers.supersample),
        shot.lens,
        shot.water_sun,
        shot.look,
        optics_of(shot, under_water(shot, buffers), buffers.supersample, buffers.supersample),
        inside,
        100 * int(buffers.supersample > 1) + 10 * int(water.thickness.fluids > 0) + world,
    )


@qd.kernel(fastcache=True)
def lay(
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
    world: qd.template(),
):
    """Shade every pixel that shows water, and copy the backdrop to the others; `surface.nearest` is filled with the
    nearer of its depth and the backdrop's.

    `world` is 1 for a plane with solids, 2 for one without, 3 for space, 4 for space with solids in a tank; ten more
    with several fluids, and a hundred more where pixels have several samples.
    """
    for task in range(strips.count):
        band, begin, last = strip(strips, task, pixels.depth.shape[0] // optics.tall, pixels.depth.shape[1])
        beside, pair = optics.samples, qd.cast(optics.samples == 1, qd.i32)
        # What is seen through a body of water is found once for all samples of a pixel, or of two pixels of one sample,
        # and not at all where it lies between the ends of two groups of pixels (`optics/ray_interpolation.py`).
        kept, kept_z, kept_layer, kept_pixel = vec4(0.0, 0.0, 0.0, -1.0), -1.0, -1, -1
        kept_above, kept_whole, uneven = vec4(0.0, 0.0, 0.0, 0.0), 0.0, 0.0
        before, before_above, before_layer = kept, kept_above, -1
        end, end_above, end_layer, end_pixel = kept, kept_above, -1, -1
        # (column, row, kind) of what these ends show, and (depth, wholeness, unevenness, column) of where they do.
        old, old_of = vec3(0.0, 0.0, 0.0), vec4(-1.0, 0.0, 0.0, 0.0)
        new, new_of = old, old_of
        # How much of what a ray shows is seen at these ends, and what is added to it; a share of -1 is not known.
        old_share, old_added = vec3(-1.0, 0.0, 0.0), vec3(0.0, 0.0, 0.0)
        new_share, new_added = old_share, old_added
        # A pixel whose samples all show the same is shaded once, in its middle.
        even, even_z, even_normal = 0, 0.0, vec3(0.0, 0.0, 0.0)
        start, wide_group = begin - optics.turn, beside * group()
        groups = qd.select(last > begin, (last - start + wide_group - 1) // wide_group + 1, 0)
        # The last pixel of the group before the first comes first, by itself.
        leading, place, down, aside, same, same_shade, dry = -group(), 0, 0, 0, -1, -1, 0
        for _ in range(qd.select(groups > 0, (groups - 1) * group() + 1, 0) * beside * optics.tall):
            # The last of a group comes first.
            at_end, number = place == 0, leading + qd.select(place == 0, group() - 1, place - 1)
            part, row, column = down + aside, band * optics.tall + down, start + number * beside + aside
            if at_end and part == 0:
                before, before_above, before_layer, old, old_of = end, end_above, end_layer, new, new_of
                old_share, old_added, new_share.x = new_share, new_added, -1.0
                end_layer, end_pixel, kept_pixel = -1, -1, -1
                # Whether what both ends show, and how they are shaded, is alike: -1 is not known yet.
                same, same_shade, dry = -1, -1, 0
                if leading >= 0 and copied_dry(
                    pixels, surface, backdrop.behind, optics, band, start + leading * beside, wide_group, begin, last
                ):
                    dry = 1
            if qd.static(world >= 100):
                if part == 0 and dry + optics.under == 0 and column >= 0 and column < pixels.depth.shape[1]:
                    even, even_z, even_normal = even_pixel(
                        pixels, surface, lens, look, optics, inside.walls, row, column, qd.static(world % 10)
                    )
            if dry == 0 and column >= 0 and column < pixels.depth.shape[1] and (part == 0 or even == 0):
                middle = vec2(column + 0.5, row + 0.5)
                result = backdrop.behind[row, column]
                z, back = (
                    qd.bit_cast(surface.depth[row, column], qd.f32),
                    qd.bit_cast(pixels.depth[row, column], qd.f32),
                )
                if even > 0:
                    middle += 0.5 * (vec2(beside, optics.tall) - 1.0)
                    z = even_z
                front = 1.7e38
                if optics.under == 1:
                    result = from_within(thickness.water, lens, optics, row, column, back, result)
                elif z < 1e30:
                    ray = view_ray(lens, middle.y - 0.5, middle.x - 0.5)
                    origin, direction = ray_origin(lens, ray), ray_direction(lens, ray)
                    ends, turns, wall = tank_interval(lens, origin, direction, inside.walls)
                    front = qd.max(z, ends[0])
                    if ends[0] <= ends[1] and front < back:
                        # Up to three surfaces share a pixel: at a pane, in the tank, and an outline before them.
                        wet, there, cover, edge, rise, risen = 0.0, 1.0, 0.0, z, vec2(0.0, 0.0), False
                        if even > 0:
                            wet = even - 1.0
                        elif qd.static(world % 10 >= 3):
                            at_pane = ends[0] > lens.near and wall.y == 0.0  # not through the open top
                            if at_pane and z < ends[0] - optics.spacing:
                                wet = 1.0
                            elif (at_pane and z < ends[0] + optics.spacing) or z > ends[1] - optics.spacing:
                                rise, risen = (rise_at(row, column, z, 3.0 * optics.spacing, surface.depth), True)
                                if at_pane and z < ends[0] + optics.spacing:
                                    wet = 1.0 - share_behind(z, ends[0], rise, vec2(turns.x, turns.y))
                                if z > ends[1] - optics.spacing:
                                    there = 1.0 - share_behind(z, ends[1], rise, vec2(turns.z, turns.w))
                        rim = surface.rim[row, column]
                        if rim > 0:
                            edge = qd.bit_cast(rim_key(rim), qd.f32)
                            cover = rim_cover(rim)
                            if edge + optics.spacing > z:
                                there *= qd.select(wet < 1.0, cover, 1.0)
                                cover = 0.0
                            else:
                                stands = qd.min((z - edge) / optics.spacing - 1.0, 1.0)
                                cover *= qd.select(edge > ends[0], stands, 0.0)
                        first, second = there * (1.0 - cover) * wet, there * (1.0 - cover) * (1.0 - wet)
                        result *= 1.0 - (first + second + cover)
                        for layer in range(3):
                            share, at = first, front
                            if layer == 1:
                                share = second
                            elif layer == 2:
                                share, at = cover, edge
                            if share > 0.0:
                                body = vec4(0.0, 0.0, 0.0, -1.0)
                                above, whole = vec4(0.0, 0.0, 0.0, 0.0), 0.0
                                bodily, fresh, lies, between = False, False, False, 0.0
                                pixel = (number + 2 * group()) >> pair
                                if qd.static(world % 10 >= 3):
                                    # A tank, and without bent rays to meet them no solid in it.
                                    wide = back > 0.999 * ends[1]
                                    if qd.static(world % 10 == 4):
                                        wide = True
                                    if inside.walls.upper.x < 1e5 and wide:
                                        bodily = True
                                        if pixel == end_pixel and kept_pixel != pixel:
                                            kept, kept_above, kept_layer, kept_pixel = (
                                                end,
                                                end_above,
                                                end_layer,
                                                pixel,
                                            )
                                            kept_z, kept_whole, uneven = new_of[0], new_of[1], new_of[2]
                                        if not at_end and layer == before_layer and layer == end_layer:
                                            between = (middle.x - old_of[3]) / (new_of[3] - old_of[3])
                                            off = qd.abs(at - old_of[0] - between * (new_of[0] - old_of[0]))
                                            if same < 0:
                                                same = qd.cast(
                                                    alike(before, before_above, old, end, end_above, new, optics.apart),
                                                    qd.i32,
                                                )
                                            lies = off < 0.3 * optics.spacing and same == 1
                                        near = qd.abs(at - kept_z) < 0.3 * optics.spacing
                                        fresh = pixel != kept_pixel or layer != kept_layer or not near
                                        # Less than half of the water shows what the rest did.
                                        minor = share < 0.5 * (first + second + cover)
                                        known = minor and qd.abs(kept_pixel - pixel) <= 1
                                        fresh = fresh and not lies and not known
                                if lies and share == 1.0 and same_shade < 0:
                                    same_shade = qd.cast(
                                        shaded_alike(old_share, old_added, new_share, new_added), qd.i32
                                    )
                                between_all = lies and share == 1.0 and same_shade == 1
                                n = wall
                                if layer == 1 and not between_all:
                                    if even > 0:
                                        n = even_normal
                                    elif qd.static(world % 10 >= 3):
                                        if not risen:
                                            rise = rise_at(row, column, z, 3.0 * optics.spacing, surface.depth)
                                        n = normal_of(lens, row, column, z, rise)
                                if qd.static(world % 10 >= 3):
                                    if layer == 2:
                                        n = normal_beside(lens, row, column, edge, optics.spacing, surface.depth)
                                half = (look.to_sun - direction.normalized()).normalized(1e-9)
                                shiny = layer == 1 and n.dot(half) > 0.9
                                is_end = False
                                if between_all:
                                    body = seen_between(backdrop.behind, between, before, old, end, new)
                                    passed = old_share + between * (new_share - old_share)
                                    result = passed * vec3(body[0], body[1], body[2])
                                    result += old_added + between * (new_added - old_added)
                                elif qd.static(world % 10 >= 3):
                                    ahead, point = direction.normalized(), origin + at * direction
                                    cosi = qd.max(-n.dot(ahead), 0.05)
                                    bent = refracted(ahead, n, cosi)
                                    found = vec2(0.0, 0.0)
                                    if fresh:
                                        found = wholeness(sun, sunlit.depth, inside, optics, point, bent)
                                    if layer == 1 and (found.y > 0.0 or shiny):
                                        uneven = unevenness(
                                            lens,
                                            inside.walls,
                                            row,
                                            column,
                                            z,
                                            n,
                                            direction,
                                            optics.spacing,
                                            surface.depth,
                                        )
                                    elif fresh:
                                        uneven = 0.0
                                    elif lies:
                                        uneven = old_of[2] + between * (new_of[2] - old_of[2])
                                    if fresh:
                                        kept_whole = found.x + calm(uneven) * (found.y - found.x)
                                        kept, kept_above, lead = through_body(
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
                                            qd.select(cosi < 0.6, ahead + 2.0 * cosi * n, 0.0),
                                            kept_whole,
                                            uneven,
                                            qd.static(world % 10 == 4),
                                        )
                                        kept_z, kept_layer, kept_pixel = at, layer, pixel
                                        if at_end and share > 0.5:
                                            is_end = True
                                            end, end_above, end_layer, end_pixel = (kept, kept_above, layer, pixel)
                                            new, new_of = lead, vec4(at, kept_whole, uneven, middle.x)
                                    if lies:
                                        body = seen_between(backdrop.behind, between, before, old, end, new)
                                        above = before_above + between * (end_above - before_above)
                                        whole = old_of[1] + between * (new_of[1] - old_of[1])
                                    elif bodily:
                                        body, above, whole = kept, kept_above, kept_whole
                                if not between_all:
                                    rough = qd.select(shiny, uneven * uneven, 0.0)
                                    shone, passed = shine(
                                        pixels,
                                        thickness,
                                        backdrop,
                                        sunlit,
                                        lens,
                                        sun,
                                        look,
                                        optics,
                                        inside,
                                        middle,
                                        at,
                                        n,
                                        origin,
                                        direction,
                                        body,
                                        above,
                                        whole,
                                        uneven,
                                        rough,
                                        qd.static(world % 10),
                                        qd.static(world % 100 >= 10),
                                    )
                                    result += share * shone
                                    if is_end and whole > 0.999 and not shiny:
                                        new_share, new_added = (
                                            passed,
                                            shone - passed * vec3(body[0], body[1], body[2]),
                                        )
                        line = line_cover(pixels.lines[row, column], front, optics.slack)
                        result += look.line_strength * there * line * (look.line - result)
                        if there < 0.5:
                            front = 1.7e38
                    else:
                        front = 1.7e38
                if column >= begin and column < last:  # what lies in other strips is only followed
                    key = qd.select(front < 1e30, qd.bit_cast(front, qd.i32), 0x7F000000)  # FARTHEST
                    for r in range(row, row + qd.select(even > 0, optics.tall, 1)):
                        for c in range(column, column + qd.select(even > 0, beside, 1)):
                            pixels.color[r, c] = result
                            surface.nearest[r, c] = qd.min(key, pixels.depth[r, c])
            aside += 1
            if aside == beside:
                aside, down = 0, down + 1
            if down == optics.tall:
                down, place = 0, place + 1
            if place == group() or (leading < 0 and place == 1):
                place, leading = 0, leading + group()


@qd.func
def copied_dry(
    pixels: Pixels, surface: WaterSurface, behind: qd.template(), optics: Optics, band, first, wide, begin, last
):
    """Copy the backdrop to the pixels from the column `first` on, `wide` of them, if no water is seen there, and say
    whether that is so; those from `begin` to `last` are written.
    """
    low, high = qd.max(first, 0), qd.min(first + wide, pixels.depth.shape[1])
    dry = optics.under == 0
    if dry:
        least = 0x7F000000  # FARTHEST
        for row in range(band * optics.tall, (band + 1) * optics.tall):
            for column in range(low, high):
                least = qd.min(least, surface.depth[row, column])
        dry = qd.bit_cast(least, qd.f32) >= 1e30
    if dry:
        for row in range(band * optics.tall, (band + 1) * optics.tall):
            for column in range(qd.max(low, begin), qd.min(high, last)):
                pixels.color[row, column] = behind[row, column]
                surface.nearest[row, column] = qd.min(0x7F000000, pixels.depth[row, column])  # FARTHEST
    return dry

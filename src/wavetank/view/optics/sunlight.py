"""How much of the sun the water leaves, at one point below it or at several together.

code       symbol   meaning                                                          unit
tau                 water along the sun's ray before it reaches a point              m
gathered            light that refraction brings or takes there                      1
spread              how far the light is blurred behind the water                    texels
through             share of the sun that is left, per colour                        1
"""

from wavetank.device.compiler import qd
from wavetank.view.lens import Lens, to_pixel, to_view, vec2, vec3
from wavetank.view.look import Look
from wavetank.view.optics.bilinear import thickness_at
from wavetank.view.optics.dyes import dye_in, swallowed_by
from wavetank.view.optics.fluid import Optics
from wavetank.view.optics.mixture import along_sun
from wavetank.view.water_buffers import SunlitWater, Thickness


@qd.func
def sun_transmittance(
    sunlit: SunlitWater, thickness: Thickness, sun: Lens, look: Look, optics: Optics, at, tinted: qd.template()
):
    """Share of the sun, per colour, that reaches the point `at` [m] through the water.

    Several fluids and dye count where the water may be `tinted` by them.
    """
    c = to_view(sun, at)
    return transmittance_in_map(sunlit, thickness, sun, look, optics, to_pixel(sun, c), c.z, tinted)


@qd.func
def transmittance_in_map(
    sunlit: SunlitWater, thickness: Thickness, sun: Lens, look: Look, optics: Optics, place, z, tinted: qd.template()
):
    """The same for a place (column, row) in the sun's view, at the depth `z` [m] there."""
    through = vec3(1.0, 1.0, 1.0)
    texels = sunlit.depth.shape[0]
    if qd.min(place.x, place.y) > 2.0 and qd.max(place.x, place.y) < texels - 2.0:
        total = thickness_at(thickness.water, place, optics.unit)
        gathered = thickness_at(sunlit.caustic, place, 1.0 / 4096.0)
        nearest, spread = 1e30, 0.0
        if total > 0.0:
            nearest = qd.bit_cast(sunlit.depth[qd.cast(place.y, qd.i32), qd.cast(place.x, qd.i32)], qd.f32)
            if nearest < 1e30:  # far behind the water its light is as blurred as the sun is wide
                spread = 2.0 * look.sun_size * qd.max(z - nearest - total, 0.0) * sun.focal
        if spread > 0.5:
            for k in range(4):
                off = spread * vec2((k % 2) * 1.6 - 0.8, (k // 2) * 1.6 - 0.8)
                total += thickness_at(thickness.water, place + off, optics.unit)
                gathered += thickness_at(sunlit.caustic, place + off, 1.0 / 4096.0)
            total *= 0.2
            gathered *= 0.2
        light = 1.0 + look.caustic * qd.min(gathered, 3.0)
        tau = total
        if tau > 0.0:
            if nearest < 1e30:  # what lies above the water is in the full sun
                within = qd.max(z - nearest, 0.0)
                light = 1.0 + (light - 1.0) * qd.min(within / tau, 1.0)
                tau = qd.min(tau, within)
        if tau > 0.0 or light != 1.0:
            swallow, murk = optics.absorption, 0.0
            if qd.static(tinted):
                if thickness.fluids > 0 and total > 0.0:
                    found = along_sun(thickness, optics, place)
                    swallow, murk = vec3(found[0], found[1], found[2]), found[3]
                if thickness.stained[0] == 1 and total > 0.0:
                    swallow = swallowed_by(dye_in(thickness.dye, place, total / optics.unit), swallow, optics.usual)
            veil = look.veil * (1.0 - qd.exp(-tau * (optics.absorption.x + optics.absorption.y)))
            through = light * (1.0 - veil) * qd.exp(-tau * (0.6 * swallow + murk))
    return through


@qd.func
def exponential(x):
    """exp(x) of a number that is not above 80, to 2e-7 of itself: what the compiler makes vectors of."""
    power = qd.max(x * 1.4426950409, -126.0)
    whole = qd.floor(power + 0.5)
    t = (power - whole) * 0.6931471806
    part = 1.0 + t * (1.0 + t * (1 / 2 + t * (1 / 6 + t * (1 / 24 + t * (1 / 120 + t * (1 / 720))))))
    return part * qd.bit_cast((qd.cast(whole, qd.i32) + 127) << 23, qd.f32)


@qd.func
def transmittance_of_lanes(
    through: qd.template(),
    points: qd.template(),
    sunlit: SunlitWater,
    thickness: Thickness,
    sun: Lens,
    look: Look,
    optics: Optics,
    lanes: qd.template(),
    tinted: qd.template(),
):
    """Fill `through` [3, lanes] with the same for `points` [4, lanes]: (column, row, depth [m]) in the sun's view, and
    whether each counts, 1 or 0.
    """
    if qd.static(tinted):
        for lane in range(lanes):
            found = vec3(1.0, 1.0, 1.0)
            if points[3, lane] > 0.0:
                place = vec2(points[0, lane], points[1, lane])
                found = transmittance_in_map(sunlit, thickness, sun, look, optics, place, points[2, lane], tinted)
            for channel in qd.static(range(3)):
                through[channel, lane] = found[channel]
    else:
        clear_transmittance_of_lanes(through, points, sunlit, thickness.water, sun, look, optics, lanes)


@qd.func
def clear_transmittance_of_lanes(
    through: qd.template(),
    points: qd.template(),
    sunlit: SunlitWater,
    water: qd.template(),
    sun: Lens,
    look: Look,
    optics: Optics,
    lanes: qd.template(),
):
    """Do so in clear water of one kind, the lanes as vectors."""
    inside = qd.Matrix.zero(qd.f32, 1, lanes)  # 1 where a point counts and the map shows it
    if find_inside(inside, points, water.shape[0], lanes) > 0.0:
        # Water along the sun's ray [m], light gathered, depth of the surface [m], how far these are blurred [texels].
        found = qd.Matrix.zero(qd.f32, 4, lanes)
        blurred = 0.0
        for sample in range(5):
            if sample == 0 or blurred > 0.5:
                add_map_sample(found, points, water, sunlit.caustic, optics.unit, sample, lanes)
                if sample == 0:
                    blurred = find_blur(found, points, inside, sunlit.depth, sun, look, lanes)
        attenuate(through, found, points, inside, look, optics, lanes)
    else:
        for lane in range(lanes):
            for channel in qd.static(range(3)):
                through[channel, lane] = 1.0


@qd.func
def find_inside(inside: qd.template(), points: qd.template(), texels, lanes: qd.template()):
    """Fill `inside` [1, lanes] with 1 where a point counts and lies in the sun's map, else 0; return the largest."""
    largest = 0.0
    for lane in range(lanes):
        low, high = qd.min(points[0, lane], points[1, lane]), qd.max(points[0, lane], points[1, lane])
        inside[0, lane] = qd.select(qd.min(low - 2.0, texels - 2.0 - high) > 0.0, points[3, lane], 0.0)
    for lane in range(lanes):
        largest = qd.max(largest, inside[0, lane])
    return largest


@qd.func
def add_map_sample(
    found: qd.template(),
    points: qd.template(),
    water: qd.template(),
    caustic: qd.template(),
    unit,
    sample,
    lanes: qd.template(),
):
    """Add the thickness of water and the light gathered to `found`: sample 0 at each point, 1 to 4 around it.

    Samples around a point count where its light is blurred. What is read of the maps is put in columns first: else the
    loops over lanes are not vectorised.
    """
    texel, between = qd.Matrix.zero(qd.i32, 2, lanes), qd.Matrix.zero(qd.f32, 2, lanes)
    read = qd.Matrix.zero(qd.i32, 8, lanes)
    away, first = vec2(0.0, 0.0), 1.0
    if sample > 0:
        away, first = vec2((sample - 1) % 2 * 1.6 - 0.8, (sample - 1) // 2 * 1.6 - 0.8), 0.0
    for lane in range(lanes):
        x, y = points[0, lane] + found[3, lane] * away.x, points[1, lane] + found[3, lane] * away.y
        x = qd.min(qd.max(x - 0.5, 0.0), water.shape[0] - 1.001)
        y = qd.min(qd.max(y - 0.5, 0.0), water.shape[0] - 1.001)
        column, row = qd.cast(x, qd.i32), qd.cast(y, qd.i32)
        texel[0, lane], texel[1, lane] = column, row
        between[0, lane], between[1, lane] = x - column, y - row
    for lane in range(lanes):
        for k in qd.static(range(4)):
            row, column = texel[1, lane] + k // 2, texel[0, lane] + k % 2
            read[k, lane], read[4 + k, lane] = water[row, column], caustic[row, column]
    for lane in range(lanes):
        u, v, spread = between[0, lane], between[1, lane], found[3, lane]
        share = qd.select(spread > 0.5, 1.0, first)
        for k in qd.static(range(2)):
            top = read[4 * k, lane] * (1.0 - u) + read[4 * k + 1, lane] * u
            low = read[4 * k + 2, lane] * (1.0 - u) + read[4 * k + 3, lane] * u
            is_caustic = qd.static((0, 1)[k])
            scale = is_caustic * (1.0 / 4096.0) + (1 - is_caustic) * unit
            found[k, lane] += share * ((top * (1.0 - v) + low * v) * scale)


@qd.func
def find_blur(
    found: qd.template(),
    points: qd.template(),
    inside: qd.template(),
    depth: qd.template(),
    sun: Lens,
    look: Look,
    lanes: qd.template(),
):
    """Fill in the depth of the surface and how far the light is blurred; return the widest blur [texels].

    Far behind the water its light is as blurred as the sun is wide.
    """
    wet, widest = 0.0, 0.0
    keys = qd.Matrix.zero(qd.i32, 1, lanes)  # bits of the depth of the surface
    for lane in range(lanes):
        wet = qd.max(wet, inside[0, lane] * found[0, lane])
        keys[0, lane] = 0x7F000000  # FARTHEST
    if wet > 0.0:
        for lane in range(lanes):
            if inside[0, lane] > 0.0:
                keys[0, lane] = depth[qd.cast(points[1, lane], qd.i32), qd.cast(points[0, lane], qd.i32)]
    for lane in range(lanes):
        total, nearest = found[0, lane], qd.bit_cast(keys[0, lane], qd.f32)
        nearest = qd.select(total > 0.0, nearest, 1.7e38)
        behind = qd.max(points[2, lane] - nearest - total, 0.0)
        found[2, lane], found[3, lane] = nearest, 2.0 * look.sun_size * behind * sun.focal
    for lane in range(lanes):
        widest = qd.max(widest, found[3, lane])
    return widest


@qd.func
def attenuate(
    through: qd.template(),
    found: qd.template(),
    points: qd.template(),
    inside: qd.template(),
    look: Look,
    optics: Optics,
    lanes: qd.template(),
):
    """Fill `through` from what the maps hold: light that is gathered, and dimmed by the water above each point."""
    for lane in range(lanes):
        share = qd.select(found[3, lane] > 0.5, 0.2, 1.0)
        tau, light = found[0, lane] * share, 1.0 + look.caustic * qd.min(found[1, lane] * share, 3.0)
        # What lies above the water is in the full sun.
        nearest, counts = found[2, lane], inside[0, lane]
        within = qd.max(points[2, lane] - nearest, 0.0)
        covered = nearest < 1e30
        light = qd.select(covered, 1.0 + (light - 1.0) * qd.min(within / qd.max(tau, 1e-20), 1.0), light)
        tau = qd.select(covered, qd.min(tau, within), tau)
        veil = look.veil * (1.0 - exponential(-tau * (optics.absorption.x + optics.absorption.y)))
        light *= 1.0 - veil
        for channel in qd.static(range(3)):
            left = light * exponential(-tau * 0.6 * optics.absorption[channel])
            through[channel, lane] = qd.select(counts > 0.0, left, 1.0)

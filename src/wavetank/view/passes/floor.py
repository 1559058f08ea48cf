"""The floor: the plane y = 0, seen from above only, without end."""

from wavetank.device.compiler import qd
from wavetank.view.buffers import Buffers, Pixels
from wavetank.view.lens import Lens, ray_direction, ray_origin, vec2, vec3, view_ray
from wavetank.view.optics.hash_noise import scrambled, share_of_bits
from wavetank.view.optics.radiance import smoothstep
from wavetank.view.shot import Shot
from wavetank.view.strips import Strips, strip, strips_of


def draw(shot: Shot, buffers: Buffers) -> None:
    """Draw the floor where it is nearer than what is there; a 2-D world has none."""
    if shot.frame.dim == 3:
        pixels, look = buffers.pixels, shot.look
        intersect_floor(pixels, strips_of(pixels.depth), shot.lens, look.floor, look.tile, look.paving)


@qd.func
def pixels_across(lens: Lens, t, direction):
    """Length [m] of floor that a pixel shows, along and across averaged."""
    wide = lens.pixel * (1.0 + lens.perspective * (t - 1.0))
    return wide * qd.sqrt(direction.norm() / qd.max(-direction.y, 1e-3))


@qd.func
def joint_cover(place, grain):
    """Share of a pixel of `grain` tiles that the joint nearest to `place` covers."""
    off = qd.abs(place - qd.floor(place + 0.5))
    half, inverse = 0.018, 1.0 / grain
    return qd.min(qd.max((half - off) * inverse + 0.5, 0.0), qd.min(1.0, 2.0 * half * inverse))


@qd.func
def knot_value(column, row):
    """A number from 0 to 1 that belongs to a knot of a grid without end."""
    mixed = qd.cast(column, qd.u32) * qd.u32(0x8DA6B343) ^ qd.cast(row, qd.u32) * qd.u32(0xD8163841)
    return share_of_bits(scrambled(mixed), 0)


@qd.func
def noise(place):
    """A smooth number from 0 to 1 at a place, with bumps a unit wide."""
    column, row = qd.cast(qd.floor(place.x), qd.i32), qd.cast(qd.floor(place.y), qd.i32)
    u, v = smoothstep(place.x - column), smoothstep(place.y - row)
    result = 0.0
    for k in range(4):
        result += (
            knot_value(column + k % 2, row + k // 2)
            * qd.select(k % 2 == 1, u, 1.0 - u)
            * qd.select(k // 2 == 1, v, 1.0 - v)
        )
    return result


@qd.func
def clouded(place, grain):
    """Noise of five octaves around 0; what is finer than a pixel of `grain` units fades."""
    result, scale, size = 0.0, 1.0, 0.5
    for _ in range(5):
        clear = qd.min(qd.max(1.5 - 2.0 * grain * scale, 0.0), 1.0)
        if clear > 0.0:
            result += clear * size * (noise(place * scale + 17.3 * scale) - 0.5)
        scale *= 2.17
        size *= 0.62
    return result


@qd.func
def stone(place, grain):
    """Share of the albedo of slabs in courses, a unit wide and two long, each of its own shade."""
    course = qd.cast(qd.floor(place.y), qd.i32)
    along = 0.5 * place.x + knot_value(course, 7)
    slab = qd.cast(qd.floor(along), qd.i32)
    joint = joint_cover(2.0 * along, grain) * qd.cast(qd.abs(along - qd.floor(along + 0.5)) < 0.25, qd.f32)
    joint = qd.min(joint + joint_cover(place.y, grain), 1.0)
    fine = qd.min(qd.max(2.0 - 2.0 * grain, 0.0), 1.0)
    shade = 1.0 + fine * 0.22 * (knot_value(slab, course) - 0.5) + 0.42 * clouded(3.1 * place, 3.1 * grain)
    return shade * (1.0 - 0.4 * joint)


@qd.func
def sand(place, grain):
    """Share of the albedo of sand: ripples that wander, and grains."""
    wander = 3.0 * clouded(0.13 * place, 0.13 * grain)
    across = 0.55 * place.x + 0.25 * place.y + 2.0 * wander
    fine = qd.min(qd.max(1.2 - 2.0 * grain, 0.0), 1.0)
    ripple = 0.07 * fine * qd.sin(3.1 * across)
    return 1.0 + ripple + 0.25 * clouded(0.4 * place, 0.4 * grain) + 0.3 * clouded(14.0 * place, 14.0 * grain)


@qd.kernel(fastcache=True)
def intersect_floor(pixels: Pixels, strips: Strips, lens: Lens, albedo: vec3, tile: qd.f32, paving: qd.template()):
    """Intersect every view ray with y = 0."""
    for task in range(strips.count):
        row, first, last = strip(strips, task, pixels.depth.shape[0], pixels.depth.shape[1])
        for column in range(first, last):
            ray = view_ray(lens, row, column)
            origin, direction = ray_origin(lens, ray), ray_direction(lens, ray)
            if origin.y > 0.0 and direction.y < -1e-6:
                t = -origin.y / direction.y
                if t > lens.near and t < 1e4 and qd.bit_cast(t, qd.i32) < pixels.depth[row, column]:
                    pixels.depth[row, column] = qd.bit_cast(t, qd.i32)
                    pixels.surface[row, column] = -2  # FLOOR
                    pixels.normal[row, column] = vec3(0.0, 1.0, 0.0)
                    pixels.color[row, column] = albedo
                    at, per = origin + t * direction, 1.0 / qd.max(tile, 1e-6)
                    grain = pixels_across(lens, t, direction) * per
                    if qd.static(paving == 1):  # tiles; joints fade where a pixel holds more than a few
                        joint = joint_cover(at.x * per, grain) + joint_cover(at.z * per, grain)
                        pixels.color[row, column] = albedo * (1.0 - 0.45 * qd.min(joint, 1.0))
                    elif qd.static(paving == 2):
                        pixels.color[row, column] = albedo * stone(vec2(at.x, at.z) * per, grain)
                    elif qd.static(paving == 3):
                        pixels.color[row, column] = albedo * sand(vec2(at.x, at.z) * per, grain)

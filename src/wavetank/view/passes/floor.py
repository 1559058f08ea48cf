"""The floor: the plane y = 0, seen from above only, without end."""

from wavetank.device.compiler import qd
from wavetank.view.buffers import Buffers, Pixels
from wavetank.view.lens import Lens, ray_direction, ray_origin, vec3, view_ray
from wavetank.view.shot import Shot
from wavetank.view.strips import Strips, strip, strips_of


def draw(shot: Shot, buffers: Buffers) -> None:
    """Draw the floor where it is nearer than what is there; a 2-D world has none."""
    if shot.frame.dim == 3:
        pixels, look = buffers.pixels, shot.look
        lay(pixels, strips_of(pixels.depth), shot.lens, look.floor, look.tile)


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


@qd.kernel(fastcache=True)
def lay(pixels: Pixels, strips: Strips, lens: Lens, albedo: vec3, tile: qd.f32):
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
                    if tile > 0.0:
                        at = origin + t * direction
                        # Joints fade where a pixel holds more than a few tiles.
                        per = 1.0 / tile
                        grain = pixels_across(lens, t, direction) * per
                        joint = joint_cover(at.x * per, grain) + joint_cover(at.z * per, grain)
                        pixels.color[row, column] = albedo * (1.0 - 0.45 * qd.min(joint, 1.0))

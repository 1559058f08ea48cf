"""What the picture shows of a place in the world where a ray ends."""

from wavetank.device.compiler import qd
from wavetank.view.lens import Lens, to_pixel, to_view, vec3
from wavetank.view.optics.bilinear import corners, margins_inside, sample_picture, share_of
from wavetank.view.optics.radiance import smoothstep


@qd.func
def seen_at(depth: qd.template(), picture: qd.template(), lens: Lens, at, usual, near, solid: qd.template()):
    """Radiance that the picture shows at the point `at`, and towards its margins and beyond it what is `usual` there;
    and (column, row, share of the picture).

    A `solid` that hides the point from the eye is not behind the water: rays meet each by themselves. A point of a
    solid is shown where the picture's depth is `near` [m] its own; for others that is 0.
    """
    result, found = usual, vec3(0.0, 0.0, 0.0)
    c = to_view(lens, at)
    if c.z > lens.near:
        there = to_pixel(lens, c)
        share = smoothstep(margins_inside(depth, there, qd.select(near > 0.0, 0.02, 0.08)))
        if share > 0.0:
            seen = vec3(0.0, 0.0, 0.0)
            if near > 0.0:
                # At its outline some of the four pixels show what is behind it.
                r, column, r1, c1, v, u = corners(there, depth.shape[0], depth.shape[1], 1.0)
                weight = 1e-6
                for k in range(4):
                    row, col = qd.select(k // 2 == 1, r1, r), qd.select(k % 2 == 1, c1, column)
                    off = qd.abs(qd.bit_cast(depth[row, col], qd.f32) - c.z) / near
                    part = share_of(k, v, u) * smoothstep(2.0 - off)
                    seen += part * picture[row, col]
                    weight += part
                seen /= weight
                share *= smoothstep(4.0 * weight)
            else:
                shown = qd.bit_cast(depth[qd.cast(there.y, qd.i32), qd.cast(there.x, qd.i32)], qd.f32)
                if shown >= 1e30:
                    share = 0.0
                if qd.static(solid):
                    if shown < 0.97 * c.z:
                        share = 0.0
                if share > 0.0:
                    seen = sample_picture(picture, there)
            if share > 0.0:
                result += share * (seen - result)
                found = vec3(there.x, there.y, share)
    return result, found

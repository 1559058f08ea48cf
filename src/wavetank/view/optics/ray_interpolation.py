"""Rays through a body of water that need not be traced, because they lie between two that were.

Of every `group_size` pixels in a row the last is traced first. Where it shows the same as the last of the group before,
the pixels between show what lies between: the place in the picture where their rays end is then found without a ray,
and read by each for itself, so that it is sharp. Elsewhere each is traced by itself, or shares a ray with the next
pixel.
"""

from wavetank.device.compiler import qd
from wavetank.view.lens import vec2, vec3, vec4
from wavetank.view.optics.bilinear import sample_picture

#: A ray that was traced through the water, see `trace_water_volume`, and the surface where it entered.
TracedRay = qd.types.struct(
    seen=vec4,  # radiance at its end, and its way through the water [m]; negative where the water is not a body
    mirrored=vec4,  # radiance and share of a solid that is mirrored where it enters
    place=vec3,  # (column, row, kind) of what it shows [px]; a kind of 0 is none
    depth=qd.f32,  # m: of the surface
    confidence=qd.f32,  # that the water is a body, 0 to 1
    uneven=qd.f32,  # standard deviation of the normals of the surface
    column=qd.f32,  # px: where it entered
    layer=qd.i32,  # of the pixel that the surface is, -1 for none
    pixel=qd.i32,  # number in the row, -1 for none
)

#: How the surface shines there: the share of what is behind that it lets through, and what is mirrored and scattered.
SurfaceShading = qd.types.struct(passed=vec3, added=vec3)


@qd.func
def no_ray():
    """A ray that shows nothing."""
    return TracedRay(
        seen=vec4(0.0, 0.0, 0.0, -1.0),
        mirrored=vec4(0.0, 0.0, 0.0, 0.0),
        place=vec3(0.0, 0.0, 0.0),
        depth=-1.0,
        confidence=0.0,
        uneven=0.0,
        column=0.0,
        layer=-1,
        pixel=-1,
    )


@qd.func
def no_shading():
    """A shading that is not known: a negative share."""
    return SurfaceShading(passed=vec3(-1.0, 0.0, 0.0), added=vec3(0.0, 0.0, 0.0))


@qd.func
def group_size():
    """Pixels of a row of which one is traced where they show the same."""
    return 4


GROUP = group_size.fn()
APART = 6.0  # groups of pixels: between rays that end farther from each other nothing is taken


@qd.func
def rays_agree(first, last, apart):
    """Whether what two rays show has what is between them in between.

    So it is where neither has met a body, where they show places of one kind that are less than `apart` [px], or nearly
    the same light and not two places of different kinds: at their border pixels would show one and the other in turn.
    Nothing agrees where `apart` is 0.
    """
    result = first.seen[3] < 0.0 and last.seen[3] < 0.0
    if first.seen[3] >= 0.0 and last.seen[3] >= 0.0:
        off = qd.max(qd.abs(first.place[0] - last.place[0]), qd.abs(first.place[1] - last.place[1]))
        result = first.place[2] > 0.0 and first.place[2] == last.place[2] and off < apart
        if not result and qd.min(first.place[2], last.place[2]) <= 0.0:
            away = qd.abs(last.seen - first.seen)
            result = qd.max(away[0], away[1], away[2]) < 0.05
    step = qd.abs(last.mirrored - first.mirrored)
    return apart > 0.0 and result and qd.max(step[0], step[1], step[2], step[3]) < 0.05


@qd.func
def shadings_agree(first, last):
    """Whether both shadings are known, and up to 0.15 apart."""
    apart = qd.max(qd.abs(last.passed - first.passed).max(), qd.abs(last.added - first.added).max())
    return qd.min(first.passed[0], last.passed[0]) >= 0.0 and apart < 0.15


@qd.func
def radiance_between(picture: qd.template(), first, last, share):
    """(radiance, way) of a ray between two, at a share of the way from the first to the last."""
    result = first.seen + share * (last.seen - first.seen)
    if first.place[2] > 0.0 and first.place[2] == last.place[2]:
        spot = first.place + share * (last.place - first.place)
        shown = sample_picture(picture, vec2(spot[0], spot[1]))
        result = vec4(shown.x, shown.y, shown.z, result[3])
    return result

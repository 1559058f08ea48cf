"""Rays in a body of water that need not be followed, because they lie between two that were.

Of every `group` of pixels in a row the last is followed first. Where it shows the same as the last of the group
before, the pixels between show what lies between: the place in the picture where their rays end is then found without
a ray, and read by each for itself, so that it is sharp. Elsewhere each is followed by itself, or shares a ray with the
pixel beside it.

    code          symbol   meaning                                                         unit
    seen                   radiance at the end of a ray, and its way through the water     1, m
    above                  radiance and share of a solid that is mirrored where it enters  1
    place                  (column, row, kind) of what it shows, see `through_body`        px, px, 1
"""

from wavetank.device.compiler import qd
from wavetank.view.lens import vec2, vec4
from wavetank.view.optics.bilinear import picture_at


@qd.func
def group():
    """Pixels of a row of which one is followed where they show the same."""
    return 4


GROUP = group.fn()
APART = 6.0  # groups of pixels: between rays that end farther from each other nothing is taken


@qd.func
def alike(seen, above, place, other_seen, other_above, other_place, apart):
    """Whether what two rays show has what is between them in between.

    So it is where neither has met a body, where they show places of one kind that are less than `apart` [px], or nearly
    the same light and not two places of different kinds: at their border pixels would show one and the other by turns.
    Nothing is alike where `apart` is 0.
    """
    result = seen[3] < 0.0 and other_seen[3] < 0.0
    if seen[3] >= 0.0 and other_seen[3] >= 0.0:
        off = qd.max(qd.abs(place[0] - other_place[0]), qd.abs(place[1] - other_place[1]))
        result = place[2] > 0.0 and place[2] == other_place[2] and off < apart
        if not result and qd.min(place[2], other_place[2]) <= 0.0:
            away = qd.abs(other_seen - seen)
            result = qd.max(away[0], away[1], away[2]) < 0.05
    step = qd.abs(other_above - above)
    return apart > 0.0 and result and qd.max(step[0], step[1], step[2], step[3]) < 0.05


@qd.func
def shaded_alike(share, added, other_share, other_added):
    """Whether the surface between two pixels shines as what lies between them.

    Of each it is told which share of what is behind it lets through, negative where that is not known, and what is
    mirrored and scattered on top. Both may be up to 0.15 apart.
    """
    apart = qd.max(qd.abs(other_share - share).max(), qd.abs(other_added - added).max())
    return qd.min(share[0], other_share[0]) >= 0.0 and apart < 0.15


@qd.func
def seen_between(picture: qd.template(), share, seen, place, other_seen, other_place):
    """(radiance, way) of a ray between two, by its share of the way from the first to the other."""
    result = seen + share * (other_seen - seen)
    if place[2] > 0.0 and place[2] == other_place[2]:
        spot = place + share * (other_place - place)
        shown = picture_at(picture, vec2(spot[0], spot[1]))
        result = vec4(shown.x, shown.y, shown.z, result[3])
    return result

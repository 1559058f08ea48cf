"""Maps and pictures, read between their texels."""

from wavetank.device.compiler import qd
from wavetank.view.lens import vec3


@qd.func
def corners(place, rows, columns, inset):
    """Rows and columns of the four texels around a place (column, row), and how far it lies down and across them.

    Places are kept `inset` texels, 1 or a little more, from the last edge.
    """
    x = qd.min(qd.max(place.x - 0.5, 0.0), columns - inset)
    y = qd.min(qd.max(place.y - 0.5, 0.0), rows - inset)
    c, r = qd.min(qd.max(qd.cast(x, qd.i32), 0), columns - 1), qd.min(qd.max(qd.cast(y, qd.i32), 0), rows - 1)
    return r, c, qd.min(r + 1, rows - 1), qd.min(c + 1, columns - 1), y - r, x - c


@qd.func
def share_of(k, v, u):
    """Share of texel `k` of four at a place that lies so far down and across them."""
    return qd.select(k % 2 == 1, u, 1.0 - u) * qd.select(k // 2 == 1, v, 1.0 - v)


@qd.func
def thickness_at(thickness: qd.template(), place, scale):
    """Thickness at a place (column, row) in texels, between the four nearest; `scale` is in m per step."""
    r, c, r1, c1, v, u = corners(place, thickness.shape[0], thickness.shape[1], 1.001)
    top = thickness[r, c] * (1.0 - u) + thickness[r, c1] * u
    low = thickness[r1, c] * (1.0 - u) + thickness[r1, c1] * u
    return (top * (1.0 - v) + low * v) * scale


@qd.func
def map_at(map: qd.template(), place, nothing):
    """What a map holds at a place (column, row), between the four nearest texels; `nothing` is a zero of its kind."""
    r, c, r1, c1, v, u = corners(place, map.shape[0], map.shape[1], 1.0)
    result = nothing
    for k in range(4):
        result += share_of(k, v, u) * map[qd.select(k // 2 == 1, r1, r), qd.select(k % 2 == 1, c1, c)]
    return result


@qd.func
def sample_picture(picture: qd.template(), place):
    """Radiance at a place (column, row), between the four nearest pixels."""
    return map_at(picture, place, vec3(0.0, 0.0, 0.0))


@qd.func
def margins_inside(picture: qd.template(), place, wide):
    """How far inside of a picture a place (column, row) lies, in margins of the width `wide` [picture heights]."""
    rows, columns = picture.shape[0], picture.shape[1]
    return qd.min(place.x, columns - place.x, place.y, rows - place.y) / (wide * rows)


@qd.func
def gap_at(sun_depth: qd.template(), place, depth):
    """Way [m] that a point at `depth` lies below what the sun sees first; negative outside of the map."""
    row, column = qd.cast(qd.floor(place.y), qd.i32), qd.cast(qd.floor(place.x), qd.i32)
    gap = -1e9
    if row >= 0 and column >= 0 and row < sun_depth.shape[0] and column < sun_depth.shape[1]:
        gap = depth - qd.bit_cast(sun_depth[row, column], qd.f32)
    return gap

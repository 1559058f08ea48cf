"""A tree of boxes around triangles: what lies near a point, or in the way of a ray, without asking all.

Triangles are sorted along a Morton curve and put into leaves of four; node n has the children 2 n and 2 n + 1, so that
the next node of a walk is a matter of bits and needs no stack.

Distance to a triangle: the nearest of its edges, or its plane where the point is above its inside.
"""

import dataclasses

import numpy as np

from wavetank.device.compiler import qd, upload
from wavetank.solids.distance import vec3

LEAF = 4  # triangles
_FAR = 1e9  # where the triangles are that fill the last leaves


@dataclasses.dataclass(frozen=True, eq=False)
class Tree:
    """Triangles in leaves on the device, in cells of the grid."""

    lower: qd.types.ndarray()  # vec3 [2 * leaves]: box around everything below a node; node 1 is the root
    upper: qd.types.ndarray()  # vec3 [2 * leaves]
    a: qd.types.ndarray()  # vec3 [4 * leaves]: corners of the triangles
    b: qd.types.ndarray()  # vec3 [4 * leaves]
    c: qd.types.ndarray()  # vec3 [4 * leaves]
    swell: qd.types.ndarray()  # f32 [4 * leaves]: how far each triangle is moved outwards
    leaves: qd.i32  # a power of two


def plant(corners: np.ndarray, swell: float) -> Tree:
    """Return the tree of triangles with these corners, [n, 3 corners, 3], each moved outwards by `swell`."""
    corners = corners[_along_curve(corners.mean(axis=1))]
    leaves = 1 << max(0, int(np.ceil(np.log2(len(corners) / LEAF))))
    padded = np.full((LEAF * leaves, 3, 3), _FAR, np.float32)
    padded[: len(corners)] = corners
    lower, upper = np.zeros((2 * leaves, 3), np.float32), np.zeros((2 * leaves, 3), np.float32)
    for box, extreme in ((lower, np.min), (upper, np.max)):
        level = extreme(padded.reshape(leaves, LEAF * 3, 3), axis=1)
        first = leaves
        while first:
            box[first : 2 * first] = level
            level = extreme(level.reshape(-1, 2, 3), axis=1) if first > 1 else level
            first //= 2
    return Tree(
        lower=_device(lower),
        upper=_device(upper),
        a=_device(padded[:, 0]),
        b=_device(padded[:, 1]),
        c=_device(padded[:, 2]),
        swell=_device(np.full(len(padded), swell, np.float32)),
        leaves=leaves,
    )


def _along_curve(points: np.ndarray) -> np.ndarray:
    """Order of points [n, 3] along a Morton curve."""
    span = np.maximum(np.ptp(points, axis=0).max(), 1e-30)
    whole = ((points - points.min(axis=0)) * (1023.0 / span)).astype(np.int64)
    code = np.zeros(len(points), np.int64)
    for bit in range(10):
        for axis in range(3):
            code |= ((whole[:, axis] >> bit) & 1) << (3 * bit + axis)
    return np.argsort(code, kind="stable")


def _device(values: np.ndarray) -> qd.types.ndarray():
    array = qd.ndarray(qd.f32 if values.ndim == 1 else vec3, shape=(len(values),))
    upload(array, values)
    return array


@qd.func
def next_node(node):
    """Return the node that a walk visits after all below `node`; 1 after the last."""
    node += 1
    while (node & 1) == 0:
        node >>= 1
    return node


@qd.func
def following_node(node, below):
    """The node of a walk after this one: its first child where the walk goes `below`; 0 after the last."""
    following = 2 * node
    if not below:
        following = next_node(node)
        if following == 1:
            following = 0
    return following


@qd.func
def first_triangle(tree: Tree, leaf):
    """Number of the first triangle of a leaf."""
    return 4 * (leaf - tree.leaves)  # LEAF


@qd.func
def box_square(p, lower, upper):
    """Square of the distance from a point to a box."""
    way = qd.max(lower - p, p - upper, 0.0)
    return way.dot(way)


@qd.func
def segment_square(p, a, b):
    """Square of the distance from a point to a segment."""
    ab, ap = b - a, p - a
    way = ap - qd.min(qd.max(ap.dot(ab) / qd.max(ab.dot(ab), 1e-30), 0.0), 1.0) * ab
    return way.dot(way)


@qd.func
def is_needle(n, a, b, c):
    """Whether a triangle is so narrow that its normal `n` is rounding; its edges are the whole of it.

    That is one less than a thousandth of a cell across, or a ten thousandth of its longest edge.
    """
    longest = qd.max((b - a).dot(b - a), (c - b).dot(c - b), (a - c).dot(a - c))
    return n.dot(n) <= qd.max(1e-6, 1e-8 * longest) * longest


@qd.func
def triangle_square(p, a, b, c):
    """Square of the distance from a point to a triangle."""
    square = qd.min(segment_square(p, a, b), segment_square(p, b, c), segment_square(p, c, a))
    n = (b - a).cross(c - a)
    if not is_needle(n, a, b, c):
        over = (
            n.cross(b - a).dot(p - a) >= 0.0 and n.cross(c - b).dot(p - b) >= 0.0 and n.cross(a - c).dot(p - c) >= 0.0
        )
        if over:
            height = n.dot(p - a)
            square = qd.min(square, height * height / n.dot(n))
    return square


@qd.func
def leaving(origin, way, a, b, c):
    """Where a ray leaves through the back of a triangle, no needle, in lengths of `way`; -1 where it does not."""
    ab, ac = b - a, c - a
    across = way.cross(ac)
    volume = ab.dot(across)
    t = -1.0
    if volume < 0.0 and not is_needle(ab.cross(ac), a, b, c):
        start = origin - a
        u, v = start.dot(across) / volume, way.dot(start.cross(ab)) / volume
        # A little beyond the edges, so that no ray slips between two triangles.
        if u >= -1e-4 and v >= -1e-4 and u + v <= 1.0 + 1e-4:
            t = ac.dot(start.cross(ab)) / volume
    return t

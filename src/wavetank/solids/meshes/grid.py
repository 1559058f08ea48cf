"""Signed distances to a mesh on a grid, exact at its nodes.

Nodes lie a quarter of a particle spacing apart, in large grids half. The distance at a node is that to the nearest
triangle. Its sign is a vote of six rays, to both sides along each axis: the crossings of a ray, counted with the side
from which it meets each triangle, add up to the winding number of a closed surface, which is not zero inside, so that
overlapping parts and inner hollows come out right. Where the six do not agree there is a hole; one that is narrower
than a spacing is outvoted, a wider one is refused.

A wall thinner than `THINNEST` cells could fall between the nodes. Its faces are moved apart to that thickness, which a
ray inwards from the middle of each triangle measures; everything else keeps its place.

    code      symbol   meaning                                              unit
    u                  distance to the nearest triangle                     cells
    swell              how far a triangle is moved outwards                 cells
    edge_function      on which side of an edge a line lies                 cells^2

Winding numbers by rays and votes after Jacobson et al. 2013, "Robust inside-outside segmentation using generalized
winding numbers" (10.1145/2461912.2461916); where we differ: six directions instead of all, which a grid gets from
counting along its lines.
"""

import numpy as np

from wavetank.device.compiler import download, qd, upload
from wavetank.foundation.errors import WavetankError
from wavetank.solids.distance import vec3
from wavetank.solids.meshes.store import DistanceGrid
from wavetank.solids.meshes.tree import (
    Tree,
    box_square,
    first_triangle,
    following_node,
    is_needle,
    leaving,
    plant,
    triangle_square,
)

CELLS = (4, 3, 2)  # per particle spacing: the first that makes a grid of at most FINE_NODES, else the last
FINE_NODES = 2_000_000
MOST_NODES = 1 << 25
THINNEST = 1.5  # cells
REACH = 3.0  # spacings, the longest support: so far around the mesh goes the grid, and are distances exact
NEARLY = 0.7  # farther out a distance grows by only that share of the way: never too long, and most of the work saved
#: Rays pass nodes at this distance [cells], so that they do not run along faces that lie on the grid.
_ASIDE = (1.13e-3, 1.71e-3)


def measure(
    points: np.ndarray, faces: np.ndarray, spacing: float, thickness: float | None, name: str, hollow: bool = False
) -> DistanceGrid:
    """Return the distances to the surface of `points` [n, 3], m, and `faces` [m, 3] for particles of that spacing [m].

    With `thickness` [m] the solid is all within half of it of a face. With `hollow` the inside is to hold water: it is
    what is around that gets no thinner than `THINNEST`. Raises `WavetankError` where the grid would be too large and,
    without `thickness`, where the surface is not closed.
    """
    edges = np.ptp(points, axis=0)
    for cells in CELLS:
        cell = spacing / cells
        walls = None if thickness is None else max(thickness / cell, THINNEST)
        exact = cells * REACH + 1.0
        counts = np.ceil(edges / cell) + 2.0 * np.ceil(exact + 0.5 * (walls or 0.0)) + 1.0
        if counts.prod() <= FINE_NODES:
            break
    if counts.prod() > MOST_NODES:
        raise WavetankError(
            f"{name} of {' x '.join(f'{edge:.3g}' for edge in edges)} m at spacing = {spacing:g} m needs a grid of "
            f"{counts.prod():.2g} nodes; at most {MOST_NODES:.2g} are allowed: use a larger spacing or a smaller mesh."
        )
    nx, ny, nz = map(int, counts)
    corners = (points / cell + 0.5 * (counts - 1))[faces].astype(np.float32)
    tree = plant(corners[:, ::-1] if hollow else corners, 0.5 * walls if walls else 0.0)
    if walls is None:
        thicken_walls(tree, THINNEST, len(faces))
    outer, inner = (qd.ndarray(qd.f32, shape=(nx * ny * nz,)) for _ in range(2))
    measure_distances(tree, outer, inner, float(download(tree.swell).max()), exact, NEARLY, nx, ny, nz)
    # Distances on the front side of the faces, and behind them; the faces of a hollow look inwards.
    before, behind = (-download(inner), -download(outer)) if hollow else (download(outer), download(inner))
    distances = before
    if walls is None:
        inside = _inside(corners, (nx, ny, nz), cells, name).reshape(-1)
        distances[inside] = behind[inside]
    return DistanceGrid((distances * np.float32(cell)).reshape(nz, ny, nx), cell)


def _inside(corners: np.ndarray, counts: tuple[int, int, int], cells: int, name: str) -> np.ndarray:
    """Return which nodes are inside, bool [nz, ny, nx], at `cells` cells per spacing."""
    votes = np.zeros(counts[::-1], np.int8)
    for axis in range(3):
        # The ray's axis comes first; turning the axes in a circle keeps the sides of the triangles.
        order = [(axis + k) % 3 for k in range(3)]
        na, nb, nc = (counts[k] for k in order)
        crossings = qd.ndarray(qd.i32, shape=(nc * nb * na,))
        crossings.fill(0)
        sides = [qd.ndarray(vec3, shape=(len(corners),)) for _ in range(3)]
        for array, values in zip(sides, corners.transpose(1, 0, 2), strict=True):
            upload(array, values[:, order])
        count_crossings(*sides, crossings, na, nb, nc, *_ASIDE, len(corners))
        before = np.cumsum(download(crossings).reshape(nc, nb, na), axis=2, dtype=np.int16)
        both = (before != 0).astype(np.int8) + (before != before[:, :, -1:])
        # [nc, nb, na] -> [nz, ny, nx]
        votes += both.transpose(*(2 - order.index(k) for k in (2, 1, 0)))
    _check_closed((votes != 0) & (votes != 6), cells, name)
    return votes > 3


def _check_closed(torn: np.ndarray, cells: int, name: str) -> None:
    """Refuse a surface with a hole so wide that more nodes fit into it, each way, than in a spacing."""
    for axis in range(3):
        torn = np.moveaxis(torn, axis, 0)
        room = len(torn) - cells
        torn = np.moveaxis(np.logical_and.reduce([torn[k : k + room] for k in range(cells + 1)]), 0, axis)
    if torn.any():
        raise WavetankError(
            f"{name} is not closed: it has a hole, or faces turned the wrong way, more than a spacing wide; close "
            "it in a modelling program, or give thickness [m] to make walls of its faces."
        )


@qd.kernel(fastcache=True)
def thicken_walls(tree: Tree, thinnest: qd.f32, count: qd.i32):
    """Swell the triangles behind which the solid is thinner than `thinnest` [cells], so that it gets that thickness."""
    for t in range(count):
        a, b, c = tree.a[t], tree.b[t], tree.c[t]
        n = (b - a).cross(c - a)
        if not is_needle(n, a, b, c):  # its neighbours say how thick the solid is there
            first = first_leaving(tree, (a + b + c) / 3.0, -thinnest * n.normalized())
            tree.swell[t] = 0.5 * thinnest * (1.0 - first)


@qd.func
def first_leaving(tree: Tree, origin, way):
    """Where a ray first leaves through the back of a triangle, in lengths of `way`, from 0 to 1."""
    low, high = qd.min(origin, origin + way) - 1e-3, qd.max(origin, origin + way) + 1e-3
    first = 1.0
    node = 1
    while node > 0:
        lower, upper = tree.lower[node], tree.upper[node]
        below = node < tree.leaves
        if (upper - low).min() >= 0.0 and (high - lower).min() >= 0.0:
            if not below:
                for k in range(first_triangle(tree, node), first_triangle(tree, node + 1)):
                    hit = leaving(origin, way, tree.a[k], tree.b[k], tree.c[k])
                    if hit > -1e-3 and hit < first:
                        first = qd.max(hit, 0.0)
        else:
            below = False
        node = following_node(node, below)
    return first


@qd.kernel(fastcache=True)
def measure_distances(
    tree: Tree,
    outer: qd.types.ndarray(),
    inner: qd.types.ndarray(),
    most: qd.f32,
    exact: qd.f32,
    nearly: qd.f32,
    nx: qd.i32,
    ny: qd.i32,
    nz: qd.i32,
):
    """Distance [cells] at every node, were it outside and were it inside; no triangle swells by more than `most`."""
    for line in range(ny * nz):
        y, z = qd.cast(line % ny, qd.f32), qd.cast(line // ny, qd.f32)
        found = any_guess()
        for x in range(nx):
            find_nearest(found, tree, vec3(qd.cast(x, qd.f32), y, z), most, exact, nearly)
            outer[x + nx * line] = limited(found.swollen, exact, nearly)
            inner[x + nx * line] = -found.distance - tree.swell[found.triangle]


@qd.dataclass
class Nearest:
    """The triangles nearest to a node; those of the node before are a good first guess."""

    distance: qd.f32  # cells: to the nearest triangle
    swollen: qd.f32  # cells: to the nearest one when they have swollen
    triangle: qd.i32
    swollen_triangle: qd.i32


@qd.func
def any_guess():
    """A first guess where no node before is known."""
    return Nearest(distance=0.0, swollen=0.0, triangle=0, swollen_triangle=0)


@qd.func
def limited(distance, exact, nearly):
    """A distance that grows by a share `nearly` only beyond `exact` [cells]."""
    return qd.min(distance, exact + nearly * (distance - exact))


@qd.func
def find_nearest(found: qd.template(), tree: Tree, p, most, exact, nearly):
    """Find the triangles nearest to the point `p`; what lies beyond `exact` [cells] may be found inexactly."""
    one, two = found.triangle, found.swollen_triangle
    found.distance = qd.sqrt(triangle_square(p, tree.a[one], tree.b[one], tree.c[one]))
    found.swollen = qd.sqrt(triangle_square(p, tree.a[two], tree.b[two], tree.c[two])) - tree.swell[two]
    node = 1
    while node > 0:
        below = node < tree.leaves
        limit = limited(found.swollen, exact, nearly) + most
        if box_square(p, tree.lower[node], tree.upper[node]) < limit * limit:
            if not below:
                for k in range(first_triangle(tree, node), first_triangle(tree, node + 1)):
                    distance = qd.sqrt(triangle_square(p, tree.a[k], tree.b[k], tree.c[k]))
                    if distance - tree.swell[k] < found.swollen:
                        found.swollen, found.swollen_triangle = distance - tree.swell[k], k
                    if distance < found.distance:
                        found.distance, found.triangle = distance, k
        else:
            below = False
        node = following_node(node, below)


@qd.func
def edge_function(py, pz, a, b):
    """Twice the area of the triangle of a line along x and an edge; to the last bit the negative from its other end."""
    sign = 1.0
    if a.y > b.y or (a.y == b.y and a.z > b.z):
        a, b = b, a
        sign = -1.0
    area = (b.y - a.y) * (pz - a.z) - (b.z - a.z) * (py - a.y)
    # A line through an edge belongs to one side of it.
    if area == 0.0:
        area = 1e-30
    return sign * area


@qd.kernel(fastcache=True)
def count_crossings(
    a: qd.types.ndarray(),
    b: qd.types.ndarray(),
    c: qd.types.ndarray(),
    crossings: qd.types.ndarray(),
    nx: qd.i32,
    ny: qd.i32,
    nz: qd.i32,
    aside_y: qd.f32,
    aside_z: qd.f32,
    count: qd.i32,
):
    """Count where lines along x cross triangles: 1 at the first node after a crossing inwards, -1 after an exit."""
    for t in range(count):
        low, high = qd.min(a[t], b[t], c[t]), qd.max(a[t], b[t], c[t])
        y0, y1 = qd.cast(qd.ceil(low.y - aside_y), qd.i32), qd.cast(qd.floor(high.y - aside_y), qd.i32)
        z0, z1 = qd.cast(qd.ceil(low.z - aside_z), qd.i32), qd.cast(qd.floor(high.z - aside_z), qd.i32)
        for z in range(z0, z1 + 1):
            for y in range(y0, y1 + 1):
                py, pz = y + aside_y, z + aside_z
                u, v, w = (
                    edge_function(py, pz, b[t], c[t]),
                    edge_function(py, pz, c[t], a[t]),
                    edge_function(py, pz, a[t], b[t]),
                )
                into = 0
                if u > 0.0 and v > 0.0 and w > 0.0:
                    into = -1
                if u < 0.0 and v < 0.0 and w < 0.0:
                    into = 1
                if into != 0:
                    x = (u * a[t].x + v * b[t].x + w * c[t].x) / (u + v + w)
                    after = qd.cast(qd.ceil(qd.min(qd.max(x, low.x), high.x)), qd.i32)
                    qd.atomic_add(crossings[after + nx * (y + ny * z)], into)

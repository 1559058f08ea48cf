"""Openings of emitters: places of the particles of one row, such that the jet has the density of water at rest.

Neighbours leave a quarter of a row after each other: a jet that gravity draws out would fall apart into discs if whole
rows left at once.

A row is a slice of the jet as long as the distance to the next one. With n particles in an opening of the area A, each
has the area A / n and rows are d^3 n / A apart: whatever n is, a particle has its volume d^3. The lattice in the
opening is stretched by a few per cent until it holds such an n that rows are about d apart as well.

    code     symbol   meaning                                                          unit
    spacing  d        distance of particles at rest                                    m
    area     A        of the opening; in a 2-D world its width                           m^2; m
    pitch             distance of rows: d^3 n / A, in 2-D d^2 n / A                    m
"""

import dataclasses
import functools
import json
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from wavetank.foundation.errors import WavetankError
from wavetank.solids.meshes.mesh import Mesh

LEAST, MOST = 0.93, 1.08  # of A / d^2: numbers of particles that are tried
MOST_IN_A_ROW = 20_000
GOLDEN = 0.6180339887498949
CANDIDATES = 8  # places that are tried for each particle on a mesh


@dataclasses.dataclass(frozen=True)
class Inlet:
    """Places of the particles of a row in the frame of an emitter: across, up and ahead."""

    places: np.ndarray  # m, [n, 3]
    ways: np.ndarray  # unit vectors, [n, 3]
    phases: np.ndarray  # shares of a row by which neighbours come out one after the other, [n]
    area: float  # m^2; in 2-D m
    pitch: float  # m
    half: tuple[float, float]  # m: what it spans to each side, across and up

    def __len__(self) -> int:
        """Particles in a row."""
        return len(self.places)


def frame_of(ahead: np.ndarray, dim: int, side: np.ndarray | None = None) -> np.ndarray:
    """Return the frame (across, up, ahead) of an inlet as rows, [3, 3]; `ahead` has unit length.

    Across is horizontal, or along `side` as far as that is not ahead; in a 2-D world it lies in the plane.
    """
    if dim == 2:
        across = np.cross(ahead, [0.0, 0.0, 1.0])
    elif side is not None:
        across = side - ahead * (side @ ahead)
    else:
        across = np.cross([0.0, 1.0, 0.0], ahead) if abs(ahead[1]) < 0.999 else np.array([1.0, 0.0, 0.0])
    across = across / max(float(np.linalg.norm(across)), 1e-12)
    return np.stack([across, np.cross(ahead, across), ahead])


def disc_rows(half: float, spacing: float) -> np.ndarray:
    """Return the points of a square lattice around its middle within `half` [m] of it, [n, 2]."""
    n = int(half / spacing)
    row = spacing * np.arange(-n, n + 1)
    a, b = (grid.reshape(-1) for grid in np.meshgrid(row, row))
    inside = a**2 + b**2 <= half**2
    return np.stack([a[inside], b[inside]], axis=1)


def line_rows(half: float, spacing: float) -> np.ndarray:
    """Return points `spacing` apart, one in the middle, no farther than `half` [m] from it, [n]."""
    n = int(half / spacing)
    return spacing * np.arange(-n, n + 1)


def _disc(shape: dict[str, Any], spacing: float) -> tuple[np.ndarray, float, tuple[float, float]]:
    radius, area = shape["radius"], math.pi * shape["radius"] ** 2
    return _disc_points(radius, area, spacing), area, (radius, radius)


def _ring(shape: dict[str, Any], spacing: float) -> tuple[np.ndarray, float, tuple[float, float]]:
    outer, inner = shape["radius"], shape["inner_radius"]
    area, middle = math.pi * (outer**2 - inner**2), 0.5 * (outer + inner)
    points = (
        _fitted(lambda p: np.abs(np.linalg.norm(p, axis=1) - middle) <= 0.5 * (outer - inner), area, outer, spacing)
        if outer - inner > 1.5 * spacing
        else None
    )
    if points is None:
        angles = math.tau * np.arange(count := max(1, round(area / spacing**2))) / count
        points = middle * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return points, area, (outer, outer)


def _rectangle(shape: dict[str, Any], spacing: float) -> tuple[np.ndarray, float, tuple[float, float]]:
    width, height = shape["size"]
    rows = [(np.arange(n) + 0.5) / n - 0.5 for n in (max(1, round(edge / spacing)) for edge in (width, height))]
    a, b = (grid.reshape(-1) for grid in np.meshgrid(width * rows[0], height * rows[1]))
    return np.stack([a, b], axis=1), width * height, (0.5 * width, 0.5 * height)


def _line(shape: dict[str, Any], spacing: float) -> tuple[np.ndarray, float, tuple[float, float]]:
    width, n = shape["width"], max(1, round(shape["width"] / spacing))
    places = width * ((np.arange(n) + 0.5) / n - 0.5)
    return np.stack([places, 0.0 * places], axis=1), width, (0.5 * width, 0.0)


#: shape -> what makes a row of it: points [n, 2], area and half its edges
SHAPES: dict[str, Callable[[dict[str, Any], float], tuple[np.ndarray, float, tuple[float, float]]]] = {
    "disc": _disc,
    "rectangle": _rectangle,
    "ring": _ring,
    "line": _line,
}


def _fitted(inside: Callable[[np.ndarray], np.ndarray], area: float, half: float, spacing: float) -> np.ndarray | None:
    """Return points of a square lattice [n, 2] of which each has the area A / n, near to d^2; None without any."""
    ideal = area / spacing**2
    _check_number(ideal)
    numbers = range(max(1, math.ceil(LEAST * ideal)), math.floor(MOST * ideal) + 1)
    for n in sorted(numbers, key=lambda n: abs(math.log(n / ideal))):
        s = math.sqrt(area / n)
        for shift in ((0.0, 0.0), (0.5, 0.5), (0.5, 0.0), (0.0, 0.5)):
            points = _lattice(half, s, shift)
            points = points[inside(points)]
            if len(points) == n:
                return points
    return None


def _disc_points(radius: float, area: float, spacing: float) -> np.ndarray:
    """Return the points of a disc [n, 2]: of a lattice, or in a spiral where none has the right number.

    The spiral of sunflowers gives every point the same area: Vogel 1979, doi:10.1016/0025-5564(79)90080-4.
    """
    points = _fitted(lambda p: np.sum(p**2, axis=1) <= radius**2, area, radius, spacing)
    if points is not None:
        return points
    number = np.arange(max(1, round(area / spacing**2)))
    far = radius * np.sqrt((number + 0.5) / len(number)) if len(number) > 1 else np.zeros(1)
    angle = number * math.pi * (3.0 - math.sqrt(5.0))
    return np.stack([far * np.cos(angle), far * np.sin(angle)], axis=1)


def _lattice(half: float, s: float, shift: tuple[float, float]) -> np.ndarray:
    reach = math.ceil(half / s) + 1
    a, b = np.meshgrid(*(s * (np.arange(-reach, reach + 1) + part) for part in shift))
    return np.stack([a.reshape(-1), b.reshape(-1)], axis=1)


def _check_number(number: float) -> None:
    if number > MOST_IN_A_ROW:
        raise WavetankError(
            f"a row of this emitter has {number:,.0f} particles; at most {MOST_IN_A_ROW:,} are allowed: make it "
            "smaller, or the spacing larger."
        )


def inlet_of(shape: dict[str, Any], spacing: float, spread: float, dim: int) -> Inlet:
    """Return the inlet of a `shape` with its sizes [m]; at the rim water leaves at `spread` [rad] to the axis."""
    return _inlet_of(json.dumps(shape, sort_keys=True), spacing, spread, dim)


@functools.lru_cache(maxsize=64)
def _inlet_of(text: str, spacing: float, spread: float, dim: int) -> Inlet:
    shape = json.loads(text)
    points, area, half = SHAPES[shape["shape"]](shape, spacing)
    _check_number(len(points))
    places = np.concatenate([points, np.zeros((len(points), 1))], axis=1)
    ways = np.concatenate([points * math.tan(spread) / max(*half, 1e-12), np.ones((len(points), 1))], axis=1)
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    return Inlet(places, ways, _phases(points), area, spacing**dim * len(points) / area, half)


def _phases(points: np.ndarray) -> np.ndarray:
    """Return shares of a row [n] that differ between neighbours: by 1/4 and 1/2 on a lattice, spread out elsewhere."""
    lines = [np.unique(np.round(column, 9), return_inverse=True) for column in points.T]
    (across, i), (up, j) = lines
    if len(across) * len(up) > 3 * len(points):
        return GOLDEN * np.arange(len(points)) % 1.0
    return np.asarray((2 * i.reshape(-1) + j.reshape(-1)) % 4 / 4.0)


def inlet_of_mesh(mesh: Mesh, spacing: float) -> Inlet:
    """Return the inlet that is the surface of a mesh; water leaves along its normals."""
    return _inlet_of_mesh(mesh.path, mesh.data, mesh.size, mesh.up, spacing)


@functools.lru_cache(maxsize=16)
def _inlet_of_mesh(path: str, data: str, size: Any, up: Any, spacing: float) -> Inlet:
    corners = Mesh(path=path, data=data, size=size, up=up, center=(0.0, 0.0, 0.0)).corners()
    sides = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = 0.5 * np.linalg.norm(sides, axis=1)
    area = float(areas.sum())
    _check_number(area / spacing**2)
    count = max(1, round(area / spacing**2))
    chance = np.random.Generator(np.random.PCG64(0))
    which = chance.choice(len(areas), CANDIDATES * count, p=areas / area)
    u, v = chance.random((2, len(which), 1))
    u, v = np.where(u + v > 1.0, 1.0 - u, u), np.where(u + v > 1.0, 1.0 - v, v)
    a, b, c = (corners[which, k] for k in range(3))
    points = a + u * (b - a) + v * (c - a)
    # Each next place is the one farthest from those that are taken: Gonzalez 1985, doi:10.1016/0304-3975(85)90224-5.
    chosen, far = [0], np.sum((points - points[0]) ** 2, axis=1)
    while len(chosen) < count:
        chosen.append(int(np.argmax(far)))
        far = np.minimum(far, np.sum((points - points[chosen[-1]]) ** 2, axis=1))
    normals = sides[which[chosen]] / (2.0 * areas[which[chosen]])[:, None]
    half = np.abs(points).max(axis=0)
    phases = GOLDEN * np.arange(count) % 1.0
    return Inlet(points[chosen], normals, phases, area, spacing**3 * count / area, (float(half[0]), float(half[1])))

"""Surfaces of solids as triangles, in their own frames: for those who draw or write meshes."""

from typing import Any

import numpy as np

from wavetank.device.compiler import borrowed
from wavetank.foundation.rotations import turned
from wavetank.solids.ground.height_field import HeightField
from wavetank.solids.ground.height_field import surface as ground
from wavetank.solids.ground.polygon import Polygon
from wavetank.solids.mass import Ruler
from wavetank.solids.meshes.mesh import Mesh
from wavetank.solids.shapes import Box, Capsule, Cylinder, HalfSpace, Sphere, Union
from wavetank.solids.solid import Solid

AROUND = 48  # edges round what is round
CELLS = 96  # along the longest edge of what set operations make
Surface = tuple[np.ndarray, np.ndarray]  # vertices [n, 3], m, and faces [m, 3], int32, counter-clockwise from outside


def surface_of(solid: Solid, dim: int, spacing: float) -> Surface:
    """Return the surface of `solid` in its own frame; in a 2-D world it is one spacing [m] thick.

    What has no end, or is all but a hollow, has none: no vertices. What set operations make is triangulated on a grid.
    """
    if isinstance(solid, HalfSpace):
        return _nothing()
    if isinstance(solid, Mesh):  # of a container its hollow, seen from inside
        points, faces = solid.surface()
        points = points - 0.5 * (points.min(axis=0) + points.max(axis=0))
        return points, (faces[:, ::-1] if solid.invert else faces).astype(np.int32)
    if isinstance(solid, Polygon):
        return _prism(solid.vertices()[:, :2], spacing)
    if isinstance(solid, HeightField):
        return _ground(solid, spacing)
    if dim == 2:
        return _flat(solid, spacing)
    if isinstance(solid, Box):
        return _box(0.5 * np.array(solid.size, float))
    if isinstance(solid, Sphere):
        return _turned_profile(solid.radius * np.column_stack(_half_circle(np.pi)))
    if isinstance(solid, Capsule | Cylinder):
        radius, half = solid.program()[0].size[:2]
        points, faces = _turned_profile(_profile(solid, radius, half))
        return turned(solid.program()[0].turn, points), faces
    if isinstance(solid, Union) and not solid.is_body:
        return _together([_placed(part, dim, spacing) for part in solid.parts])
    return _triangulated(solid, spacing)


def _nothing() -> Surface:
    return np.zeros((0, 3)), np.zeros((0, 3), np.int32)


def _placed(part: Solid, dim: int, spacing: float) -> Surface:
    points, faces = surface_of(part, dim, spacing)
    return turned(part.quaternion, points) + part.origin, faces


def _together(parts: list[Surface]) -> Surface:
    firsts = np.cumsum([0, *(len(points) for points, _ in parts)])
    faces = [faces + first for (_, faces), first in zip(parts, firsts, strict=False)]
    return np.concatenate([points for points, _ in parts]), np.concatenate(faces).astype(np.int32)


def _box(half: np.ndarray) -> Surface:
    corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * half
    quads = np.array([(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)], np.int32)
    return corners, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def _half_circle(angle: float) -> tuple[np.ndarray, np.ndarray]:
    """Radius and height of a unit half circle from its lower pole up to `angle` [rad]."""
    turn = np.linspace(0.0, angle, round(AROUND / 2 * angle / np.pi) + 1)
    return np.sin(turn), -np.cos(turn)


def _profile(solid: Solid, radius: float, half: float) -> np.ndarray:
    if isinstance(solid, Cylinder):
        return np.array([(0.0, -half), (radius, -half), (radius, half), (0.0, half)])
    below = radius * np.column_stack(_half_circle(np.pi / 2)) - (0.0, half)
    return np.concatenate([below, below[::-1] * (1.0, -1.0)])


def _turned_profile(profile: np.ndarray) -> Surface:
    """Turn points (radius, height) [n, 2], the first and last on the axis, about y."""
    turn = 2.0 * np.pi * np.arange(AROUND) / AROUND
    rings = profile[1:-1]
    x, z = (rings[:, :1] * wave(turn) for wave in (np.cos, np.sin))
    y = np.repeat(rings[:, 1:], AROUND, axis=1)
    points = np.concatenate(
        [np.stack([x, y, z], axis=-1).reshape(-1, 3), [(0, profile[0, 1], 0), (0, profile[-1, 1], 0)]]
    )
    number = np.arange(len(rings) * AROUND).reshape(len(rings), AROUND)
    after = np.roll(number, -1, axis=1)
    a, b, c, d = (part.reshape(-1) for part in (number[:-1], after[:-1], number[1:], after[1:]))
    low, high = np.full(AROUND, len(points) - 2), np.full(AROUND, len(points) - 1)
    faces = [
        np.column_stack(corners)
        for corners in ((a, c, b), (b, c, d), (low, number[0], after[0]), (high, after[-1], number[-1]))
    ]
    return points, np.concatenate(faces).astype(np.int32)


def _prism(outline: np.ndarray, thickness: float) -> Surface:
    """A plate with a simple outline [n, 2] around z = 0; its faces by clipping ears."""
    x, y = outline.T
    if np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y) < 0.0:
        outline = outline[::-1]
    count, half = len(outline), 0.5 * thickness
    points = np.concatenate([np.column_stack([outline, np.full(count, side)]) for side in (-half, half)])
    front = _ears(outline)
    a, b = np.arange(count), np.roll(np.arange(count), -1)
    sides = [np.column_stack([a, b, b + count]), np.column_stack([a, b + count, a + count])]
    return points, np.concatenate([front[:, ::-1], front + count, *sides]).astype(np.int32)


def _ears(outline: np.ndarray) -> np.ndarray:
    """Triangulate a simple polygon [n, 2], counter-clockwise, by clipping ears (Meisters 1975); [n - 2, 3]."""
    left, faces = [*range(len(outline))], []

    def cross(o: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return (a[..., 0] - o[..., 0]) * (b[..., 1] - o[..., 1]) - (a[..., 1] - o[..., 1]) * (b[..., 0] - o[..., 0])

    while len(left) > 3:
        for k in range(len(left)):
            corners = [left[k - 1], left[k], left[(k + 1) % len(left)]]
            a, b, c = outline[corners]
            others = outline[[n for n in left if n not in corners]]
            inside = (cross(a, b, others) >= 0) & (cross(b, c, others) >= 0) & (cross(c, a, others) >= 0)
            if cross(a, b, c) > 0 and not inside.any():
                break
        else:
            k = 0  # a line that crosses itself: some triangle rather than none
            corners = [left[-1], left[0], left[1]]
        faces.append(corners)
        del left[k]
    return np.array([*faces, left])


def _ground(solid: HeightField, spacing: float) -> Surface:
    heights, bottom = solid.elevations() * solid.size[1], float(solid.vertices()[:, 1].min())
    if len(solid.size) == 3:
        points, faces = ground(heights, (solid.size[0], solid.size[-1]), bottom)
        return points, faces.astype(np.int32)
    line = np.column_stack([np.linspace(-0.5, 0.5, len(heights)) * solid.size[0], heights])
    return _prism(np.concatenate([line, [(line[-1, 0], bottom), (line[0, 0], bottom)]]), spacing)


def _flat(solid: Solid, spacing: float) -> Surface:
    """A solid of a 2-D world as a plate."""
    if isinstance(solid, Box):
        return _box(0.5 * np.array([*solid.size[:2], spacing]))
    if isinstance(solid, Sphere):
        turn = 2.0 * np.pi * np.arange(AROUND) / AROUND
        return _prism(solid.radius * np.column_stack([np.cos(turn), np.sin(turn)]), spacing)
    if isinstance(solid, Capsule | Cylinder):
        radius, half = solid.program()[0].size[:2]
        turn = np.linspace(0.0, np.pi, AROUND // 2 + 1)
        cap = radius * np.column_stack([np.cos(turn), np.sin(turn)])
        upper = cap + (0.0, half) if isinstance(solid, Capsule) else np.array([(radius, half), (-radius, half)])
        points, faces = _prism(np.concatenate([upper, -upper]), spacing)
        return turned(solid.program()[0].turn, points), faces
    if isinstance(solid, Union):
        return _together([_placed(part, 2, spacing) for part in solid.parts])
    return _triangulated(solid, spacing)


def _triangulated(solid: Solid, spacing: float) -> Surface:
    """Marching cubes over the distances to a solid (Lorensen and Cline 1987)."""
    try:
        import pysplashsurf
    except ImportError:
        return _nothing()
    with borrowed():
        return _marched(solid, spacing, pysplashsurf)


def _marched(solid: Solid, spacing: float, pysplashsurf: Any) -> Surface:
    dim = 2 if not solid.is_spatial and len(next(iter(solid.vectors()), ("", (0.0,) * 3))[1]) == 2 else 3
    ruler = Ruler(solid, dim, spacing)
    lower, upper = ruler.extent()
    edge = float((upper - lower).max()) / CELLS
    if dim == 2:
        lower[2], upper[2] = -0.5 * spacing, 0.5 * spacing
    lower, upper = lower - 1.5 * edge, upper + 1.5 * edge
    numbers = np.ceil((upper - lower) / edge).astype(int) + 1
    axes = [low + edge * np.arange(n) for low, n in zip(lower, numbers, strict=True)]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    distances = ruler.distances(places)
    if dim == 2:
        distances = np.maximum(distances, np.abs(places[:, 2]) - 0.5 * spacing)
    values = np.ascontiguousarray(-distances.reshape(numbers), np.float32)
    mesh = pysplashsurf.marching_cubes(
        values, iso_surface_threshold=0.0, cube_size=edge, translation=[*map(float, lower)]
    )
    return np.asarray(mesh.vertices, float), np.asarray(mesh.triangles, np.int32)

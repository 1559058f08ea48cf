"""Rigid bodies of SPlisHSPlasH's scenes: tank, boxes, balls, meshes, bodies; see `splishsplash.py`."""

import importlib.util
import itertools
import math
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from wavetank.foundation.errors import WavetankError
from wavetank.foundation.rotations import length_of, turned
from wavetank.scene.tank import Tank
from wavetank.solids.ground.polygon import Polygon
from wavetank.solids.meshes.counted import check_file
from wavetank.solids.meshes.files import ALONE, SUFFIXES
from wavetank.solids.meshes.mesh import Mesh
from wavetank.solids.shapes import Box, Sphere
from wavetank.solids.solid import Solid

ROUND = 1e-3  # of a radius: how equal distances from the middle of a ball are
STRAIGHT = 1e-6  # rad: below it there is no rotation
CORNER = 1e-9  # m: what is nearer is the same corner
BALL = 1  # collisionObjectType


def turn_of(row: dict[str, Any], planar: bool = False) -> np.ndarray:
    """Return the unit quaternion (w, x, y, z) of an axis and an angle [rad]; about z where `planar`."""
    angle = float(row.get("rotationAngle", 0.0))
    axis = np.array([0.0, 0.0, 1.0] if planar else row.get("rotationAxis", (0.0, 0.0, 1.0)), float)
    length = length_of(axis)
    if not (math.isfinite(angle) and math.isfinite(length)):
        raise WavetankError(f"rotationAngle = {angle:g} about rotationAxis = {axis.tolist()} is not a rotation.")
    if length == 0.0 or abs(angle) < STRAIGHT:
        return np.array([1.0, 0.0, 0.0, 0.0])
    return np.concatenate([[np.cos(0.5 * angle)], np.sin(0.5 * angle) * axis / length])


def arrays_of(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Return the vertices [n, 3] of a mesh file as they are in it, and its faces [m, 3], without repeated vertices.

    Raises `WavetankError` for a file that cannot be read.
    """
    try:
        import trimesh
    except ImportError:
        raise WavetankError(f"{path}: mesh files are read by trimesh; install it: pip install trimesh.") from None
    if path.suffix.lower() not in SUFFIXES:
        raise WavetankError(f"{path}: meshes are read from {', '.join(SUFFIXES)} files; convert this one.")
    try:
        check_file(path)
    except ValueError as error:
        raise WavetankError(str(error)) from None
    try:
        loaded = trimesh.load(path, process=False, force="mesh", **ALONE)
        vertices, faces = np.asarray(loaded.vertices, float), np.asarray(loaded.faces, np.int64)
    except Exception as error:  # a damaged file fails in as many ways as there are formats
        reason = (str(error) or type(error).__name__).splitlines()[0]
        raise WavetankError(f"{path}: this mesh cannot be read: {reason}.") from None
    if not len(faces):
        raise WavetankError(f"{path} has no faces; a solid needs a surface of triangles.")
    _, first, place = np.unique(np.round(vertices / CORNER), axis=0, return_index=True, return_inverse=True)
    return vertices[first], place.reshape(-1)[faces]


def is_inverted(row: dict[str, Any]) -> bool:
    """Say whether a body is all but its hollow: a container."""
    told = [row[key] for key in ("mapInvert", "invertSDF") if key in row]
    return any(told) if told else bool(row.get("isWall"))


class Solids:
    """The tank and the solids of a file, in their order."""

    def __init__(self, scene: Path, dim: int, spacing: float, notes: list[str]) -> None:
        self.scene, self.dim, self.spacing, self.notes = scene, dim, spacing, notes
        self.tank: Tank | None = None
        self.found: list[Solid] = []
        self.names: dict[Any, str] = {}  # of solids by their ids; those of the tank are empty
        self.movable: set[str] = set()

    @staticmethod
    def find_file(scene: Path, name: str) -> Path:
        """Return a file that a scene names: next to it, or in the peer's package; raises `WavetankError`."""
        plain = name.replace("\\", "/")
        places = [scene.parent / plain, scene.parent / Path(plain).name, *_packaged(plain)]
        for place in places:
            if place.is_file():
                return place
        raise WavetankError(
            f"{scene}: there is no file {name!r} next to it or in an installed pysplishsplash; put it there."
        )

    def add(self, number: int, row: dict[str, Any]) -> None:
        """Take a row of `RigidBodies`; raises `WavetankError`."""
        name = f"body {row['id']}" if "id" in row else f"body {number + 1}"
        self.names[row.get("id", number)] = ""
        vertices, faces = arrays_of(self.find_file(self.scene, str(row["geometryFile"])))
        vertices = vertices * np.array(row.get("scale", (1.0, 1.0, 1.0)), float)
        turn, shift = turn_of(row, planar=False), np.array(row.get("translation", (0.0, 0.0, 0.0)), float)
        if self.dim == 2 and np.abs(turn[1:3]).max() > STRAIGHT:
            self.notes.append(f"{name}: in a 2-D world it can turn about z only; its rotation is left out.")
            turn = np.array([1.0, 0.0, 0.0, 0.0])
        if row.get("isAnimated"):
            self.notes.append(f"{name}: it is moved by a script, which is left out; it stands still, give it a motion.")
        if row.get("particleFile"):
            self.notes.append(f"{name}: particleFile samples its surface; distances to its mesh take that place.")
        if is_inverted(row) and _is_box(vertices, faces) and self._becomes_tank(vertices, turn, shift):
            return
        place = {"name": name, **self._physics(name, row)}
        for k, solid in enumerate(self._solids(place, row, vertices, faces, (turn, shift))):
            solid = solid if not k else solid.model_copy(update={"name": f"{name} {k + 1}"})
            self.found.append(solid)
            if not k:
                self.names[row.get("id", number)] = name
                self.movable |= {name} if solid.is_body else set()

    def _becomes_tank(self, vertices: np.ndarray, turn: np.ndarray, shift: np.ndarray) -> bool:
        lower, upper = _bounds(turned(turn, vertices) + shift)
        straight = np.isclose(np.abs(turn).max(), 1.0, atol=STRAIGHT)
        if self.tank is not None or not straight:
            return False
        size = (upper - lower)[: self.dim]
        self.tank = Tank(size=tuple(map(float, size)), lower=tuple(map(float, lower[: self.dim])))
        return True

    def _physics(self, name: str, row: dict[str, Any]) -> dict[str, Any]:
        fields: dict[str, Any] = {}
        if row.get("friction") is not None:
            fields["friction"] = min(max(float(row["friction"]), 0.0), 1.0)
        if not row.get("isDynamic") or is_inverted(row):
            return fields
        fields["density"] = float(row.get("density", 1000.0))
        fields["restitution"] = min(max(float(row.get("restitution", 0.2)), 0.0), 1.0)
        if any(row.get("velocity", ())):
            fields["velocity"] = tuple(map(float, row["velocity"]))[: self.dim]
        if any(row.get("angularVelocity", ())):
            self.notes.append(f"{name}: angularVelocity is not imported; set angular_velocity.")
        return fields

    def _solids(
        self, place: dict[str, Any], row: dict[str, Any], vertices: np.ndarray, faces: np.ndarray, pose: Any
    ) -> Iterator[Solid]:
        turn, shift = pose
        lower, upper = _bounds(vertices)
        middle = 0.5 * (lower + upper)
        center = tuple(map(float, (turned(turn, middle) + shift)[: self.dim]))
        angle = 2.0 * float(np.arctan2(turn[3], turn[0]))
        rotation = {"rotation": tuple(map(float, turn)) if self.dim == 3 else angle}
        if _is_box(vertices, faces) and not is_inverted(row):
            yield Box(center=center, size=tuple(map(float, (upper - lower)[: self.dim])), **rotation, **place)
        elif _is_ball(vertices - middle) and not is_inverted(row):
            yield Sphere(center=center, radius=float(0.5 * (upper - lower)[0]), **rotation, **place)
        elif self.dim == 2:
            for loop in section(turned(turn, vertices) + shift, faces):
                yield Polygon(points=[(float(x), float(y)) for x, y in loop], invert=is_inverted(row), **place)
        else:
            thickness: dict[str, Any] = {}
            if is_inverted(row):
                thickness = {"invert": True}
            elif not is_closed(faces):
                thickness = {"thickness": 2.0 * self.spacing}
                self.notes.append(f"{place['name']}: its surface is not closed; it becomes walls two particles thick.")
            edge = float((upper - lower).max())
            yield Mesh.of(vertices, faces, center=center, size=edge, **rotation, **thickness, **place)


def _packaged(name: str) -> Iterator[Path]:
    """Places where the peer's package may keep a file."""
    roots = [Path(sys.prefix) / "bin" / "data"]
    spec = importlib.util.find_spec("pysplishsplash")
    if spec is not None and spec.origin:
        roots.append(Path(spec.origin).parent / "data")
    for root in roots:
        yield root / "models" / Path(name).name


def _bounds(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return points.min(axis=0), points.max(axis=0)


def _is_box(vertices: np.ndarray, faces: np.ndarray) -> bool:
    """Say whether these are the eight corners of a box along the axes, each in some face."""
    lower, upper = _bounds(vertices)
    at_corner = (np.isclose(vertices, lower) | np.isclose(vertices, upper)).all()
    return len(vertices) == 8 and len(faces) == 12 and bool(at_corner) and bool((upper > lower).all())


def _is_ball(offsets: np.ndarray) -> bool:
    distances = np.linalg.norm(offsets, axis=1)
    return len(offsets) > 50 and bool(np.ptp(distances) < ROUND * distances.max())


def is_closed(faces: np.ndarray) -> bool:
    """Say whether each edge of the triangles [m, 3] has two of them."""
    edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    return bool((np.unique(edges, axis=0, return_counts=True)[1] == 2).all())


def section(vertices: np.ndarray, faces: np.ndarray) -> Iterator[np.ndarray]:
    """Yield the closed lines [n, 2] in which a surface meets the plane z = 0, the longest ones first."""
    height = vertices[:, 2] + 1e-9 * max(float(np.abs(vertices[:, 2]).max()), 1e-9)  # no corner lies in the plane
    nexts: dict[tuple[int, int], tuple[int, int]] = {}
    points: dict[tuple[int, int], np.ndarray] = {}
    for face in faces.tolist():
        crossed = {}
        for a, b in itertools.pairwise([*face, face[0]]):
            if (height[a] > 0.0) != (height[b] > 0.0):
                edge = (min(a, b), max(a, b))
                share = height[edge[0]] / (height[edge[0]] - height[edge[1]])
                points[edge] = vertices[edge[0]] + share * (vertices[edge[1]] - vertices[edge[0]])
                crossed["down" if height[a] > 0.0 else "up"] = edge
        if len(crossed) == 2:
            nexts[crossed["down"]] = crossed["up"]
    loops = []
    while nexts:
        start = next(iter(nexts))
        line, edge = [], start
        while edge in nexts:
            line.append(points[edge][:2])
            edge = nexts.pop(edge)
        if edge == start and len(line) > 2:
            loops.append(np.array(line))
    loops.sort(key=lambda loop: -float(np.ptp(loop, axis=0).sum()))
    for loop in loops:
        if np.ptp(loop, axis=0).min() > 1e-6:
            yield loop

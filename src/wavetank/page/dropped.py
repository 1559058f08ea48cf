"""Meshes dropped on page or window: the text of an OBJ becomes a solid in the middle of the world."""

import itertools
from pathlib import PurePath
from typing import Any

import numpy as np

from wavetank.foundation.errors import WavetankError
from wavetank.foundation.input_limits import explain_errors
from wavetank.session.commands import AddSolid
from wavetank.session.session import Session
from wavetank.solids.meshes.mesh import Mesh
from wavetank.view.extent import extent_of

SHARE = 0.3  # of the world's length: longest edge of a dropped mesh
MOST_CORNERS = 400_000


def drop_mesh(session: Session, text: str, file: str) -> str:
    """Add the mesh of an OBJ file's `text` as a solid; return the sentence that says so, or why it was refused."""
    try:
        with explain_errors(file, "mesh"):
            session.apply(command_for(session, text, file))
    except WavetankError as error:
        return str(error)[:400]
    return f"{file} was added as a solid; move it with Grab."


def command_for(session: Session, text: str, file: str) -> AddSolid:
    """Return the command that places the mesh of an OBJ file's `text` on the floor of the world.

    Raises `WavetankError`, with the name `file`, where it is not a closed mesh or the world is 2-D.
    """
    scene, extent = session.sim.scene, extent_of(session.sim.scene)
    if scene.dim == 2:
        raise WavetankError(f"{file}: a mesh needs a 3-D world, and this one is 2-D; choose a 3-D scene first.")
    vertices, faces = _triangles(text, file)
    edges = np.ptp(vertices[np.unique(faces)], axis=0)
    if not edges.max() > 0.0:
        raise WavetankError(f"{file}: all corners of the mesh are one point.")
    size = SHARE * float((extent.upper - extent.lower).max())
    middle = extent.middle.copy()
    up = "xyz".index(scene.upward[-1])
    middle[up] = extent.lower[up] + 0.5 * size * float(edges[up] / edges.max()) + 0.25 * extent.spacing
    names = set(session.sim.solids.names)
    stem = PurePath(file).stem[:40] or "mesh"
    name = next(n for n in (stem, *(f"{stem} {k}" for k in range(2, 1000))) if n not in names)
    try:
        return AddSolid(solid=Mesh.of(vertices, faces, name=name, center=tuple(map(float, middle)), size=size))
    except ValueError as error:
        raise WavetankError(f"{file}: {error}") from None
    except WavetankError as error:
        raise WavetankError(f"{file}: {error}") from None


def _triangles(text: str, file: str) -> tuple[np.ndarray, np.ndarray]:
    """Read the vertices and faces of an OBJ; polygons become triangle fans."""
    corners: list[list[float]] = []
    faces: list[tuple[int, int, int]] = []
    for number, line in enumerate(text.splitlines(), 1):
        words: list[Any] = line.split()
        try:
            if words[:1] == ["v"]:
                x, y, z = (float(word) for word in words[1:4])
                corners.append([x, y, z])
            elif words[:1] == ["f"]:
                around = [int(word.split("/")[0]) for word in words[1:]]
                around = [k - 1 if k > 0 else len(corners) + k for k in around]
                faces += [(around[0], a, b) for a, b in itertools.pairwise(around[1:])]
        except ValueError:
            raise WavetankError(f"{file}, line {number}: {line.strip()[:60]!r} is not valid in an OBJ file.") from None
        if len(corners) > MOST_CORNERS or len(faces) > MOST_CORNERS:
            raise WavetankError(f"{file}: the mesh has more than {MOST_CORNERS:,} corners or faces; simplify it.")
    points, triangles = np.array(corners, float).reshape(-1, 3), np.array(faces, np.int64).reshape(-1, 3)
    if not len(triangles) or triangles.min() < 0 or triangles.max() >= len(points) or not np.isfinite(points).all():
        raise WavetankError(f"{file}: it contains no mesh: an OBJ has lines 'v x y z' and 'f a b c'.")
    return points, triangles

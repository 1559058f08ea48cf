"""Mesh files, and the models that come with the package."""

import importlib.resources
from pathlib import Path
from typing import Any

import numpy as np

from wavetank.solids.meshes.counted import check_file
from wavetank.solids.meshes.triangles import Triangles

SUFFIXES = (".obj", ".stl", ".ply", ".glb")
#: how trimesh reads a file, and none that it names
ALONE: dict[str, Any] = {"skip_materials": True, "resolver": {}}
BUNDLED = "wavetank/"  # how the names of bundled models begin


def bundled_models() -> list[str]:
    """Names of the meshes that come with the package, sorted."""
    return sorted(BUNDLED + entry.name for entry in _models().iterdir() if entry.name.endswith(SUFFIXES))


def read_model(name: str) -> Triangles:
    """Return the surface of a bundled model."""
    with importlib.resources.as_file(_models() / name.removeprefix(BUNDLED)) as path:
        return read_file(path)


def read_file(path: Path) -> Triangles:
    """Return the surface of a mesh file; raises `ValueError` with one sentence for a file that cannot be read."""
    if path.suffix.lower() not in SUFFIXES:
        raise ValueError(f"{path}: meshes are read from {', '.join(SUFFIXES)} files; convert this one.")
    if not path.exists():
        raise ValueError(f"there is no mesh file {path}; bundled models are: {', '.join(bundled_models())}.")
    check_file(path)
    return Triangles.of(*_arrays(path), str(path))


def bounds_in_file(path: str, folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """Return the corners [2, 3] of the box around the faces of a file or a bundled model, in the file's own numbers.

    Raises `ValueError` with one sentence for a file that cannot be read.
    """
    if path in bundled_models():
        with importlib.resources.as_file(_models() / path.removeprefix(BUNDLED)) as model:
            return bounds_of(*_arrays(model))
    read_file(folder / path)  # says what is wrong with it
    return bounds_of(*_arrays(folder / path))


def bounds_of(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the corners of the box around the vertices that faces use, [3] each."""
    used = vertices[np.unique(faces)]
    return used.min(axis=0), used.max(axis=0)


def _arrays(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and faces of all that is in a file, where its scene puts them."""
    try:
        import trimesh
    except ModuleNotFoundError:
        raise ValueError(f"{path}: mesh files are read by trimesh; install it: pip install trimesh.") from None
    try:
        scene = trimesh.load_scene(path, process=False, **ALONE)
        parts = [part for part in scene.dump() if hasattr(part, "faces")]
    except Exception as error:  # a damaged file fails in as many ways as there are formats
        reason = (str(error) or type(error).__name__).splitlines()[0]
        raise ValueError(f"{path}: this mesh cannot be read: {reason}.") from None
    counts = np.cumsum([0, *(len(part.vertices) for part in parts)])
    vertices = [np.asarray(part.vertices, np.float64).reshape(-1, 3) for part in parts]
    faces = [
        np.asarray(part.faces, np.int64).reshape(-1, 3) + first for part, first in zip(parts, counts, strict=False)
    ]
    return np.concatenate([np.zeros((0, 3)), *vertices]), np.concatenate([np.zeros((0, 3), np.int64), *faces])


def _models() -> Any:
    return importlib.resources.files("wavetank.solids") / "models"

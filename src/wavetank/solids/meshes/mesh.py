"""A solid from a mesh, as data. Its distances come from a grid: see `grid.py`."""

import functools
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, ValidationInfo, model_validator
from typing_extensions import override

from wavetank.foundation.errors import WavetankError
from wavetank.foundation.model import METRES, Length, Number
from wavetank.solids.meshes.files import bundled_models, read_file, read_model
from wavetank.solids.meshes.store import DistanceGrid, grid_of
from wavetank.solids.meshes.triangles import Triangles, volume_within
from wavetank.solids.solid import AROUND, GRIDS, Node, Solid, complement, point_in_space

FLAT = 1e-6  # of the longest edge
_UP = {"x": (0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0), "z": (1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0)}


class Mesh(Solid):
    """A solid whose surface is a mesh, in a 3-D world.

    The box around the mesh has its middle at `center`. A file is read once, when this is made; from then on `data` is
    the mesh, so that saved scenes, states and recordings need no file and do not change with it.
    """

    shape: Literal["mesh"] = "mesh"
    center: Annotated[tuple[Number, Number, Number], METRES]
    size: Length | tuple[Length, Length, Length]  # the longest edge of the box around it, or its three edges
    path: str = ""  # OBJ, STL, PLY or GLB, from the scene file's folder; or a bundled model, as in wavetank/boat.obj
    data: Annotated[str, Field(repr=False)] = ""  # the mesh itself, made from the file; where given, no file is read
    up: Literal["x", "y", "z"] = "y"  # axis of the file that points up; STL files often have z
    thickness: Length | None = None  # make walls of the faces, for a surface that is not closed
    invert: bool = False  # a container: all but what the mesh encloses is solid

    @classmethod
    def of(cls, vertices: Any, faces: Any, **fields: Any) -> "Mesh":
        """Return a mesh from arrays: `vertices` [n, 3] and `faces` [m, 3], counter-clockwise from outside."""
        try:
            return cls(data=Triangles.of(vertices, faces, "the mesh").text(), **fields)
        except ValueError as error:
            raise WavetankError(str(error)) from None

    @model_validator(mode="after")
    def _from_file(self, info: ValidationInfo) -> "Mesh":
        if not self.path and not self.data:
            raise ValueError("a mesh needs path, the name of an OBJ, STL, PLY or GLB file.")
        context: dict[str, Any] = info.context or {}
        if not self.data and self.path not in bundled_models():
            if not context.get("files", True):
                raise ValueError(
                    f"path = {self.path!r} is not a bundled model ({', '.join(bundled_models())}), "
                    "and no other file is opened from here; start with the scene's file, or save it from Python, "
                    "which puts the mesh into it."
                )
            self.__dict__["data"] = read_file(Path(context.get("folder", "."), self.path)).text()
        if self.invert and self.thickness is not None:
            raise ValueError("invert makes a container of what a closed mesh encloses; leave out thickness.")
        if self.data:
            self._triangles()
        return self

    @property
    @override
    def origin(self) -> np.ndarray:
        return point_in_space(self.center)

    @property
    @override
    def is_spatial(self) -> bool:
        return True

    @override
    def program(self) -> list[Node]:
        own = Node(GRIDS, [1.0], mesh=self)
        return complement([own]) if self.invert else [own]

    @override
    def reach(self) -> float:
        return AROUND if self.invert else self.span()

    @override
    def span(self) -> float:
        # The ball around the box: what is in the file is read by those who need it.
        edges = (self.size,) * 3 if isinstance(self.size, float) else self.size
        return 0.5 * math.hypot(*edges) + 0.5 * (self.thickness or 0.0)

    @override
    def vectors(self) -> list[tuple[str, Sequence[float]]]:
        return [("center", self.center)]

    def surface(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the vertices [n, 3], m, in the solid's frame, and the faces [m, 3], int.

        Raises `WavetankError` for a mesh that cannot be read.
        """
        return self.vertices(), self._triangles().faces

    def corners(self) -> np.ndarray:
        """Return the corners of the triangles [m] in the mesh's own frame, [m, 3, 3], as seen from outside."""
        result: np.ndarray = self.vertices()[self._triangles().faces]
        return result

    def vertices(self) -> np.ndarray:
        """Return its vertices [m], float64 [n, 3], in its own frame; raises `WavetankError` for a flat mesh."""
        points = self._triangles().vertices.astype(np.float64)
        if self.up in _UP:
            points = points @ np.reshape(_UP[self.up], (3, 3)).T
        edges = np.ptp(points, axis=0)
        if not isinstance(self.size, float) and edges.min() < FLAT:
            raise WavetankError(f"{self._label()} is flat; a mesh without a depth needs size as one number.")
        scaled: np.ndarray = points * (self.size if isinstance(self.size, float) else np.array(self.size) / edges)
        return scaled

    def volume(self) -> float:
        """Return the volume that a closed mesh encloses [m^3]; parts that overlap count twice."""
        return abs(volume_within(*self.surface()))

    def grid(self, spacing: float) -> DistanceGrid:
        """Return the distances to this mesh for particles of that spacing [m], in its own frame.

        Raises `WavetankError` for a mesh that cannot be read, is not closed or too large.
        """
        from wavetank.solids.meshes.grid import measure  # kernels

        triangles, points = self._triangles(), self.vertices()
        key = f"{triangles.digest} {self.up} {self.size} {self.thickness} {spacing}" + " hollow" * self.invert
        name = self.name or self._label()
        return grid_of(key, lambda: measure(points, triangles.faces, spacing, self.thickness, name, self.invert))

    def _triangles(self) -> Triangles:
        try:
            return _triangles(self.path, self.data)
        except ValueError as error:
            raise WavetankError(str(error)) from None

    def _label(self) -> str:
        return self.path or "the mesh"


@functools.lru_cache(maxsize=8)
def _triangles(path: str, data: str) -> Triangles:
    return Triangles.from_text(data, path or "the mesh") if data else read_model(path)

"""A solid from a mesh, as data. Its distances come from a grid: see `grid.py`."""

import functools
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, ValidationInfo, model_validator
from typing_extensions import override

from wavetank.foundation.arguments import finite
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.model import FARTHEST, METRES, Length, Number, Positive
from wavetank.solids.meshes.files import bounds_in_file, bounds_of, bundled_models, read_file, read_model
from wavetank.solids.meshes.store import DistanceGrid, grid_of
from wavetank.solids.meshes.triangles import Triangles, volume_within
from wavetank.solids.solid import AROUND, GRIDS, Node, Solid, complement, point_in_space

FLAT = 1e-6  # of the longest edge
_UP = {"x": (0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0), "z": (1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0)}


Units = Literal["mm", "cm", "m", "in", "ft"]
METRES_IN: dict[str, float] = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 0.0254, "ft": 0.3048}


class Mesh(Solid):
    """A solid whose surface is a mesh, in a 3-D world.

    The box around the mesh has its middle at `center`. With `scale`, `units` or both in place of `size` it has the size
    that the file gives it and, without a `center`, the place as well, so that parts of an assembly fit; both are
    replaced by `size` and `center` when this is made. A file is read once, when this is made; from then on `data` is
    the mesh, so that saved scenes, states and recordings need no file and do not change with it.
    """

    shape: Literal["mesh"] = "mesh"
    center: Annotated[tuple[Number, Number, Number], METRES]
    size: Length | tuple[Length, Length, Length]  # the longest edge of the box around it, or its three edges
    path: str = ""  # OBJ, STL, PLY or GLB, from the scene file's folder; or a bundled model, as in wavetank/boat.obj
    data: Annotated[str, Field(repr=False)] = ""  # the mesh itself, made from the file; where given, no file is read
    up: Literal["x", "y", "z"] = "y"  # axis of the file that points up; STL files often have z
    scale: Annotated[Positive | None, Field(exclude=True)] = None  # metres that are 1 in the file, or times its units
    units: Annotated[Units | None, Field(exclude=True)] = None  # of the file: mm, cm, m, in or ft
    thickness: Length | None = None  # make walls of the faces, for a surface that is not closed
    invert: bool = False  # a container: all but what the mesh encloses is solid

    @classmethod
    def of(cls, vertices: Any, faces: Any, **fields: Any) -> "Mesh":
        """Return a mesh from arrays: `vertices` [n, 3] and `faces` [m, 3], counter-clockwise from outside."""
        try:
            data = Triangles.of(vertices, faces, "the mesh").text()
            own = bounds_of(np.asarray(vertices, float), np.asarray(faces, int))
            return cls(data=data, **_in_own_coordinates(fields, lambda: own))
        except ValueError as error:
            raise WavetankError(str(error)) from None

    @model_validator(mode="before")
    @classmethod
    def _as_in_file(cls, values: Any, info: ValidationInfo) -> Any:
        if not isinstance(values, dict):
            return values
        context: dict[str, Any] = info.context or {}
        path = values.get("path")

        def bounds() -> tuple[np.ndarray, np.ndarray]:
            if not isinstance(path, str) or not path or values.get("data"):
                raise ValueError("scale and units are for a mesh with a path, or of arrays; give size and center.")
            if not context.get("files", True) and path not in bundled_models():
                raise ValueError(
                    f"path = {path!r}: no file is opened from here; give size in place of scale and units."
                )
            return bounds_in_file(path, Path(context.get("folder", ".")))

        return _in_own_coordinates(values, bounds)

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


def _in_own_coordinates(values: dict[str, Any], bounds: Callable[[], Any]) -> dict[str, Any]:
    """Return the keys of a mesh with `size` and `center` in place of `scale` and `units`; raises `ValueError`.

    `bounds` returns the box around it in its own numbers.
    """
    scale, units = values.get("scale"), values.get("units")
    if scale is None and units is None:
        if values.get("size") is None:
            raise ValueError(
                "a mesh needs size, its longest edge [m], or scale or units, which keep the size of its file."
            )
        return values
    if values.get("size") is not None:
        raise ValueError("size and scale, or units, exclude each other: both say how large the mesh is.")
    if units is not None and units not in METRES_IN:
        raise ValueError(f"units = {units!r} is not allowed; it must be one of {', '.join(METRES_IN)}.")
    if isinstance(scale, bool):
        raise ValueError(f"scale = {scale} is not allowed; it must be a number.")
    factor = finite("scale", 1.0 if scale is None else scale, 0.0) * METRES_IN[units or "m"]
    lower, upper = (factor * np.asarray(corner, float) for corner in bounds())
    size = float((upper - lower).max())
    if not 0.0 < size <= FARTHEST:
        raise ValueError(
            f"the mesh would be {size:g} m long with that scale; it must be more than 0, at most {FARTHEST:g}."
        )
    turn = np.reshape(_UP[values["up"]], (3, 3)) if values.get("up") in _UP else np.eye(3)
    middle = tuple((turn @ (0.5 * (lower + upper))).tolist())
    rest = {name: value for name, value in values.items() if name not in ("scale", "units")}
    return {"center": middle, **rest, "size": size}


@functools.lru_cache(maxsize=8)
def _triangles(path: str, data: str) -> Triangles:
    return Triangles.from_text(data, path or "the mesh") if data else read_model(path)

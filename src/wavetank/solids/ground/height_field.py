"""Ground with heights on a regular grid, as data: from numbers, a NumPy file or a picture."""

import base64
import binascii
import functools
import hashlib
import importlib.resources
import io
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import (
    BeforeValidator,
    Field,
    PlainSerializer,
    PrivateAttr,
    ValidationInfo,
    WithJsonSchema,
    model_validator,
)
from typing_extensions import override

from wavetank.foundation.errors import WavetankError
from wavetank.foundation.input_limits import open_regular, read_array, unpack_text
from wavetank.foundation.model import Edges, Length, Place
from wavetank.foundation.rotations import product, quaternion_of
from wavetank.solids.meshes.files import BUNDLED
from wavetank.solids.meshes.store import DistanceGrid, grid_of
from wavetank.solids.solid import GRIDS, Node, Solid, point_in_space

MOST_HEIGHTS = 480_000  # two triangles each
MOST_INLINE = 4096  # numbers that a saved scene writes out
LARGEST_FILE = 200_000_000  # bytes
PICTURES = (".png", ".tif", ".tiff", ".bmp", ".jpg", ".jpeg")


def _array(value: Any) -> Any:
    if value is None:
        return None
    try:
        return np.asarray(value, np.float64)
    except (TypeError, ValueError):
        raise ValueError("heights must be rows of equal length of numbers, one row for each step along z.") from None


Heights = Annotated[
    np.ndarray,
    BeforeValidator(_array),
    PlainSerializer(lambda array: array.tolist()),
    WithJsonSchema({"type": "array"}),
]


class HeightField(Solid):
    """Ground with given heights over a rectangle, solid below; in a 2-D world over a line.

    `heights` [rows along z, columns along x] (2-D: [columns]) times the second number of `size` lie above the height of
    `center`, the middle of the rectangle. Between them the ground is flat triangles. A picture has heights from 0 for
    black to 1 for white, its upper row lies at the far side, at the lowest z. Where z is up, rows follow each other
    against y, and heights are along z. A file is read once, when this is made;
    from then on `data` is the ground.
    """

    shape: Literal["height-field"] = "height-field"
    center: Place
    size: (
        Edges  # along x, of a height of 1, along z; 1 m for the second where heights are in metres; z up: x, y, height
    )
    heights: Heights | None = None
    path: str = ""  # a .npy file or a picture, 16-bit PNG for smooth ground, from the scene file's folder
    data: Annotated[str, Field(repr=False)] = ""  # many heights as text, made from the file or the numbers
    _upright: np.ndarray | None = PrivateAttr(None)  # turns the world so that y is up; None where it is
    base: Length | None = None  # thickness below the lowest height; a tenth of its longest edge where None

    @model_validator(mode="after")
    def _from_file(self, info: ValidationInfo) -> "HeightField":
        if len(self.center) != len(self.size):
            raise ValueError(f"center = {self.center} and size = {self.size} must have the same number of components.")
        context: dict[str, Any] = info.context or {}
        if self.heights is None and not self.data:
            if not self.path:
                raise ValueError("a height field needs heights, or path, the name of a .npy file or a picture.")
            if not context.get("files", True) and not self.path.startswith(BUNDLED):
                raise ValueError(
                    f"path = {self.path!r}: no file is opened from here; start with the scene's file, or save it from "
                    "Python, which puts the heights into it."
                )
            self.__dict__["heights"] = read_heights(self.path, Path(context.get("folder", ".")))
        if self.heights is not None:
            self._check(self.heights)
            if self.heights.size > MOST_INLINE or self.path:
                self.__dict__["data"], self.__dict__["heights"] = _text(self.heights), None
        else:
            self._check(self.elevations())
        return self

    def _check(self, heights: np.ndarray) -> None:
        dim = len(self.size)
        if heights.ndim != dim - 1 or min(heights.shape) < 2:
            raise ValueError(
                f"heights have shape {list(heights.shape)}; in a {dim}-D world they must have {dim - 1} dimensions of "
                "at least 2 numbers each."
            )
        if heights.size > MOST_HEIGHTS:
            raise ValueError(
                f"there are {heights.size:,} heights; at most {MOST_HEIGHTS:,} are allowed: take every second one, "
                "details below half a spacing are lost anyway."
            )
        if not np.isfinite(heights).all():
            raise ValueError("heights must be finite numbers.")

    @property
    @override
    def origin(self) -> np.ndarray:
        return point_in_space(self.center)

    @property
    @override
    def quaternion(self) -> np.ndarray:
        own = super().quaternion
        return own if self._upright is None else product(own, np.array(quaternion_of(self._upright.T)))

    @override
    def stand(self, upright: np.ndarray) -> None:
        self._upright = None if np.array_equal(upright, np.eye(3)) else upright

    def _edges(self) -> tuple[float, ...]:
        """Return `size` in its own frame, in which y is up."""
        if self._upright is None:
            return self.size
        dim = len(self.size)
        return tuple(np.abs(self._upright[:dim, :dim] @ np.array(self.size)).tolist())

    def elevations(self) -> np.ndarray:
        """Return the heights as they were given, float64 [rows, columns] or [columns]."""
        if self.heights is not None:
            return self.heights
        try:
            return _heights(self.data)
        except ValueError as error:
            raise WavetankError(str(error)) from None

    def _bottom(self) -> float:
        """Height [m] of its lower face, over the centre."""
        size = self._edges()
        edges = (size[0], *size[2:])
        lowest = min(0.0, float(self.elevations().min()) * size[1])
        return lowest - (self.base or 0.1 * max(edges))

    def vertices(self) -> np.ndarray:
        """Return the corners of the box around it [m], [8, 3], in its own frame."""
        size = self._edges()
        x, z = 0.5 * size[0], 0.5 * size[2] if len(size) == 3 else 0.0
        top = float(self.elevations().max()) * size[1]
        return np.array([(a, b, c) for a in (-x, x) for b in (self._bottom(), top) for c in (-z, z)])

    def volume(self) -> float:
        """Return its volume [m^3], in a 2-D world its area [m^2]."""
        size = self._edges()
        h = self.elevations() * size[1] - self._bottom()
        for _ in range(h.ndim):
            h = np.mean(0.5 * (h[1:] + h[:-1]), axis=0)
        return float(h) * size[0] * (size[2] if len(size) == 3 else 1.0)

    @override
    def program(self) -> list[Node]:
        corners = self.vertices()
        return [Node(GRIDS, [1.0], 0.5 * (corners.min(axis=0) + corners.max(axis=0)), mesh=self)]

    @override
    def reach(self) -> float:
        return float(np.linalg.norm(self.vertices(), axis=1).max())

    @override
    def vectors(self) -> list[tuple[str, Sequence[float]]]:
        return [("center", self.center), ("size", self.size)]

    def grid(self, spacing: float) -> DistanceGrid:
        """Return the distances to the ground for particles of that spacing [m], around the middle of its box.

        Raises `WavetankError` where the grid would be too large.
        """
        from wavetank.solids.ground.outline import measure_outline  # kernels
        from wavetank.solids.meshes.grid import measure

        size = self._edges()
        heights, bottom, name = self.elevations() * size[1], self._bottom(), self.name or "the height field"
        digest = hashlib.sha256(heights.tobytes()).hexdigest()
        key = f"heights {digest} {heights.shape} {size} {bottom} {spacing}"
        if len(size) == 2:
            line = np.column_stack([np.linspace(-0.5, 0.5, len(heights)) * size[0], heights])
            ends = [(line[-1, 0], bottom), (line[0, 0], bottom)]
            return grid_of(key, lambda: measure_outline(np.concatenate([line, ends]), spacing, name))
        points, faces = surface(heights, (size[0], size[-1]), bottom)
        points -= 0.5 * (points.min(axis=0) + points.max(axis=0))
        return grid_of(key, lambda: measure(points, faces, spacing, None, name))


def surface(heights: np.ndarray, edges: tuple[float, float], bottom: float) -> tuple[np.ndarray, np.ndarray]:
    """Return vertices [n, 3], m, and faces [m, 3] of ground with these heights [rows, columns], m, over `edges` [m]."""
    rows, columns = heights.shape
    z, x = np.meshgrid(
        np.linspace(-0.5, 0.5, rows) * edges[1], np.linspace(-0.5, 0.5, columns) * edges[0], indexing="ij"
    )
    top = np.stack([x, heights, z], axis=-1).reshape(-1, 3)
    number = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = (part.reshape(-1) for part in (number[:-1, :-1], number[:-1, 1:], number[1:, :-1], number[1:, 1:]))
    faces = [np.column_stack([a, c, b]), np.column_stack([b, c, d])]
    # Around the rim, seen from above against the clock, walls down to the bottom and a fan below.
    rim = np.concatenate([number[:, 0], number[-1, 1:], number[-2::-1, -1], number[0, -2:0:-1]])
    below = top[rim] * (1.0, 0.0, 1.0) + (0.0, bottom, 0.0)
    low = len(top) + np.arange(len(rim))
    after, low_after, middle = np.roll(rim, -1), np.roll(low, -1), np.full(len(rim), len(top) + len(rim))
    faces += [np.column_stack([rim, low, after]), np.column_stack([after, low, low_after])]
    faces += [np.column_stack([low_after, low, middle])]
    return np.concatenate([top, below, [(0.0, bottom, 0.0)]]), np.concatenate(faces)


def read_heights(name: str, folder: Path) -> np.ndarray:
    """Return the heights in a file, or in a bundled one, as in wavetank/valley.png."""
    if name.startswith(BUNDLED):
        with importlib.resources.as_file(
            importlib.resources.files("wavetank.solids") / "models" / name.removeprefix(BUNDLED)
        ) as path:
            return _read(path)
    return _read(folder / name)


def _read(path: Path) -> np.ndarray:
    """Return the heights in a file; raises `ValueError` with one sentence for a file that cannot be read."""
    if not path.exists():
        raise ValueError(f"there is no file of heights {path}.")
    if path.suffix.lower() not in (".npy", *PICTURES):
        raise ValueError(f"{path}: heights are read from .npy, {', '.join(PICTURES)} files; convert this one.")
    try:
        file = open_regular(path, LARGEST_FILE, "file of heights")
    except WavetankError as error:
        raise ValueError(str(error)) from None
    try:
        if path.suffix.lower() == ".npy":
            with file:
                return np.asarray(read_array(file, os.fstat(file.fileno()).st_size, f"{path}", "it"), np.float64)
        from PIL import Image

        with file, Image.open(file) as picture:
            if picture.width * picture.height > MOST_HEIGHTS:
                raise ValueError(
                    f"it has {picture.width} x {picture.height} pixels; at most {MOST_HEIGHTS:,} are allowed"
                )
            deep = picture.mode in ("I", "I;16", "I;16B", "I;16L", "I;16N", "F")
            values = np.asarray(picture if deep else picture.convert("L"), np.float64)
            return values if picture.mode == "F" else values / (65535.0 if deep else 255.0)
    except Exception as error:  # a damaged file fails in as many ways as there are formats
        reason = (str(error) or type(error).__name__).splitlines()[0].rstrip(".")
        raise ValueError(f"{path}: these heights cannot be read: {reason}.") from None


def _text(heights: np.ndarray) -> str:
    """Return heights as text for `_heights`."""
    file = io.BytesIO()
    np.savez_compressed(file, heights=heights.astype(np.float32))
    return base64.b64encode(file.getvalue()).decode("ascii")


@functools.lru_cache(maxsize=8)
def _heights(text: str) -> np.ndarray:
    wrong = "data does not hold the heights of a saved scene; give heights or path instead"
    try:
        return np.asarray(unpack_text(base64.b64decode(text, validate=True), wrong)["heights"], np.float64)
    except (binascii.Error, ValueError, KeyError):
        raise ValueError(f"{wrong}.") from None
    except WavetankError as error:
        raise ValueError(str(error)) from None

"""Triangles on the host: checked, of unit size, and as text that a scene file can hold."""

import base64
import binascii
import dataclasses
import hashlib
import io
from typing import Any

import numpy as np

from wavetank.foundation.errors import WavetankError
from wavetank.foundation.input_limits import unpack_text

MOST_TRIANGLES = 1_000_000


def volume_within(vertices: np.ndarray, faces: np.ndarray) -> float:
    """Return the volume that a closed surface encloses, by the divergence theorem; less than 0 if inside out.

    Vertices [n, 3], and faces [m, 3] that are counter-clockwise from outside; parts that overlap count twice.
    """
    a, b, c = (vertices[faces[:, k]].astype(np.float64) for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0


@dataclasses.dataclass(frozen=True)
class Triangles:
    """A surface around the origin whose longest edge along an axis is 1, turned so that its signed volume is > 0."""

    vertices: np.ndarray  # float32 [n, 3]
    faces: np.ndarray  # int32 [m, 3]: counter-clockwise from outside

    @classmethod
    def of(cls, vertices: Any, faces: Any, origin: str) -> "Triangles":
        """Return the surface of these arrays, [n, 3] each; raises `ValueError`, with `origin` in front, for others."""
        try:
            points, corners = np.asarray(vertices, np.float64), np.asarray(faces, np.int64)
        except (TypeError, ValueError):
            raise ValueError(f"{origin}: vertices and faces must be arrays of numbers [n, 3].") from None
        for name, array in (("vertices", points), ("faces", corners)):
            if array.size and (array.ndim != 2 or array.shape[1] != 3):
                raise ValueError(f"{origin}: {name} have shape {list(array.shape)}; they must be [n, 3].")
        if not corners.size or not points.size:
            raise ValueError(f"{origin} has no faces; a solid needs a surface of triangles, points are not enough.")
        if len(corners) > MOST_TRIANGLES:
            raise ValueError(
                f"{origin} has {len(corners):,} triangles; at most {MOST_TRIANGLES:,} are allowed: simplify it, "
                "details below half a spacing are lost anyway."
            )
        if corners.min() < 0 or corners.max() >= len(points):
            raise ValueError(
                f"{origin}: its faces name the vertices {int(corners.min())} to {int(corners.max())}; "
                f"there are 0 to {len(points) - 1}."
            )
        used, corners = np.unique(corners, return_inverse=True)
        points, corners = points[used], corners.reshape(-1, 3)
        bad = ~np.isfinite(points).all(axis=1)
        if bad.any():
            raise ValueError(f"{origin}: vertex {int(used[np.argmax(bad)])} is not finite; every number must be.")
        lower, upper = points.min(axis=0), points.max(axis=0)
        longest = float((upper - lower).max())
        if not 0.0 < longest < 1e30:
            raise ValueError(
                f"{origin} has the size {longest:g}; its vertices must span a box, not a point or beyond 1e30."
            )
        small = ((points - 0.5 * (lower + upper)) / longest).astype(np.float32)
        first, place = _first_of_equals(small)  # seams of textures and STL repeat vertices
        small, corners = small[first], _without_repeats(place[corners].astype(np.int32))
        a, b, c = (small[corners[:, k]].astype(np.float64) for k in range(3))
        if np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() < 1e-9:
            raise ValueError(f"{origin} has only faces without an area; a solid needs a surface of triangles.")
        if np.einsum("ij,ij->", a, np.cross(b, c)) < 0.0:
            corners = corners[:, ::-1]
        return cls(small, np.ascontiguousarray(corners))

    @property
    def digest(self) -> str:
        """Return a hash of this surface."""
        return hashlib.sha256(self.vertices.tobytes() + b"|" + self.faces.tobytes()).hexdigest()

    def text(self) -> str:
        """Return this as text for `from_text`."""
        file = io.BytesIO()
        np.savez_compressed(file, vertices=self.vertices, faces=self.faces)
        return base64.b64encode(file.getvalue()).decode("ascii")

    @classmethod
    def from_text(cls, text: str, origin: str) -> "Triangles":
        """Read what `text` wrote; raises `ValueError` for anything else."""
        wrong = f"{origin}: data is not a mesh that a saved scene holds; give path instead"
        try:
            arrays = unpack_text(base64.b64decode(text, validate=True), wrong)
            vertices, faces = arrays["vertices"], arrays["faces"]
        except (binascii.Error, ValueError, KeyError):
            raise ValueError(f"{wrong}.") from None
        except WavetankError as error:
            raise ValueError(str(error)) from None
        if len(faces) > MOST_TRIANGLES or len(vertices) > 3 * MOST_TRIANGLES:
            raise ValueError(f"{origin} has {len(faces):,} triangles; at most {MOST_TRIANGLES:,} are allowed.")
        return cls.of(vertices, faces, origin)


def _without_repeats(corners: np.ndarray) -> np.ndarray:
    """Drop faces without an area and second copies of the same face."""
    a, b, c = corners.T
    corners = corners[(a != b) & (b != c) & (c != a)]
    lowest, rows = corners.argmin(axis=1), np.arange(len(corners))
    turned = np.stack([corners[rows, (lowest + k) % 3] for k in range(3)], axis=1)
    return turned[np.sort(_first_of_equals(turned)[0])]


def _first_of_equals(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where the different ones of the `rows` [n, 3] come first, [m], and the number of each row among them, [n]."""
    order = np.lexsort(rows.T)
    ordered = rows[order]
    new = np.concatenate([np.ones(min(len(rows), 1), bool), (ordered[1:] != ordered[:-1]).any(axis=1)])
    place = np.empty(len(rows), np.int64)
    place[order] = np.cumsum(new) - 1
    return order[new], place

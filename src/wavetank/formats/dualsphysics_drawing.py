"""What the commands of a DualSPHysics case draw: boxes, balls, cylinders and meshes, in their order.

GenCase, their tool that reads a case, keeps a state while it draws: what is drawn (fluid, bound or void) with which
number (mk), and a matrix that moves it. Numbers may be expressions of `Dp` and of variables (`#Dp*2`).
"""

import dataclasses
import functools
import math
import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np

from wavetank.formats.splishsplash_solids import Solids, arrays_of
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.expressions import Expression
from wavetank.foundation.input_limits import one_line
from wavetank.foundation.rotations import unit_quaternion
from wavetank.solids.meshes.counted import MOST_FACES

MOST_ITEMS, DEEPEST, MOST_COMMANDS = 2000, 8, 20_000  # shapes; lists that run lists; commands
FACES = ("bottom", "top", "left", "right", "front", "back")  # -z, +z, -x, +x, -y, +y of theirs
_NAME = re.compile(r"[A-Za-z_][A-Za-z_0-9]*")
#: commands that say how something is drawn, shown or kept, which a shape of ours does not need to be told
_SILENT = {
    "setshapemode",
    "setdrawmode",
    "shapeout",
    "resetdraw",
    "setdpctes",
    "dpctessave",
    "dpctesload",
    "dpctesreset",
    "setactive",
    "setboxlimitmode",
    "setnormalinvert",
    "debugout",
    "cellsout",
    "pointsmkout",
    "printf",
    "exportvar",
    "setfrdrawmode",
    "delvar",
    "newvarstr",
    "newvarstrcte",
    "setvarstr",
    "varssave",
    "varsload",
    "list",
}


@dataclasses.dataclass(frozen=True)
class Item:
    """A shape that was drawn, in their axes."""

    what: str  # fluid, bound or void
    mk: int
    shape: str  # box, sphere, cylinder or mesh
    points: np.ndarray  # [m], [n, 3]: lower and upper corner, center, ends of the axis, or vertices; before the matrix
    matrix: np.ndarray  # [4, 4]
    radius: float = 0.0  # m
    faces: Any = None  # names of the faces of a box that consists of its faces; triangles [m, 3] of a mesh
    is_filling: bool = False  # whether it fills what is free in a box

    @property
    def is_straight(self) -> bool:
        """Whether the matrix does not turn it."""
        return bool(np.allclose(self.matrix[:3, :3], np.diag(np.diag(self.matrix[:3, :3])), atol=1e-9))

    def corners(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the corners of the box along the axes that holds it [m], each [3]."""
        return self._corners

    @functools.cached_property
    def _corners(self) -> tuple[np.ndarray, np.ndarray]:
        points = self.points
        if self.shape == "box":
            points = np.array([[self.points[k >> axis & 1, axis] for axis in range(3)] for k in range(8)])
        placed = points @ self.matrix[:3, :3].T + self.matrix[:3, 3]
        way = self.radius * self.scale
        return placed.min(axis=0) - way, placed.max(axis=0) + way

    @property
    def scale(self) -> float:
        """How much larger the matrix makes it."""
        return float(abs(np.linalg.det(self.matrix[:3, :3])) ** (1.0 / 3.0))

    def turn(self) -> np.ndarray:
        """Return the unit quaternion (w, x, y, z) of the matrix: Bar-Itzhack 2000, 10.2514/2.4654."""
        rows = self.matrix[:3, :3] / max(self.scale, 1e-12)
        skew = np.array([rows[2, 1] - rows[1, 2], rows[0, 2] - rows[2, 0], rows[1, 0] - rows[0, 1]])
        table = np.zeros((4, 4))
        table[0, 0], table[0, 1:], table[1:, 0] = np.trace(rows), skew, skew
        table[1:, 1:] = rows + rows.T - np.trace(rows) * np.eye(3)
        return unit_quaternion(np.linalg.eigh(table)[1][:, -1].tolist())


def meeting(item: Item, others: Sequence[Item]) -> np.ndarray:
    """Return which of the others reach into the box that holds an item, bool [n]."""
    corners = np.array([other.corners() for other in others]).reshape(-1, 2, 3)
    lower, upper = item.corners()
    overlaps = (corners[:, 0] < upper - 1e-9) & (corners[:, 1] > lower + 1e-9)
    return np.all(overlaps, axis=1)


class Drawing:
    """Runs the commands of a case; raises `WavetankError` for numbers that it cannot read."""

    def __init__(self, path: Path, geometry: Element, dp: float, notes: list[str]) -> None:
        self.path, self.notes = path, notes
        self.items: list[Item] = []
        self.variables = {"Dp": dp}
        self.what, self.mk, self.matrix = "void", 0, np.eye(4)
        self._kept: list[Any] = []
        self._left, self._faces = MOST_COMMANDS, 0  # commands that may come; triangles so far
        self._meshes: dict[str, tuple[np.ndarray, np.ndarray]] = {}  # by the names of their files
        for row in geometry.findall("predefinition/*"):
            self._run(row, 0)
        commands = geometry.find("commands")
        self.lists = {row.get("name", ""): row for row in commands.findall("list")} if commands is not None else {}
        for row in commands.findall("mainlist/*") if commands is not None else ():
            self._run(row, 0)

    def number(self, text: str) -> float:
        """Return the number that a text means."""
        try:
            value = float(text)
        except ValueError:
            plain = text.strip().lstrip("#").replace("pi()", "pi")
            known = _NAME.sub(lambda m: repr(self.variables[m[0]]) if m[0] in self.variables else m[0], plain)
            value = Expression(known)(0.0)
        if not math.isfinite(value):
            raise WavetankError(f"{one_line(text, 60)} is not a finite number.")
        return value

    def vector(self, row: Element | None, usual: float = 0.0) -> np.ndarray:
        """Return x, y, z of a tag, float [3]."""
        return np.array([usual if row is None else self.number(row.get(axis, str(usual))) for axis in "xyz"])

    def _charge(self, depth: int) -> None:
        """Count a command, or a repetition of a list; raises `WavetankError` beyond what a case may draw."""
        self._left -= 1
        if self._left < 0 or depth > DEEPEST or len(self.items) > MOST_ITEMS or self._faces > MOST_FACES:
            raise WavetankError(
                f"it draws too much; at most {MOST_COMMANDS:,} commands, {MOST_ITEMS:,} shapes, {MOST_FACES:,} "
                f"triangles and lists in lists {DEEPEST} deep are allowed."
            )

    def _run(self, row: Element, depth: int) -> None:
        """Run a command, `depth` lists deep: a change of what is drawn next, a list, or a shape."""
        self._charge(depth)
        tag = str(row.tag)
        if tag in _CHANGES:
            _CHANGES[tag](self, row)
        elif tag == "runlist":
            self._run_list(row, depth)
        elif tag not in _SILENT and row.get("active", "true") not in ("false", "0"):
            try:
                self._draw(tag, row)
            except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError):
                raise WavetankError(f"<{one_line(tag, 40)}> lacks points or numbers that it needs") from None

    def _set_variables(self, row: Element) -> None:
        for name, text in row.attrib.items():
            if not name.startswith("_"):
                self.variables[name] = self.number(text)

    def _set_mk(self, row: Element) -> None:
        self.what = str(row.tag).removeprefix("setmk")
        self.mk = 0 if self.what == "void" else int(self.number(row.get("mk", "0")))

    def _transform(self, row: Element) -> None:
        self.matrix = np.eye(4) if row.tag == "matrixreset" else self.matrix @ self._moved(row)

    def _save(self, row: Element) -> None:
        self._kept.append((self.what, self.mk) if row.tag == "mksave" else self.matrix)

    def _run_list(self, row: Element, depth: int) -> None:
        """Run the commands of a named list, as many times as it says."""
        for _ in range(int(self.number(row.get("times", "1")))):
            self._charge(depth)
            for part in self.lists.get(row.get("name", ""), ()):
                self._run(part, depth + 1)

    def _load(self, row: Element) -> None:
        """Take back the matrix that was saved last, or else what was drawn with which mk; keep it if none was saved."""
        is_matrix = row.tag == "matrixload"
        saved = [k for k, kept in enumerate(self._kept) if isinstance(kept, np.ndarray) == is_matrix]
        if saved and is_matrix:
            self.matrix = self._kept.pop(saved[-1])
        elif saved:
            self.what, self.mk = self._kept.pop(saved[-1])

    def _moved(self, row: Element) -> np.ndarray:
        """Return the matrix [4, 4] of a command that moves, scales or turns."""
        matrix = np.eye(4)
        if row.tag == "move":
            matrix[:3, 3] = self.vector(row)
        elif row.tag == "scale":
            matrix[:3, :3] = np.diag(self.vector(row, 1.0))
        else:
            start, end = np.zeros(3), self.vector(row)
            if row.tag == "rotateline":
                start, end = (self.vector(point) for point in row.findall("point")[:2])
            matrix[:3, :3] = turning(end - start, math.radians(self.number(row.get("ang", "0"))))
            matrix[:3, 3] = start - matrix[:3, :3] @ start
        return matrix

    def _draw(self, tag: str, row: Element) -> None:
        points = [self.vector(point) for point in row.findall("point")]
        if tag in ("drawbox", "fillbox"):
            size, end = row.find("size"), row.find("endpoint")
            other = points[0] + self.vector(size) if size is not None else self.vector(end)
            corners = np.sort([points[0], other], axis=0)
            mode = (row.findtext("boxfill") or "solid").replace(" ", "").lower()
            faces = None if mode == "solid" or tag == "fillbox" else _faces_of(mode)
            self._add("box", corners, faces=faces, is_filling=tag == "fillbox")
        elif tag == "drawsphere":
            self._add("sphere", np.array(points[:1]), radius=self.number(row.get("radius", "")))
        elif tag == "drawcylinder":
            self._add("cylinder", np.array(points[:2]), radius=self.number(row.get("radius", "")))
        elif tag in ("drawfilestl", "drawfileply"):
            self._add_file(row)
        elif tag in ("drawprism", "drawpyramid", "drawfigure"):
            self._add_figure(tag, row)
        else:
            self.notes.append(f"<{one_line(tag, 40)}> has no counterpart; it is left out.")

    def _add(self, shape: str, points: np.ndarray, **rest: Any) -> None:
        item = Item(self.what, self.mk, shape, points, self.matrix.copy(), **rest)
        item.corners()  # raises where points are missing
        self.items.append(item)

    def _add_file(self, row: Element) -> None:
        name = row.get("file", "")
        if name not in self._meshes:
            self._meshes[name] = arrays_of(Solids.find_file(self.path, name))
        vertices, faces = self._meshes[name]
        self._faces += len(faces)
        vertices = vertices * self.vector(row.find("drawscale"), 1.0)
        turns = row.find("drawrotate")
        angles = {} if turns is None else turns.attrib
        for axis, name in enumerate("xyz"):
            angle = math.radians(self.number(angles.get(f"ang{name}", "0")))
            vertices = vertices @ turning(np.eye(3)[axis], angle).T
        self._add("mesh", vertices + self.vector(row.find("drawmove")), faces=faces)

    def _add_figure(self, tag: str, row: Element) -> None:
        """A prism has two ends of as many points, a pyramid a top and a base; a figure has triangles."""
        points = np.array([self.vector(point) for point in row.iter("point")])
        if tag == "drawfigure":
            triangles = [[int(self.number(t.get(axis, "0"))) for axis in "xyz"] for t in row.iter("triangle")]
            faces = np.array(triangles, np.int64).reshape(-1, 3)
            if len(faces) and (faces.min() < 0 or faces.max() >= len(points)):
                raise WavetankError("a triangle of <drawfigure> names a point that it does not have.")
        elif tag == "drawprism":
            n = len(points) // 2
            sides = [(k, (k + 1) % n, n + (k + 1) % n, n + k) for k in range(n)]
            faces = _triangles([tuple(range(n))[::-1], tuple(range(n, 2 * n)), *sides])
        else:
            n = len(points)
            faces = _triangles([tuple(range(1, n))[::-1], *((0, k, k % (n - 1) + 1) for k in range(1, n))])
        if not len(faces):
            raise WavetankError(f"<{tag}> has no triangles; it needs more points.")
        self._add("mesh", points, faces=faces)


#: Commands that change what is drawn next and how, by their tags.
_CHANGES: dict[str, Callable[[Drawing, Element], None]] = {
    **dict.fromkeys(("newvar", "newvarcte", "setvar"), Drawing._set_variables),
    **dict.fromkeys(("setmkvoid", "setmkfluid", "setmkbound"), Drawing._set_mk),
    **dict.fromkeys(("move", "scale", "rotate", "rotateline", "matrixreset"), Drawing._transform),
    **dict.fromkeys(("mksave", "matrixsave"), Drawing._save),
    **dict.fromkeys(("mkload", "matrixload"), Drawing._load),
}


def _faces_of(mode: str) -> tuple[str, ...]:
    names = mode.split("|")
    return FACES if "all" in names else tuple(name for name in FACES if name in names)


def _triangles(polygons: Sequence[tuple[int, ...]]) -> np.ndarray:
    """Return fans over convex polygons, int64 [m, 3]."""
    fans = [(face[0], face[k], face[k + 1]) for face in polygons for k in range(1, len(face) - 1)]
    return np.array(fans, np.int64).reshape(-1, 3)


def turning(axis: np.ndarray, angle: float) -> np.ndarray:
    """Return the matrix [3, 3] that turns by `angle` [rad] about an axis (Rodrigues); no axis turns nothing."""
    length = float(np.linalg.norm(axis))
    if length == 0.0:
        return np.eye(3)
    x, y, z = axis / length
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * (cross @ cross)


def numbers_of(text: str) -> Iterator[int]:
    """Yield the numbers of a list as theirs, "1,4-6", at most `MOST_ITEMS`."""
    left = MOST_ITEMS
    for part in text.split(","):
        first, _, last = part.strip().partition("-")
        if first.isdecimal() and left > 0:
            numbers = range(int(first), min(int(last) if last.isdecimal() else int(first), int(first) + left - 1) + 1)
            left -= len(numbers)
            yield from numbers

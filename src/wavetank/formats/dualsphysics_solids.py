"""The bound of a DualSPHysics case as solids, see `dualsphysics.py`: still, moved by themselves, or bodies."""

import dataclasses
import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from wavetank.formats.dualsphysics_drawing import FACES, Item, meeting
from wavetank.formats.dualsphysics_motion import RATE, Course
from wavetank.formats.splishsplash_solids import is_closed, section
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.rotations import inverse, product
from wavetank.solids.ground.polygon import Polygon
from wavetank.solids.meshes.mesh import Mesh
from wavetank.solids.motion import Motion
from wavetank.solids.shapes import Box, Cylinder, Sphere, Union
from wavetank.solids.solid import Solid

OURS = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # of their axes: z becomes y
STANDING = np.array([math.sqrt(0.5), -math.sqrt(0.5), 0.0, 0.0])  # the same as a quaternion
FACE_AXES = {"left": 0, "right": 0, "front": 1, "back": 1, "bottom": 2, "top": 2}
WALL = 2.0  # spacings: how thick a face becomes


@dataclasses.dataclass(frozen=True)
class Placed:
    """Makes solids of what was drawn."""

    dim: int
    spacing: float
    plane: float  # their y of a 2-D world [m]
    notes: list[str]

    def vector(self, theirs: np.ndarray) -> tuple[float, ...]:
        """Return a place or a way in our axes, with as many components as the world has."""
        return tuple(map(float, (OURS @ theirs)[: self.dim]))

    def turned(self, turn: np.ndarray) -> Any:
        """Return a rotation in their axes as one in ours; in a 2-D world its angle about z [rad]."""
        ours = product(product(STANDING, turn), inverse(STANDING))
        return (
            tuple(map(float, ours))
            if self.dim == 3
            else math.remainder(2.0 * math.atan2(float(ours[3]), float(ours[0])), math.tau)
        )

    def shapes(self, item: Item, name: str, **fields: Any) -> Iterator[Solid]:
        """Yield the solids that an item is in this world: none where a 2-D one does not meet it."""
        center = item.matrix[:3, :3] @ item.points.mean(axis=0) + item.matrix[:3, 3]
        lower, upper = item.corners()
        if self.dim == 2 and not lower[1] - 1e-9 <= self.plane <= upper[1] + 1e-9:
            return
        if item.shape == "box":
            size = np.abs(OURS @ (np.diff(item.points, axis=0)[0] * np.linalg.norm(item.matrix[:3, :3], axis=0)))
            size = np.maximum(size, WALL * self.spacing)[: self.dim]
            turn = {} if item.is_straight else {"rotation": self.turned(item.turn())}
            yield Box(name=name, center=self.vector(center), size=tuple(map(float, size)), **turn, **fields)
        elif item.shape == "sphere":
            yield Sphere(name=name, center=self.vector(center), radius=item.radius * item.scale, **fields)
        elif item.shape == "cylinder":
            ends = item.points @ item.matrix[:3, :3].T + item.matrix[:3, 3]
            radius = item.radius * item.scale
            if self.dim == 3:
                yield Cylinder(name=name, start=self.vector(ends[0]), end=self.vector(ends[1]), radius=radius, **fields)
            elif np.ptp(ends[:, [0, 2]], axis=0).max() < 1e-9:
                yield Sphere(name=name, center=self.vector(center), radius=radius, **fields)
            else:
                self.notes.append(f"{name}: a cylinder that does not stand on the plane of a 2-D case is left out.")
        else:
            yield from self._mesh(item, name, fields)

    def _mesh(self, item: Item, name: str, fields: dict[str, Any]) -> Iterator[Solid]:
        shift = item.matrix[:3, 3] - ([0.0, self.plane, 0.0] if self.dim == 2 else 0.0)
        placed = (item.points @ item.matrix[:3, :3].T + shift) @ OURS.T
        if self.dim == 2:
            for loop in section(placed, item.faces):
                yield Polygon(name=name, points=[(float(x), float(y)) for x, y in loop], **fields)
            return
        thickness: dict[str, Any] = {}
        if not is_closed(item.faces):
            thickness = {"thickness": WALL * self.spacing}
            self.notes.append(f"{name}: its surface is not closed; it becomes walls two particles thick.")
        middle = tuple(map(float, 0.5 * (placed.min(axis=0) + placed.max(axis=0))))
        yield Mesh.of(
            placed,
            item.faces,
            name=name,
            center=middle,
            size=float(np.ptp(placed, axis=0).max()),
            **thickness,
            **fields,
        )

    def faces(self, item: Item) -> Iterator[Item]:
        """Yield the faces of a box as boxes that lie outside of it."""
        for face in item.faces:
            points, axis = item.points.copy(), FACE_AXES[face]
            is_upper = face in ("top", "right", "back")
            points[1 - is_upper, axis] = points[int(is_upper), axis]
            points[int(is_upper), axis] += (1.0 if is_upper else -1.0) * WALL * self.spacing
            yield dataclasses.replace(item, points=points, faces=None)


def placed_solids(
    items: list[Item],
    fluids: list[Item],
    bodies: dict[int, dict[str, Any]],
    courses: dict[int, Course],
    seconds: float,
    place: Placed,
) -> list[Solid]:
    """Return the solids of these items: those of a mk that moves or floats as one."""
    found: list[Solid] = []
    for mk in dict.fromkeys(item.mk for item in items):
        parts = _solids_of(mk, items, fluids, place)
        if len(parts) > 1 and (mk in bodies or mk in courses):
            parts = [Union(name=f"mk {mk}", parts=[part.model_copy(update={"name": ""}) for part in parts])]
        fields = {**bodies.get(mk, {})}
        if parts and mk in courses:
            fields["motion"] = _motion(parts[0], courses[mk], seconds, place)
        for number, solid in enumerate(parts):
            name = _name_of(mk, number)
            kept = {key: getattr(solid, key) for key in solid.model_fields_set if key != "name"}
            found.append(type(solid).model_validate({**kept, "name": name, **fields}))
    return found


def _name_of(mk: int, number: int) -> str:
    return f"mk {mk}, {number + 1}" if number else f"mk {mk}"


def _solids_of(mk: int, items: list[Item], fluids: list[Item], place: Placed) -> list[Solid]:
    """Return the solids of the items with that mk, one by one; boxes that hold fluids are their faces."""
    parts: list[Solid] = []
    for item in items:
        if item.mk == mk:
            pieces = _pieces(item, fluids, place)
            parts += [solid for piece in pieces for solid in place.shapes(piece, _name_of(mk, len(parts)))]
    return parts


def _pieces(item: Item, fluids: list[Item], place: Placed) -> Iterator[Item]:
    """Yield what is solid: a box that is but its faces is whole where it is closed and holds no fluid."""
    if item.shape != "box" or not item.faces:
        yield item
        return
    holds = bool(meeting(item, fluids).any())
    sides = [f for f in FACES if place.dim == 3 or f not in ("front", "back")]
    if not holds and len([f for f in sides if f not in item.faces]) <= 1:
        yield dataclasses.replace(item, faces=None)
    else:
        yield from place.faces(item)


def _motion(solid: Solid, course: Course, seconds: float, place: Placed) -> Motion:
    """Return the motion of a solid whose every point moves by the course, sampled up to the end of the case."""
    at_rest, theirs = np.append(OURS.T @ solid.origin, 1.0), solid.quaternion
    turns = any(not np.allclose(course(k / 20.0 * seconds)[:3, :3], np.eye(3), atol=1e-9) for k in range(21))
    before = 0.0

    def at(time: float) -> tuple[Any, Any]:
        nonlocal before
        matrix = course(time)
        position = place.vector((matrix @ at_rest)[:3])
        if not turns:
            return position, None
        turned = place.turned(Item("", 0, "", at_rest[None, :3], matrix).turn())
        if place.dim == 3:
            return position, tuple(map(float, product(np.array(turned), theirs)))
        angle = turned + 2.0 * math.atan2(float(theirs[3]), float(theirs[0]))
        before = angle + math.tau * round((before - angle) / math.tau)  # of any number of turns
        return position, before

    motion = Motion.sampled(at, seconds, RATE)
    if not motion.keyframes:
        raise WavetankError("a motion has no time to happen; TimeMax must be above 0 s.")
    return motion

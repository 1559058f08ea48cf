"""Solids as plain data: shapes, and set operations between them.

A shape is one model here with its `program`, and one distance function in `distance.py`.
"""

from collections.abc import Sequence
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator
from typing_extensions import override

from wavetank.foundation.model import Edges, Length, Place, Vector, register_model
from wavetank.foundation.rotations import turn_from_y, unit_quaternion
from wavetank.solids.ground.height_field import HeightField
from wavetank.solids.ground.polygon import Polygon
from wavetank.solids.meshes.mesh import Mesh
from wavetank.solids.solid import ENDLESS, Code, Node, Solid, point_in_space


def moved(solid: Solid, position: np.ndarray, rotation: np.ndarray) -> Solid:
    """Return the same solid with its frame at `position` [m], shape [3], turned by the quaternion `rotation`."""
    shift = position - solid.origin
    keys = [name for name in ("center", "start", "end", "point") if name in type(solid).model_fields]
    places = {name: tuple(float(a + b) for a, b in zip(getattr(solid, name), shift, strict=False)) for name in keys}
    result: Solid = type(solid).model_validate(
        {
            **{name: getattr(solid, name) for name in type(solid).model_fields},
            **places,
            "rotation": tuple(map(float, unit_quaternion([*rotation]))),
        }
    )
    return result


#: What makes a body of a solid, and moves it, as it is without.
STILL = {
    "name": "",
    "density": None,
    "mass": None,
    "hollow": False,
    "held": False,
    "velocity": None,
    "angular_velocity": None,
    "motion": None,
}


def still(solid: Solid) -> Solid:
    """Return the same solid without a name, as one that nothing moves."""
    return solid.model_copy(update=STILL)


class Box(Solid):
    """A box; in a 2-D world a rectangle."""

    shape: Literal["box"] = "box"
    center: Place
    size: Edges

    @property
    @override
    def origin(self) -> np.ndarray:
        return point_in_space(self.center)

    @override
    def program(self) -> list[Node]:
        half = [0.5 * edge for edge in self.size]
        return [Node(Code.BOX, half if len(half) == 3 else [*half, ENDLESS])]

    @override
    def reach(self) -> float:
        return 0.5 * float(np.linalg.norm(self.size))

    def corners(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Return the lower and the upper corner [m], float64 [dim]; None of a box that is turned."""
        if not np.array_equal(self.quaternion, (1.0, 0.0, 0.0, 0.0)):
            return None
        center, half = np.array(self.center, float), 0.5 * np.array(self.size, float)
        return center - half, center + half

    @override
    def vectors(self) -> list[tuple[str, Sequence[float]]]:
        return [("center", self.center), ("size", self.size)]


class Sphere(Solid):
    """A ball; in a 2-D world a disc."""

    shape: Literal["sphere"] = "sphere"
    center: Place
    radius: Length

    @property
    @override
    def origin(self) -> np.ndarray:
        return point_in_space(self.center)

    @override
    def program(self) -> list[Node]:
        return [Node(Code.SPHERE, [self.radius])]

    @override
    def reach(self) -> float:
        return self.radius

    @override
    def vectors(self) -> list[tuple[str, Sequence[float]]]:
        return [("center", self.center)]


class _Axial(Solid):
    start: Place
    end: Place
    radius: Length

    @model_validator(mode="after")
    def _has_length(self) -> "_Axial":
        if len(self.start) != len(self.end):
            raise ValueError(f"start = {self.start} and end = {self.end} must have the same number of components.")
        return self

    @property
    def origin(self) -> np.ndarray:
        return 0.5 * (point_in_space(self.start) + point_in_space(self.end))

    def _node(self, op: int) -> Node:
        axis = point_in_space(self.end) - point_in_space(self.start)
        return Node(op, [self.radius, 0.5 * float(np.linalg.norm(axis))], turn=turn_from_y(axis))

    def vectors(self) -> list[tuple[str, Sequence[float]]]:
        return [("start", self.start), ("end", self.end)]


class Capsule(_Axial):
    """All points within `radius` of the segment from `start` to `end`."""

    shape: Literal["capsule"] = "capsule"

    @override
    def program(self) -> list[Node]:
        return [self._node(Code.CAPSULE)]

    @override
    def reach(self) -> float:
        return 0.5 * float(np.linalg.norm(point_in_space(self.end) - point_in_space(self.start))) + self.radius


class Cylinder(_Axial):
    """A round cylinder between the centres `start` and `end` of its two faces."""

    shape: Literal["cylinder"] = "cylinder"

    @override
    def program(self) -> list[Node]:
        return [self._node(Code.CYLINDER)]

    @override
    def reach(self) -> float:
        return float(np.hypot(0.5 * np.linalg.norm(point_in_space(self.end) - point_in_space(self.start)), self.radius))


class HalfSpace(Solid):
    """All points below a plane through `point`; `normal` points out of the solid, into the water."""

    shape: Literal["half-space"] = "half-space"
    point: Place
    normal: Vector

    @model_validator(mode="after")
    def _has_direction(self) -> "HalfSpace":
        if not any(self.normal):
            raise ValueError(f"normal = {self.normal} has no direction; give a vector of any length but zero.")
        return self

    @property
    @override
    def origin(self) -> np.ndarray:
        return point_in_space(self.point)

    @override
    def program(self) -> list[Node]:
        return [Node(Code.HALF_SPACE, turn=turn_from_y(point_in_space(self.normal)))]

    @override
    def reach(self) -> float:
        return ENDLESS

    @override
    def vectors(self) -> list[tuple[str, Sequence[float]]]:
        return [("point", self.point), ("normal", self.normal)]


class _SetOperation(Solid):
    center: Place = (0.0, 0.0, 0.0)
    parts: Annotated[list["AnySolid"], Field(min_length=2)]

    @model_validator(mode="after")
    def _moves_as_a_whole(self) -> "_SetOperation":
        if any(part.motion is not None for part in self.parts):
            raise ValueError("parts of a solid cannot have a motion of their own; give the motion to the whole solid.")
        return self

    @property
    def origin(self) -> np.ndarray:
        return point_in_space(self.center)

    @property
    def is_spatial(self) -> bool:
        return any(part.is_spatial for part in self.parts)

    def _combine(self, op: int) -> list[Node]:
        nodes: list[Node] = []
        for number, part in enumerate(self.parts):
            nodes += [node.placed(part.origin, part.quaternion) for node in part.program()]
            if number:
                nodes.append(Node(op))
        return nodes

    def reach(self) -> float:
        return max(float(np.linalg.norm(part.origin)) + part.reach() for part in self.parts)

    def vectors(self) -> list[tuple[str, Sequence[float]]]:
        own = [("center", self.center)] if any(self.center) else []  # the origin is valid in 2-D and 3-D
        return own + [
            (f"parts[{number}].{name}", vector)
            for number, part in enumerate(self.parts)
            for name, vector in part.vectors()
        ]


class Union(_SetOperation):
    """All points that are in any part. Parts are placed in the frame of the whole."""

    shape: Literal["union"] = "union"

    @override
    def program(self) -> list[Node]:
        return self._combine(Code.UNION)


class Intersection(_SetOperation):
    """All points that are in every part."""

    shape: Literal["intersection"] = "intersection"

    @override
    def program(self) -> list[Node]:
        return self._combine(Code.INTERSECTION)


class Difference(_SetOperation):
    """All points of the first part that are not in any other."""

    shape: Literal["difference"] = "difference"

    @override
    def program(self) -> list[Node]:
        return self._combine(Code.DIFFERENCE)

    @override
    def reach(self) -> float:
        return float(np.linalg.norm(self.parts[0].origin)) + self.parts[0].reach()


SHAPES: tuple[type[Solid], ...] = (
    Box,
    Sphere,
    Capsule,
    Cylinder,
    HalfSpace,
    Union,
    Intersection,
    Difference,
    Mesh,
    Polygon,
    HeightField,
)
AnySolid = Annotated[
    Box | Sphere | Capsule | Cylinder | HalfSpace | Union | Intersection | Difference | Mesh | Polygon | HeightField,
    Field(discriminator="shape"),
]
for _shape in SHAPES:
    _shape.model_rebuild()
    register_model(_shape.model_fields["shape"].default, _shape)

"""The base class of solids, and the nodes of their programs."""

from collections.abc import Sequence
from enum import IntEnum
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from wavetank.foundation.model import Model, Number, Positive, Quaternion, Vector
from wavetank.foundation.rotations import product, turned, unit_quaternion
from wavetank.solids.motion import AnyMotion, shorthand

Floats = Sequence[float] | np.ndarray
Rates = tuple[Number, Number, Number]
ENDLESS = 1.0e5  # m: half size of infinite shapes
AROUND = 4.0e5  # m: reach of a container, whose walls have no outside: pictures look through it at what it holds
GRIDS = 1 << 16  # the code of the first grid of distances, numbered as in `SolidSet.grid`; others follow


class Code(IntEnum):
    """What a node of a program is: a shape, by its number in `distance.shape_distance`, or a set operation."""

    DIFFERENCE = -3
    INTERSECTION = -2
    UNION = -1
    HALF_SPACE = 0
    BOX = 1
    SPHERE = 2
    CAPSULE = 3
    CYLINDER = 4


class Node:
    """One step of a solid's program: a shape with its pose, a grid of distances with its `mesh`, or a set operation."""

    def __init__(self, op: int, size: Floats = (), offset: Floats = (), turn: Floats = (), mesh: Any = None) -> None:
        self.op = op
        self.mesh = mesh
        self.size = np.zeros(4)
        self.size[: len(size)] = size
        self.offset = np.array(offset if len(offset) else (0.0, 0.0, 0.0), float)
        self.turn = np.array(turn if len(turn) else (1.0, 0.0, 0.0, 0.0), float)

    def placed(self, offset: np.ndarray, turn: np.ndarray) -> "Node":
        """Return this node as seen from a frame in which its own frame has that offset and turn."""
        return Node(self.op, self.size, offset + turned(turn, self.offset), product(turn, self.turn), self.mesh)


class Solid(Model):
    """The base class of solids: a name, a pose and a surface."""

    name: str = ""
    rotation: Quaternion | Number = (1.0, 0.0, 0.0, 0.0)  # (w, x, y, z), or an angle about z [rad]
    color: Annotated[str, Field(pattern=r"^(#[0-9a-fA-F]{6})?$")] = ""  # in pictures; the default one where empty
    finish: Literal["matte", "metal", "glass"] = "matte"  # metal in pictures of quality film only
    friction: Annotated[Number, Field(ge=0, le=1)] | None = None  # where None the scene's, or 0.5 between solids
    density: Positive | None = None  # kg/m^3: a density or a mass makes a solid a body that water moves
    mass: Positive | None = None  # kg, in a 2-D world of a metre's length of it
    hollow: bool = False  # whether its mass lies in its surface
    held: bool = False  # whether a body stays where it is (or is moved to) until it is let go
    velocity: Vector | None = None  # m/s, of a body's centre of mass at the start
    angular_velocity: Rates | Number | None = None  # rad/s, of a body at the start; about z where one number
    restitution: Annotated[Number, Field(ge=0, le=1)] = 0.2  # share of the speed that a body bounces back with

    motion: AnyMotion = None  # how it moves by itself; see `motion.py`

    @model_validator(mode="before")
    @classmethod
    def _expressed(cls, values: Any) -> Any:
        return shorthand(values, ("center", "point"))

    @model_validator(mode="after")
    def _is_body_or_not(self) -> "Solid":
        if self.density is not None and self.mass is not None:
            raise ValueError(f"a body has a density or a mass, not both; density = {self.density}, mass = {self.mass}.")
        if self.is_body and getattr(self, "invert", False):
            raise ValueError("a container that is all but its hollow has no mass; give a body walls instead of invert.")
        if self.is_body:
            return self
        for name in ("hollow", "held", "velocity", "angular_velocity"):
            if getattr(self, name):
                raise ValueError(f"{name} is for bodies; give this solid a density or a mass as well.")
        return self

    def stand(self, upright: np.ndarray) -> None:
        """Stand in a world that the matrix `upright` [3, 3] turns so that y is up; parts of a solid do as well."""
        for part in getattr(self, "parts", ()):
            part.stand(upright)

    @property
    def is_body(self) -> bool:
        """Whether water and other solids move this."""
        return self.density is not None or self.mass is not None

    @property
    def origin(self) -> np.ndarray:
        """Position of the solid's frame [m], shape [3]."""
        raise NotImplementedError

    @property
    def quaternion(self) -> np.ndarray:
        """Rotation of the solid's frame as a unit quaternion (w, x, y, z)."""
        return unit_quaternion(self.rotation)

    @property
    def is_spatial(self) -> bool:
        """Whether this needs a 3-D world."""
        return False

    def program(self) -> list[Node]:
        """Return the nodes of this solid in postfix order, in its own frame."""
        raise NotImplementedError

    def reach(self) -> float:
        """Radius [m] around the origin that holds the whole solid."""
        raise NotImplementedError

    def span(self) -> float:
        """Radius [m] around the origin that holds its surface; of a container, which is infinite, the hollow's."""
        return self.reach()

    def vectors(self) -> list[tuple[str, Sequence[float]]]:
        """Name every point or size of this solid, to check that all have the dimension of the world."""
        return []


def point_in_space(vector: Sequence[float]) -> np.ndarray:
    """Return a point of a 2-D or 3-D world as a point in space, shape [3]."""
    point = np.zeros(3)
    point[: len(vector)] = vector
    return point


def complement(nodes: list[Node]) -> list[Node]:
    """Return the program of the complement of the solid with the program `nodes`."""
    return [Node(Code.BOX, [ENDLESS] * 3), *nodes, Node(Code.DIFFERENCE)]

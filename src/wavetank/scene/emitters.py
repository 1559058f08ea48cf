"""Inlets: openings through which particles enter the world, row after row."""

import math
import re
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, field_validator, model_validator

from wavetank.foundation.model import METRES, Length, Number, Place, Positive, Vector
from wavetank.foundation.timed import Timed
from wavetank.scene.drains import LITRE
from wavetank.scene.gauges import Gauge
from wavetank.scene.inlets import Inlet, inlet_of, inlet_of_mesh
from wavetank.solids.meshes.mesh import Mesh
from wavetank.solids.motion import AnyMotion

#: shape -> the keys that say how large it is
NEEDS: dict[str, tuple[str, ...]] = {
    "disc": ("radius",),
    "ring": ("radius", "inner_radius"),
    "rectangle": ("size",),
    "line": ("width",),
    "mesh": ("mesh",),
}
SLACK = 1.001  # by how much a flow may exceed what the mouth passes, by rounding


class Emitter(Timed):
    """A source: a disc, a ring, a rectangle or the surface of a mesh; in a 2-D world a line.

    Give the speed, and the flow follows from the mouth's area; or the flow, and the speed follows; or both, where the
    flow is smaller, as that of a shower: then rows come farther apart.
    """

    name: str = ""
    shape: Literal["disc", "ring", "rectangle", "line", "mesh"] = "disc"
    position: Place | None = None  # m, the middle of the mouth; that of its mesh where None
    direction: Vector | None = None  # where the water goes, of any length; along its normals from a mesh
    radius: Length | None = None
    inner_radius: Length | None = None
    size: tuple[Length, Length] | None = None  # across and up
    side: tuple[Number, Number, Number] | None = None  # where across is; horizontal where None
    width: Length | None = None
    mesh: Mesh | None = None
    speed: Positive | None = None  # m/s
    flow: Annotated[Number, Field(ge=0)] | None = None  # l/s; m^2/s in a 2-D world
    spread: Annotated[Number, Field(ge=0, le=1.4)] = 0.0  # rad between the axis and the water from the rim
    start: Annotated[Number, Field(ge=0)] = 0.0  # s
    duration: Positive | None = None  # s; unlimited where None
    material: str | None = None  # one of the scene's materials; the scene's own parameters where None
    dye: str = ""  # '#rrggbb'
    feed: str = ""  # name of a drain: emits only what that has removed
    level: Annotated[Number | None, METRES] = None  # m: acts while the water of the gauge stands lower
    gauge: Gauge | None = None  # the whole tank where None
    motion: AnyMotion = None  # a position, and a rotation that turns its direction

    @field_validator("dye")
    @classmethod
    def _is_color(cls, value: str) -> str:
        if value and not re.fullmatch("#[0-9a-fA-F]{6}", value):
            raise ValueError(f"dye = {value!r} is not allowed; write it as '#rrggbb', for example '#e0a526'.")
        return value

    @model_validator(mode="before")
    @classmethod
    def _named(cls, values: Any) -> Any:
        if isinstance(values, dict) and "shape" not in values:
            told = {"mesh": "mesh", "size": "rectangle", "width": "line", "inner_radius": "ring"}
            return {**values, "shape": next((shape for key, shape in told.items() if key in values), "disc")}
        return values

    @model_validator(mode="after")
    def _complete(self) -> "Emitter":
        needed = NEEDS[self.shape] + (() if self.shape == "mesh" else ("position", "direction"))
        missing = [name for name in needed if getattr(self, name) is None]
        if missing:
            raise ValueError(f"emitter: a {self.shape} needs {' and '.join(missing)}.")
        if self.direction is not None and not any(self.direction):
            raise ValueError(f"emitter: direction = {self.direction} has no direction; give a vector of any length.")
        if self.speed is None and self.flow is None:
            raise ValueError(
                "emitter: give speed [m/s] or flow [l/s]; the other one follows from the size of the mouth."
            )
        if self.inner_radius is not None and self.radius is not None and self.inner_radius >= self.radius:
            raise ValueError(f"emitter: inner_radius = {self.inner_radius} must be less than radius = {self.radius}.")
        if self.position is not None and (self.shape == "line") != (len(self.position) == 2):
            raise ValueError("emitter: in a 2-D world its shape is line, with a width; in a 3-D world any other.")
        self._check_flow()
        return self

    def _check_flow(self) -> None:
        area = self._area()
        if self.speed is None or self.flow is None or area is None:
            return
        most = self.speed * area / self.unit
        if self.flow > SLACK * most:
            unit = "m^2/s" if self.shape == "line" else "l/s"
            raise ValueError(
                f"emitter: at speed = {self.speed:g} m/s the mouth passes {most:.4g} {unit} at most, and flow is "
                f"{self.flow:g} {unit}; give one of the two, or a larger mouth."
            )

    def _area(self) -> float | None:
        if self.shape == "disc" and self.radius:
            return math.pi * self.radius**2
        if self.shape == "ring" and self.radius and self.inner_radius:
            return math.pi * (self.radius**2 - self.inner_radius**2)
        return self.size[0] * self.size[1] if self.size else self.width

    @property
    def flow_power(self) -> int:
        """The power of a length that the flow has, while speeds stay: `Scene.scaled` needs it."""
        return 1 if self.shape == "line" else 2

    @property
    def unit(self) -> float:
        """What a unit of the flow is in m^3/s, in a 2-D world in m^2/s."""
        return 1.0 if self.shape == "line" else LITRE

    @property
    def dye_number(self) -> int:
        """The dye as particles have it; see `state.Particles`."""
        return 127 << 24 | int(self.dye[1:], 16) if self.dye else 0

    @property
    def middle(self) -> tuple[float, ...]:
        """The middle of the mouth [m]."""
        if self.position is not None:
            return tuple(self.position)
        assert self.mesh is not None
        return tuple(self.mesh.center)

    def vectors(self) -> list[tuple[str, tuple[float, ...]]]:
        """Name every vector of this emitter, to check that all have the dimension of the world."""
        found = [("position", self.middle), ("direction", self.direction)]
        own = [(name, tuple(value)) for name, value in found if value is not None]
        return own + [(f"gauge.{name}", value) for name, value in self.gauge.vectors()] if self.gauge else own

    def inlet(self, spacing: float) -> Inlet:
        """Return the places of a row for particles of that spacing [m]."""
        if self.mesh is not None:
            return inlet_of_mesh(self.mesh, spacing)
        shape = {"shape": self.shape} | {name: getattr(self, name) for name in NEEDS[self.shape]}
        return inlet_of(shape, spacing, self.spread, len(self.middle))

    def rate(self, inlet: Inlet) -> float:
        """Return the volume that comes out in a second [m^3/s; m^2/s in a 2-D world]."""
        if self.flow is not None:
            return self.flow * self.unit
        assert self.speed is not None
        return self.speed * inlet.area

    def pace(self, inlet: Inlet) -> float:
        """Return the speed [m/s] at which it comes out."""
        return self.speed if self.speed is not None else self.rate(inlet) / inlet.area


def unit_vector(vector: Any) -> np.ndarray:
    """Return a vector of a 2-D or 3-D world as one of unit length in space, [3]."""
    whole = np.zeros(3)
    whole[: len(vector)] = vector
    return whole / np.linalg.norm(whole)

"""A vortex: water within a tube is dragged along a rotation about the tube's axis."""

from typing import Annotated, Literal

from pydantic import Field
from typing_extensions import override

from wavetank.foundation.model import Number, Place
from wavetank.scene.forces.force import Force, Radius, Speed


class Vortex(Force):
    """A rotation that carries the water along."""

    kind: Literal["vortex"] = "vortex"
    center: Place
    radius: Radius
    speed: Speed  # m/s at the rim; negative turns the other way
    axis: tuple[Number, Number, Number] = (0.0, 1.0, 0.0)  # in a 2-D world give (0, 0, 1)
    drag: Annotated[Number, Field(ge=0, le=1e4)] = 8.0  # 1/s

    @override
    def largest_acceleration(self) -> float:
        return self.drag * abs(self.speed) + self.speed**2 / self.radius

    @override
    def largest_speed(self) -> float:
        return abs(self.speed)

    @override
    def vectors(self) -> list[tuple[str, tuple[float, ...]]]:
        return [("center", self.center)]

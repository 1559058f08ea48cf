"""A burst: water is thrown away from a point, within a short time."""

from typing import Annotated, Literal

from pydantic import Field
from typing_extensions import override

from wavetank.foundation.model import Place, Positive
from wavetank.scene.forces.force import Force, Radius, Speed


class Burst(Force):
    """An explosion."""

    kind: Literal["burst"] = "burst"
    center: Place
    radius: Radius
    speed: Speed  # m/s
    duration: Annotated[Positive, Field(ge=1e-6)] = 1 / 60  # s

    @override
    def largest_acceleration(self) -> float:
        return abs(self.speed) / self.duration

    @override
    def largest_speed(self) -> float:
        return abs(self.speed)

    @override
    def vectors(self) -> list[tuple[str, tuple[float, ...]]]:
        return [("center", self.center)]

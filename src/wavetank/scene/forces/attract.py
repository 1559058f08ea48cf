"""A point that attracts, or repels where the strength is negative."""

import math
from typing import Annotated, Literal

from pydantic import Field
from typing_extensions import override

from wavetank.foundation.model import Number, Place
from wavetank.scene.forces.force import Force, Radius, Strength


class Attract(Force):
    """A point that pulls water to itself."""

    kind: Literal["attract"] = "attract"
    center: Place
    radius: Radius
    strength: Strength  # m/s^2, negative repels
    drag: Annotated[Number, Field(ge=0, le=1e4)] = 2.0  # 1/s

    @override
    def largest_acceleration(self) -> float:
        return abs(self.strength)

    @override
    def largest_speed(self) -> float:
        return math.sqrt(2.0 * abs(self.strength) * self.radius)

    @override
    def vectors(self) -> list[tuple[str, tuple[float, ...]]]:
        return [("center", self.center)]

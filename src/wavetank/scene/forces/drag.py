"""Drag along: water in a ball follows a velocity, as if a hand went through it."""

import math
from typing import Annotated, Literal

from pydantic import Field
from typing_extensions import override

from wavetank.foundation.model import Number, Place
from wavetank.scene.forces.force import Force, Radius, Speeds


class Drag(Force):
    """A hand that takes water along."""

    kind: Literal["drag"] = "drag"
    center: Place
    radius: Radius
    velocity: Speeds  # m/s
    drag: Annotated[Number, Field(ge=0, le=1e4)] = 20.0  # 1/s

    @override
    def largest_acceleration(self) -> float:
        return self.drag * math.hypot(*self.velocity)

    @override
    def largest_speed(self) -> float:
        return math.hypot(*self.velocity)

    @override
    def vectors(self) -> list[tuple[str, tuple[float, ...]]]:
        return [("center", self.center), ("velocity", self.velocity)]

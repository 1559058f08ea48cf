"""The tank sways: in its own frame all water feels the opposite acceleration, a sin(2 pi f t + phase)."""

import math
from typing import Annotated, Literal

from pydantic import Field
from typing_extensions import override

from wavetank.foundation.model import Number
from wavetank.scene.forces.force import Force, Strengths


class Sway(Force):
    """A tank on the move."""

    kind: Literal["sway"] = "sway"
    acceleration: Strengths  # m/s^2
    frequency: Annotated[Number, Field(ge=0, le=1e3)] = 0.0  # Hz
    phase: Number = 0.0  # rad

    @override
    def largest_acceleration(self) -> float:
        return math.hypot(*self.acceleration)

    @override
    def largest_speed(self) -> float:
        slowest = max(2.0 * math.pi * self.frequency, 1.0)
        return 2.0 * math.hypot(*self.acceleration) / slowest

    @override
    def vectors(self) -> list[tuple[str, tuple[float, ...]]]:
        return [("acceleration", self.acceleration)]

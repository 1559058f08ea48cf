"""Wind: drag towards the velocity of the air, in the open or in a tube."""

import math
from typing import Annotated, Literal

from pydantic import Field
from typing_extensions import override

from wavetank.foundation.model import METRES, Number, Place
from wavetank.scene.forces.force import Force, Speeds


class Wind(Force):
    """Moving air. With a radius it blows in a tube through `center`, without one everywhere."""

    kind: Literal["wind"] = "wind"
    velocity: Speeds  # m/s
    drag: Annotated[Number, Field(ge=0, le=1e4)] = 1.0  # 1/s
    center: Place | None = None
    radius: Annotated[Number, Field(ge=0), METRES] = 0.0

    @override
    def largest_acceleration(self) -> float:
        return self.drag * math.hypot(*self.velocity)

    @override
    def largest_speed(self) -> float:
        return math.hypot(*self.velocity)

    @override
    def vectors(self) -> list[tuple[str, tuple[float, ...]]]:
        return [("velocity", self.velocity), *([("center", self.center)] if self.center else [])]

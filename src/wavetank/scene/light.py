"""Light of pictures: environment, position of the sun, and floor. It does not affect the simulation."""

from typing import Annotated, Literal

from pydantic import Field

from wavetank.foundation.model import Model, Number

Environment = Literal["studio", "pool", "paper", "sky", "evening", "overcast"]
Floor = Literal["plain", "tiles", "stone", "sand", "table"]

LOWEST, HIGHEST = 3.0, 90.0  # deg: elevations of the sun


class Light(Model):
    """How pictures of a scene are lit; None leaves a choice to the view."""

    environment: Environment | None = None
    azimuth: Number | None = None  # deg: direction of the sun, from +z towards +x
    elevation: Annotated[Number, Field(ge=LOWEST, le=HIGHEST)] | None = None  # deg above the horizon
    floor: Floor | None = None

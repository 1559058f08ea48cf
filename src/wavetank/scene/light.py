"""Light: under which sky a world lies, where its sun stands, and on what floor; pictures alone know of it."""

from typing import Annotated, Literal

from pydantic import Field

from wavetank.foundation.model import Model, Number

Environment = Literal["studio", "pool", "paper", "sky", "evening", "overcast"]
Floor = Literal["plain", "tiles", "stone", "sand", "table"]

LOWEST, HIGHEST = 3.0, 90.0  # deg: how high the sun may stand


class Light(Model):
    """How pictures of a scene are lit; what is left out is usual for the view."""

    environment: Environment | None = None
    azimuth: Number | None = None  # deg: where the sun stands, from +z towards +x
    elevation: Annotated[Number, Field(ge=LOWEST, le=HIGHEST)] | None = None  # deg above the horizon
    floor: Floor | None = None

"""Materials as plain data: what a fluid is made of, in SI units."""

import dataclasses
import re
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator

from wavetank.foundation.model import Model
from wavetank.foundation.params import PARAMETERS, Parameters

#: Colours of fluids that name none, in the order of the materials of a scene.
COLORS = ("#2f7fd0", "#e0a526", "#c8553d", "#3c9a6b", "#8a63b8", "#6b7885")
#: How far one sees into a fluid: any way but for its colour, as into honey; some spacings, as into ice; or not at all.
CLARITIES = ("clear", "cloudy", "opaque")
BRIGHTEST = 100.0  # of a fluid's own light, in what white paper shows in the sun


def _as(name: str) -> Any:
    """Declare a value that may be what the scene's parameter `name` may be."""
    like = next(p for p in PARAMETERS if p.name == name)
    return Field(default=None, ge=like.low, le=like.high, allow_inf_nan=False)


class Material(Model):
    """A kind of fluid. What is not given is that of the scene."""

    name: str = ""
    density: float | None = _as("rest_density")  # kg/m^3
    viscosity: float | None = _as("dynamic_viscosity")  # Pa s, dynamic
    surface_tension: float | None = _as("surface_tension")  # N/m, towards air
    contact_angle: float | None = _as("contact_angle")  # deg, on solids in air: 0 wets, 180 repels
    color: str | None = None  # '#rrggbb'
    clarity: Literal["clear", "cloudy", "opaque"] = "clear"  # how far one sees into it
    glow: Annotated[float, Field(ge=0, le=BRIGHTEST, allow_inf_nan=False)] = 0.0  # own light of its colour

    @field_validator("color")
    @classmethod
    def _is_color(cls, value: str | None) -> str | None:
        if value is not None and not re.fullmatch("#[0-9a-fA-F]{6}", value):
            raise ValueError(f"colour {value!r} is not allowed; write it as '#rrggbb', for example '#e0a526'.")
        return value

    def properties(self, params: Parameters) -> "Properties":
        """Return the values that hold with the scene's parameters `params`."""

        def own(value: float | None, otherwise: float) -> float:
            return otherwise if value is None else value

        return Properties(
            density=own(self.density, params.rest_density),
            viscosity=own(self.viscosity, params.dynamic_viscosity),
            surface_tension=own(self.surface_tension, params.surface_tension),
            contact_angle=own(self.contact_angle, params.contact_angle),
        )


@dataclasses.dataclass(frozen=True)
class Properties:
    """The values of a material that the solver needs."""

    density: float  # kg/m^3
    viscosity: float  # Pa s
    surface_tension: float  # N/m
    contact_angle: float  # deg

"""Outlets: regions that remove particles from the world."""

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from wavetank.foundation.model import METRES, Length, Number, Place, Positive, Vector
from wavetank.foundation.timed import Timed
from wavetank.scene.gauges import Gauge

LITRE = 1e-3  # m^3
DEPTH = 1.5  # d: how far from its plane a mouth without a flow takes what comes
#: shape -> the keys that it needs
NEEDS = {
    "box": ("lower", "upper"),
    "sphere": ("center", "radius"),
    "mouth": ("center", "radius", "direction"),
    "outside": ("lower", "upper"),
}


class Drain(Timed):
    """A sink: a box, a sphere, a mouth in a wall, or all that is outside of a box (a kill zone)."""

    name: str = ""
    shape: Literal["box", "sphere", "mouth", "outside"] = "sphere"
    lower: Place | None = None
    upper: Place | None = None
    center: Place | None = None
    radius: Length | None = None
    direction: Vector | None = None  # of a mouth: where the water comes from, out of the wall
    flow: Annotated[Number, Field(ge=0)] | None = None  # l/s, at most; m^2/s in a 2-D world; unlimited where None
    suction: Annotated[Number, Field(ge=0, le=1e4)] = 0.0  # m/s^2 towards the center, felt within four radii
    start: Annotated[Number, Field(ge=0)] = 0.0  # s
    duration: Positive | None = None  # s; unlimited where None
    level: Annotated[Number | None, METRES] = None  # m: acts while the water of the gauge stands higher
    gauge: Gauge | None = None  # the whole tank where None

    @model_validator(mode="before")
    @classmethod
    def _named(cls, values: Any) -> Any:
        if isinstance(values, dict) and "shape" not in values:
            shape = "mouth" if "direction" in values else "box" if "lower" in values else "sphere"
            return {**values, "shape": shape}
        return values

    @model_validator(mode="after")
    def _complete(self) -> "Drain":
        missing = [name for name in NEEDS[self.shape] if getattr(self, name) is None]
        if missing:
            raise ValueError(f"drain: a {self.shape} needs {' and '.join(missing)}.")
        if any(a >= b for a, b in zip(self.lower or (), self.upper or (), strict=False)):
            raise ValueError(
                f"drain: lower = {self.lower}, upper = {self.upper} is not allowed; "
                "every component of upper must be greater than that of lower."
            )
        if self.direction is not None and not any(self.direction):
            raise ValueError(f"drain: direction = {self.direction} has no direction; give a vector of any length.")
        if self.suction and self.center is None:
            raise ValueError("drain: suction needs a center to pull towards; a box has none.")
        return self

    @property
    def flow_power(self) -> int:
        """The power of a length that the flow has, while speeds stay: `Scene.scaled` needs it."""
        return len(self.center or self.lower or ()) - 1

    def vectors(self) -> list[tuple[str, tuple[float, ...]]]:
        """Name every point of this drain, to check that all have the dimension of the world."""
        found = [(name, getattr(self, name)) for name in ("lower", "upper", "center", "direction")]
        own = [(name, value) for name, value in found if value is not None]
        return own + [(f"gauge.{name}", value) for name, value in self.gauge.vectors()] if self.gauge else own

    def middle(self) -> np.ndarray | None:
        """Return the middle [m], [dim], of the region; None for `outside`."""
        if self.shape == "outside":
            return None
        return np.array(self.center, float) if self.center else 0.5 * (np.array(self.lower) + np.array(self.upper))

    def depths(self, x: np.ndarray, spacing: float) -> np.ndarray:
        """Return the distances [m] of points [n, dim] from where this removes first; infinite outside of it."""
        if self.shape in ("box", "outside"):
            lower, upper = np.array(self.lower, float), np.array(self.upper, float)
            inside = np.all((x >= lower) & (x <= upper), axis=1)
            if self.shape == "outside":
                return np.where(inside, np.inf, 0.0)
            return np.where(inside, np.linalg.norm(x - 0.5 * (lower + upper), axis=1), np.inf)
        assert self.center is not None
        assert self.radius is not None
        way = x - np.array(self.center, float)
        distance = np.linalg.norm(way, axis=1)
        if self.shape == "sphere":
            return np.where(distance < self.radius, distance, np.inf)
        ahead = np.array(self.direction, float)
        ahead /= np.linalg.norm(ahead)
        depth = way @ ahead
        aside = np.sqrt(np.maximum(distance**2 - depth**2, 0.0))
        reach = DEPTH * spacing if self.flow is None else max(DEPTH * spacing, 2.0 * self.radius)
        return np.where((depth > -spacing) & (depth < reach) & (aside <= self.radius), np.hypot(depth, aside), np.inf)

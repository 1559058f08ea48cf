"""Level gauges of emitters and drains: the depth of the water in a box."""

import numpy as np
from pydantic import model_validator

from wavetank.foundation.model import Model, Place


class Gauge(Model):
    """A box without solids in it; the level is its lower end and the volume of water in it over its base."""

    lower: Place
    upper: Place

    @model_validator(mode="after")
    def _ordered(self) -> "Gauge":
        if len(self.lower) != len(self.upper) or any(a >= b for a, b in zip(self.lower, self.upper, strict=True)):
            raise ValueError(
                f"gauge: lower = {self.lower}, upper = {self.upper} is not allowed; "
                "every component of upper must be greater than that of lower."
            )
        return self

    def vectors(self) -> list[tuple[str, tuple[float, ...]]]:
        """Name the corners."""
        return [("lower", self.lower), ("upper", self.upper)]

    def base(self, up: str) -> float:
        """Return its base [m^2] across the axis `up`, in a 2-D world its width [m]."""
        edges = zip("xyz", self.lower, self.upper, strict=False)
        return float(np.prod([b - a for axis, a, b in edges if axis != up[-1]]))

    def level(self, x: np.ndarray, spacing: float, up: str) -> float:
        """Return the level [m] along the axis `up` for particles at `x` [n, dim]."""
        inside = np.all((x >= np.array(self.lower)) & (x < np.array(self.upper)), axis=1)
        axis = "xyz".index(up[-1])
        bottom = -self.upper[axis] if up.startswith("-") else self.lower[axis]
        return float(bottom) + int(inside.sum()) * spacing ** x.shape[1] / self.base(up)

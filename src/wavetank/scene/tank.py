"""The tank: a box with walls, which holds the water of a scene."""

import numpy as np
from pydantic import model_validator

from wavetank.foundation.model import Edges, Model, Place
from wavetank.solids.shapes import HalfSpace
from wavetank.solids.solid import Solid


class Tank(Model):
    """The container: its inner size [m] and its lower corner, the origin unless told. Two numbers make a 2-D world."""

    size: Edges
    lower: Place | None = None

    @model_validator(mode="after")
    def _fits(self) -> "Tank":
        if self.lower is not None and len(self.lower) != len(self.size):
            raise ValueError(
                f"tank.lower = {self.lower} has {len(self.lower)} components and tank.size = {self.size} has "
                f"{len(self.size)}; both must have as many as the world has dimensions."
            )
        return self

    def box(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the lower and upper corner [m], float64 [dim]."""
        lower = np.zeros(len(self.size)) if self.lower is None else np.array(self.lower, float)
        return lower, lower + np.array(self.size, float)

    def walls(self) -> list[Solid]:
        """Return the walls as half-spaces, lower and upper for each axis."""
        result: list[Solid] = []
        for axis, name in enumerate("xyz"[: len(self.size)]):
            normal = np.eye(len(self.size))[axis]
            for side, corner, sign in zip(("lower", "upper"), self.box(), (1.0, -1.0), strict=True):
                result.append(
                    HalfSpace(name=f"tank {name} {side}", point=tuple(corner * normal), normal=tuple(sign * normal))
                )
        return result

"""The tank: a box with walls, which holds the water of a scene."""

from typing import Literal

import numpy as np
from pydantic import model_validator

from wavetank.foundation.model import Edges, Place
from wavetank.scene.schedule import Tilted
from wavetank.solids.shapes import HalfSpace
from wavetank.solids.solid import Solid

_OTHER_NAMES = {"bottom": "-y", "top": "+y"}


class Tank(Tilted):
    """The container: its inner size [m] and its lower corner, the origin unless told. Two numbers make a 2-D world.

    What crosses an open side is taken out of the world; to the water inside there is air beyond it.
    """

    size: Edges
    lower: Place | None = None
    open: list[Literal["-x", "+x", "-y", "+y", "-z", "+z", "bottom", "top"]] = []  # sides without a wall: an outflow

    @model_validator(mode="after")
    def _fits(self) -> "Tank":
        if self.lower is not None and len(self.lower) != len(self.size):
            raise ValueError(
                f"tank.lower = {self.lower} has {len(self.lower)} components and tank.size = {self.size} has "
                f"{len(self.size)}; both must have as many as the world has dimensions."
            )
        if len(self.size) == 2 and any(side.endswith("z") for side in self.open):
            raise ValueError(f"tank.open = {self.open} names a side along z, which a 2-D world does not have.")
        return self

    def is_open(self, axis: int, side: int) -> bool:
        """Say whether there is no wall at the lower (0) or upper (1) side along an axis."""
        return "-+"[side] + "xyz"[axis] in {_OTHER_NAMES.get(name, name) for name in self.open}

    def beyond(self, way: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the corners of `box` moved out by `way` [m] where sides are open."""
        ways = way * np.array([[self.is_open(axis, side) for axis in range(len(self.size))] for side in (0, 1)])
        lower, upper = self.box()
        return lower - ways[0], upper + ways[1]

    def box(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the lower and upper corner [m], float64 [dim]."""
        lower = np.zeros(len(self.size)) if self.lower is None else np.array(self.lower, float)
        return lower, lower + np.array(self.size, float)

    def open_box(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the corners of `box`, moved out of reach but where sides are open: what is beyond has left."""
        (lower, upper), (low, high) = self.box(), self.beyond(1.0)
        return np.where(low < lower, lower, -1e9), np.where(high > upper, upper, 1e9)

    def walls(self) -> list[Solid]:
        """Return the walls as half-spaces, lower and upper for each axis, but for the sides that are open."""
        result: list[Solid] = []
        for axis, name in enumerate("xyz"[: len(self.size)]):
            normal = np.eye(len(self.size))[axis]
            for side, corner in enumerate(self.box()):
                if not self.is_open(axis, side):
                    title, inward = f"tank {name} {('lower', 'upper')[side]}", (1.0 - 2.0 * side) * normal
                    result.append(HalfSpace(name=title, point=tuple(corner * normal), normal=tuple(inward)))
        return result

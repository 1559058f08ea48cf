"""The tank: a box with walls, which holds the water of a scene."""

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from pydantic import SerializerFunctionWrapHandler, model_serializer, model_validator

from wavetank.foundation.model import Edges, Place
from wavetank.scene.lattice import NEAR
from wavetank.scene.schedule import Tilted
from wavetank.solids.shapes import HalfSpace
from wavetank.solids.solid import Solid

if TYPE_CHECKING:
    from wavetank.device.periods import Periods

_OTHER_NAMES = {"bottom": "-y", "top": "+y"}


class Tank(Tilted):
    """The container: its inner size [m] and its lower corner, by default the origin. Two numbers make a 2-D world.

    What crosses an open side is taken out of the world; to the water inside there is air beyond it. What crosses one
    side of an axis that is periodic comes in at the other: there is no wall, and the water goes on.
    """

    size: Edges
    lower: Place | None = None
    open: list[Literal["-x", "+x", "-y", "+y", "-z", "+z", "bottom", "top"]] = []  # sides without a wall: an outflow
    periodic: list[Literal["x", "y", "z"]] = []  # axes along which the world repeats

    @model_validator(mode="after")
    def _fits(self) -> "Tank":
        if self.lower is not None and len(self.lower) != len(self.size):
            raise ValueError(
                f"tank.lower = {self.lower} has {len(self.lower)} components and tank.size = {self.size} has "
                f"{len(self.size)}; both must have as many as the world has dimensions."
            )
        if len(self.size) == 2 and any(side.endswith("z") for side in self.open):
            raise ValueError(f"tank.open = {self.open} names a side along z, which a 2-D world does not have.")
        self._check_periodic()
        return self

    def _check_periodic(self) -> None:
        if len(self.size) == 2 and "z" in self.periodic:
            raise ValueError("tank.periodic names the axis z, which a 2-D world does not have.")
        if len({*self.periodic}) < len(self.periodic):
            raise ValueError(f"tank.periodic = {self.periodic} names an axis twice.")
        for axis in self.periodic:
            if any(self.is_open("xyz".index(axis), side) for side in (0, 1)):
                raise ValueError(
                    f"tank.open = {self.open} leaves out a wall along {axis}, and tank.periodic = {self.periodic} says "
                    "that it has no walls: what leaves comes in at the other side; take the axis out of one of them."
                )

    @model_serializer(mode="wrap")
    def _without_defaults(self, plain: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out `periodic` where nothing is, so that digests of other worlds are what they were."""
        values: dict[str, Any] = plain(self)
        if not self.periodic:
            values.pop("periodic", None)
        return values

    @property
    def periodic_axes(self) -> list[int]:
        """The periodic axes, as numbers."""
        return sorted("xyz".index(axis) for axis in self.periodic)

    def periods(self) -> "Periods":
        """Return the periods of the world, for the device."""
        from wavetank.device.periods import periods_of  # kernels

        return periods_of(self.periodic_axes, self.box()[0], self.size)

    def within(self, places: np.ndarray) -> np.ndarray:
        """Return the images of `places` [m], [n, dim], in the tank along the axes that are periodic."""
        return places_within(places, *self.box(), self.periodic_axes)

    def beside(self, places: np.ndarray, point: np.ndarray) -> np.ndarray:
        """Return the images of `places` [m], [n, dim], that are nearest to a point, along axes that are periodic."""
        half = 0.5 * np.array(self.size, float)
        return places_within(places, point - half, point + half, self.periodic_axes)

    def touched_by(self, lower: np.ndarray, upper: np.ndarray, spacing: float) -> np.ndarray:
        """Say where a box between two corners [m] reaches a wall or a seam, at both sides along each axis, [2, dim]."""
        low, high = self.box()
        is_open = np.array([[self.is_open(axis, side) for axis in range(len(low))] for side in (0, 1)])
        return ~is_open & np.array([lower < low + NEAR * spacing, upper > high - NEAR * spacing])

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
        """Return the corners of `box`, far away except at open sides: particles outside of it have left."""
        (lower, upper), (low, high) = self.box(), self.beyond(1.0)
        return np.where(low < lower, lower, -1e9), np.where(high > upper, upper, 1e9)

    def walls(self) -> list[Solid]:
        """Return the walls as half-spaces, lower and upper for each axis that has any."""
        result: list[Solid] = []
        for axis, name in enumerate("xyz"[: len(self.size)]):
            normal = np.eye(len(self.size))[axis]
            for side, corner in enumerate(self.box()):
                if not self.is_open(axis, side) and axis not in self.periodic_axes:
                    title, inward = f"tank {name} {('lower', 'upper')[side]}", (1.0 - 2.0 * side) * normal
                    result.append(HalfSpace(name=title, point=tuple(corner * normal), normal=tuple(inward)))
        return result


def places_within(places: np.ndarray, lower: np.ndarray, upper: np.ndarray, axes: Iterable[int]) -> np.ndarray:
    """Return the images of `places` [m], [n, dim], between two corners along the `axes` that repeat."""
    x = places
    for axis in axes:
        x = x.copy() if x is places else x
        low, high = x.dtype.type(lower[axis]), x.dtype.type(upper[axis])
        inside = low + np.mod(x[:, axis] - low, high - low)
        outside = (x[:, axis] < low) | (x[:, axis] >= high)
        x[:, axis] = np.where(outside, np.where(inside < high, inside, low), x[:, axis])
    return x

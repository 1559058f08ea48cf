"""Fluids as plain data: where a scene's particles start."""

from collections.abc import Sequence
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, PlainSerializer, WithJsonSchema, model_validator
from typing_extensions import override

from wavetank.foundation.model import FARTHEST, METRES, Length, Model, Place, Vector, register_model
from wavetank.scene.lattice import fitted, plain_lattice, touching
from wavetank.scene.tank import Tank
from wavetank.solids.shapes import Box
from wavetank.solids.solid import Solid


class Fluid(Model):
    """What every fluid has."""

    velocity: Vector | None = None  # m/s, at the start; at rest where None
    material: str | None = None  # one of the scene's materials; the scene's own parameters where None

    def vectors(self) -> list[tuple[str, tuple[float, ...]]]:
        """Name every vector of this fluid, to check that all live in one dimension."""
        return [("velocity", self.velocity)] if self.velocity is not None else []

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper corner [m] of the fluid."""
        raise NotImplementedError

    def estimate(self, spacing: float) -> float:
        """Number of particles to expect, without making them."""
        lower, upper = self.bounds()
        return float(np.prod(np.maximum((upper - lower) / spacing, 1.0)))

    def contains(self, points: np.ndarray) -> np.ndarray:
        """Say for each of the points [n, dim] whether it lies in this fluid, bool [n]."""
        raise NotImplementedError

    def particles(self, spacing: float) -> np.ndarray:
        """Positions [n, dim] of a cubic lattice that fills this fluid, half a spacing from its lower corner."""
        lower, upper = self.bounds()
        x = plain_lattice(lower, upper, spacing)
        return x[self.contains(x)]

    def placed(self, spacing: float, tank: Tank | None, boxes: np.ndarray) -> np.ndarray:
        """Positions [n, dim] of this fluid in a `tank`, beside all `boxes` of fluid and solids, [n, 2, dim]."""
        return self.particles(spacing)


class Block(Fluid):
    """A rectangular block of fluid between two corners."""

    shape: Literal["block"] = "block"
    lower: Place
    upper: Place

    @model_validator(mode="after")
    def _ordered(self) -> "Block":
        if len(self.lower) != len(self.upper) or any(a >= b for a, b in zip(self.lower, self.upper, strict=True)):
            raise ValueError(
                f"fluid block lower = {self.lower}, upper = {self.upper} is not allowed; "
                "every component of upper must be greater than that of lower."
            )
        return self

    @override
    def vectors(self) -> list[tuple[str, tuple[float, ...]]]:
        return [("lower", self.lower), ("upper", self.upper), *super().vectors()]

    @override
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        return np.array(self.lower, float), np.array(self.upper, float)

    @override
    def contains(self, points: np.ndarray) -> np.ndarray:
        lower, upper = self.bounds()
        return np.all((points > lower) & (points < upper), axis=1)

    @override
    def placed(self, spacing: float, tank: Tank | None, boxes: np.ndarray) -> np.ndarray:
        lower, upper = self.bounds()
        touched = touching(lower, upper, boxes[:, 0], boxes[:, 1], spacing)  # itself does not touch itself
        if tank is not None:
            touched |= tank.touched_by(lower, upper, spacing)
        return fitted(lower, upper, spacing, touched[0] & touched[1], tank.periodic_axes if tank else [])


class Ball(Fluid):
    """A ball of fluid; in a 2-D world a disc."""

    shape: Literal["ball"] = "ball"
    center: Place
    radius: Length

    @override
    def vectors(self) -> list[tuple[str, tuple[float, ...]]]:
        return [("center", self.center), *super().vectors()]

    @override
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        center = np.array(self.center, float)
        return center - self.radius, center + self.radius

    @override
    def contains(self, points: np.ndarray) -> np.ndarray:
        return np.sum((points - np.array(self.center)) ** 2, axis=1) < self.radius**2


def _array(value: Any) -> np.ndarray:
    try:
        array = np.asarray(value, np.float64)
    except (TypeError, ValueError):
        raise ValueError("positions and velocities must be arrays of numbers [n, 2] or [n, 3].") from None
    if array.size == 0:
        array = array.reshape(0, array.shape[1] if array.ndim == 2 else 3)
    if array.ndim != 2 or array.shape[1] not in (2, 3):
        raise ValueError(f"positions have shape {list(array.shape)}; they must be [n, 2] or [n, 3].")
    bad = ~(np.abs(array) <= FARTHEST).all(axis=1)
    if bad.any():
        row = int(np.argmax(bad))
        what = f"beyond {FARTHEST:g}" if np.isfinite(array[row]).all() else "not finite"
        raise ValueError(f"positions[{row}] = {array[row].tolist()} is {what}; every number must be within that.")
    return array


Array = Annotated[
    np.ndarray,
    BeforeValidator(_array),
    PlainSerializer(lambda array: array.tolist()),
    WithJsonSchema({"type": "array", "items": {"type": "array", "items": {"type": "number"}}}),
]


class Points(Fluid):
    """Fluid particles at given places, each of the mass that the scene's spacing gives."""

    shape: Literal["points"] = "points"
    positions: Annotated[Array, METRES]
    velocities: Array | None = None

    @model_validator(mode="after")
    def _paired(self) -> "Points":
        if self.velocities is not None and self.velocities.shape != self.positions.shape:
            raise ValueError(
                f"velocities have shape {list(self.velocities.shape)}; "
                f"they must have that of positions, {list(self.positions.shape)}."
            )
        return self

    @override
    def vectors(self) -> list[tuple[str, tuple[float, ...]]]:
        return [*([("positions", tuple(self.positions[0]))] if len(self.positions) else []), *super().vectors()]

    @override
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        return self.positions.min(axis=0), self.positions.max(axis=0)

    @override
    def estimate(self, spacing: float) -> float:
        return float(len(self.positions))

    @override
    def contains(self, points: np.ndarray) -> np.ndarray:
        return np.zeros(len(points), bool)

    @override
    def particles(self, spacing: float) -> np.ndarray:
        return self.positions


def boxes_of(fluids: Sequence[Fluid], solids: Sequence[Solid], dim: int) -> np.ndarray:
    """Return lower and upper corner [m] of all blocks and of all upright boxes, float64 [n, 2, dim]."""
    corners: list[Any] = [fluid.bounds() for fluid in fluids if isinstance(fluid, Block)]
    corners += [solid.corners() for solid in solids if isinstance(solid, Box)]
    return np.array([pair for pair in corners if pair is not None], float).reshape(-1, 2, dim)


class Earlier:
    """Fluids so far, to tell which points lie in one of them: the first fluid wins."""

    def __init__(self, dim: int) -> None:
        self.fluids: list[Fluid] = []
        self._bounds = np.zeros((0, 2, dim))
        self._count = 0

    def append(self, fluid: Fluid) -> None:
        """Add a fluid that is not empty."""
        if self._count == len(self._bounds):
            self._bounds = np.concatenate([self._bounds, np.zeros((max(16, self._count), *self._bounds.shape[1:]))])
        self._bounds[self._count] = fluid.bounds()
        self.fluids.append(fluid)
        self._count += 1

    def contain(self, points: np.ndarray) -> np.ndarray:
        """Return which of the points [n, dim] lie in one of them, bool [n]."""
        free = np.arange(len(points))
        if not len(points):
            return np.zeros(0, bool)
        bounds = self._bounds[: self._count]
        near = ((bounds[:, 0] < points.max(axis=0)) & (bounds[:, 1] > points.min(axis=0))).all(axis=1)
        for number in np.flatnonzero(near):
            free = free[~self.fluids[number].contains(points[free])]
            if not len(free):
                break
        taken = np.ones(len(points), bool)
        taken[free] = False
        return taken


for _fluid in (Block, Ball, Points):
    register_model(_fluid.model_fields["shape"].default, _fluid)

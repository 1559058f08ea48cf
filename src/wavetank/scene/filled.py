"""Fluid that fills a shape: a mesh, a polygon, or any other solid's shape."""

from typing import Annotated, Literal

import numpy as np
from pydantic import Field, PrivateAttr, model_validator
from typing_extensions import override

from wavetank.foundation.model import register_model
from wavetank.scene.fluids import Ball, Block, Fluid, Points
from wavetank.solids.bounds import bounds_of
from wavetank.solids.ground.polygon import Polygon
from wavetank.solids.meshes.mesh import Mesh
from wavetank.solids.shapes import AnySolid

FINE = 50.0  # lattice points along the longest edge where no spacing is given


class Filled(Fluid):
    """Fluid at rest that fills the shape of a solid, closely packed, with as many particles as its volume holds.

    Parts that solids, the tank or earlier fluids occupy are left out. The particles are packed when a simulation starts
    (`simulation/packing.py`); before that they are those of a lattice.
    """

    shape: Literal["filled"] = "filled"
    inside: AnySolid  # a closed mesh, in 2-D a polygon, or any other finite shape
    _packed: np.ndarray | None = PrivateAttr(default=None)

    @model_validator(mode="after")
    def _has_end(self) -> "Filled":
        if not np.isfinite(self._box()).all():
            raise ValueError(
                "inside: this shape is infinite and cannot be filled; give a finite one, or an intersection."
            )
        if isinstance(self.inside, Mesh) and self.inside.thickness is not None:
            raise ValueError("inside.thickness makes walls of a mesh's faces; only a closed mesh can be filled.")
        return self

    def packed(self, positions: np.ndarray) -> "Filled":
        """Return this fluid with its particles at these positions [m], [n, dim]."""
        result = self.model_copy()
        result._packed = positions
        return result

    def _box(self) -> np.ndarray:
        return np.stack(bounds_of(self.inside))

    @override
    def vectors(self) -> list[tuple[str, tuple[float, ...]]]:
        own = [(f"inside.{name}", tuple(vector)) for name, vector in self.inside.vectors()]
        return [*own, *super().vectors()]

    @property
    def dim(self) -> int:
        """Number of dimensions of its world."""
        return len(next(iter(self.vectors()), ("", (0.0,) * 3))[1])

    @override
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        lower, upper = self._box()
        return lower[: self.dim], upper[: self.dim]

    @override
    def estimate(self, spacing: float) -> float:
        if isinstance(self.inside, Mesh | Polygon):
            return float(self.inside.volume() / spacing**self.dim)
        return super().estimate(spacing)

    @override
    def contains(self, points: np.ndarray) -> np.ndarray:
        from wavetank.solids.sampling import nearest_distances  # kernels

        lower, upper = self.bounds()
        result = np.all((points > lower) & (points < upper), axis=1)
        result[result] = nearest_distances([self.inside], points[result], float((upper - lower).max()) / FINE) < 0.0
        return result

    @override
    def particles(self, spacing: float) -> np.ndarray:
        return super().particles(spacing) if self._packed is None else self._packed


AnyFluid = Annotated[Block | Ball | Points | Filled, Field(discriminator="shape")]
register_model("filled", Filled)

"""A solid with an outline of straight edges, in a 2-D world."""

import hashlib
from collections.abc import Sequence
from typing import Annotated, Literal

import numpy as np
from pydantic import model_validator
from typing_extensions import override

from wavetank.foundation.model import METRES, Number
from wavetank.solids.meshes.store import DistanceGrid, grid_of
from wavetank.solids.solid import AROUND, GRIDS, Node, Solid, complement, point_in_space

MOST_CORNERS = 20_000


class Polygon(Solid):
    """What a closed line of straight edges encloses, in a 2-D world: what a mesh is in space.

    A line that crosses itself encloses what an odd number of its parts go around.
    """

    shape: Literal["polygon"] = "polygon"
    points: Annotated[list[tuple[Number, Number]], METRES]  # corners in order, relative to the centre
    center: Annotated[tuple[Number, Number], METRES] = (0.0, 0.0)
    invert: bool = False  # a container: all but what the line encloses is solid

    @model_validator(mode="after")
    def _encloses(self) -> "Polygon":
        if not 3 <= len(self.points) <= MOST_CORNERS:
            raise ValueError(f"points: a polygon has 3 to {MOST_CORNERS:,} corners; there are {len(self.points)}.")
        if np.ptp(np.array(self.points), axis=0).min() <= 0.0:
            raise ValueError("points: the corners of a polygon lie on one line; they must enclose something.")
        return self

    @property
    @override
    def origin(self) -> np.ndarray:
        return point_in_space(self.center)

    @override
    def program(self) -> list[Node]:
        points = np.array(self.points)
        own = Node(GRIDS, [1.0], point_in_space(0.5 * (points.min(axis=0) + points.max(axis=0))), mesh=self)
        return complement([own]) if self.invert else [own]

    @override
    def reach(self) -> float:
        return AROUND if self.invert else self.span()

    @override
    def span(self) -> float:
        return float(np.linalg.norm(self.points, axis=1).max())

    @override
    def vectors(self) -> list[tuple[str, Sequence[float]]]:
        return [("center", self.center)]

    def vertices(self) -> np.ndarray:
        """Return the corners [m], [n, 3], in its own frame."""
        return np.column_stack([self.points, np.zeros(len(self.points))])

    def volume(self) -> float:
        """Return the area that it encloses [m^2]; of a line that crosses itself, roughly."""
        x, y = np.array(self.points).T
        return 0.5 * abs(float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)))

    def grid(self, spacing: float) -> DistanceGrid:
        """Return the distances to the outline for particles of that spacing [m], around the middle of its box."""
        from wavetank.solids.ground.outline import measure_outline  # kernels

        points = np.array(self.points)
        key = f"outline {hashlib.sha256(points.tobytes()).hexdigest()} {spacing}"
        return grid_of(key, lambda: measure_outline(points, spacing, self.name or "the polygon"))

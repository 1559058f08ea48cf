"""The box of the world that is worth looking at."""

import dataclasses
import itertools
from typing import Any

import numpy as np

IN_SIGHT = 99.8  # per cent of the water that a still shows for certain
ENDLESS = 1e4  # m: what reaches that far, a half-space, is not a reason to step back


@dataclasses.dataclass(frozen=True)
class Extent:
    """A box; flat in z for a 2-D world."""

    dim: int
    spacing: float  # m
    lower: np.ndarray  # m, [3]
    upper: np.ndarray  # m, [3]

    def turned(self, turn: np.ndarray) -> "Extent":
        """Return the box around this one, rotated by a matrix [3, 3]."""
        corners = self.corners @ turn.T
        return dataclasses.replace(self, lower=corners.min(axis=0), upper=corners.max(axis=0))

    @property
    def middle(self) -> np.ndarray:
        """Centre of the box [m], shape [3]."""
        middle: np.ndarray = 0.5 * (self.lower + self.upper)
        return middle

    @property
    def corners(self) -> np.ndarray:
        """Corners of the box [m], shape [8, 3]."""
        return np.array(list(itertools.product(*zip(self.lower, self.upper, strict=True))))

    @property
    def radius(self) -> float:
        """Radius [m] of the ball around the middle that holds the box."""
        return 0.5 * float(np.linalg.norm(self.upper - self.lower))


def extent_of(scene: Any) -> Extent:
    """Return the tank of `scene`; without one the box around its fluids and solids, without those a unit box."""
    if scene.tank is not None:
        boxes = [scene.tank.box()]
    else:
        fluids = [fluid for fluid in getattr(scene, "fluids", []) if fluid.estimate(scene.spacing) > 0.0]
        boxes = [fluid.bounds() for fluid in fluids]
        boxes += [(s.origin - s.span(), s.origin + s.span()) for s in scene.solids if s.span() < ENDLESS]
    boxes = boxes or [(np.zeros(scene.dim), np.ones(scene.dim))]
    lower = np.min([_in_space(low) for low, _ in boxes], axis=0)
    upper = np.max([_in_space(high) for _, high in boxes], axis=0)
    if scene.dim == 2:
        lower[2] = upper[2] = 0.0
    # A single particle, or a sheet of them, still needs a box with an inside.
    thin = (upper - lower < scene.spacing) & (np.arange(3) < scene.dim)
    return Extent(
        scene.dim, float(scene.spacing), lower - 0.5 * scene.spacing * thin, upper + 0.5 * scene.spacing * thin
    )


def extent_of_water(frame: Any) -> Extent:
    """Return the box around the water and the solids of a frame, without single drops that fly high, on the floor.

    What a still of a tall tank with little water in it shows; a 2-D world is shown as a whole.
    """
    whole = extent_of(frame.scene)
    if whole.dim == 2 or frame.count == 0:
        return whole
    x = frame.positions
    boxes = [np.percentile(x, (100.0 - IN_SIGHT, IN_SIGHT), axis=0)]
    boxes += [(s.origin - s.span(), s.origin + s.span()) for s in frame.scene.solids if s.span() < ENDLESS]
    margin = 0.04 * whole.radius
    lower = np.maximum(np.min([low for low, _ in boxes], axis=0) - margin, whole.lower)
    upper = np.minimum(np.max([high for _, high in boxes], axis=0) + margin, whole.upper)
    up = frame.scene.upward
    axis, (end, floor) = "xyz".index(up[-1]), (upper, whole.upper) if up.startswith("-") else (lower, whole.lower)
    end[axis] = floor[axis]  # what floats, with its shadow
    return Extent(whole.dim, whole.spacing, lower, np.maximum(upper, lower + whole.spacing))


def _in_space(point: np.ndarray) -> np.ndarray:
    return np.concatenate([point, np.zeros(3 - len(point))])

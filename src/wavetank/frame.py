"""What a viewer or an exporter may see of a world: one instant of it.

The arrays live on the device and are borrowed, not copied: a frame is valid until the simulation moves on. The host
copies are made when they are first asked for, ordered by particle id, and stay valid.
"""

import dataclasses
import functools
from typing import Any

import numpy as np

from wavetank.distance import SolidSet
from wavetank.scene import Scene


@dataclasses.dataclass
class Frame:
    """One instant of a world."""

    scene: Scene
    number: int  # frames since the start
    time: float  # s of water since the start
    count: int  # particles; the arrays may be longer
    x: Any  # device ndarray of vectors [capacity], m, in device order
    v: Any  # device ndarray of vectors [capacity], m/s
    rho: Any  # device ndarray f32 [capacity], kg/m^3
    id: Any  # device ndarray i32 [capacity]: particle id at each place of the device order
    solids: SolidSet

    @property
    def dim(self) -> int:
        """Number of dimensions of the world, 2 or 3."""
        return self.scene.dim

    @functools.cached_property
    def positions(self) -> np.ndarray:
        """Positions [m], float32 [count, dim], ordered by particle id."""
        return self._by_id(self.x)

    @functools.cached_property
    def velocities(self) -> np.ndarray:
        """Velocities [m/s], float32 [count, dim], ordered by particle id."""
        return self._by_id(self.v)

    @functools.cached_property
    def densities(self) -> np.ndarray:
        """Densities [kg/m^3], float32 [count], ordered by particle id."""
        return self._by_id(self.rho)

    def _by_id(self, array: Any) -> np.ndarray:
        host = array.to_numpy()[: self.count]
        ordered = np.empty_like(host)
        ordered[self.id.to_numpy()[: self.count]] = host
        return ordered

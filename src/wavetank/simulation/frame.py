"""What a viewer or an exporter may see of a world: one instant of it.

The arrays live on the device and are borrowed, not copied: a frame is valid until the simulation moves on. The host
copies are made when they are first asked for, ordered by particle id, and stay valid.
"""

import dataclasses
import functools
from collections.abc import Callable
from typing import Any

import numpy as np

from wavetank.device.compiler import download
from wavetank.device.state import Diffuse
from wavetank.foundation.errors import NotFiniteError
from wavetank.scene.scene import Scene
from wavetank.simulation.instant import Standing
from wavetank.solids.distance import SolidSet


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
    dye: Any  # device ndarray i32 [capacity]: 0 or strength << 24 | red << 16 | green << 8 | blue, see `state.py`
    material: Any  # device ndarray i32 [capacity]: number of the material, see `Scene.palette`
    solids: SolidSet
    frozen: Any = None  # device ndarray i32 [capacity]: 1 where a particle is ice
    frozen_count: int = 0  # of them
    diffuse: Diffuse | None = None  # spray, foam and bubbles in device arrays, packed at the front
    foam_count: int = 0  # of them
    stand: Callable[[], tuple[Standing, ...]] = tuple  # asks where the solids stand

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

    def check_finite(self) -> None:
        """Raise `NotFiniteError` where a place or a velocity is no number."""
        bad = ~(np.isfinite(self.positions) & np.isfinite(self.velocities)).all(axis=1)
        if bad.any():
            row = int(np.argmax(bad))
            raise NotFiniteError(
                f"particle {self.ids[row]} at {self.positions[row].tolist()} m has the velocity "
                f"{self.velocities[row].tolist()} m/s at t = {self.time:.6g} s and is no number that water can go on "
                f"from, as are {int(bad.sum()) - 1:,} others; try shorter steps (substeps) or weaker forces."
            )

    @functools.cached_property
    def densities(self) -> np.ndarray:
        """Densities [kg/m^3], float32 [count], ordered by particle id."""
        return self._by_id(self.rho)

    @functools.cached_property
    def ids(self) -> np.ndarray:
        """Ids of the particles, int32 [count], rising; those of removed particles are missing."""
        return self._by_id(self.id)

    @functools.cached_property
    def dyes(self) -> np.ndarray:
        """Dyes, int32 [count], ordered by particle id; 0 is clear water."""
        return self._by_id(self.dye)

    @functools.cached_property
    def _order(self) -> np.ndarray:
        return np.argsort(download(self.id)[: self.count], kind="stable")

    @functools.cached_property
    def materials(self) -> np.ndarray:
        """Number of the material of each particle, see `Scene.palette`, int32 [count], ordered by particle id."""
        return self._by_id(self.material)

    @property
    def rest_densities(self) -> np.ndarray:
        """Density [kg/m^3] that each particle keeps, float64 [count], ordered by particle id."""
        return np.array([fluid.density for fluid in self.scene.properties()])[self.materials]

    @property
    def fluids_present(self) -> dict[str, str]:
        """Names of the materials that are there and their colours ``#rrggbb``."""
        palette = self.scene.palette()
        return {palette[number].name: str(palette[number].color) for number in np.unique(self.materials)}

    @property
    def weber_numbers(self) -> np.ndarray:
        """Weber number We = rho_0 v^2 d / sigma of each particle, float32 [count], ordered by particle id."""
        ratio = (self.velocities / np.float32(self.scene.foaming_speed)) ** 2
        return np.float32(self.scene.foam_threshold) * ratio.sum(axis=1)

    @property
    def foaming(self) -> np.ndarray:
        """Whether each particle counts as foam by the report's rule, We >= foam_threshold, bool [count]."""
        return self.weber_numbers >= np.float32(self.scene.foam_threshold)

    @functools.cached_property
    def foam_positions(self) -> np.ndarray:
        """Positions [m] of spray, foam and bubbles, float32 [foam_count, dim], in the order of their birth."""
        return self._of_foam("x", np.zeros((0, self.dim), np.float32))

    @functools.cached_property
    def foam_velocities(self) -> np.ndarray:
        """Their velocities [m/s], float32 [foam_count, dim]."""
        return self._of_foam("v", np.zeros((0, self.dim), np.float32))

    @functools.cached_property
    def foam_kinds(self) -> np.ndarray:
        """What they are, int32 [foam_count]: places in `state.KINDS`, 1 spray, 2 foam, 3 bubble."""
        return self._of_foam("kind", np.zeros(0, np.int32))

    @functools.cached_property
    def foam_ages(self) -> np.ndarray:
        """Time since their birth [s], float32 [foam_count]."""
        return self._of_foam("age", np.zeros(0, np.float32))

    @functools.cached_property
    def foam_lives(self) -> np.ndarray:
        """Ages [s] at which they end, float32 [foam_count]."""
        return self._of_foam("life", np.zeros(0, np.float32))

    @functools.cached_property
    def foam_ids(self) -> np.ndarray:
        """Numbers of their births, int32 [foam_count]: the same particle has the same number in every frame."""
        return self._of_foam("id", np.zeros(0, np.int32))

    @functools.cached_property
    def standing(self) -> tuple[Standing, ...]:
        """The solids but for the walls of the tank, where they stand."""
        return self.stand()

    def _of_foam(self, name: str, nothing: np.ndarray) -> np.ndarray:
        if self.diffuse is None:
            return nothing
        host: np.ndarray = download(getattr(self.diffuse, name))[: self.foam_count].copy()
        return host

    def _by_id(self, array: Any) -> np.ndarray:
        ordered: np.ndarray = download(array)[: self.count][self._order]
        return ordered

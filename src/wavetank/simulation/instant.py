"""What an instant of a world consists of, wherever its arrays are: on the device (`Frame`) or on the host (`State`).

Particles are read by id, foam in the order of its births. `COLUMNS` and `FOAM` declare each array once: checks of
files, states in memory, exports and uploads go by these tables.
"""

import dataclasses
import functools
from abc import ABC, abstractmethod
from typing import Any

import numpy as np

from wavetank.foundation.arguments import read_only
from wavetank.scene.scene import Scene
from wavetank.solids.solid import Solid

#: Parts of an instant, as `--only` names them; the surface is made of the particles.
PARTS = ("particles", "foam", "solids", "surface")
DEFAULT_COLOR = "#2f7fd0"


@dataclasses.dataclass(frozen=True)
class Field:
    """An array of an instant: one row for each particle, or for each drop of foam."""

    name: str  # of the host array that users and exports see
    column: str  # of the array on the device; columns of particles have this name in saved states
    kind: type  # of its numbers
    is_vector: bool = False  # whether a row has a number for each dimension of the world
    is_exported: bool = True

    def shape(self, rows: int, dim: int) -> tuple[int, ...]:
        """Return the shape of this array in a world of `dim` dimensions."""
        return (rows, dim) if self.is_vector else (rows,)

    def zeros(self, rows: int, dim: int) -> np.ndarray:
        """Return this array filled with zeros."""
        return np.zeros(self.shape(rows, dim), self.kind)


#: Columns of particles by their names on the device; see `device/state.py` for those that are saved.
COLUMNS = {
    field.column: field
    for field in (
        Field("ids", "id", np.int32),
        Field("positions", "x", np.float32, is_vector=True),  # m
        Field("velocities", "v", np.float32, is_vector=True),  # m/s
        Field("densities", "rho", np.float32),  # kg/m^3
        Field("materials", "material", np.int32),
        Field("dyes", "dye", np.int32),
        Field("pressure_accelerations", "a", np.float32, is_vector=True, is_exported=False),  # m/s^2
        Field("viscous_accelerations", "viscous", np.float32, is_vector=True, is_exported=False),  # m/s^2
        Field("frozen", "frozen", np.int32, is_exported=False),
    )
}
#: Particles as pictures and exports have them.
PARTICLES = tuple(field for field in COLUMNS.values() if field.is_exported)
#: Spray, foam and bubbles, in exports and in saved states.
FOAM = (
    Field("foam_ids", "id", np.int32),
    Field("foam_positions", "x", np.float32, is_vector=True),  # m
    Field("foam_velocities", "v", np.float32, is_vector=True),  # m/s
    Field("foam_kinds", "kind", np.int32),
    Field("foam_ages", "age", np.float32),  # s
    Field("foam_lives", "life", np.float32),  # s
)

#: What sets arrays of a running world.
SETTERS = {
    name: f"x = sim.{name}.copy(), x[...] = ... and sim.{name} = x set it" for name in ("positions", "velocities")
}
SETTERS["dyes"] = "sim.paint_inside dyes, and sim.add with dyes"


@dataclasses.dataclass(frozen=True)
class PlacedSolid:
    """A solid at its pose."""

    name: str
    solid: Solid
    position: np.ndarray  # m, float64 [3]: of its frame
    rotation: np.ndarray  # unit quaternion (w, x, y, z), float64 [4]
    velocity: np.ndarray  # m/s, float64 [3]: of the frame of a body; zero for other solids
    angular_velocity: np.ndarray  # rad/s, float64 [3], likewise


class Instant(ABC):
    """Particles, foam and solids of a world at one time, as host arrays."""

    scene: Scene
    number: int  # frames since the start
    time: float  # s of water since the start

    @abstractmethod
    def _by_id(self, column: str) -> np.ndarray:
        """Return an array of the particles on the host, ordered by id."""

    @abstractmethod
    def _of_foam(self, field: Field) -> np.ndarray:
        """Return an array of the foam on the host."""

    def _copy(self, name: str, values: np.ndarray) -> np.ndarray:
        return read_only(values, name, SETTERS.get(name, "nothing sets it, .copy() can be changed"))

    @property
    def dim(self) -> int:
        """Number of dimensions of the world, 2 or 3."""
        return self.scene.dim

    @functools.cached_property
    def positions(self) -> np.ndarray:
        """Positions [m], float32 [count, dim], ordered by particle id."""
        return self._copy("positions", self._by_id("x"))

    @functools.cached_property
    def velocities(self) -> np.ndarray:
        """Velocities [m/s], float32 [count, dim], ordered by particle id."""
        return self._copy("velocities", self._by_id("v"))

    @functools.cached_property
    def densities(self) -> np.ndarray:
        """Densities [kg/m^3], float32 [count], ordered by particle id."""
        return self._copy("densities", self._by_id("rho"))

    @functools.cached_property
    def ids(self) -> np.ndarray:
        """Ids of the particles, int32 [count], rising; those of removed particles are missing."""
        return self._copy("ids", self._by_id("id"))

    @functools.cached_property
    def dyes(self) -> np.ndarray:
        """Dyes, int32 [count], ordered by particle id; 0 is clear water, see `Particles.dye`."""
        return self._copy("dyes", self._by_id("dye"))

    @functools.cached_property
    def materials(self) -> np.ndarray:
        """Number of the material of each particle, see `Scene.palette`, int32 [count], ordered by particle id."""
        return self._copy("materials", self._by_id("material"))

    @property
    def rest_densities(self) -> np.ndarray:
        """Rest density [kg/m^3] of each particle, float64 [count], ordered by particle id."""
        return np.array([fluid.density for fluid in self.scene.properties()])[self.materials]

    @property
    def fluids_present(self) -> dict[str, str]:
        """Names of the materials that particles have, and their colours ``#rrggbb``."""
        palette = self.scene.palette()
        return {palette[number].name: str(palette[number].color) for number in np.unique(self.materials)}

    @property
    def colors(self) -> np.ndarray:
        """Colour of each particle, uint8 [count, 3], sRGB: that of its material, mixed with its dye by its strength."""
        palette = [material.color or DEFAULT_COLOR for material in self.scene.palette()]
        table = np.array([[int(text[k : k + 2], 16) for k in (1, 3, 5)] for text in palette], np.float32)
        dye = self.dyes.astype(np.int64)
        share = ((dye >> 24) & 0x7F)[:, None].astype(np.float32) / 127.0
        tint = np.stack([(dye >> 16) & 0xFF, (dye >> 8) & 0xFF, dye & 0xFF], axis=1).astype(np.float32)
        mixed = table[self.materials] * (1.0 - share) + tint * share
        return np.round(mixed).astype(np.uint8)

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
    def foam_ids(self) -> np.ndarray:
        """Numbers of the births of foam, int32 [n]: a drop has the same number in every frame."""
        return self._copy("foam_ids", self._of_foam(FOAM[0]))

    @functools.cached_property
    def foam_positions(self) -> np.ndarray:
        """Positions [m] of spray, foam and bubbles, float32 [n, dim], in the order of their births."""
        return self._copy("foam_positions", self._of_foam(FOAM[1]))

    @functools.cached_property
    def foam_velocities(self) -> np.ndarray:
        """Their velocities [m/s], float32 [n, dim]."""
        return self._copy("foam_velocities", self._of_foam(FOAM[2]))

    @functools.cached_property
    def foam_kinds(self) -> np.ndarray:
        """Their kinds, int32 [n]: index in `state.KINDS`, 1 spray, 2 foam, 3 bubble."""
        return self._copy("foam_kinds", self._of_foam(FOAM[3]))

    @functools.cached_property
    def foam_ages(self) -> np.ndarray:
        """Time since their births [s], float32 [n]."""
        return self._copy("foam_ages", self._of_foam(FOAM[4]))

    @functools.cached_property
    def foam_lives(self) -> np.ndarray:
        """Ages [s] at which they vanish, float32 [n]."""
        return self._copy("foam_lives", self._of_foam(FOAM[5]))


def in_space(rows: np.ndarray) -> np.ndarray:
    """Return vectors [n, 2] or [n, 3] as vectors in space, float32 [n, 3]."""
    result = np.zeros((len(rows), 3), np.float32)
    result[:, : rows.shape[1]] = rows
    return result


def solids_by_name(scene: Scene) -> dict[str, Solid]:
    """Return the solids of a scene by the names that a running world gives them: "solid 1" and so on without one."""
    found: dict[str, Solid] = {}
    for solid in scene.solids:
        name, number = solid.name, 1
        while not name or name in found:
            name, number = f"solid {number}", number + 1
        found[name] = solid
    return found


def non_finite_rows(*arrays: Any) -> np.ndarray:
    """Return which rows of these arrays [n, ...] have a number that is not finite, bool [n]."""
    return np.logical_or.reduce([~np.isfinite(rows.reshape(len(rows), -1)).all(axis=1) for rows in arrays])

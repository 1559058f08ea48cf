"""One body: what is known of it, and its public face."""

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np

from wavetank.foundation.errors import WavetankError
from wavetank.foundation.rotations import turned
from wavetank.solids.mass import Inertia
from wavetank.solids.motion import Pose
from wavetank.solids.solid import Solid

AFLOAT = 0.4  # of the water that goes along with an immersed body: what goes along with one that lies on the surface


def _six() -> np.ndarray:
    return np.zeros(6)


@dataclasses.dataclass
class Body:
    """A solid that water and other solids move."""

    name: str  # of the solid
    number: int  # of the solid
    solid: Solid
    rigid: Callable[[], Any]  # the engine's view of it
    pose: Callable[[], Pose]
    dim: int
    dry: Inertia
    wet: Inertia  # of the water that it displaces
    added: tuple[float, float]  # mass [kg] and moment of inertia [kg m^2] of the water that goes along
    unit: float  # 1/m, see `SolidSet.unit`
    immersed: float = 0.0  # share of its volume that is under water
    lasted: float = 0.0  # s, of the last step
    impulse: np.ndarray = dataclasses.field(default_factory=_six)  # kg m/s and kg m^2/s that the water gave it
    expected: np.ndarray = dataclasses.field(default_factory=_six)  # the same, of the step before
    early: np.ndarray = dataclasses.field(default_factory=_six)  # what it got of that within the step already
    carried: np.ndarray = dataclasses.field(default_factory=_six)  # N and N m: `by_grid` before the step
    by_grid: np.ndarray = dataclasses.field(default_factory=_six)  # N and N m, by the pressure of the grid
    velocity_row: np.ndarray = dataclasses.field(default_factory=_six)  # m/s and rad/s, as water sees it
    change: np.ndarray = dataclasses.field(default_factory=_six)  # m/s and rad/s, since the step before

    # --- what users see ---

    @property
    def mass(self) -> float:
        """Mass [kg]; in a 2-D world that of a metre's length."""
        return self.dry.mass

    @property
    def position(self) -> np.ndarray:
        """Position of the solid's frame [m], shape [dim]."""
        return self.pose()[0][: self.dim].copy()

    @property
    def rotation(self) -> np.ndarray:
        """Rotation of the solid's frame as a unit quaternion (w, x, y, z)."""
        return self.pose()[1].copy()

    @property
    def velocity(self) -> np.ndarray:
        """Velocity of the centre of mass [m/s], shape [dim]; writable."""
        return self.velocity_row[: self.dim].copy()

    @velocity.setter
    def velocity(self, value: Any) -> None:
        self.velocity_row[: self.dim] = self._checked("velocity", value, self.dim)
        self.rigid().linvel = self.velocity_row[:3].tolist()

    @property
    def angular_velocity(self) -> np.ndarray:
        """Angular velocity [rad/s], shape [3] (in a 2-D world the first two are 0); writable."""
        return self.velocity_row[3:].copy()

    @angular_velocity.setter
    def angular_velocity(self, value: Any) -> None:
        self.velocity_row[3:] = self._checked("angular_velocity", value, 3)
        self.rigid().angvel = self.velocity_row[3:].tolist()

    @property
    def force(self) -> np.ndarray:
        """What the water pushed it with in the last step [N], shape [dim]."""
        return self.impulse[: self.dim] / (self.lasted or 1.0)

    @property
    def torque(self) -> np.ndarray:
        """The same about its centre of mass [N m], shape [3]."""
        return self.impulse[3:] / (self.lasted or 1.0)

    def _checked(self, what: str, value: Any, length: int) -> np.ndarray:
        row = np.asarray(value, float)
        if row.shape != (length,) or not np.isfinite(row).all():
            raise WavetankError(f"{what} = {value} of body {self.name!r} must be {length} finite numbers.")
        return row

    # --- inertia ---

    @property
    def center(self) -> np.ndarray:
        """Centre of mass in the world [m], shape [3]."""
        position, rotation = self.pose()
        return position + turned(rotation, self.dry.center)

    @property
    def added_row(self) -> np.ndarray:
        """`added` for each axis of motion and turn."""
        return np.repeat(self.added, 3)

    @property
    def dry_row(self) -> np.ndarray:
        """Mass [kg] and mean moment of inertia [kg m^2] likewise."""
        return np.repeat([self.dry.mass, float(np.trace(self.dry.tensor)) / 3.0], 3)

    @property
    def taken(self) -> float:
        """Share of `added` that goes along: that of a plate on the surface is a third of a cube's (Lamb 1932, 108)."""
        return max(float(np.cbrt(self.immersed)), AFLOAT if self.impulse.any() else 0.0)

    # --- states ---

    def memory(self) -> np.ndarray:
        """Return all that it remembers, float64 [8, 6]."""
        rows = [self.impulse, self.expected, self.early, self.carried, self.by_grid, self.velocity_row, self.change]
        return np.stack([*rows, np.array([self.immersed, self.lasted, 0.0, 0.0, 0.0, 0.0])])

    def recall(self, memory: np.ndarray) -> None:
        """Take what `memory` returned."""
        rows = [row.copy() for row in memory]
        self.impulse, self.expected, self.early, self.carried, self.by_grid, self.velocity_row, self.change = rows[:7]
        self.immersed, self.lasted = float(rows[7][0]), float(rows[7][1])

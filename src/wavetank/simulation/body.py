"""One rigid body of a running world, by its name in `sim.bodies`."""

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np

from wavetank.device.turns import one_at_a_time
from wavetank.foundation.arguments import KnownAttributes, array_of, read_only
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.rotations import turned
from wavetank.simulation.coupling import Coupling
from wavetank.solids.mass import Inertia
from wavetank.solids.motion import Pose
from wavetank.solids.solid import Solid

MOVED = "sim.hold({name!r}) and sim.move({name!r}, {what}=...) move it"
SET = "sim.bodies[{name!r}].{what} = ... sets all of it"


@one_at_a_time()
@dataclasses.dataclass
class Body(KnownAttributes):
    """A solid that water and other solids move."""

    name: str  # of the solid
    number: int  # of the solid
    solid: Solid
    rigid: Callable[[], Any]  # its handle in the engine
    pose: Callable[[], Pose]
    gravity: Callable[[], np.ndarray]  # m/s^2, [3]
    dim: int
    dry: Inertia
    wet: Inertia  # of the water that it displaces when immersed
    unit: float  # 1/m, see `SolidSet.unit`
    coupling: Coupling  # of all bodies
    row: int  # of this body in `coupling`

    # --- what users see ---

    @property
    def mass(self) -> float:
        """Mass [kg]; in a 2-D world per metre of depth."""
        return self.dry.mass

    @property
    def position(self) -> np.ndarray:
        """Position of the solid's frame [m], shape [dim]."""
        return self._copy("position", self.pose()[0][: self.dim], MOVED)

    @property
    def rotation(self) -> np.ndarray:
        """Rotation of the solid's frame as a unit quaternion (w, x, y, z)."""
        return self._copy("rotation", self.pose()[1], MOVED)

    @property
    def velocity(self) -> np.ndarray:
        """Velocity of the centre of mass [m/s], shape [dim]; writable."""
        return self._copy("velocity", self.coupling.velocity[self.row][: self.dim], SET)

    @velocity.setter
    def velocity(self, value: Any) -> None:
        row = self.coupling.velocity[self.row]
        row[: self.dim] = self._checked("velocity", value, self.dim)
        self.rigid().linvel = row[:3].tolist()

    @property
    def angular_velocity(self) -> np.ndarray:
        """Angular velocity [rad/s], shape [3] (in a 2-D world the first two are 0); writable."""
        return self._copy("angular_velocity", self.coupling.velocity[self.row][3:], SET)

    @angular_velocity.setter
    def angular_velocity(self, value: Any) -> None:
        row = self.coupling.velocity[self.row]
        row[3:] = self._checked("angular_velocity", value, 3)
        self.rigid().angvel = row[3:].tolist()

    @property
    def force(self) -> np.ndarray:
        """Force of the water on it in the last step [N], shape [dim]."""
        return self.coupling.impulse[self.row][: self.dim] / (self.coupling.last_dt or 1.0)

    @property
    def buoyancy(self) -> np.ndarray:
        """The hydrostatic part of `force` [N], shape [dim]: minus the weight of the fluid that it displaces."""
        lifted: np.ndarray = -self.wet.mass * self.coupling.displaced[self.row] * self.gravity()[: self.dim]
        return lifted

    @property
    def drag(self) -> np.ndarray:
        """The hydrodynamic part of `force` [N], shape [dim]: drag, lift, slamming and added mass."""
        return self.force - self.buoyancy

    @property
    def torque(self) -> np.ndarray:
        """Torque of the water about its centre of mass in the last step [N m], shape [3]."""
        return self.coupling.impulse[self.row][3:] / (self.coupling.last_dt or 1.0)

    @property
    def immersed(self) -> float:
        """Immersed share of its volume, 0 to 1."""
        return float(self.coupling.immersed[self.row])

    @property
    def pending_impulse(self) -> np.ndarray:
        """Impulse that it is still to get, and that about its centre, [6], kg m/s and kg m^2/s."""
        return self.coupling.pending_impulse[self.row]

    @property
    def center(self) -> np.ndarray:
        """Centre of mass in the world [m], shape [3]."""
        position, rotation = self.pose()
        return position + turned(rotation, self.dry.center)

    def _copy(self, what: str, values: np.ndarray, setter: str) -> np.ndarray:
        return read_only(values.copy(), f"{what} of body {self.name!r}", setter.format(what=what, name=self.name))

    def _checked(self, what: str, value: Any, length: int) -> np.ndarray:
        row = array_of(f"{what} of body {self.name!r}", value, float, f"[{length}]")
        if row.shape != (length,) or not np.isfinite(row).all():
            raise WavetankError(f"{what} = {value} of body {self.name!r} must be {length} finite numbers.")
        return row

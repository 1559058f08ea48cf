"""Live parameters of a running world, and its gravity over time."""

from typing import TYPE_CHECKING, Any

from wavetank.device.turns import TURN
from wavetank.foundation.arguments import near
from wavetank.foundation.errors import NoAttributeError
from wavetank.foundation.params import LIVE, PARAMETERS, Parameters, refuse_assignment
from wavetank.scene.scene import Scene
from wavetank.scene.schedule import changes_gravity, gravity_at, with_gravity
from wavetank.simulation.state import Counters

if TYPE_CHECKING:
    Declared = Parameters  # what editors complete, and types are checked by
else:
    Declared = object


class LiveParameters(Declared):
    """The parameters of a scene by name: all can be read, those that are live can be set while the water moves.

    A value that is set is checked, raises `WavetankError` where it is not allowed, and holds from the next substep on.
    """

    def __init__(self, scene: Scene, counters: Counters) -> None:
        vars(self).update(_scene=scene, _counters=counters, _gravity=None)

    def at(self, time: float) -> Scene:
        """Return the scene with gravity as it is at `time` [s] of the water."""
        scene: Scene = self._scene
        if not changes_gravity(scene):
            return scene
        return scene.model_copy(update={"gravity": self._gravity or gravity_at(scene, time)})

    def fixed(self) -> Scene:
        """Return a copy of the scene that has gravity as it was set, where expressions or a tilt gave it before."""
        scene: Scene = self._scene
        return scene.model_copy() if self._gravity is None else with_gravity(scene, self._gravity)

    def release_gravity(self) -> None:
        """Give gravity back to its expressions and to the tilt of the tank."""
        vars(self)["_gravity"] = None

    def take_over(self, other: "LiveParameters") -> None:
        """Set gravity where it was set in `other`."""
        vars(self)["_gravity"] = other._gravity

    def __getattr__(self, name: str) -> Any:
        if name == "gravity":
            return self.at(self._counters.time).gravity
        if name in Parameters.model_fields:
            return getattr(self._scene, name)
        raise AttributeError(f"there is no parameter {name!r}")

    @TURN
    def __setattr__(self, name: str, value: Any) -> None:
        if name not in LIVE:
            refuse_assignment(name)
            raise NoAttributeError(f"there is no parameter {name!r}; {near(name, type(self))}.")
        if name == "gravity" and self._scene.up is None:
            self._scene.up = self._scene.upward  # it stays where it was
        if name == "gravity" and changes_gravity(self._scene):
            trial = self._scene.model_copy(update={"gravity_track": None})
            setattr(trial, name, value)
            vars(self)["_gravity"] = trial.gravity
        else:
            setattr(self._scene, name, value)

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *Parameters.model_fields})

    def __repr__(self) -> str:
        values = ", ".join(f"{p.name}={getattr(self, p.name)!r}" for p in PARAMETERS if p.live)
        return f"<live parameters {values}>"

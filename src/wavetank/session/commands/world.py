"""Commands that change the scene, its parameters and its solids."""

import math
from typing import Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from wavetank.foundation.errors import WavetankError
from wavetank.foundation.model import Quaternion
from wavetank.foundation.params import LIVE, Parameters
from wavetank.scene.scene import Scene, bundled_levels, bundled_scenes, with_particles
from wavetank.session.commands.command import Angle, Command, Length, Name, Point, Value, WorldEdit
from wavetank.session.game import HARMLESS, Game
from wavetank.session.state import MOST_SOLIDS, SessionState
from wavetank.solids.shapes import AnySolid

STRONGEST = 1e3  # m/s^2: largest gravity
LONGEST_TEXT = 2_000_000  # characters of a scene file
SWELL = 0.35  # s in which a new solid grows to its size, so that the water has time to make way


class SetParameter(WorldEdit):
    """Set a live parameter."""

    do: Literal["set"] = "set"
    coalesces_by: ClassVar = ("name",)
    name: Name
    value: Value

    def as_allowed(self, game: Game) -> Command:
        """Allow the parameters that do not act on the water."""
        return self if self.name in HARMLESS else super().as_allowed(game)

    def apply(self, state: SessionState) -> None:
        """Set it on the running simulation."""
        name, value = self.name, self.value
        if name not in LIVE:
            if name in Parameters.model_fields:
                raise WavetankError(f"{name} cannot change while the water moves; reset the scene with it.")
            raise WavetankError(f"{name!r} is not a parameter.")
        if name == "gravity" and isinstance(value, tuple) and math.hypot(*value) > STRONGEST:
            raise WavetankError(f"gravity = {value} is too strong; its length must be at most {STRONGEST:g} m/s^2.")
        setattr(state.sim, name, value)
        if name == "gravity":
            state.untilted_gravity = None


class Reset(Command):
    """Restart the scene, with the given parameters changed."""

    do: Literal["reset"] = "reset"
    is_slow: ClassVar = True
    restarts: ClassVar = True
    parameters: dict[Name, Value] = {}

    def apply(self, state: SessionState) -> None:
        """Restart it, with the camera as it is, and paused if it is."""
        unknown = next((name for name in self.parameters if name not in Parameters.model_fields), None)
        if unknown is not None:
            raise WavetankError(f"{unknown!r} is not a parameter.")
        state.end_all_tools()
        scene, camera, paused = state.changed_scene(self.parameters), state.chosen_camera, state.paused
        state.begin(scene)
        state.camera, state.paused = camera, paused or state.awaits_touch


class LoadScene(Command):
    """Start another scene: a bundled one by name, or the text of a scene file."""

    do: Literal["load"] = "load"
    is_slow: ClassVar = True
    restarts: ClassVar = True
    name: Name = ""
    text: Annotated[str, Field(max_length=LONGEST_TEXT)] = ""
    file: Annotated[str, Field(max_length=200)] = ""  # the text's name in error messages
    particles: Annotated[int, Field(ge=0, le=100_000_000)] = 0  # approximate number; 0: as the scene says

    @model_validator(mode="after")
    def _check_one_source(self) -> "LoadScene":
        if bool(self.name) == bool(self.text):
            raise ValueError("give either the name of a bundled scene or the text of a scene file.")
        return self

    def apply(self, state: SessionState) -> None:
        """Start it. Only bundled names: a command may come over the network, and must not open files."""
        if self.text:
            scene = Scene.from_text(self.text, self.file or "scene", files=False)
        elif self.name in (*bundled_scenes(), *bundled_levels()):
            scene = Scene.load(self.name)
        else:
            known = ", ".join((*bundled_scenes(), *bundled_levels()))
            raise WavetankError(f"{self.name!r} is not a bundled scene; those are {known}.")
        if self.particles and scene.goal is None:
            scene = with_particles(scene, self.particles)
        state.end_all_tools()
        state.begin(scene)


class Undo(Command):
    """Swap the world with the one that the last reset or scene replaced; a second undo swaps back."""

    do: Literal["undo"] = "undo"
    is_slow: ClassVar = True

    def apply(self, state: SessionState) -> None:
        """Swap them."""
        state.undo()


class MoveSolid(WorldEdit):
    """Carry a solid to a pose, no faster than water can make way."""

    do: Literal["move-solid"] = "move-solid"
    coalesces_by: ClassVar = ("name",)
    name: Name
    position: tuple[Length, Length] | Point | None = None  # m
    rotation: Quaternion | Angle | None = None

    def apply(self, state: SessionState) -> None:
        """Set its target pose."""
        number = state.sim.solids.find(self.name)
        if number < state.sim.solids.tank_count:
            raise WavetankError(f"{self.name!r} is a wall of the tank, which cannot move.")
        if self.position is not None and len(self.position) != state.sim.scene.dim:
            raise WavetankError(f"position = {self.position} must be {state.sim.scene.dim} numbers.")
        if isinstance(self.rotation, tuple) and sum(part * part for part in self.rotation) < 1e-12:
            raise WavetankError(f"rotation = {self.rotation} is not a quaternion of non-zero length.")
        state.moving[self.name] = (self.position, self.rotation)


class AddSolid(WorldEdit):
    """Add a solid."""

    do: Literal["add-solid"] = "add-solid"
    is_slow: ClassVar = True
    solid: AnySolid

    def apply(self, state: SessionState) -> None:
        """Add it; it grows to its size within `SWELL`."""
        if len(state.sim.scene.solids) >= MOST_SOLIDS:
            raise WavetankError(f"there are {MOST_SOLIDS} solids already; remove one first.")
        state.sim.add_solid(self.solid, SWELL)


class RemoveSolid(WorldEdit):
    """Remove a solid."""

    do: Literal["remove-solid"] = "remove-solid"
    is_slow: ClassVar = True
    name: Name

    def apply(self, state: SessionState) -> None:
        """Remove it."""
        state.sim.remove_solid(self.name)

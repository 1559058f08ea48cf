"""What changes with time in a scene: sources, sinks, and gravity, by itself or because the tank is tilted.

A tilted tank is computed in its own frame, in which gravity is rotated the other way. That holds for slow rotations:
Coriolis, centrifugal and Euler forces are neglected.
"""

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from wavetank.foundation.errors import WavetankError
from wavetank.foundation.model import Model, Number
from wavetank.foundation.rotations import turned
from wavetank.foundation.timed import Timed
from wavetank.foundation.tracks import checked_track, track, varies
from wavetank.scene.bounds import STRONGEST
from wavetank.scene.drains import Drain
from wavetank.scene.emitters import Emitter


class Tilted(Timed):
    """The tilt of a tank: gravity is rotated the other way, and pictures show the tank tilted."""

    tilt: Number = 0.0  # rad about the axis
    tilt_axis: tuple[Number, Number, Number] = (0.0, 0.0, 1.0)

    @property
    def is_tilted(self) -> bool:
        """Whether it is tilted at any time."""
        return bool(self.tilt or "tilt" in self.over_time)


class Timetable(Model):
    """The part of a scene that depends on time."""

    emitters: list[Emitter] = []
    drains: list[Drain] = []
    most_particles: Annotated[int, Field(ge=1)] | None = None  # at which emitters stop
    when_full: Literal["stop", "recycle"] = "stop"  # what emitters do then: wait, or take the oldest particles
    start_time: Annotated[Number, Field(ge=0)] = 0.0  # s: t of all expressions and keyframes when the water starts
    gravity_track: Any = None  # what gravity does over time; made from expressions or keyframes in its place

    @staticmethod
    def spread_gravity(values: dict[str, Any]) -> dict[str, Any]:
        """Accept expressions or keyframes as gravity; `gravity` is then its value at t = 0. Raises `ValueError`."""
        plain = values.get("gravity")
        if not (callable(plain) or varies(plain)):
            plain = values.get("gravity_track")  # as a state has it
            if plain is None:
                return values
        try:
            size = 3 if callable(plain) else np.atleast_1d(track(plain)(0.0)).size
            tidy = checked_track(plain, "gravity", size)
        except (WavetankError, TypeError, ValueError) as error:
            text = str(error)
            raise ValueError(text if text.startswith("gravity") else f"gravity: {text}") from None
        return {**values, "gravity": np.atleast_1d(track(tidy)(0.0)).tolist(), "gravity_track": tidy}

    def is_timed(self: Any) -> bool:
        """Say whether anything here depends on time."""
        own = self.emitters or self.drains or changes_gravity(self) or any(force.over_time for force in self.forces)
        return bool(own or any(solid.motion for solid in self.solids))

    def check_sources(self) -> None:
        """Raise `ValueError` for an emitter that is fed by an unknown drain."""
        known = [drain.name for drain in self.drains if drain.name]
        for number, emitter in enumerate(self.emitters):
            if emitter.feed and emitter.feed not in known:
                raise ValueError(
                    f"emitters[{number}].feed = {emitter.feed!r} is not the name of a drain; "
                    f"they are: {', '.join(known) or 'none; add one under [[drains]]'}."
                )


def changes_gravity(scene: Any) -> bool:
    """Say whether the gravity of a scene changes with time, or is not the one that it names."""
    return scene.gravity_track is not None or (scene.tank is not None and scene.tank.is_tilted)


def with_gravity(scene: Any, gravity: tuple[float, ...]) -> Any:
    """Return the scene with a constant gravity [m/s^2], in an upright tank."""
    tank = scene.tank and scene.tank.model_copy(update={"tilt": 0.0, "over_time": {}})
    return scene.model_copy(update={"gravity": gravity, "gravity_track": None, "tank": tank})


def tilted_by(scene: Any, time: float) -> tuple[np.ndarray, np.ndarray]:
    """Return gravity [m/s^2, 3] in the room at `time` [s] of the water, and as the tank's frame has it."""
    own = np.zeros(3)
    own[: scene.dim] = gravity_at(scene, time)
    return _in_the_room(scene, time + scene.start_time), own


def _in_the_room(scene: Any, clock: float) -> np.ndarray:
    g = np.zeros(3)
    g[: scene.dim] = scene.gravity if scene.gravity_track is None else track(scene.gravity_track)(clock)
    return g


def gravity_at(scene: Any, time: float) -> tuple[float, ...]:
    """Return gravity [m/s^2] in the frame of the tank at `time` [s] of the water; raises `WavetankError`."""
    clock = time + scene.start_time
    g = _in_the_room(scene, clock)
    if scene.tank is not None and scene.tank.is_tilted:
        tank = scene.tank.at(clock)
        axis = np.array(tank.tilt_axis, float)
        half = -0.5 * tank.tilt
        g = turned(np.concatenate([[np.cos(half)], np.sin(half) * axis / np.linalg.norm(axis)]), g)
    if not np.linalg.norm(g) <= STRONGEST:
        raise WavetankError(
            f"gravity has a length of {np.linalg.norm(g):.3g} at t = {clock:.6g} s; at most {STRONGEST:g} m/s^2 are "
            "allowed."
        )
    return tuple(g[: scene.dim].tolist())

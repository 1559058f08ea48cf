"""Prescribed motion of a solid or an emitter: its pose as a function of the simulated time.

    motion = [{time=0, position=[0.5, 0.2]}, {time=2, position=[0.5, 0.6], rotation=1.57}]
    motion = {keyframes=[...], between="smooth", after="loop"}
    motion = {position=["0.4 + 0.1*sin(2*pi*t)", 0.3], rotation="30*deg*sin(t)", axis=[0, 1, 0]}

What is not given keeps its value at rest. Positions are those of the frame, for example the centre of a box. A rotation
is an angle [rad] about `axis`, of any number of turns, or a quaternion (w, x, y, z).
"""

import functools
import json
import math
from collections.abc import Callable, Sequence
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from wavetank.foundation.errors import WavetankError
from wavetank.foundation.expressions import TRIED, TRIES
from wavetank.foundation.model import METRES, Model, Number
from wavetank.foundation.rotations import interpolate, unit_quaternion
from wavetank.foundation.tracks import Keys, check_times, checked_track, track, varies

Pose = tuple[np.ndarray, np.ndarray]  # position [m], shape [3], and rotation (w, x, y, z)
WHOLE_TURN = 1e-6  # rad: how near a loop must come to where it began

Moving = Annotated[list[Number | str], Field(min_length=2, max_length=3)]
Turning = Number | str | Annotated[list[Number | str], Field(min_length=4, max_length=4)]


class Keyframe(Model):
    """Where a solid is at a time."""

    time: Annotated[Number, Field(ge=0)]  # s
    position: Annotated[Moving | None, METRES] = None  # m
    rotation: Turning | None = None  # rad about the motion's axis, or (w, x, y, z)


def _plain(value: Any) -> Any:
    """Accept a list of keyframes as a motion; refuse a function."""
    if callable(value) and not isinstance(value, Model):
        raise ValueError(
            "motion is a Python function, which a file cannot hold; write expressions or keyframes, or make keyframes "
            "of it: motion=wt.Motion.sampled(function, seconds=10)."
        )
    return {"keyframes": value} if isinstance(value, list | tuple) else value


class Motion(Model):
    """A pose over time, by keyframes or by expressions of t [s]. Lists in place of it are keyframes."""

    keyframes: list[Keyframe] = []
    between: Literal["linear", "smooth"] = "linear"  # straight ways, or monotone cubics that rest where they turn
    after: Literal["hold", "loop"] = "hold"  # what follows the last keyframe
    position: Annotated[Moving | None, METRES] = None  # m, by expressions
    rotation: Turning | None = None  # rad about the axis, or (w, x, y, z), by expressions
    axis: tuple[Number, Number, Number] = (0.0, 0.0, 1.0)  # that angles turn about

    @model_validator(mode="after")
    def _checked(self) -> "Motion":
        try:
            self._check()
        except WavetankError as error:
            raise ValueError(str(error)) from None
        return self

    def _check(self) -> None:
        expressed = self.position is not None or self.rotation is not None
        if expressed == bool(self.keyframes):
            raise WavetankError("motion needs either keyframes, or a position or a rotation by expressions of t.")
        if not any(self.axis):
            raise WavetankError(f"motion: axis = {self.axis} has no direction; give a vector of any length but zero.")
        if self.keyframes:
            self._check_keyframes()
            self._check_loop()
        for name in ("position", "rotation"):
            if getattr(self, name) is not None:
                checked_track(getattr(self, name), f"motion.{name}", _size(getattr(self, name)))
        path = self.path()
        for number in range(round(TRIED * TRIES) + 1 if _size(self.rotation) else 0):
            path.rotation(number / TRIES)

    def _check_keyframes(self) -> None:
        check_times([key.time for key in self.keyframes], "motion")
        for name in ("position", "rotation"):
            given = [getattr(key, name) for key in self.keyframes]
            if any(value is None for value in given) and any(value is not None for value in given):
                raise WavetankError(f"motion: either every keyframe or none must have a {name}.")
            if len({_size(value) for value in given}) > 1:
                raise WavetankError(f"motion: every keyframe must have a {name} of the same number of components.")
        if all(key.position is None and key.rotation is None for key in self.keyframes):
            raise WavetankError("motion: keyframes need a position or a rotation.")

    def _check_loop(self) -> None:
        if self.after != "loop":
            return
        first, last, path = self.keyframes[0], self.keyframes[-1], self.path()
        if path.position_keys is not None:
            way = float(np.linalg.norm(path.position_keys.values[-1] - path.position_keys.values[0]))
            if way > 1e-9:
                raise WavetankError(
                    f"motion: it loops, but the last position is {way:g} m from the first and the solid would jump; "
                    "end where it begins."
                )
        if path.angle_keys is not None:
            turns = float(path.angle_keys.values[-1, 0] - path.angle_keys.values[0, 0]) / math.tau
            if abs(turns - round(turns)) * math.tau > WHOLE_TURN:
                raise WavetankError(
                    f"motion: it loops, but the last rotation is {turns:.4g} turns from the first and the solid would "
                    "jump; end after whole turns."
                )
        elif first.rotation is not None and abs(float(path.rotation(first.time) @ _quaternion(last))) < 1.0 - 1e-9:
            raise WavetankError("motion: it loops, but the last rotation is not the first; end where it begins.")

    def vectors(self) -> list[tuple[str, Sequence[float]]]:
        """Name the positions, to check that they have the world's dimension; each as numbers at its time."""
        rows = [(f"keyframes[{k}].position", key.position, key.time) for k, key in enumerate(self.keyframes)]
        rows.append(("position", self.position, 0.0))
        return [(name, track(list(row))(time).tolist()) for name, row, time in rows if row is not None]

    def path(self) -> "Path":
        """Return the pose as functions of time."""
        return _path_of(self.model_dump_json())

    @classmethod
    def sampled(
        cls, function: Callable[[float], tuple[Any, Any]], seconds: float, rate: float = 240.0, **fields: Any
    ) -> "Motion":
        """Return keyframes of `function`, which takes t [s] and returns (position or None, rotation or None).

        `rate` is keyframes a second; `fields` are those of a motion. A file can hold what this returns.
        """
        count = _samples(seconds, rate)
        rows = []
        for number in range(count + 1):
            position, rotation = function(number / rate)
            rows.append(
                {"time": number / rate}
                | {
                    name: value if isinstance(value, float | int) else np.asarray(value, float).tolist()
                    for name, value in (("position", position), ("rotation", rotation))
                    if value is not None
                }
            )
        motion: Motion = cls(keyframes=rows, **fields)
        return motion


AnyMotion = Annotated[Motion | None, BeforeValidator(_plain)]


def sampled(function: Callable[[float], Any], seconds: float, rate: float = 240.0) -> list[dict[str, Any]]:
    """Return keyframes of a function of t [s] that returns a number or a vector: what a file can hold of it."""
    return [
        {"time": number / rate, "value": np.asarray(function(number / rate), float).tolist()}
        for number in range(_samples(seconds, rate) + 1)
    ]


class Path:
    """A motion as functions of time: position [m] of as many components as the world has, and unit quaternion."""

    position: Callable[[float], np.ndarray] | None = None
    rotation: Callable[[float], np.ndarray] = None  # type: ignore[assignment]
    position_keys: Keys | None = None
    angle_keys: Keys | None = None
    turns: bool = False  # whether there is a rotation

    def __init__(self, motion: Motion) -> None:
        self.axis = np.array(motion.axis, float) / np.linalg.norm(motion.axis)
        keys, ways = motion.keyframes, (motion.between, motion.after)
        times = [key.time for key in keys]
        if motion.position is not None:
            self.position = track(motion.position)
        elif keys and keys[0].position is not None:
            rows = [track(key.position)(key.time) for key in keys]
            self.position = self.position_keys = Keys(times, np.array(rows), *ways)
        self.turns = motion.rotation is not None or bool(keys and keys[0].rotation is not None)
        if motion.rotation is not None:
            turning = track(motion.rotation)
            self.rotation = lambda time: self._turned(turning(time))
        elif self.turns and _size(keys[0].rotation) is None:
            rows = [track(key.rotation)(key.time) for key in keys]
            self.angle_keys = Keys(times, np.array(rows)[:, None], *ways)
            self.rotation = self._by_angle_keys
        elif self.turns:
            self._quaternions = [_quaternion(key) for key in keys]
            self._places = Keys(times, np.zeros((len(keys), 1)), *ways)
            self.rotation = self._by_quaternions

    def _by_angle_keys(self, time: float) -> np.ndarray:
        keys = self.angle_keys
        assert keys is not None
        whole = float(keys.values[-1, 0] - keys.values[0, 0])
        return self._turned(keys(time)[0] + keys.place(time)[2] * whole)

    def _by_quaternions(self, time: float) -> np.ndarray:
        section, share, _ = self._places.place(time)
        share = share * share * (3.0 - 2.0 * share) if self._places.between == "smooth" else share
        following = min(section + 1, len(self._quaternions) - 1)
        return interpolate(self._quaternions[section], self._quaternions[following], share)

    def _turned(self, value: Any) -> np.ndarray:
        """Return the unit quaternion of an angle about the axis, or of four numbers."""
        if np.size(value) == 4:
            return unit_quaternion([*np.asarray(value)])
        half = 0.5 * float(value)
        return np.concatenate([[math.cos(half)], math.sin(half) * self.axis])

    def pose(self, time: float, rest: Pose) -> Pose:
        """Return the pose at `time` [s]; a part that does not move is that of the pose `rest`."""
        place, turn = rest
        if self.position is not None:
            place = place.copy()
            moved = self.position(time)
            place[: len(moved)] = moved
        return place, self.rotation(time) if self.turns else turn


@functools.lru_cache(maxsize=256)
def _path_of(text: str) -> Path:
    return Path(Motion.model_construct(**_built(text)))


def _built(text: str) -> dict[str, Any]:
    fields = json.loads(text)
    return {**fields, "keyframes": [Keyframe.model_construct(**key) for key in fields["keyframes"]]}


def _quaternion(key: Keyframe) -> np.ndarray:
    return unit_quaternion([*track(key.rotation)(key.time)])


def _size(rotation: Any) -> int | None:
    return len(rotation) if isinstance(rotation, list | tuple) else None


def _samples(seconds: float, rate: float) -> int:
    if not (math.isfinite(seconds) and seconds > 0.0 and math.isfinite(rate) and rate > 0.0):
        raise WavetankError(f"seconds = {seconds} and rate = {rate} must be positive numbers.")
    return round(seconds * rate)


def shorthand(values: Any, places: Sequence[str]) -> Any:
    """Let expressions in `rotation` and in a place of a solid mean its motion; what rests is their value at t = 0.

    `places` are the keys that say where the solid's frame is.
    """
    if not isinstance(values, dict):
        return values
    moving = {name: values[name] for name in ("rotation", *places) if varies(values.get(name))}
    if not moving:
        return values
    if values.get("motion") is not None:
        raise ValueError(f"{next(iter(moving))} is an expression, and there is a motion as well; give one of the two.")
    motion: dict[str, Any] = {}
    rest = dict(values)
    for name, plain in moving.items():
        rotation = name == "rotation"
        size = None if isinstance(plain, str) else len(plain)
        try:
            motion["rotation" if rotation else "position"] = checked_track(plain, name, size)
            rest[name] = np.asarray(track(plain if isinstance(plain, str) else list(plain))(0.0)).tolist()
        except WavetankError as error:
            raise ValueError(str(error)) from None
    return rest | {"motion": motion}

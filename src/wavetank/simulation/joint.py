"""One joint of a running world: how far it has gone, and what its motor is to do."""

from collections.abc import Callable
from typing import Any

import numpy as np

from wavetank.foundation.errors import WavetankError
from wavetank.foundation.rotations import inverse, product, turned
from wavetank.foundation.tracks import track, varies
from wavetank.scene.joints import Hinge, Joint, Slider
from wavetank.solids.motion import Pose

SETTLED = 4.744  # critically damped, 5 % are left after so many times the inverse of the frequency
STOPS = 1e8  # N m s/rad or N s/m: a motor gives all that it has until it is as fast as it should be

Ends = Callable[[], tuple[Pose, Pose]]  # of the first solid, and of the second or the world


class LiveJoint:
    """A joint by name, in `sim.joints`. Hinges and sliders have a place, and motors may move them.

    The first solid turns or slides against the second one, or the world: angles [rad] and ways [m] count from where
    they began. A number that is set holds until another one is; it is part of saved states.
    """

    def __init__(
        self,
        name: str,
        joint: Joint,
        axis: Any,
        engines: Callable[[], Any],
        poses: Ends,
        starts: tuple[Pose, Pose, Pose],
    ) -> None:
        """Watch the `engines` one; `starts` are where both solids and the joint began."""
        self.name, self.joint = name, joint
        self._axis, self._engines, self._starts = axis, engines, starts
        self._poses, self._before, self._lasted = poses, 0.0, 0.0
        self._given: Callable[[Any, Pose], float] = lambda joint, middle: 0.0
        self.response = joint.response if isinstance(joint, Hinge | Slider) else 0.0

    def __repr__(self) -> str:
        return f"<{self.joint.kind} {self.name!r} of {self.joint.first!r}>"  # type: ignore[attr-defined]

    @property
    def place(self) -> np.ndarray:
        """Where it is now, on its second solid [m], shape [3]."""
        return self._carried(self._poses())[1][0]

    @property
    def position(self) -> float:
        """Angle [rad], -pi to pi, or way [m] from where it began. Raises `WavetankError` for one that has none."""
        first, second = self._frames(self._poses())
        if isinstance(self._moving, Slider):
            return float((first[0] - second[0])[0])
        turn = product(inverse(second[1]), first[1])
        return float((2.0 * np.arctan2(turn[1], turn[0]) + np.pi) % (2.0 * np.pi) - np.pi)

    @property
    def velocity(self) -> float:
        """How fast it turned [rad/s] or slid [m/s] in the last step; 0 before the first of this run."""
        way = self.position - self._before
        if isinstance(self._moving, Hinge):
            way = (way + np.pi) % (2.0 * np.pi) - np.pi
        return way / self._lasted if self._lasted else 0.0

    @property
    def target(self) -> float | None:
        """Angle [rad] or way [m] to which the motor moves it; None where it has no such aim. Writable."""
        motor = self._motor
        return float(motor.target_pos) if motor is not None and motor.stiffness > 0.0 else None

    @target.setter
    def target(self, value: float) -> None:
        self._aim("target", value)
        self.follow(self._checked("target", value), 0.0)

    @property
    def speed(self) -> float | None:
        """Speed [rad/s or m/s] at which the motor moves it; None where it has no motor for that. Writable."""
        motor = self._motor
        return float(motor.target_vel) if motor is not None and motor.stiffness == 0.0 else None

    @speed.setter
    def speed(self, value: float) -> None:
        self._aim("speed", value)
        self.run(self._checked("speed", value))

    @property
    def strength(self) -> float:
        """The most that the motor gives, N m or N. Writable."""
        motor = self._motor
        return float(motor.max_force) if motor is not None else self._moving.strength

    @strength.setter
    def strength(self, value: float) -> None:
        if not self._checked("strength", value) > 0.0:
            raise WavetankError(f"strength = {value} of joint {self.name!r} must be above 0.")
        self._data().set_motor_max_force(self._axis, float(value))

    @property
    def effort(self) -> float:
        """What the joint gave along its way in the last step, N m or N: by its motor, or its stop at a limit.

        It is what moved all that hangs on the joint; what leans on solids elsewhere gets a part of it from these. Not a
        number where joints form a ring, and 0 before the first step of this run.
        """
        middle = self._carried(self._poses())[-1]
        return self._given(self._moving, middle) if self._lasted else 0.0

    @property
    def power(self) -> float:
        """What it put into what hangs on it in the last step [W]; less than 0 where it brakes, and takes it out."""
        return self.effort * self.velocity

    # --- for `Bodies` ---

    def ask(self, given: Callable[[Any, Pose], float]) -> None:
        """Ask `given` what the joint, which is so turned there, gave."""
        self._given = given

    def drive(self, time: float, dt: float) -> None:
        """Aim at what expression or keyframes say for the step of `dt` [s] that ends at `time` [s]."""
        if not isinstance(self.joint, Hinge | Slider):
            return
        joint, self._before, self._lasted = self.joint, self.position, dt
        if varies(joint.target):
            aim = track(joint.target)
            end, begin = float(aim(time)), float(aim(time - dt))
            self.follow(end, (end - begin) / dt)
        elif varies(joint.speed):
            self.run(float(track(joint.speed)(time)))

    def follow(self, target: float, speed: float) -> None:
        """Let the motor move it to `target`, which moves at that `speed`."""
        rate, strength = SETTLED / self.response, self.strength
        self._data().set_motor(self._axis, target, speed, rate * rate, 2.0 * rate)
        self._data().set_motor_max_force(self._axis, strength)

    def run(self, speed: float) -> None:
        """Let the motor move it at that `speed`."""
        strength = self.strength
        self._data().set_motor(self._axis, 0.0, speed, 0.0, STOPS)
        self._data().set_motor_max_force(self._axis, strength)

    def take_over(self, other: "LiveJoint") -> None:
        """Let its motor do what that of `other` did."""
        motor = other._motor if isinstance(self.joint, Hinge | Slider) else None
        if motor is not None and not (varies(self._moving.speed) or varies(self._moving.target)):
            self._data().set_motor(self._axis, motor.target_pos, motor.target_vel, motor.stiffness, motor.damping)
            self._data().set_motor_max_force(self._axis, motor.max_force)

    @property
    def is_there(self) -> bool:
        """Whether the engine has it."""
        return self._engines() is not None

    def _data(self) -> Any:
        return self._engines().data

    @property
    def _moving(self) -> Hinge | Slider:
        if not isinstance(self.joint, Hinge | Slider):
            raise WavetankError(f"joint {self.name!r} is a {self.joint.kind}; hinges and sliders have these.")  # type: ignore[attr-defined]
        return self.joint

    @property
    def _motor(self) -> Any:
        return self._data().motor(self._axis) if self._moving else None

    def _frames(self, ends: tuple[Pose, Pose]) -> tuple[Pose, Pose]:
        """Return the frames of `_carried`; places of a slider are along the axes of the second one."""
        first, second = self._carried(ends)
        if isinstance(self.joint, Slider):
            back = inverse(second[1])
            return (turned(back, first[0]), first[1]), (turned(back, second[0]), second[1])
        return first, second

    def _carried(self, ends: tuple[Pose, Pose]) -> tuple[Pose, Pose]:
        """Return what were the same frames at the start, x along the axis, as both solids have carried them."""
        (at, turn), result = self._starts[2], []
        for (position, rotation), (place, before) in zip(ends, self._starts, strict=False):
            there = turned(inverse(before), at - place)
            now = product(rotation, product(inverse(before), turn))
            result.append((position + turned(rotation, there), now))
        return result[0], result[1]

    def _aim(self, what: str, value: Any) -> None:
        if varies(self._moving.speed) or varies(self._moving.target):
            raise WavetankError(
                f"joint {self.name!r} follows what its scene says over time; {what} = {value} cannot be set."
            )

    def _checked(self, what: str, value: Any) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float | np.floating) or not np.isfinite(value):
            raise WavetankError(f"{what} = {value} of joint {self.name!r} must be a finite number.")
        return float(value)

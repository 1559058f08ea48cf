"""Joints of a running world: positions, motors, reactions, and their counterparts in the engine (Rapier).

Reaction along the axis of a joint: within what hangs on a joint, the joints between its parts give as much as they
take, and cancel. So the sum over all of it of the momentum that the engine gave it in a step passed through this joint.

    code      symbol                meaning                                        unit
    pulled    J                     momentum of a body by contact and joints       kg m/s, kg m^2/s
    effort    n sum(L + r x J) / dt with the axis n, of a hinge; n sum J / dt      N m; N

The axis of a rope or a spring goes from its end on the first solid to the other one: their effort is their tension.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from wavetank.device.turns import one_at_a_time
from wavetank.foundation.arguments import KnownAttributes
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.rotations import inverse, product, turned
from wavetank.foundation.tracks import track, varies
from wavetank.scene.joints import BallJoint, Hinge, Joint, Rope, Slider, Spring, Weld
from wavetank.simulation.body import Body
from wavetank.simulation.solids import Solids
from wavetank.solids.motion import Pose

SETTLED = 4.744  # critically damped: 5 % are left after this many times the inverse of the frequency
TAUT = 0.999  # a rope that is not this much of its length pulls nothing
STOPS = 1e8  # N m s/rad or N s/m: a motor gives its full strength until it has the speed wanted
FIGURES = ("position", "velocity", "effort", "power")
WORLD: Pose = (np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))

Ends = Callable[[], tuple[Pose, Pose]]  # poses of the first solid, and of the second or the world


@one_at_a_time()
class LiveJoint(KnownAttributes):
    """A joint of a running world, in `sim.joints`. Hinges and sliders have a position, and may have a motor.

    The first solid turns or slides relative to the second one, or the world: angles [rad] and distances [m] count from
    the start. A value that is set holds until the next one; it is part of saved states. The position of a rope or a
    spring is the distance of its ends [m].
    """

    name: str
    joint: Joint
    response: float  # s

    def __init__(
        self,
        name: str,
        joint: Joint,
        axis: Any,
        engines: Callable[[], Any],
        poses: Ends,
        starts: tuple[Pose, Pose, Pose],
    ) -> None:
        """Watch the joint that `engines` returns; `starts` are the first poses of both solids and of the joint."""
        self.name, self.joint = name, joint
        self._axis, self._engines, self._starts = axis, engines, starts
        self._poses, self._last_position, self._last_dt = poses, 0.0, 0.0
        self._reaction: Callable[[Any, Pose], float] = lambda joint, frame: 0.0
        self.response = joint.response if isinstance(joint, Hinge | Slider) else 0.0

    def __repr__(self) -> str:
        return f"<{self.joint.kind} {self.name!r} of {self.joint.first!r}>"  # type: ignore[attr-defined]

    @property
    def place(self) -> np.ndarray:
        """Its place in the world [m], shape [3], as a point of the second solid."""
        return self._carried(self._poses())[1][0]

    @property
    def position(self) -> float:
        """Angle [rad], -pi to pi, or distance [m] from the start; of a rope or a spring that of its ends [m].

        Raises `WavetankError` for other kinds of joints.
        """
        if isinstance(self.joint, Rope | Spring):
            return float(np.linalg.norm(self._line(self.joint)))
        first, second = self._frames(self._poses())
        if isinstance(self._moving, Slider):
            return float((first[0] - second[0])[0])
        turn = product(inverse(second[1]), first[1])
        return float((2.0 * np.arctan2(turn[1], turn[0]) + np.pi) % (2.0 * np.pi) - np.pi)

    @property
    def velocity(self) -> float:
        """Angular velocity [rad/s] or velocity [m/s] in the last step; 0 before the first of this run."""
        way = self.position - self._last_position
        if isinstance(self.joint, Hinge):
            way = (way + np.pi) % (2.0 * np.pi) - np.pi
        return way / self._last_dt if self._last_dt else 0.0

    @property
    def target(self) -> float | None:
        """Angle [rad] or distance [m] that the motor drives it to; None where it drives to none. Writable."""
        motor = self._motor
        return float(motor.target_pos) if motor is not None and motor.stiffness > 0.0 else None

    @target.setter
    def target(self, value: float) -> None:
        self._check_free("target", value)
        self.follow(self._checked("target", value), 0.0)

    @property
    def speed(self) -> float | None:
        """Speed [rad/s or m/s] that the motor holds; None where it holds none. Writable."""
        motor = self._motor
        return float(motor.target_vel) if motor is not None and motor.stiffness == 0.0 else None

    @speed.setter
    def speed(self, value: float) -> None:
        self._check_free("speed", value)
        self.run(self._checked("speed", value))

    @property
    def strength(self) -> float:
        """Largest torque [N m] or force [N] of the motor. Writable."""
        motor = self._motor
        return float(motor.max_force) if motor is not None else self._moving.strength

    @strength.setter
    def strength(self, value: float) -> None:
        if not self._checked("strength", value) > 0.0:
            raise WavetankError(f"strength = {value} of joint {self.name!r} must be above 0.")
        self._data().set_motor_max_force(self._axis, float(value))

    @property
    def effort(self) -> float:
        """Torque [N m] or force [N] along its axis in the last step: of its motor, or of its stop at a limit.

        Of a rope or a spring its tension [N], below 0 where a spring pushes. It is what moved all that hangs on the
        joint; contact with other solids may bear a part of the load. NaN where joints form a ring, of a spring what its
        law says there; 0 before the first step of this run. Raises `WavetankError` for other kinds of joints.
        """
        position, velocity = self.position, self.velocity
        if not self._last_dt:
            return 0.0
        if isinstance(self.joint, Rope | Spring):
            length = _length(self.joint)
            if isinstance(self.joint, Rope) and position < TAUT * length:
                return 0.0
            pull = self._reaction(self.joint, (WORLD[0], _turn_from_x(self._line(self.joint))))
            if isinstance(self.joint, Spring) and math.isnan(pull):
                return self.joint.stiffness * (position - length) + self.joint.damping * velocity
            return pull
        return self._reaction(self._moving, self._carried(self._poses())[-1])

    @property
    def power(self) -> float:
        """Power [W] that it gave to what hangs on it in the last step; negative where it brakes."""
        return self.effort * self.velocity

    # --- for `Bodies` ---

    def read_reaction(self, reaction: Callable[[Any, Pose], float]) -> None:
        """Let `reaction` return the reaction [N m or N] of a joint with this frame, in the last step."""
        self._reaction = reaction

    def drive(self, time: float, dt: float) -> None:
        """Set the motor to what expression or keyframes give for the step of `dt` [s] that ends at `time` [s]."""
        if isinstance(self.joint, BallJoint | Weld):
            return
        joint, self._last_position, self._last_dt = self.joint, self.position, dt
        if not isinstance(joint, Hinge | Slider):
            return
        if varies(joint.target):
            target = track(joint.target)
            end, begin = float(target(time)), float(target(time - dt))
            self.follow(end, (end - begin) / dt)
        elif varies(joint.speed):
            self.run(float(track(joint.speed)(time)))

    def follow(self, target: float, speed: float) -> None:
        """Let the motor drive it to `target` [rad or m], which moves at `speed` [rad/s or m/s]."""
        rate, strength = SETTLED / self.response, self.strength
        self._data().set_motor(self._axis, target, speed, rate * rate, 2.0 * rate)
        self._data().set_motor_max_force(self._axis, strength)

    def run(self, speed: float) -> None:
        """Let the motor hold the `speed` [rad/s or m/s]."""
        strength = self.strength
        self._data().set_motor(self._axis, 0.0, speed, 0.0, STOPS)
        self._data().set_motor_max_force(self._axis, strength)

    def take_over(self, other: "LiveJoint") -> None:
        """Set its motor as that of `other` is set."""
        motor = other._motor if isinstance(self.joint, Hinge | Slider) else None
        if motor is not None and not (varies(self._moving.speed) or varies(self._moving.target)):
            self._data().set_motor(self._axis, motor.target_pos, motor.target_vel, motor.stiffness, motor.damping)
            self._data().set_motor_max_force(self._axis, motor.max_force)

    @property
    def is_there(self) -> bool:
        """Whether it exists in the engine."""
        return self._engines() is not None

    def _data(self) -> Any:
        return self._engines().data

    @property
    def _moving(self) -> Hinge | Slider:
        if not isinstance(self.joint, Hinge | Slider):
            raise WavetankError(f"joint {self.name!r} is a {self.joint.kind}; hinges and sliders have this.")  # type: ignore[attr-defined]
        return self.joint

    @property
    def _motor(self) -> Any:
        return self._data().motor(self._axis) if self._moving else None

    def _frames(self, ends: tuple[Pose, Pose]) -> tuple[Pose, Pose]:
        """Return the frames of `_carried`; those of a slider have their places along the axes of the second one."""
        first, second = self._carried(ends)
        if isinstance(self.joint, Slider):
            back = inverse(second[1])
            return (turned(back, first[0]), first[1]), (turned(back, second[0]), second[1])
        return first, second

    def _carried(self, ends: tuple[Pose, Pose]) -> tuple[Pose, Pose]:
        """Return the joint's frame, x along the axis, as each of both solids has moved it since the start."""
        (at, turn), result = self._starts[2], []
        for (position, rotation), (place, before) in zip(ends, self._starts, strict=False):
            there = turned(inverse(before), at - place)
            now = product(rotation, product(inverse(before), turn))
            result.append((position + turned(rotation, there), now))
        return result[0], result[1]

    def _line(self, joint: Rope | Spring) -> np.ndarray:
        """Return the way from the end of a line on the first solid to the other [m], shape [3]."""
        ends = zip(self._poses(), self._starts, (joint.at, joint.to), strict=False)
        first, second = (
            position + turned(product(rotation, inverse(before)), np.array([*end, 0.0][:3]) - place)
            for (position, rotation), (place, before), end in ends
        )
        return second - first

    def _check_free(self, what: str, value: Any) -> None:
        if varies(self._moving.speed) or varies(self._moving.target):
            raise WavetankError(
                f"joint {self.name!r} follows what its scene says over time; {what} = {value} cannot be set."
            )

    def _checked(self, what: str, value: Any) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float | np.floating) or not np.isfinite(value):
            raise WavetankError(f"{what} = {value} of joint {self.name!r} must be a finite number.")
        return float(value)


def joint_reaction(members: Iterable[Body], joints: Mapping[str, Any], joint: Any, frame: Pose) -> float:
    """Return the torque [N m] or force [N] that `joint` gave along its axis, x of its `frame`, in the last step.

    NaN where joints form a ring.
    """
    hanging = hanging_on(joint, [live.joint for live in joints.values()])
    total, axis = 0.0, turned(frame[1], np.array([1.0, 0.0, 0.0]))
    for body in members:
        if body.name in hanging:
            pulled = body.coupling.contact_impulse[body.row]
            turn = pulled[3:] + np.cross(body.center - frame[0], pulled[:3])
            total += float(axis @ (turn if isinstance(joint, Hinge) else pulled[:3])) / (body.coupling.last_dt or 1.0)
    return math.nan if joint.second in hanging else total


def hanging_on(joint: Any, joints: list[Any]) -> set[str]:
    """Return the names of the solids that other joints connect to the first one of `joint`; "" is the world."""
    found, rest = {joint.first}, [joint.first]
    while rest:
        name = rest.pop()
        for other in joints:
            ends = {other.first, other.second}
            if other is not joint and name in ends:
                rest += [end for end in ends - found if end]
                found |= ends
    return found


class Joints(dict[str, LiveJoint]):
    """The joints of a world by name. Raises `WavetankError` for an unknown name."""

    @property
    def motors(self) -> list[str]:
        """Names of the hinges and sliders that have a motor."""
        moving = [(name, live) for name, live in self.items() if isinstance(live.joint, Hinge | Slider)]
        return [name for name, live in moving if live.target is not None or live.speed is not None]

    @property
    def powers(self) -> dict[str, float]:
        """Power [W] of each joint that has a motor; negative where it brakes."""
        return {name: self[name].power for name in self.motors}

    def figures(self) -> dict[str, float]:
        """Return position [rad or m], velocity and effort [N m or N] of all but ball joints and welds, by name.

        And the power [W] of hinges and sliders.
        """
        rows: dict[str, float] = {}
        for name, live in self.items():
            if not isinstance(live.joint, BallJoint | Weld):
                keys = FIGURES if isinstance(live.joint, Hinge | Slider) else FIGURES[:-1]
                rows |= {f"joints.{name}.{key}": float(getattr(live, key)) for key in keys}
        return {key: value for key, value in rows.items() if math.isfinite(value)}  # a ring has no effort of its own

    def __missing__(self, name: str) -> LiveJoint:
        raise WavetankError(f"there is no joint named {name!r}; joints: {', '.join(self) or 'none'}.")


def put_joints(
    engine: Any, world: Callable[[], Any], handles: Sequence[Any], solids: Solids, joints: Sequence[Joint]
) -> Joints:
    """Create `joints` in the `world` of the `engine` and return them by name; `handles` are those of the solids."""
    result = Joints()
    for joint in joints:
        name, number = joint.name or f"{joint.kind} of {joint.first}", 2  # type: ignore[attr-defined]
        while name in result:
            name, number = f"{joint.name or joint.kind} {number}", number + 1  # type: ignore[attr-defined]
        result[name] = _put(engine, world, handles, solids, (name, joint))
    return result


def _put(
    engine: Any, world: Callable[[], Any], handles: Sequence[Any], solids: Solids, named: tuple[str, Joint]
) -> LiveJoint:
    name, joint = named
    first = solids.find(joint.first)
    second = solids.find(joint.second) if joint.second else None
    ground = world().add_body(engine.RigidBody.fixed()) if second is None else None
    ends = (handles[first], ground if second is None else handles[second])
    starts = (solids.starts[first], WORLD if second is None else solids.starts[second], _frame(joint))
    built = _built(engine, joint, starts)
    handle = world().impulse_joints.insert(ends[1], ends[0], built)
    axis = engine.JointAxis.LIN_X if isinstance(joint, Slider) else engine.JointAxis.ANG_X

    def poses() -> tuple[Pose, Pose]:
        other = solids.poses[solids.find(joint.second)] if joint.second else WORLD
        return solids.poses[solids.find(joint.first)], other

    live = LiveJoint(name, joint, axis, lambda: world().impulse_joints.get(handle), poses, starts)
    if isinstance(joint, Hinge | Slider):
        if joint.target is not None:
            live.follow(float(track(joint.target)(0.0)), 0.0)
        elif joint.speed is not None:
            live.run(float(track(joint.speed)(0.0)))
        if joint.target is not None or joint.speed is not None:
            live.strength = joint.strength
    return live


def _frame(joint: Joint) -> Pose:
    """Return the frame of a joint at the start; x of a hinge or a slider is along its axis."""
    at = np.array([*joint.at, 0.0][:3], float)
    if not isinstance(joint, Hinge | Slider):
        return at, WORLD[1]
    return at, _turn_from_x(np.array([*joint.axis, 0.0][:3], float))


def _turn_from_x(axis: np.ndarray) -> np.ndarray:
    """Return the shortest rotation from x to the direction of an axis, as a quaternion."""
    axis = axis / max(float(np.linalg.norm(axis)), 1e-30)
    turn = np.array([1.0 + axis[0], 0.0, -axis[2], axis[1]])
    return turn / np.linalg.norm(turn) if axis[0] > -1.0 + 1e-12 else np.array([0.0, 0.0, 1.0, 0.0])


def _length(joint: Rope | Spring) -> float:
    """Return the length of a rope, or that of a spring at rest [m]."""
    return float(np.linalg.norm(np.subtract(joint.to, joint.at))) if joint.length is None else joint.length


def _built(engine: Any, joint: Joint, starts: tuple[Pose, Pose, Pose]) -> Any:
    """Return the engine's joint; its first end is our second one, so that positions are those of our first solid."""
    first, second, (at, turn) = starts

    def local(pose: Pose, point: Any) -> list[float]:
        place = np.array([*point, 0.0][:3], float)
        return turned(inverse(pose[1]), place - pose[0]).tolist()

    def frame(pose: Pose) -> Any:
        rotation = engine.Rotation3(*map(float, product(inverse(pose[1]), turn)))
        return engine.Isometry3(local(pose, at), rotation)

    if isinstance(joint, Rope | Spring):
        if isinstance(joint, Rope):
            line = engine.RopeJointBuilder(_length(joint))
        else:
            line = engine.SpringJointBuilder(_length(joint), joint.stiffness, joint.damping)
        return line.local_anchor1(local(second, joint.to)).local_anchor2(local(first, joint.at)).build()
    if isinstance(joint, Weld):
        return engine.FixedJointBuilder().local_frame1(frame(second)).local_frame2(frame(first)).build()
    if isinstance(joint, BallJoint):
        ball = engine.SphericalJointBuilder().contacts_enabled(False)
        return ball.local_anchor1(local(second, joint.at)).local_anchor2(local(first, joint.at)).build()
    assert isinstance(joint, Hinge | Slider)
    masks = engine.JointAxesMask
    mask = masks.LOCKED_REVOLUTE_AXES if isinstance(joint, Hinge) else masks.LOCKED_PRISMATIC_AXES
    builder = engine.GenericJointBuilder(mask).local_frame1(frame(second)).local_frame2(frame(first))
    if joint.limits is not None:
        axis = engine.JointAxis.ANG_X if isinstance(joint, Hinge) else engine.JointAxis.LIN_X
        builder = builder.limits(axis, *joint.limits)
    return builder.contacts_enabled(False).build()

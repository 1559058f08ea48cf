"""Joints of a scene as the engine's."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from wavetank.foundation.errors import WavetankError
from wavetank.foundation.rotations import inverse, product, turned
from wavetank.foundation.tracks import track
from wavetank.scene.joints import BallJoint, Hinge, Joint, Rope, Slider, Spring, Weld
from wavetank.simulation.joint import LiveJoint
from wavetank.simulation.moving_solids import MovingSolids
from wavetank.solids.motion import Pose

WORLD: Pose = (np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))


class Joints(dict[str, LiveJoint]):
    """Joints by name."""

    def __missing__(self, name: str) -> LiveJoint:
        raise WavetankError(f"there is no joint named {name!r}; joints: {', '.join(self) or 'none'}.")


def put_joints(
    engine: Any, world: Callable[[], Any], handles: Sequence[Any], solids: MovingSolids, joints: Sequence[Joint]
) -> Joints:
    """Put joints into the `world` of the `engine`, and return them by name; `handles` are those of the solids."""
    result = Joints()
    for joint in joints:
        name, number = joint.name or f"{joint.kind} of {joint.first}", 2  # type: ignore[attr-defined]
        while name in result:
            name, number = f"{joint.name or joint.kind} {number}", number + 1  # type: ignore[attr-defined]
        result[name] = _put(engine, world, handles, solids, (name, joint))
    return result


def _put(
    engine: Any, world: Callable[[], Any], handles: Sequence[Any], solids: MovingSolids, named: tuple[str, Joint]
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
    """Return where a joint is at the start; the x of a hinge or a slider is along its axis."""
    at = np.array([*joint.at, 0.0][:3], float)
    if not isinstance(joint, Hinge | Slider):
        return at, WORLD[1]
    axis = np.array([*joint.axis, 0.0][:3], float)
    axis /= np.linalg.norm(axis)
    turn = np.array([1.0 + axis[0], 0.0, -axis[2], axis[1]])  # the shortest way from x to the axis
    return at, turn / np.linalg.norm(turn) if axis[0] > -1.0 + 1e-12 else np.array([0.0, 0.0, 1.0, 0.0])


def _built(engine: Any, joint: Joint, starts: tuple[Pose, Pose, Pose]) -> Any:
    """Return the engine's joint; its first end is our second one, so that angles and ways are the first solid's."""
    first, second, (at, turn) = starts

    def local(pose: Pose, point: Any) -> list[float]:
        place = np.array([*point, 0.0][:3], float)
        return turned(inverse(pose[1]), place - pose[0]).tolist()

    def frame(pose: Pose) -> Any:
        rotation = engine.Rotation3(*map(float, product(inverse(pose[1]), turn)))
        return engine.Isometry3(local(pose, at), rotation)

    if isinstance(joint, Rope | Spring):
        span = float(np.linalg.norm(np.subtract(joint.to, joint.at)))
        length = span if joint.length is None else joint.length
        if isinstance(joint, Rope):
            line = engine.RopeJointBuilder(length)
        else:
            line = engine.SpringJointBuilder(length, joint.stiffness, joint.damping)
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

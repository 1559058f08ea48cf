"""Joints of a scene as the engine's."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from wavetank.foundation.rotations import inverse, turned
from wavetank.scene.joints import BallJoint, Hinge, Joint, Rope, Slider, Spring, Weld
from wavetank.simulation.moving_solids import MovingSolids

DAMPING = 1e8  # N m s or N s/m: a motor gives all that it has until it is as fast as it should be


def put_joint(engine: Any, world: Any, handles: Sequence[Any], solids: MovingSolids, joint: Joint) -> None:
    """Put a joint into the `world` of the `engine`; `handles` are those of the solids."""
    first = solids.find(joint.first)
    second = solids.find(joint.second) if joint.second else None
    if second is None:
        ground = world.add_body(engine.RigidBody.fixed())
    ends = (handles[first], ground if second is None else handles[second])

    def local(number: int | None, point: Any) -> list[float]:
        place = np.array([*point, 0.0][:3], float)
        if number is None:
            return place.tolist()
        position, rotation = solids.poses[number]
        return turned(inverse(rotation), place - position).tolist()

    def direction(number: int | None, axis: Any) -> list[float]:
        vector = np.array([*axis, 0.0][:3], float)
        vector /= np.linalg.norm(vector)
        if number is None:
            return vector.tolist()
        return turned(inverse(solids.poses[number][1]), vector).tolist()

    if isinstance(joint, Hinge | Slider):
        kind = engine.RevoluteJointBuilder if isinstance(joint, Hinge) else engine.PrismaticJointBuilder
        # Angles and ways are those of the second end: it begins with the world, so that they are the first solid's.
        builder = kind(direction(second, joint.axis))
        builder = builder.local_axis1(direction(second, joint.axis)).local_axis2(direction(first, joint.axis))
        if joint.limits is not None:
            builder = builder.limits(*joint.limits)
        if joint.speed is not None:
            builder = builder.motor_velocity(joint.speed, DAMPING).motor_max_force(joint.strength)
    elif isinstance(joint, Rope | Spring):
        span = float(np.linalg.norm(np.subtract(joint.to, joint.at)))
        length = span if joint.length is None else joint.length
        if isinstance(joint, Rope):
            builder = engine.RopeJointBuilder(length)
        else:
            builder = engine.SpringJointBuilder(length, joint.stiffness, joint.damping)
    elif isinstance(joint, Weld):
        pose = solids.poses[first]
        builder = engine.FixedJointBuilder()
        turn = engine.Rotation3(*map(float, pose[1])).inverse()
        if second is not None:
            turn = turn * engine.Rotation3(*map(float, solids.poses[second][1]))
        builder = builder.local_frame2(engine.Isometry3(local(first, joint.at), turn))
        builder = builder.local_frame1(engine.Isometry3(local(second, joint.at)))
    else:
        assert isinstance(joint, BallJoint)
        builder = engine.SphericalJointBuilder()
    if not isinstance(joint, Weld):  # whose frames say it
        far = joint.to if isinstance(joint, Rope | Spring) else joint.at
        builder = builder.local_anchor1(local(second, far)).local_anchor2(local(first, joint.at))
    if isinstance(joint, Hinge | Slider | BallJoint):
        builder = builder.contacts_enabled(False)
    world.impulse_joints.insert(ends[1], ends[0], builder.build())

"""What a joint gave: all that contact and joints have moved what hangs on it by, along its axis.

Within what hangs on a joint, the joints between its parts give as much as they take, and cancel. So the sum over all of
it of the momentum that the engine gave it in a step is what came through this joint, for a robot as for a single flap.

    code      symbol                meaning                                        unit
    pulled    J                     momentum of a body by contact and joints       kg m/s, kg m^2/s
    effort    n sum(L + r x J) / dt with the axis n, of a hinge; n sum J / dt      N m; N
"""

import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from wavetank.foundation.rotations import turned
from wavetank.scene.joints import Hinge
from wavetank.simulation.body import Body
from wavetank.solids.motion import Pose


def given(members: Iterable[Body], joints: Mapping[str, Any], joint: Any, middle: Pose) -> float:
    """Return what `joint`, whose frame is at `middle` with x along its axis, gave in the last step, N m or N.

    Not a number where joints form a ring.
    """
    hanging = hanging_on(joint, [live.joint for live in joints.values()])
    total, axis = 0.0, turned(middle[1], np.array([1.0, 0.0, 0.0]))
    for body in members:
        if body.name in hanging:
            pulled = body.coupling.pulled[body.row]
            turn = pulled[3:] + np.cross(body.center - middle[0], pulled[:3])
            total += float(axis @ (turn if isinstance(joint, Hinge) else pulled[:3])) / (body.coupling.lasted or 1.0)
    return math.nan if joint.second in hanging else total


def hanging_on(joint: Any, joints: list[Any]) -> set[str]:
    """Return the names of the solids that joints hold to the first one of a joint, but for that; "" is the world."""
    found, rest = {joint.first}, [joint.first]
    while rest:
        name = rest.pop()
        for other in joints:
            ends = {other.first, other.second}
            if other is not joint and name in ends:
                rest += [end for end in ends - found if end]
                found |= ends
    return found

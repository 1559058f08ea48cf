"""Grab: moves a solid with the pointer; a body hangs on a spring."""

from typing import ClassVar

import numpy as np
from pydantic import PrivateAttr
from typing_extensions import override

from wavetank.session.tools.hand import Hand
from wavetank.session.tools.solids import Spring, force_unit, move_towards, pull_with_spring, to_body_frame
from wavetank.session.tools.tool import Tool, option

STRETCH = 0.1  # of the world's length: stretch of the spring at its largest force


class Grab(Tool):
    """Move a solid."""

    name: ClassVar[str] = "grab"
    label: ClassVar[str] = "Grab"
    sentence: ClassVar[str] = "Drag a solid through the water; a body hangs on a spring, so heavy ones lag."
    icon: ClassVar[str] = (
        "M8 13V6a1.5 1.5 0 0 1 3 0v5V4a1.5 1.5 0 0 1 3 0v7V6a1.5 1.5 0 0 1 3 0v8a7 7 0 0 1-7 7c-4 0-5-3-7-8 1-1 2-1 4 2"
    )
    key: ClassVar[str] = "g"
    cursor_radius: ClassVar[bool] = False
    through_water: ClassVar[bool] = True
    takes: ClassVar[str] = "solid"

    pace: float = option(0.8, 0.05, 2.0, "√(gL)", "Largest speed of the solid.")
    strength: float = option(1.0, 0.01, 10.0, "cubes", "Largest force, in weights of a cube of water of L/4.")
    _held: str = PrivateAttr("")
    _point: np.ndarray | None = PrivateAttr(None)
    _offset: np.ndarray | None = PrivateAttr(None)

    @override
    def begin(self, hand: Hand) -> None:
        if hand.hit.kind != "solid":
            hand.notes.append("There is no solid under the pointer; place one, or point at one.")
            return
        self._held = hand.hit.name
        if self._held in hand.sim.bodies and not hand.sim.bodies[self._held].solid.held:
            self._point = to_body_frame(hand.sim.bodies[self._held], hand.anchor)
            return
        self._offset = hand.sim.solids.poses[hand.sim.solids.find(self._held)][0] - hand.anchor

    @override
    def hold(self, hand: Hand, duration: float) -> None:
        if self._point is not None and self._held in hand.sim.bodies:
            spring = Spring(self.strength * force_unit(hand.sim, hand.size), STRETCH * hand.size)
            limit = self.pace * hand.speed
            speed = hand.velocity * min(1.0, limit / max(float(np.linalg.norm(hand.velocity)), 1e-12))
            pull_with_spring(hand.sim, hand.sim.bodies[self._held], self._point, hand.point, speed, spring, duration)
        elif self._held in hand.sim.solids.names and self._offset is not None:
            move_towards(hand.sim, self._held, hand.point + self._offset, None, self.pace * hand.speed * duration)

    @override
    def end(self, hand: Hand) -> None:
        if self._held in hand.sim.solids.names and hand.sim.solids.has_motion(self._held):
            hand.sim.release(self._held)

"""Shove: a force on a body at the point under the pointer."""

from typing import ClassVar

import numpy as np
from pydantic import PrivateAttr
from typing_extensions import override

from wavetank.session.tools.hand import Hand
from wavetank.session.tools.solids import apply_force, force_unit, to_body_frame, to_world_frame
from wavetank.session.tools.tool import Tool, option

STRAIGHT = 0.02  # of the world's length: a shorter drag pushes straight ahead


class Shove(Tool):
    """Apply a force to a body."""

    name: ClassVar[str] = "shove"
    label: ClassVar[str] = "Shove"
    sentence: ClassVar[str] = "Hold on a body to push it away from you; drag to choose the direction."
    icon: ClassVar[str] = "M13 7h8v10h-8zM2 12h8m-3-3 3 3-3 3M3 20c3-2 6-2 9 0s6 2 9 0"
    key: ClassVar[str] = "v"
    cursor_radius: ClassVar[bool] = False
    through_water: ClassVar[bool] = True
    takes: ClassVar[str] = "body"

    strength: float = option(0.3, 0.01, 5.0, "cubes", "Force, in weights of a cube of water of L/4.")
    _held: str = PrivateAttr("")
    _point: np.ndarray | None = PrivateAttr(None)

    @override
    def begin(self, hand: Hand) -> None:
        if hand.hit.kind != "solid" or hand.hit.name not in hand.sim.bodies:
            hand.notes.append("There is no body under the pointer: a solid with a density or a mass; drop one.")
            return
        self._held, self._point = hand.hit.name, to_body_frame(hand.sim.bodies[hand.hit.name], hand.anchor)

    @override
    def hold(self, hand: Hand, duration: float) -> None:
        if self._point is None or self._held not in hand.sim.bodies:
            return
        body = hand.sim.bodies[self._held]
        way = hand.point - to_world_frame(body, self._point)
        if np.linalg.norm(hand.point - hand.anchor) < STRAIGHT * hand.size:
            way = np.array([1.0, 0.0, 0.0]) if hand.sim.scene.dim == 2 else hand.direction
        force = way * (self.strength * force_unit(hand.sim, hand.size) / max(float(np.linalg.norm(way)), 1e-9))
        apply_force(body, self._point, force, duration)

"""Grab: takes hold of a solid and carries it; it pushes the water as it goes."""

from typing import ClassVar

import numpy as np
from pydantic import PrivateAttr
from typing_extensions import override

from wavetank.session.tools.carry import carry
from wavetank.session.tools.hand import Hand
from wavetank.session.tools.tool import Tool, option


class Grab(Tool):
    """Carry a solid."""

    name: ClassVar[str] = "grab"
    label: ClassVar[str] = "Grab"
    sentence: ClassVar[str] = "Drag a solid through the water."
    icon: ClassVar[str] = (
        "M8 13V6a1.5 1.5 0 0 1 3 0v5V4a1.5 1.5 0 0 1 3 0v7V6a1.5 1.5 0 0 1 3 0v8a7 7 0 0 1-7 7c-4 0-5-3-7-8 1-1 2-1 4 2"
    )
    key: ClassVar[str] = "g"
    cursor_radius: ClassVar[bool] = False
    through_water: ClassVar[bool] = True

    pace: float = option(0.8, 0.05, 2.0, "√(gL)", "Largest speed it is carried at.")
    _held: str = PrivateAttr("")
    _offset: np.ndarray | None = PrivateAttr(None)

    @override
    def begin(self, hand: Hand) -> None:
        if hand.hit.kind != "solid":
            hand.notes.append("There is no solid under the pointer; place one, or point at one.")
            return
        self._held = hand.hit.name
        self._offset = hand.sim.solids.poses[hand.sim.solids.find(self._held)][0] - hand.anchor

    @override
    def hold(self, hand: Hand, duration: float) -> None:
        if self._held in hand.sim.solids.names and self._offset is not None:
            carry(hand.sim, self._held, hand.point + self._offset, None, self.pace * hand.speed * duration)

    @override
    def end(self, hand: Hand) -> None:
        if self._held in hand.sim.solids.names and hand.sim.solids.moves_itself(self._held):
            hand.sim.release(self._held)

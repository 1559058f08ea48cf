"""Dye: colours the particles at the pointer."""

from typing import ClassVar

import numpy as np
from pydantic import PrivateAttr
from typing_extensions import override

from wavetank.session.tools.hand import Hand
from wavetank.session.tools.tool import Color, Tool, dye_of, option


class Dye(Tool):
    """Dye water."""

    name: ClassVar[str] = "dye"
    label: ClassVar[str] = "Dye"
    sentence: ClassVar[str] = "Drag over the water to colour it; without a colour it becomes clear."
    icon: ClassVar[str] = "M12 3c4 5 6 8 6 11a6 6 0 0 1-12 0c0-3 2-6 6-11zM9 14a3 3 0 0 0 3 3"
    key: ClassVar[str] = "9"

    radius: float = option(0.1, 0.01, 0.5, "L", "Radius of the brush.")
    color: Color = option("#ff2458", None, None, "color", "Colour.")
    strength: float = option(1.0, 0.05, 1.0, "", "Strength of the colour.")
    _last: np.ndarray | None = PrivateAttr(None)

    @override
    def begin(self, hand: Hand) -> None:
        self._touch(hand)

    @override
    def move(self, hand: Hand) -> None:
        self._touch(hand)

    @override
    def hold(self, hand: Hand, duration: float) -> None:
        self._touch(hand)

    def _touch(self, hand: Hand) -> None:
        place = hand.pick_again().point
        # A fast stroke leaves no gaps, unless it jumped from one wave to another.
        near = self._last is not None and float(np.linalg.norm(place - self._last)) < 0.2 * hand.size
        start = self._last if near and self._last is not None else place
        hand.sim.paint_inside(start, place, hand.radius(self.radius), dye_of(self.color, self.strength))
        self._last = place

"""Freeze: particles at the pointer become fixed, until they are melted."""

from typing import ClassVar

from typing_extensions import override

from wavetank.session.tools.hand import Hand
from wavetank.session.tools.tool import Tool, option


class Freeze(Tool):
    """Freeze water, or melt it."""

    name: ClassVar[str] = "freeze"
    label: ClassVar[str] = "Freeze"
    sentence: ClassVar[str] = "Drag over the water to freeze it, or to melt it again."
    icon: ClassVar[str] = "M12 2v20M3.500 7l17 10M20.500 7l-17 10M9 3.500l3 3 3-3M9 20.500l3-3 3 3"
    key: ClassVar[str] = "7"

    radius: float = option(0.08, 0.01, 0.5, "L", "Radius.")
    melt: bool = option(False, None, None, "", "Melts instead.")

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
        hand.sim.freeze_inside(hand.before, hand.point, hand.radius(self.radius), not self.melt)

"""Attract and repel: a central force on the water around the pointer."""

from typing import ClassVar

from typing_extensions import override

from wavetank.scene.forces import Attract
from wavetank.session.tools.hand import Hand
from wavetank.session.tools.tool import Tool, option


class Magnet(Tool):
    """Attract the water to the pointer, or repel it."""

    name: ClassVar[str] = "attract"
    label: ClassVar[str] = "Attract"
    sentence: ClassVar[str] = "Hold to pull the water to the pointer; a negative strength repels it."
    icon: ClassVar[str] = "M6 4v8a6 6 0 0 0 12 0V4M6 8h4M14 8h4M10 4v8a2 2 0 0 0 4 0V4M6 4h4M14 4h4"
    key: ClassVar[str] = "3"

    radius: float = option(0.25, 0.02, 1.0, "L", "Radius of its effect.")
    strength: float = option(10.0, -20.0, 20.0, "9.81 m/s²", "Acceleration at the centre; negative repels.")
    keep: bool = option(False, None, None, "", "Keeps running when you let go.")

    @override
    def hold(self, hand: Hand, duration: float) -> None:
        hand.sim.push(
            Attract(center=hand.flat(hand.point), radius=hand.radius(self.radius), strength=9.81 * self.strength)
        )

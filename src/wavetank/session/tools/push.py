"""Push and pull: the water goes where the hand goes."""

from typing import ClassVar

from typing_extensions import override

from wavetank.scene.forces import Drag
from wavetank.session.tools.hand import Hand
from wavetank.session.tools.tool import Tool, option


class Push(Tool):
    """Take the water along."""

    name: ClassVar[str] = "push"
    label: ClassVar[str] = "Push"
    sentence: ClassVar[str] = "Drag through the water: it goes where the hand goes."
    icon: ClassVar[str] = "M4 12h13m-5-5 5 5-5 5M20 5v14"
    key: ClassVar[str] = "1"

    radius: float = option(0.13, 0.01, 0.5, "L", "Radius of the hand.")
    grip: float = option(60.0, 1.0, 100.0, "1/s", "How firmly it holds the water.")

    @override
    def hold(self, hand: Hand, duration: float) -> None:
        hand.sim.push(
            Drag(
                center=hand.flat(hand.point),
                radius=hand.radius(self.radius),
                velocity=hand.flat(hand.velocity),
                drag=self.grip,
            )
        )

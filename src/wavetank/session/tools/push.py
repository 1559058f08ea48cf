"""Push and pull: a drag force towards the pointer's velocity."""

from typing import ClassVar

from typing_extensions import override

from wavetank.scene.forces import Drag
from wavetank.session.tools.hand import Hand
from wavetank.session.tools.tool import Tool, option


class Push(Tool):
    """Drag the water along with the pointer."""

    name: ClassVar[str] = "push"
    label: ClassVar[str] = "Push"
    sentence: ClassVar[str] = "Drag through the water to move it with the pointer."
    icon: ClassVar[str] = "M4 12h13m-5-5 5 5-5 5M20 5v14"
    key: ClassVar[str] = "1"

    radius: float = option(0.13, 0.01, 0.5, "L", "Radius.")
    grip: float = option(60.0, 1.0, 100.0, "1/s", "Rate at which the water takes the pointer's velocity.")

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

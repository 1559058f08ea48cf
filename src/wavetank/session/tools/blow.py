"""Wind: a drag force towards the velocity of an air jet, along the drag of the pointer."""

from typing import ClassVar

import numpy as np
from typing_extensions import override

from wavetank.scene.forces import Wind
from wavetank.session.tools.hand import Hand
from wavetank.session.tools.tool import Tool, option


class Blow(Tool):
    """Apply wind."""

    name: ClassVar[str] = "wind"
    label: ClassVar[str] = "Wind"
    sentence: ClassVar[str] = "Hold to blow away from you; drag to choose the direction."
    icon: ClassVar[str] = "M3 9h10a3 3 0 1 0-3-3M3 13h15a3 3 0 1 1-3 3M3 17h7a2 2 0 1 1-2 2"
    key: ClassVar[str] = "6"

    radius: float = option(0.2, 0.02, 1.0, "L", "Radius of the jet.")
    speed: float = option(1.2, 0.0, 4.0, "√(gL)", "Speed of the air.")
    drag: float = option(2.0, 0.1, 50.0, "1/s", "Rate at which the water takes the air's velocity.")
    keep: bool = option(False, None, None, "", "Goes on when you let go.")

    @override
    def hold(self, hand: Hand, duration: float) -> None:
        way = hand.point - hand.anchor
        if np.linalg.norm(way) < 0.03 * hand.size:
            way = np.array([1.0, 0.0, 0.0]) if hand.sim.scene.dim == 2 else hand.normal * [1.0, 0.0, 1.0]
        way = way / max(float(np.linalg.norm(way)), 1e-9)
        hand.sim.push(
            Wind(
                velocity=hand.flat(self.speed * hand.speed * way),
                drag=self.drag,
                center=hand.flat(hand.anchor),
                radius=hand.radius(self.radius),
            )
        )

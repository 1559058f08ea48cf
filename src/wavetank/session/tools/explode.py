"""Explosion: one radial impulse from a point below the surface."""

from typing import ClassVar

from pydantic import PrivateAttr
from typing_extensions import override

from wavetank.scene.forces import Burst
from wavetank.session.tools.hand import Hand
from wavetank.session.tools.tool import Tool, option


class Explode(Tool):
    """Apply a radial impulse."""

    name: ClassVar[str] = "explosion"
    label: ClassVar[str] = "Explosion"
    sentence: ClassVar[str] = "Click for an explosion under the surface."
    icon: ClassVar[str] = "M12 2l2 6 5-3-2 5 5 2-5 2 2 5-5-3-2 6-2-6-5 3 2-5-5-2 5-2-2-5 5 3z"
    key: ClassVar[str] = "8"

    radius: float = option(0.25, 0.02, 1.0, "L", "Radius of its effect.")
    speed: float = option(1.5, 0.1, 4.0, "√(gL)", "Speed that it gives at the centre.")
    _done: bool = PrivateAttr(False)

    @override
    def hold(self, hand: Hand, duration: float) -> None:
        if self._done:
            return
        self._done = True
        radius = hand.radius(self.radius)
        place = hand.anchor + 0.4 * radius * (-hand.up if hand.sim.scene.dim == 2 else hand.normal)
        hand.sim.push(Burst(center=hand.flat(place), radius=radius, speed=self.speed * hand.speed, duration=duration))

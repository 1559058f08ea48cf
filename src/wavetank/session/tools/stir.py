"""Stir: a vortex around an upright axis under the pointer."""

from typing import ClassVar

from typing_extensions import override

from wavetank.scene.forces import Vortex
from wavetank.session.tools.hand import Hand
from wavetank.session.tools.tool import Tool, option


class Stir(Tool):
    """Apply a vortex force around the pointer."""

    name: ClassVar[str] = "stir"
    label: ClassVar[str] = "Stir"
    sentence: ClassVar[str] = "Hold to make a whirlpool; drag to move it."
    icon: ClassVar[str] = "M12 12a3 3 0 1 1 3 3 6 6 0 1 1 3-9M6 16a8.500 8.500 0 0 0 12 3"
    key: ClassVar[str] = "2"

    radius: float = option(0.22, 0.02, 0.5, "L", "Radius of the whirlpool.")
    speed: float = option(1.2, -2.0, 2.0, "√(gL)", "Speed at the rim; negative turns the other way round.")
    keep: bool = option(False, None, None, "", "Keeps running when you let go.")

    @override
    def hold(self, hand: Hand, duration: float) -> None:
        axis = (0.0, 0.0, 1.0) if hand.sim.scene.dim == 2 else (0.0, 1.0, 0.0)
        hand.sim.push(
            Vortex(
                center=hand.flat(hand.point), radius=hand.radius(self.radius), speed=self.speed * hand.speed, axis=axis
            )
        )

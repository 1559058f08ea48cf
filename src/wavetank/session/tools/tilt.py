"""Tilt: turns gravity along the drag of the pointer, as if the tank were tilted."""

from typing import ClassVar

import numpy as np
from pydantic import PrivateAttr
from typing_extensions import override

from wavetank.scene.schedule import changes_gravity
from wavetank.session.tools.hand import Hand
from wavetank.session.tools.tool import Tool, option


class Tilt(Tool):
    """Tilt the tank."""

    name: ClassVar[str] = "tilt"
    label: ClassVar[str] = "Tilt"
    sentence: ClassVar[str] = "Drag to tilt the tank; let go to set it upright again."
    icon: ClassVar[str] = "M5 8l12-4 3 11-12 4zM6.500 13c4 1 8-3 12 .5M3 21h18"
    key: ClassVar[str] = "t"
    cursor_radius: ClassVar[bool] = False
    tilts: ClassVar[bool] = True

    most: float = option(50.0, 5.0, 180.0, "°", "Largest angle.")
    stay: bool = option(False, None, None, "", "Stays tilted when you let go.")
    _upright: tuple[float, ...] | None = PrivateAttr(None)

    @override
    def begin(self, hand: Hand) -> None:
        self._upright = tuple(hand.sim.gravity)

    @override
    def move(self, hand: Hand) -> None:
        if self._upright is None:
            return
        strength = float(np.linalg.norm(self._upright)) or 9.81
        drag = (hand.point - hand.anchor) / hand.size
        up = hand.up
        lean = drag - float(drag @ up) * up
        if hand.sim.scene.dim == 3:
            # Up on the screen is away from the eye.
            away = hand.normal * (1.0 - np.abs(up))
            lean += float(drag @ up) * away / max(float(np.linalg.norm(away)), 1e-9)
        angle = min(np.radians(self.most), 3.0 * float(np.linalg.norm(lean)))
        way = lean / max(float(np.linalg.norm(lean)), 1e-12)
        gravity = strength * (np.sin(angle) * way - np.cos(angle) * up)
        hand.sim.gravity = hand.flat(gravity)

    @override
    def end(self, hand: Hand) -> None:
        if self._upright is None or self.stay:
            return
        if changes_gravity(hand.sim.scene):
            hand.sim.release("gravity")
        else:
            hand.sim.gravity = self._upright

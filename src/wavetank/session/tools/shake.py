"""Shake: the inertial force in a tank that follows the pointer on a spring."""

from typing import ClassVar

import numpy as np
from pydantic import PrivateAttr
from typing_extensions import override

from wavetank.scene.forces import Sway
from wavetank.session.tools.hand import Hand
from wavetank.session.tools.tool import Tool, option

RATE = 14.0  # 1/s, of the critically damped spring between hand and tank


class Shake(Tool):
    """Shake the tank."""

    name: ClassVar[str] = "shake"
    label: ClassVar[str] = "Shake"
    sentence: ClassVar[str] = "Drag back and forth to shake the tank."
    icon: ClassVar[str] = "M7 6h10v12H7zM7 12c3-2 6 2 10 0M3 8v8M21 8v8"
    key: ClassVar[str] = "k"
    cursor_radius: ClassVar[bool] = False

    strength: float = option(1.0, 0.1, 4.0, "", "Distance that the tank moves, over that of the pointer.")
    _offset: np.ndarray = PrivateAttr(default_factory=lambda: np.zeros(3))
    _velocity: np.ndarray = PrivateAttr(default_factory=lambda: np.zeros(3))

    @override
    def hold(self, hand: Hand, duration: float) -> None:
        goal = self.strength * (hand.point - hand.anchor)
        pull = RATE**2 * (goal - self._offset) - 2.0 * RATE * self._velocity
        most = 40.0 * 9.81 * self.strength
        pull *= min(1.0, most / max(float(np.linalg.norm(pull)), 1e-9))
        self._velocity = self._velocity + duration * pull
        self._offset = self._offset + duration * self._velocity
        hand.sim.push(Sway(acceleration=hand.flat(pull)))

"""Cutter: removes the water along the pointer's ray."""

from typing import ClassVar

import numpy as np
from pydantic import PrivateAttr
from typing_extensions import override

from wavetank.session.tools.hand import Hand
from wavetank.session.tools.picking import exit_point
from wavetank.session.tools.tool import Tool, option
from wavetank.view.extent import extent_of

MOST_STEPS = 24  # capsules that one movement is divided into


class Cut(Tool):
    """Remove water along rays."""

    name: ClassVar[str] = "cut"
    label: ClassVar[str] = "Cut"
    sentence: ClassVar[str] = "Drag to cut water away, all the way through."
    icon: ClassVar[str] = "M5 3l14 14M19 3 9 13M8 18a3 3 0 1 1-6 0 3 3 0 0 1 6 0zM22 18a3 3 0 1 1-6 0 3 3 0 0 1 6 0z"
    key: ClassVar[str] = "0"

    radius: float = option(0.03, 0.005, 0.3, "L", "Half the width of the cut.")
    _last: np.ndarray | None = PrivateAttr(None)

    @override
    def begin(self, hand: Hand) -> None:
        self._cut(hand)

    @override
    def move(self, hand: Hand) -> None:
        self._cut(hand)

    def _cut(self, hand: Hand) -> None:
        radius = hand.radius(self.radius)
        start = hand.point if self._last is None else self._last
        steps = min(MOST_STEPS, 1 + int(np.linalg.norm(hand.point - start) / radius))
        for place in np.linspace(start, hand.point, steps + 1)[min(1, steps) :]:
            near = far = place
            if hand.sim.scene.dim == 3:
                way = place - hand.origin
                way /= max(float(np.linalg.norm(way)), 1e-9)
                near, (far, _) = hand.origin, exit_point(extent_of(hand.sim.scene), hand.origin, way)
            hand.sim.remove_inside(near, far, radius)
        self._last = hand.point

"""Paddle: a wall across the tank that is lowered at the pointer and follows it."""

from typing import ClassVar

from pydantic import PrivateAttr
from typing_extensions import override

from wavetank.session.tools.hand import Hand
from wavetank.session.tools.solids import TOOL_SOLID, move_towards
from wavetank.session.tools.tool import Tool, option
from wavetank.solids.shapes import Box


class Paddle(Tool):
    """Move a wall along the tank."""

    name: ClassVar[str] = "paddle"
    label: ClassVar[str] = "Paddle"
    sentence: ClassVar[str] = "Hold to lower a wall into the water; drag it along the tank."
    icon: ClassVar[str] = "M10 3h4v13h-4zM3 19c3-2 6-2 9 0s6 2 9 0M18 9l3 3-3 3M6 9l-3 3 3 3"
    key: ClassVar[str] = "b"
    cursor_radius: ClassVar[bool] = False

    height: float = option(0.8, 0.1, 1.0, "tank", "Height of the wall.")
    pace: float = option(0.5, 0.05, 2.0, "√(gL)", "Largest speed.")
    _held: str = PrivateAttr("")

    @override
    def begin(self, hand: Hand) -> None:
        along, up, across = hand.axes
        size = hand.upper - hand.lower
        plate = max(0.02 * hand.size, 2.0 * hand.spacing), self.height * size[up], size[across]
        start = hand.anchor[along], hand.upper[up] + 0.5 * plate[1], hand.lower[across] + 0.5 * size[across]
        center, edges = (hand.flat(hand.along_axes(*part)) for part in (start, plate))
        box = Box(name=f"{TOOL_SOLID}paddle", center=center, size=edges)
        self._held = hand.sim.add_solid(box)

    @override
    def hold(self, hand: Hand, duration: float) -> None:
        if self._held not in hand.sim.solids.names:
            return
        where = hand.sim.solids.poses[hand.sim.solids.find(self._held)][0].copy()
        along, up, across = hand.axes
        middle = hand.lower[up] + 0.5 * self.height * (hand.upper - hand.lower)[up]
        goal = hand.along_axes(hand.point[along], middle, where[across])
        move_towards(hand.sim, self._held, goal, None, self.pace * hand.speed * duration, inside=False)

    @override
    def end(self, hand: Hand) -> None:
        if self._held in hand.sim.solids.names:
            hand.sim.remove_solid(self._held)

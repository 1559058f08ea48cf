"""Place: adds a solid, which grows to its size and displaces the water."""

from typing import ClassVar, Literal

import numpy as np
from pydantic import PrivateAttr
from typing_extensions import override

from wavetank.session.tools.hand import Hand
from wavetank.session.tools.solids import move_towards
from wavetank.session.tools.tool import Tool, option
from wavetank.solids.shapes import Box, Capsule, Sphere
from wavetank.solids.solid import Solid

MOST_SOLIDS = 24
SWELL = 0.35  # s in which the solid grows to its size


class Place(Tool):
    """Add a solid."""

    name: ClassVar[str] = "place"
    label: ClassVar[str] = "Place"
    sentence: ClassVar[str] = "Click to place a solid; keep dragging to move it."
    icon: ClassVar[str] = "M12 3l8 4.500v9L12 21l-8-4.500v-9zM12 12l8-4.500M12 12v9M12 12 4 7.500"
    key: ClassVar[str] = "p"

    shape: Literal["ball", "box", "post"] = option("ball", None, None, "", "Shape.")
    radius: float = option(0.07, 0.02, 0.3, "L", "Half of its size.")
    _held: str = PrivateAttr("")

    @override
    def begin(self, hand: Hand) -> None:
        if len(hand.sim.scene.solids) >= MOST_SOLIDS:
            hand.notes.append(f"There are {MOST_SOLIDS} solids already; remove one first.")
            return
        half = max(self.radius * hand.size, 2.0 * hand.spacing)
        center = hand.anchor
        if hand.sim.scene.dim == 3:
            # Into the water behind its surface, but in front of a wall or another solid.
            center = center + half * hand.normal * (0.8 if hand.hit.kind == "water" else -1.0)
        middle = 0.5 * (hand.lower + hand.upper)
        center = np.clip(center, np.minimum(hand.lower + half, middle), np.maximum(hand.upper - half, middle))
        self._held = hand.sim.add_solid(self._solid(hand.flat(center), half), SWELL)

    def _solid(self, center: tuple[float, ...], half: float) -> Solid:
        if self.shape == "box":
            return Box(center=center, size=(2.0 * half,) * len(center))
        if self.shape == "post":
            up = (0.0, 1.5 * half, 0.0)[: len(center)]
            low, high = (tuple(c + s * u for c, u in zip(center, up, strict=True)) for s in (-1.0, 1.0))
            return Capsule(start=low, end=high, radius=0.5 * half)
        return Sphere(center=center, radius=half)

    @override
    def hold(self, hand: Hand, duration: float) -> None:
        if self._held in hand.sim.solids.names and float(np.linalg.norm(hand.point - hand.anchor)) > 0.01 * hand.size:
            move_towards(hand.sim, self._held, hand.point, None, 0.8 * hand.speed * duration)

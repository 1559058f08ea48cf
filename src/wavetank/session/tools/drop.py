"""Drop: adds a body above the pointer, which falls into the water."""

import math
from typing import ClassVar, Literal

import numpy as np
from typing_extensions import override

from wavetank.session.tools.hand import Hand
from wavetank.session.tools.tool import Tool, option
from wavetank.solids.shapes import Box, Capsule, Sphere
from wavetank.solids.solid import Solid

MOST_BODIES = 60


class Drop(Tool):
    """Add a falling body."""

    name: ClassVar[str] = "drop"
    label: ClassVar[str] = "Drop"
    sentence: ClassVar[str] = "Click to drop a body; its density decides whether it floats or sinks."
    icon: ClassVar[str] = "M8 2h8v8H8zM12 12v4m-2-2 2 2 2-2M3 20c3-2 6-2 9 0s6 2 9 0"
    key: ClassVar[str] = "o"

    shape: Literal["box", "ball", "log", "plank"] = option("box", None, None, "", "Shape.")
    radius: float = option(0.06, 0.02, 0.3, "L", "Half of its size.")
    density: float = option(0.4, 0.05, 10.0, "water", "Density relative to water.")
    height: float = option(0.1, 0.0, 0.5, "L", "Height above the pointer.")

    @override
    def begin(self, hand: Hand) -> None:
        sim = hand.sim
        if len(sim.bodies) >= MOST_BODIES:
            hand.notes.append(f"There are {MOST_BODIES} bodies already; remove one first.")
            return
        half = max(self.radius * hand.size, 2.0 * hand.spacing)
        reach = half * (
            2.2 if self.shape in ("log", "plank") else math.sqrt(sim.scene.dim) if self.shape == "box" else 1
        )
        center = hand.anchor + (self.height * hand.size + reach) * hand.up
        if sim.scene.dim == 3 and hand.hit.kind != "water":  # in front of what the pointer met
            center -= reach * hand.normal * (1.0 - np.abs(hand.up))
        middle = 0.5 * (hand.lower + hand.upper)
        inside = np.clip(center, np.minimum(hand.lower + reach, middle), np.maximum(hand.upper - reach, middle))
        level = [hand.axes[0], hand.axes[2]]
        center[level] = inside[level]
        center += (self._clear(hand, center, reach) - float(center @ hand.up)) * hand.up
        sim.add_solid(self._solid(hand, center, half))

    def _clear(self, hand: Hand, center: np.ndarray, reach: float) -> float:
        """Return the height [m], from that of `center` on up, where neither water nor another body is in the way."""
        others = [(np.array([*body.position, 0.0][:3]), body.solid.reach()) for body in hand.sim.bodies.values()]
        balls = [(place, reach + far) for place, far in others]
        x = hand.sim.positions.astype(float)
        x = np.concatenate([x, np.zeros((len(x), 3 - x.shape[1]))], axis=1)
        level, up = [hand.axes[0], hand.axes[2]], hand.up
        beside = np.hypot(*(x - center)[:, level].T)
        over = x[beside < reach + hand.spacing]
        height = float(center @ up)
        if len(over):
            height = max(height, float((over @ up).max()) + reach + hand.spacing)
        for place, apart in sorted(balls, key=lambda ball: float(ball[0] @ up)):
            away = math.hypot(*(place - center)[level])
            if away < apart and abs(float(place @ up) - height) < math.sqrt(apart**2 - away**2):
                height = float(place @ up) + math.sqrt(apart**2 - away**2)
        return height

    def _solid(self, hand: Hand, middle: np.ndarray, half: float) -> Solid:
        density = 1000.0 * self.density
        center = hand.flat(middle)
        dim = len(center)
        if self.shape == "log":
            along = hand.along_axes(2.0 * half, 0.0, 0.0)
            start, end = hand.flat(middle - along), hand.flat(middle + along)
            return Capsule(start=start, end=end, radius=0.6 * half, density=density)
        if self.shape == "plank":
            size = hand.along_axes(4.0 * half, 0.8 * half, 2.0 * half)
            return Box(center=center, size=hand.flat(size), density=density)
        if self.shape == "box":
            return Box(center=center, size=(2.0 * half,) * dim, density=density)
        return Sphere(center=center, radius=half, density=density)

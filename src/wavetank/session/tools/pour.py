"""Pour: emits particles from a nozzle, where there is free space."""

from typing import ClassVar, Literal

import numpy as np
from pydantic import PrivateAttr
from typing_extensions import override

from wavetank.scene.inlets import disc_rows, line_rows
from wavetank.session.tools.hand import Hand
from wavetank.session.tools.tool import Color, Tool, dye_of, option
from wavetank.simulation.sources import rows_due

GAP, WALL = 0.9, 0.5  # d: least distance of new particles from others and from walls
MOST_LAYERS = 8  # of particles in a frame


class Pour(Tool):
    """Emit particles."""

    name: ClassVar[str] = "pour"
    label: ClassVar[str] = "Pour"
    sentence: ClassVar[str] = "Hold to pour water from above, or straight ahead."
    icon: ClassVar[str] = "M4 5h9a4 4 0 0 1 4 4v2M14 11h6M17 14v2M17 19v2M13 15v2M21 15v2"
    key: ClassVar[str] = "4"

    width: float = option(0.1, 0.01, 0.5, "L", "Width of the jet.")
    speed: float = option(0.5, 0.05, 2.0, "√(gL)", "Speed of the jet.")
    aim: Literal["down", "ahead"] = option("down", None, None, "", "Direction of the jet.")
    color: Color = option("", None, None, "color", "Dye in the water.")
    keep: bool = option(False, None, None, "", "Keeps running when you let go.")
    _way: float = PrivateAttr(0.0)
    _nozzle: np.ndarray | None = PrivateAttr(None)

    @override
    def begin(self, hand: Hand) -> None:
        self._aim(hand)
        self._way = hand.spacing

    @override
    def move(self, hand: Hand) -> None:
        self._aim(hand)

    def _aim(self, hand: Hand) -> None:
        """Place the nozzle once per movement: water that rises under a resting pointer must not move it."""
        half = 0.5 * max(self.width * hand.size, hand.spacing)
        point = hand.pick_again().point
        if hand.sim.scene.dim == 3 and self.aim == "down":
            point = point.copy()
            point[hand.axes[1]] = (hand.lower if hand.up.min() < 0.0 else hand.upper)[hand.axes[1]]
        elif hand.sim.scene.dim == 3:
            point = point - 0.5 * hand.size * hand.direction
        room = hand.spacing + hand.along_axes(half, 0.0 if self.aim == "down" else half, half)
        low, high = hand.lower + room, hand.upper - room
        self._nozzle = np.clip(point, np.minimum(low, high), np.maximum(low, high))
        if hand.sim.scene.dim == 2:
            self._nozzle[2] = 0.0

    @override
    def hold(self, hand: Hand, duration: float) -> None:
        spacing, speed = hand.spacing, self.speed * hand.speed
        steps, self._way = rows_due(self._way, speed * duration, spacing)
        if not len(steps) or self._nozzle is None:
            return
        ahead = -hand.up
        if self.aim == "ahead":
            ahead = hand.along_axes(1.0, 0.0, 0.0) if hand.sim.scene.dim == 2 else hand.direction
        disc = self._disc(hand, ahead)
        places = (self._nozzle + disc[None] + steps[:MOST_LAYERS, None, None] * ahead).reshape(-1, 3)[
            :, : hand.sim.scene.dim
        ]
        places = places.astype(np.float32)
        places = places[hand.sim.free_places(places, GAP * spacing, WALL * spacing)]
        if hand.sim.count + len(places) > hand.most_particles:
            hand.notes.append(f"There are {hand.sim.count:,} particles; pouring stops at {hand.most_particles:,}.")
            return
        velocity = (speed * ahead)[: hand.sim.scene.dim]
        hand.sim.add(places, np.tile(velocity, (len(places), 1)), np.full(len(places), dye_of(self.color)))

    def _disc(self, hand: Hand, ahead: np.ndarray) -> np.ndarray:
        """Return the positions of one layer of particles relative to the nozzle [m], [n, 3]."""
        side = np.cross(ahead, [0.0, 0.0, 1.0] if abs(ahead[2]) < 0.9 else [0.0, 1.0, 0.0])
        side /= np.linalg.norm(side)
        up = np.cross(side, ahead)
        half = 0.5 * max(self.width * hand.size, hand.spacing)
        if hand.sim.scene.dim == 2:
            return line_rows(half, hand.spacing)[:, None] * side
        return disc_rows(half, hand.spacing) @ np.stack([side, up])

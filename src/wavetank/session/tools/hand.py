"""A hand in the water: a pointer that is down, where it is and how fast it moves."""

from collections.abc import Sequence

import numpy as np

from wavetank.session.tools.picking import Hit, on_plane, pick
from wavetank.simulation.simulation import Simulation
from wavetank.view.extent import extent_of

LARGEST_PACE = 3.0  # of the hand, in units of `Hand.speed`


class Hand:
    """What a tool gets to work with.

    It begins at what the pointer's ray meets and then moves in the plane through that point which faces the eye, so
    that waves passing under the pointer do not throw it back and forth. `look` picks anew.
    """

    def __init__(
        self,
        sim: Simulation,
        origin: Sequence[float],
        direction: Sequence[float],
        most: int,
        through_water: bool = False,
    ) -> None:
        self.sim, self.most_particles = sim, most
        self.notes: list[str] = []  # for the person, one sentence each
        extent = extent_of(sim.scene)
        self.lower, self.upper = extent.lower, extent.upper
        self.size = float((extent.upper - extent.lower).max())  # m, length of the world
        self.speed = float(np.sqrt(9.81 * self.size))  # m/s, a natural speed in a world of that size
        self.origin, self.direction = _ray(origin, direction)
        self.hit: Hit = pick(sim, self.origin, self.direction, through_water)
        self.anchor = self._inside(self.hit.point)
        self.normal = np.array([0.0, 0.0, 1.0]) if sim.scene.dim == 2 else self.direction
        self.point = self.before = self.anchor
        self.velocity = np.zeros(3)  # m/s

    @property
    def spacing(self) -> float:
        """Particle spacing [m]."""
        return float(self.sim.scene.spacing)

    def aim(self, origin: Sequence[float], direction: Sequence[float]) -> None:
        """Follow the pointer to another ray."""
        self.origin, self.direction = _ray(origin, direction)
        point = on_plane(self.origin, self.direction, self.anchor, self.normal)
        if point is not None:
            self.point = self._inside(point)

    def look(self) -> Hit:
        """Return what the ray meets now."""
        hit = pick(self.sim, self.origin, self.direction)
        return Hit(hit.kind, self._inside(hit.point), hit.name)

    def pass_time(self, duration: float) -> None:
        """Measure the hand's velocity over a frame of `duration` [s], limited to what water can follow."""
        velocity = (self.point - self.before) / duration
        pace = float(np.linalg.norm(velocity))
        self.velocity = velocity * min(1.0, LARGEST_PACE * self.speed / max(pace, 1e-12))
        self.before = self.point

    def radius(self, share: float) -> float:
        """Return a share of the world's length [m], but never so small that nothing is inside."""
        return max(share * self.size, 1.5 * self.spacing)

    def flat(self, vector: np.ndarray) -> tuple[float, ...]:
        """Return a vector in space as one of this world, 2-D or 3-D."""
        return tuple(float(part) for part in vector[: self.sim.scene.dim])

    def _inside(self, point: np.ndarray) -> np.ndarray:
        margin = 0.25 * self.size
        inside: np.ndarray = np.clip(point, self.lower - margin, self.upper + margin)
        return inside if self.sim.scene.dim == 3 else inside * [1.0, 1.0, 0.0]


def _ray(origin: Sequence[float], direction: Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
    way = np.asarray(direction, float)
    return np.asarray(origin, float), way / np.linalg.norm(way)

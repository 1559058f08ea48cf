"""A pointer that is down in the world: its position and velocity."""

from collections.abc import Sequence

import numpy as np

from wavetank.session.tools.picking import Hit, intersect_plane, pick
from wavetank.simulation.simulation import Simulation
from wavetank.view.extent import extent_of

FASTEST = 3.0  # limit of the velocity, in units of `Hand.speed`


class Hand:
    """A pointer in the world, for tools.

    It starts where the pointer's ray hits something, and then moves in the plane through that point that faces the
    camera, so that passing waves do not move it back and forth. `pick_again` returns the hit of the current ray.
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
        self.notes: list[str] = []  # messages to viewers, one sentence each
        extent = extent_of(sim.scene)
        self.lower, self.upper = extent.lower, extent.upper
        #: axes of the world: along, up and across; tools think of a world in which these are x, y and z
        self.axes = {"x": [1, 0, 2], "y": [0, 1, 2], "z": [0, 2, 1]}[sim.scene.upward[-1]]
        self.up = sim.scene.upright[1]  # unit vector, [3]
        self.size = float((extent.upper - extent.lower).max())  # m, L: length of the world
        self.speed = float(np.sqrt(9.81 * self.size))  # m/s, sqrt(g L)
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
        """Move along the plane to another ray."""
        self.origin, self.direction = _ray(origin, direction)
        point = intersect_plane(self.origin, self.direction, self.anchor, self.normal)
        if point is not None:
            self.point = self._inside(point)

    def pick_again(self) -> Hit:
        """Return what the ray hits now."""
        hit = pick(self.sim, self.origin, self.direction)
        return Hit(hit.kind, self._inside(hit.point), hit.name)

    def pass_time(self, duration: float) -> None:
        """Compute the velocity over a frame of `duration` [s], limited to what water can follow."""
        velocity = (self.point - self.before) / duration
        pace = float(np.linalg.norm(velocity))
        self.velocity = velocity * min(1.0, FASTEST * self.speed / max(pace, 1e-12))
        self.before = self.point

    def radius(self, share: float) -> float:
        """Return a share of the world's length [m], but at least 1.5 particle spacings."""
        return max(share * self.size, 1.5 * self.spacing)

    def along_axes(self, along: float, up: float, across: float) -> np.ndarray:
        """Return a vector of the world, [3], from its components along the axes of tools."""
        vector = np.zeros(3)
        vector[self.axes] = along, up, across
        return vector

    def flat(self, vector: np.ndarray) -> tuple[float, ...]:
        """Return the components of a 3-D vector that this world has, 2 or 3."""
        return tuple(float(part) for part in vector[: self.sim.scene.dim])

    def _inside(self, point: np.ndarray) -> np.ndarray:
        margin = 0.25 * self.size
        inside: np.ndarray = np.clip(point, self.lower - margin, self.upper + margin)
        return inside if self.sim.scene.dim == 3 else inside * [1.0, 1.0, 0.0]


def _ray(origin: Sequence[float], direction: Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
    way = np.asarray(direction, float)
    return np.asarray(origin, float), way / np.linalg.norm(way)

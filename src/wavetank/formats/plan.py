"""What a writer of many frames is told before the first one."""

import dataclasses
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from wavetank.foundation.retry import Retry
from wavetank.foundation.rotations import turned
from wavetank.scene.scene import Scene
from wavetank.simulation.instant import PlacedSolid
from wavetank.simulation.state import State
from wavetank.solids.surfaces import Surface, surface_of


class Shapes:
    """Surfaces of solids by their names. Made in the simulation's thread, read in that of the writer."""

    def __init__(self, scene: Scene) -> None:
        self._dim, self._spacing = scene.dim, scene.spacing
        self._known: dict[str, tuple[Any, Surface]] = {}

    def learn(self, standing: tuple[PlacedSolid, ...]) -> None:
        """Triangulate the solids that are new."""
        for one in standing:
            if one.name not in self._known or self._known[one.name][0] is not one.solid:
                self._known[one.name] = (one.solid, surface_of(one.solid, self._dim, self._spacing))

    def own(self, one: PlacedSolid) -> Surface:
        """Return the surface of a solid in its own frame; without vertices where it has none."""
        return self._known[one.name][1]

    def placed(self, instant: State) -> Iterator[tuple[PlacedSolid, np.ndarray, np.ndarray]]:
        """Yield the solids of an instant that have a surface: vertices in the world [m] and faces."""
        for one in instant.placed:
            points, faces = self.own(one)
            if len(points):
                yield one, turned(one.rotation, points) + one.position, faces


@dataclasses.dataclass(frozen=True)
class Viewpoint:
    """Where a picture is taken from."""

    eye: tuple[float, float, float]  # m
    target: tuple[float, float, float]  # m
    field_of_view: float  # rad, vertical
    height: float | None = None  # m that are seen by a camera without perspective
    up: tuple[float, float, float] = (0.0, 1.0, 0.0)


@dataclasses.dataclass(frozen=True)
class Plan:
    """Where to write, what of, and how many frames a second."""

    base: Path  # of all files: their folder and the front part of their names
    scene: Scene
    fps: float
    parts: frozenset[str]  # of `instant.PARTS`
    shapes: Shapes
    view: Viewpoint | None = None
    kept: int = 0  # frames of the files that are there, which a resumed run goes on with
    retry: Retry = dataclasses.field(default_factory=Retry)

    def path(self, suffix: str, part: str = "") -> Path:
        """Return the file of a part."""
        return self.base.with_name(f"{self.base.name}{'-' * bool(part)}{part}{suffix}")


class Series(Protocol):
    """A writer of many frames."""

    files: list[str]
    repeatable: bool  # whether a frame may be written again after it failed; what grows is patient itself

    def write(self, number: int, instant: State) -> None:
        """Write frame `number`, which counts from 0; what the instant does not have is not asked for."""

    def close(self) -> None:
        """Complete the files; what was written is there whether this is called or not."""

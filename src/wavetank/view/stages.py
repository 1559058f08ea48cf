"""What pictures keep from one to the next: for every stage of a view a record of what it was last drawn for.

A stage that is drawn for the same once more would come out the same, and is left as it is.
"""

import dataclasses
import itertools
from collections.abc import Iterable
from typing import Any

import numpy as np

from wavetank.device.compiler import download
from wavetank.simulation.frame import Frame
from wavetank.view.lens import Lens
from wavetank.view.shot import Shot


@dataclasses.dataclass
class Rest:
    """Whether the water is where it was in the last picture, as when an eye goes round it."""

    moment: tuple[Any, ...] = ()
    places: list[np.ndarray] | None = None  # of particles, and their ids
    shape: int = 0  # number of the water's shape: the next one whenever it has moved

    def shape_of(self, frame: Frame) -> int:
        """Return the number of the water's shape in a frame.

        Only in the second picture of a moment its places are kept, so that moving water costs nothing here.
        """
        moment = (frame.number, frame.time, frame.count)
        if moment != self.moment:
            self.moment, self.places, self.shape = moment, None, self.shape + 1
            return self.shape
        places = [download(array)[: frame.count] for array in (frame.x, frame.id)]
        if self.places is None or not all(map(np.array_equal, self.places, places)):
            self.places, self.shape = [array.copy() for array in places], self.shape + 1
        return self.shape


@dataclasses.dataclass(frozen=True)
class Sunlight:
    """What the light in the water was found for."""

    cast: tuple[Any, ...]  # sun and solids
    water: Any  # WaterBuffers
    shape: int


class Stages:
    """The records of one renderer."""

    def __init__(self) -> None:
        self._drawn: dict[str, Any] = {}  # name of a stage -> what it was drawn for
        self._rest = Rest()

    def forget(self) -> None:
        """Forget all, where a view has drawn over it that keeps nothing."""
        self._drawn.clear()
        self._rest.moment = ()

    def is_due(self, stage: str, of: Any) -> bool:
        """Say whether a stage has to be drawn for that."""
        return stage not in self._drawn or bool(self._drawn[stage] != of)

    def remember(self, stage: str, of: Any) -> None:
        """Note that a stage has been drawn for that."""
        self._drawn[stage] = of

    def shapes(self, frame: Frame, water: Any, hasty: bool) -> tuple[int, int]:
        """Return the number of the water's shape, and of the shape in whose light it is seen.

        In haste moving water lies in the light of the picture before, every second time.
        """
        before = self._rest.shape
        shape, sunlit = self._rest.shape_of(frame), self._drawn.get("sunny")
        waits = hasty and shape != before and sunlit is not None and (sunlit.water, sunlit.shape) == (water, before)
        return shape, before if waits else shape


def sun_and_solids(shot: Shot) -> tuple[Any, ...]:
    """Return all that the shadows of solids in the sun's view depend on, to be compared with another picture's."""
    solids, arrays = shot.frame.solids, []
    if solids.count > solids.tank_count:
        names = ("op", "size", "offset", "turn", "first", "reach", "position", "rotation")
        arrays = [download(getattr(solids, name)) for name in names]
    numbers = (shot.look.to_sun, shot.extent.lower, shot.extent.upper)
    return shot.frame.dim, solids.count, *_bytes(_numbers(shot.sun), numbers, arrays)


def eye_and_style(shot: Shot) -> tuple[Any, ...]:
    """Return all of eye and style that what is not water depends on, likewise."""
    paints = "".join(solid.finish + (solid.color or "-") for solid in shot.frame.scene.solids)
    look = shot.look
    light = (look.sun_size, look.paving, look.sun, look.sky, look.floor, shot.radius)
    tank = (look.glass, look.pane, look.line, look.line_strength)
    return *_bytes(_numbers(shot.lens), light, tank), paints, shot.lit


def _numbers(lens: Lens) -> list[Any]:
    return [getattr(lens, field.name) for field in dataclasses.fields(lens)]


def _bytes(*numbers: Iterable[Any]) -> tuple[bytes, ...]:
    return tuple(np.asarray(number).tobytes() for number in itertools.chain(*numbers))

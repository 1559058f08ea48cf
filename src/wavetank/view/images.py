"""Solids at a seam of a world that repeats, as pictures show them: cut there, and the rest at the other side.

The water sees a solid at its nearest image (`solids/seams.py`). A picture shows one world and not its neighbours, so
that what reaches over a seam is cut at it, as the water is, and its image comes in at the other side.
"""

import dataclasses
import itertools
import math

import numpy as np

from wavetank.scene.tank import Tank
from wavetank.simulation.frame import Frame
from wavetank.simulation.instant import PlacedSolid
from wavetank.simulation.solids import Solids
from wavetank.solids.seams import is_short
from wavetank.solids.shapes import Difference, HalfSpace, moved, still
from wavetank.solids.solid import ENDLESS, Solid

UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])


class Images:
    """The solids of the last picture with their images; they are made anew only where a solid has moved."""

    def __init__(self) -> None:
        self._of: tuple[object, ...] = ()
        self._shown: tuple[Solids, tuple[PlacedSolid, ...]] | None = None

    def within(self, frame: Frame) -> Frame:
        """Return the frame with its solids as they are seen; itself where none is at a seam."""
        tank = frame.scene.tank
        if tank is None or not tank.periodic_axes:
            return frame
        standing = frame.placed
        key = tank, tuple((id(one.solid), one.position.tobytes(), one.rotation.tobytes()) for one in standing)
        if key != self._of:
            self._of, self._shown = key, _placed(frame, tank, standing)
        if self._shown is None:
            return frame
        solids, shown = self._shown
        scene = frame.scene.model_copy(update={"solids": [one.solid for one in shown]})
        return dataclasses.replace(frame, scene=scene, solids=solids.device, read_placed=lambda: shown)


def _placed(
    frame: Frame, tank: Tank, standing: tuple[PlacedSolid, ...]
) -> tuple[Solids, tuple[PlacedSolid, ...]] | None:
    """Return all solids where they stand, cut at the seams, with their images; None where none is at a seam."""
    crossing = [_crossed(one, tank) for one in standing]
    if not any(crossing):
        return None
    shown, others = list[PlacedSolid](), list[PlacedSolid]()
    for one, axes in zip(standing, crossing, strict=True):
        first, *ways = _ways(one, tank, axes, frame.scene.spacing)
        shown.append(_cut(one, tank, first, axes) if axes else one)
        others += [_cut(one, tank, way, axes) for way in ways]
    shown += others
    scene = frame.scene
    solids = Solids(
        tank.walls(), [one.solid for one in shown], scene.dim, scene.friction, scene.spacing, scene.start_time
    )
    for number, one in enumerate(shown, solids.tank_count):
        solids.targets[number] = one.position, one.rotation
    solids.arrive()
    solids.move_to(0.0, 0.0)
    return solids, tuple(shown)


def _crossed(one: PlacedSolid, tank: Tank) -> list[int]:
    """Return the axes at whose seam a solid may stand; none for one without an end."""
    reach, (lower, upper) = one.solid.reach(), tank.box()
    if reach >= 0.1 * ENDLESS:
        return []
    return [k for k in tank.periodic_axes if one.position[k] - reach < lower[k] or one.position[k] + reach > upper[k]]


def _ways(one: PlacedSolid, tank: Tank, axes: list[int], spacing: float) -> list[np.ndarray]:
    """Return how far it is [m], [3], from a solid to its images that reach into the tank, first that of its middle.

    A solid that has moved on for long may be whole lengths of the tank away.
    """
    steps, (lower, upper), reach = [[0.0], [0.0], [0.0]], tank.box(), one.solid.reach()
    for axis in axes:
        length = float(upper[axis] - lower[axis])
        if is_short(one.solid, length, spacing):
            home = -length * math.floor((one.position[axis] - float(lower[axis])) / length)
            place = one.position[axis] + home
            beyond = {length: place - reach < lower[axis], -length: place + reach > upper[axis]}
            steps[axis] = [home, *(home + way for way, reached in beyond.items() if reached)]
    return [np.array(way) for way in itertools.product(*steps)]


def _cut(one: PlacedSolid, tank: Tank, way: np.ndarray, axes: list[int]) -> PlacedSolid:
    """Return a solid moved by a `way` [m], without what is beyond the seams along some axes."""
    dim = len(tank.size)
    place = one.position + way
    parts: list[Solid] = [moved(still(one.solid), np.zeros(3), one.rotation)]
    for axis in axes:
        for side, corner in zip((1.0, -1.0), tank.box(), strict=True):
            across = np.eye(dim)[axis]
            point = across * (float(corner[axis]) - place[axis])
            parts.append(HalfSpace(point=tuple(point), normal=tuple(side * across)))
    cut = Difference(parts=parts, center=tuple(place[:dim]), color=one.solid.color, finish=one.solid.finish)
    return dataclasses.replace(one, solid=cut, position=place, rotation=UPRIGHT)

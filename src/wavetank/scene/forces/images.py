"""Forces at a seam of a world that repeats: what reaches over it acts at the other side as well.

A force is a kernel over particles and may be a user's own, so that it is not told of seams. One whose ball or tube
reaches over a seam is applied once more from its image: no particle is in both as long as the region is no wider than
the world. A wider one, a tube at a slant to the axis, and forces of your own act where they stand only.
"""

import dataclasses
import itertools
import math
from collections.abc import Iterable, Iterator

import numpy as np

from wavetank.scene.forces import Attract, Burst, Drag, Force, Vortex, Wind
from wavetank.scene.forces.jet import Jet
from wavetank.scene.tank import Tank
from wavetank.solids.solid import point_in_space


def with_images(forces: Iterable[Force], tank: Tank | None) -> Iterator[Force]:
    """Yield the forces, each followed by its images whose regions reach into the tank."""
    for force in forces:
        yield force
        if tank is not None and tank.periodic_axes:
            yield from _images(force, tank)


def _images(force: Force, tank: Tank) -> Iterator[Force]:
    region = _region(force)
    if region is None:
        return
    (center, radius, line), (lower, upper) = region, tank.box()
    steps = [[0.0], [0.0], [0.0]]
    for axis in tank.periodic_axes:
        low, high = float(lower[axis]), float(upper[axis])
        if line[axis] == 0.0 and 2.0 * radius <= high - low:
            steps[axis] += [high - low] * bool(center[axis] - radius < low)
            steps[axis] += [low - high] * bool(center[axis] + radius > high)
    for way in itertools.product(*steps):
        if any(way):
            yield _moved(force, center + np.array(way), len(tank.size))


def _region(force: Force) -> tuple[np.ndarray, float, np.ndarray] | None:
    """Return centre and radius [m] of where a force acts, and the way of the tube that it is, 0 for a ball."""
    ball = np.zeros(3, np.float32)
    if isinstance(force, Jet):
        opening = force.opening
        reach = math.hypot(opening.length, opening.half_across, opening.half_up)
        return np.array(opening.middle, float), reach, ball
    if isinstance(force, Attract | Burst | Drag | Vortex | Wind) and force.center is not None and force.radius:
        line = ball
        if isinstance(force, Vortex | Wind):  # tubes
            line = point_in_space(force.axis if isinstance(force, Vortex) else force.velocity).astype(np.float32)
        return point_in_space(force.center).astype(np.float32).astype(float), float(force.radius), line
    return None


def _moved(force: Force, center: np.ndarray, dim: int) -> Force:
    if isinstance(force, Jet):
        opening = dataclasses.replace(force.opening, middle=np.float32(center))
        return force.model_copy(update={"opening": opening})
    return force.model_copy(update={"center": tuple(map(float, center[:dim]))})

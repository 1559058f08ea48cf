"""Force and moment of the liquid's pressure on any solid, still ones and the walls of the tank too.

The surface is that of the boxes that a body is cut into (`physics/pressure/bodies.py`): a box with the volume V is
pushed by V times the difference of the pressures at its faces over its edge, and what lies between two full boxes
cancels. A wall of the tank is a lattice of squares. Pressures are those on the side that the surface looks to
(`probes.py`).
"""

import dataclasses
import math

import numpy as np

from wavetank.foundation.errors import WavetankError
from wavetank.foundation.params import Parameters
from wavetank.foundation.rotations import turned
from wavetank.physics.bodies import surface_sides
from wavetank.physics.pressure.grid import THRESHOLDS
from wavetank.physics.pressure.probes import pressures
from wavetank.physics.world import World
from wavetank.scene.tank import Tank
from wavetank.solids.mass import Ruler
from wavetank.solids.motion import Pose
from wavetank.solids.shapes import HalfSpace
from wavetank.solids.solid import ENDLESS, Solid


@dataclasses.dataclass(frozen=True)
class Load:
    """What the pressure of the liquid does to a solid; per metre of depth in a 2-D world."""

    force: np.ndarray  # N, [dim]
    moment: np.ndarray  # N m, [3]: about `center`
    center: np.ndarray  # m, [dim]: the origin of the solid's frame, or the middle of a wall

    def figures(self) -> dict[str, float]:
        """Return its components by name; of the moment in 2-D that about z."""
        axes = "xyz"[: len(self.force)]
        moments = zip("xyz", self.moment, strict=True)
        figures = {f"force_{axis}": float(x) for axis, x in zip(axes, self.force, strict=True)}
        return figures | {f"moment_{axis}": float(x) for axis, x in moments if axis == "z" or len(axes) == 3}


def unknown_load(dim: int) -> Load:
    """Return a load that is not known: not a number."""
    return Load(np.full(dim, math.nan), np.full(3, math.nan), np.full(dim, math.nan))


@dataclasses.dataclass(frozen=True)
class Panels:
    """Faces of a solid's surface in its frame."""

    places: np.ndarray  # m, [n, 3]
    outward: np.ndarray  # unit vectors [n, 3], out of the solid
    levers: np.ndarray  # m, [n, 3]: from the origin to where it is pushed
    areas: np.ndarray  # m^2, [n, 3]: what the pressure there is to be multiplied by, negative
    center: np.ndarray  # m, [3]: that moments are about


def panels_of(solid: Solid, dim: int, spacing: float) -> Panels:
    """Cut the surface of a solid into panels; raises `WavetankError` for one without an end."""
    if solid.reach() >= ENDLESS:
        raise WavetankError(f"the solid {solid.name!r} has no end, and so no force on it; use a box.")
    cut = Ruler(solid, dim, spacing).cut_for_surface(spacing)
    places, outward, levers, areas = [], [], [], []
    for side, looks in zip((1, -1), surface_sides(cut.places, cut.edges, cut.volumes), strict=True):
        for axis in range(dim):
            unit, found = np.eye(3)[axis], looks[:, axis] != 0.0
            places.append(cut.places[found] + 0.5 * side * cut.edges[axis] * unit)
            outward.append(looks[found, axis, None] * unit)
            levers.append(cut.places[found])
            areas.append(side * cut.volumes[found, None] / cut.edges[axis] * unit)
    faces = [np.concatenate(rows) for rows in (places, outward, levers, areas)]
    return Panels(faces[0], faces[1], faces[2], faces[3], center=np.zeros(3))


def load_of(world: World, params: Parameters, panels: Panels, pose: Pose, dim: int) -> Load:
    """Return the load on a solid at a `pose`."""
    assert world.pressure is not None, "there is a pressure grid"
    position, rotation = pose
    grid = world.pressure.finest
    away = THRESHOLDS.outside * min(grid.dx, grid.dy)
    places = turned(rotation, panels.places) + position
    outside = places + away * turned(rotation, panels.outward)
    pressure = pressures(world, params, places[:, :dim], outside[:, :dim]).astype(float)
    pushes = -pressure[:, None] * turned(rotation, panels.areas)
    moment = np.cross(turned(rotation, panels.levers - panels.center), pushes).sum(axis=0)
    return Load(pushes.sum(axis=0)[:dim], moment, (turned(rotation, panels.center) + position)[:dim])


def panels_of_wall(tank: Tank, wall: Solid, spacing: float) -> Panels:
    """Return the panels of a wall of the tank, squares of about a spacing."""
    assert isinstance(wall, HalfSpace), "walls are half-spaces"
    lower, upper = tank.box()
    dim, inward = len(lower), np.append(np.array(wall.normal, float), 0.0)[:3]
    middles, area = [], 1.0
    for axis in range(dim):
        length = upper[axis] - lower[axis]
        count = 1 if inward[axis] else max(1, round(length / spacing))
        middles.append(np.array([wall.point[axis]]) if inward[axis] else lower[axis] + length * _shares(count))
        area *= 1.0 if inward[axis] else length / count
    places = np.stack(np.meshgrid(*middles, indexing="ij"), axis=-1).reshape(-1, dim)
    places = np.pad(places, ((0, 0), (0, 3 - dim))) - wall.origin
    normals = np.tile(inward, (len(places), 1))
    return Panels(places, normals, places, area * normals, center=places.mean(axis=0))


def _shares(count: int) -> np.ndarray:
    return (np.arange(count) + 0.5) / count

"""Solids as shapes of the engine that bodies move in (Rapier), in their own frames."""

from typing import Any

import numpy as np

from wavetank.foundation.rotations import product, turned
from wavetank.solids.mass import Ruler
from wavetank.solids.meshes.mesh import Mesh
from wavetank.solids.shapes import Box, Capsule, Cylinder, HalfSpace, Sphere, Union
from wavetank.solids.solid import Solid

VOXELS = 32  # across what is made of voxels, at least
THICK = 100.0  # m: half of the edge of a box that stands for a half-space
UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])
Placed = tuple[np.ndarray, np.ndarray, Any]  # position [m] and rotation in the solid's frame, and the shape there


def shapes_of(solid: Solid, dim: int, spacing: float) -> list[Placed]:
    """Return the shapes that a solid consists of; what has no exact counterpart is made of voxels.

    In a 2-D world all shapes lie in the plane z = 0, and a box or what is made of voxels is as thick as it is wide.
    """
    import rapier3d as engine

    shapes, middle = engine.SharedShape, np.zeros(3)
    if isinstance(solid, Box):
        half = [0.5 * edge for edge in solid.size]
        return [(middle, UPRIGHT, shapes.cuboid(half[0], half[1], half[2] if dim == 3 else max(half)))]
    if isinstance(solid, Sphere):
        return [(middle, UPRIGHT, shapes.ball(solid.radius))]
    if isinstance(solid, Capsule | Cylinder):
        node = solid.program()[0]
        radius, half_height = node.size[:2]
        make = shapes.capsule_y if isinstance(solid, Capsule) else shapes.cylinder
        return [(middle, node.turn, make(half_height, radius))]
    if isinstance(solid, HalfSpace):
        # A large box: the engine knows no contact of voxels with a half-space.
        normal = np.array([float(n) for n in (*solid.normal, 0.0)[:3]])
        normal /= np.linalg.norm(normal)
        return [(-THICK * normal, _upwards(normal), shapes.cuboid(THICK, THICK, THICK))]
    if isinstance(solid, Union):
        return [
            (part.origin + turned(part.quaternion, place), product(part.quaternion, turn), shape)
            for part in solid.parts
            for place, turn, shape in shapes_of(part, dim, spacing)
        ]
    if isinstance(solid, Mesh) and not solid.invert:
        points, faces = solid.surface()
        points = points - 0.5 * (points.min(axis=0) + points.max(axis=0))
        closed = solid.is_body and solid.thickness is None
        return [(middle, UPRIGHT, (shapes.convex_decomposition if closed else shapes.trimesh)(points, faces))]
    return [] if getattr(solid, "invert", False) else [_of_voxels(solid, dim, spacing)]


def _upwards(normal: np.ndarray) -> np.ndarray:
    """Return the quaternion that turns y to a unit vector."""
    turn = np.array([1.0 + normal[1], normal[2], 0.0, -normal[0]])  # of half the angle about y x normal
    length = float(np.linalg.norm(turn))
    return turn / length if length > 1e-6 else np.array([0.0, 1.0, 0.0, 0.0])


def _of_voxels(solid: Solid, dim: int, spacing: float) -> Placed:
    import rapier3d as engine

    cut = Ruler(solid, dim, spacing).cut(min(spacing, 2.0 * solid.reach() / VOXELS))
    edges = np.where(cut.edges > 0.0, cut.edges, cut.edges.max())
    full = cut.volumes > 0.5 * cut.volumes.max()
    lower = cut.places[full].min(axis=0) - 0.5 * edges
    numbers = np.round((cut.places[full] - lower) / edges - 0.5).astype(np.int32)
    return lower, UPRIGHT, engine.SharedShape.voxels(edges.tolist(), numbers)

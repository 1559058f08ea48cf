"""Solids as colliders of the engine that bodies move in (Rapier), in their own frames."""

from typing import Any

import numpy as np

from wavetank.solids.mass import Ruler
from wavetank.solids.meshes.mesh import Mesh
from wavetank.solids.shapes import Box, Capsule, Cylinder, HalfSpace, Sphere, Union
from wavetank.solids.solid import Solid

VOXELS = 32  # across what is made of voxels, at least


def shape_of(solid: Solid, dim: int, spacing: float) -> Any:
    """Return the shape of a solid in its frame, but for its turn; what has no exact counterpart is made of voxels.

    In a 2-D world all shapes lie in the plane z = 0, and a box or what is made of voxels is as thick as it is wide.
    """
    import rapier3d as engine

    shapes = engine.SharedShape
    if isinstance(solid, Box):
        half = [0.5 * edge for edge in solid.size]
        return shapes.cuboid(half[0], half[1], half[2] if dim == 3 else max(half))
    if isinstance(solid, Sphere):
        return shapes.ball(solid.radius)
    if isinstance(solid, Capsule | Cylinder):
        node = solid.program()[0]
        radius, half_height = node.size[:2]
        shape = shapes.capsule_y if isinstance(solid, Capsule) else shapes.cylinder
        return _placed(shape(half_height, radius), np.zeros(3), node.turn)
    if isinstance(solid, HalfSpace):
        return shapes.halfspace([float(n) for n in (*solid.normal, 0.0)[:3]])
    if isinstance(solid, Union):
        parts = [(part, shape_of(part, dim, spacing)) for part in solid.parts]
        return shapes.compound([(_pose(part.origin, part.quaternion), shape) for part, shape in parts])
    if isinstance(solid, Mesh):
        points, faces = solid.surface()
        points -= 0.5 * (points.min(axis=0) + points.max(axis=0))
        closed = solid.is_body and solid.thickness is None
        return (shapes.convex_decomposition if closed else shapes.trimesh)(points, faces)
    return _of_voxels(solid, dim, spacing)


def _of_voxels(solid: Solid, dim: int, spacing: float) -> Any:
    import rapier3d as engine

    cut = Ruler(solid, dim, spacing).cut(min(spacing, 2.0 * solid.reach() / VOXELS))
    edges = np.where(cut.edges > 0.0, cut.edges, cut.edges.max())
    full = cut.volumes > 0.5 * cut.volumes.max()
    lower = cut.places[full].min(axis=0) - 0.5 * edges
    numbers = np.round((cut.places[full] - lower) / edges - 0.5).astype(np.int32)
    shift = lower if dim == 3 else lower * (1.0, 1.0, 0.0) - (0.0, 0.0, 0.5 * edges[2])
    return _placed(engine.SharedShape.voxels(edges.tolist(), numbers), shift, np.array([1.0, 0.0, 0.0, 0.0]))


def _placed(shape: Any, position: np.ndarray, rotation: np.ndarray) -> Any:
    import rapier3d as engine

    return engine.SharedShape.compound([(_pose(position, rotation), shape)])


def _pose(position: np.ndarray, rotation: np.ndarray) -> Any:
    import rapier3d as engine

    return engine.Isometry3(position.tolist(), engine.Rotation3(*map(float, rotation)))

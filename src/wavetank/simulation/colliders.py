"""Solids as shapes of the engine that bodies move in (Rapier), in their own frames."""

from typing import Any

import numpy as np

from wavetank.foundation.rotations import product, turned
from wavetank.solids.mass import Ruler
from wavetank.solids.meshes.mesh import Mesh
from wavetank.solids.shapes import Box, Capsule, Cylinder, HalfSpace, Sphere, Union
from wavetank.solids.solid import Solid

FEWEST, MOST = 24, 64  # small cubes across what is made of them
UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])
Placed = tuple[np.ndarray, np.ndarray, Any]  # position [m] and rotation in the solid's frame, and the shape there


def shapes_of(solid: Solid, dim: int, spacing: float) -> list[Placed]:
    """Return the shapes that a solid consists of; what has no exact counterpart is made of boxes.

    In a 2-D world all shapes lie in the plane z = 0, and a box or what is made of boxes is as thick as it is wide.
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
        return [(middle, UPRIGHT, shapes.halfspace([float(n) for n in (*solid.normal, 0.0)[:3]]))]
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
    return [] if getattr(solid, "invert", False) else _of_boxes(solid, dim, spacing)


def _of_boxes(solid: Solid, dim: int, spacing: float) -> list[Placed]:
    """Return boxes of the small cubes that are mostly inside, as large as they get; voxels know no half-space."""
    import rapier3d as engine

    cut = Ruler(solid, dim, spacing).cut(max(min(spacing, 2.0 * solid.reach() / FEWEST), 2.0 * solid.reach() / MOST))
    edges = np.where(cut.edges > 0.0, cut.edges, cut.edges.max())
    full = cut.volumes > 0.5 * cut.volumes.max()
    lower = cut.places[full].min(axis=0) - 0.5 * edges
    numbers = np.round((cut.places[full] - lower) / edges - 0.5).astype(int)
    taken = np.zeros(numbers.max(axis=0) + 1, bool)
    taken[tuple(numbers.T)] = True
    boxes = []
    for corner in numbers[np.lexsort(numbers.T)]:
        if not taken[tuple(corner)]:
            continue
        end = corner + 1
        for axis in range(3):  # grow along one axis after the other
            while end[axis] < taken.shape[axis]:
                slab = [slice(low, high) for low, high in zip(corner, end, strict=True)]
                slab[axis] = slice(end[axis], end[axis] + 1)
                if not taken[tuple(slab)].all():
                    break
                end[axis] += 1
        taken[tuple(slice(low, high) for low, high in zip(corner, end, strict=True))] = False
        half = 0.5 * (end - corner) * edges
        boxes.append((lower + corner * edges + half, UPRIGHT, engine.SharedShape.cuboid(*map(float, half))))
    return boxes

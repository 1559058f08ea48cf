"""The rigid-body engine (Rapier): poses and velocities of all bodies at once, and solids as its collision shapes.

A value read from the engine by itself takes half a microsecond, and a body needs thirteen of them in a step.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from wavetank.foundation.errors import WavetankError
from wavetank.foundation.rotations import product, turned
from wavetank.solids.mass import Ruler
from wavetank.solids.meshes.mesh import Mesh
from wavetank.solids.shapes import Box, Capsule, Cylinder, HalfSpace, Sphere, Union
from wavetank.solids.solid import Solid


def import_engine() -> Any:
    """Return the engine's module; raises `WavetankError` where it is not installed."""
    try:
        import rapier3d
    except ImportError:
        raise WavetankError(
            "this scene has bodies, and these need the package rapier3d; install it: pip install rapier3d"
        ) from None
    return rapier3d


def isometry(engine: Any, position: np.ndarray, rotation: np.ndarray) -> Any:
    """Return the engine's pose of a position [3] [m] and a quaternion (w, x, y, z)."""
    return engine.Isometry3(position.tolist(), engine.Rotation3(*rotation.tolist()))


def velocities_of(rigid: Sequence[Any]) -> np.ndarray:
    """Return velocities [m/s] and angular velocities [rad/s] of the engine's bodies, [n, 6]."""
    return np.array([now.linvel.to_tuple() + now.angvel.to_tuple() for now in rigid])


def poses_of(rigid: Sequence[Any]) -> tuple[np.ndarray, np.ndarray]:
    """Return positions [n, 3] [m] and quaternions (w, x, y, z) [n, 4] of the engine's bodies."""
    rows = np.array([now.translation.to_tuple() + now.rotation.to_tuple() for now in rigid])
    return rows[:, :3].copy(), rows[:, [6, 3, 4, 5]]


def keep_in_plane(engine: Any, rigid: Sequence[Any]) -> None:
    """Project positions, rotations and velocities of the bodies of a 2-D world back into its plane.

    Contacts move and turn them out of it by rounding errors.
    """
    for now in rigid:
        (x, y, z), (i, j, k, w) = now.translation.to_tuple(), now.rotation.to_tuple()
        if z or i or j:
            length = math.hypot(k, w)
            now.position = isometry(engine, np.array([x, y, 0.0]), np.array([w, 0.0, 0.0, k]) / length)
        velocity, spin = now.linvel, now.angvel
        if velocity.z or spin.x or spin.y:
            now.linvel, now.angvel = [velocity.x, velocity.y, 0.0], [0.0, 0.0, spin.z]


FEWEST, MOST = 24, 64  # voxels across a solid that is approximated by boxes
UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])
Placed = tuple[np.ndarray, np.ndarray, Any]  # position [m] and rotation in the solid's frame, and the shape there


def shapes_of(solid: Solid, dim: int, spacing: float) -> list[Placed]:
    """Return the engine's collision shapes of a solid; one without an exact counterpart is approximated by boxes.

    In a 2-D world all shapes lie in the plane z = 0, and boxes are as thick as they are wide.
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
    """Return boxes that cover the voxels mostly inside of a solid, merged to be as large as possible.

    The engine's own voxel shape is not used: it does not collide with half-spaces.
    """
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

"""Boxes around solids, where they stand."""

import numpy as np

from wavetank.foundation.rotations import turned
from wavetank.solids.ground.height_field import HeightField
from wavetank.solids.ground.polygon import Polygon
from wavetank.solids.meshes.mesh import Mesh
from wavetank.solids.shapes import Box, Capsule, Cylinder, Difference, Intersection, Sphere, Union
from wavetank.solids.solid import Solid, point_in_space


def bounds_of(solid: Solid) -> tuple[np.ndarray, np.ndarray]:
    """Return the lower and upper corner [m], [3] each, of a box around `solid`.

    It is the smallest one for a single shape and contains the others; corners of infinite solids are infinite.
    """
    if isinstance(solid, HeightField) or (isinstance(solid, Mesh | Polygon) and not solid.invert):
        points = turned(solid.quaternion, solid.vertices()) + solid.origin
        return points.min(axis=0), points.max(axis=0)
    low, high = _in_own_frame(solid)
    if not np.isfinite(low).all():
        return np.full(3, -np.inf), np.full(3, np.inf)
    if isinstance(solid, Sphere):
        return solid.origin + low, solid.origin + high
    columns = np.abs(np.stack([turned(solid.quaternion, axis) for axis in np.eye(3)], axis=1))
    middle = solid.origin + turned(solid.quaternion, 0.5 * (low + high))
    half = columns @ (0.5 * (high - low))
    return middle - half, middle + half


def _in_own_frame(solid: Solid) -> tuple[np.ndarray, np.ndarray]:
    if isinstance(solid, Box):
        half = point_in_space([0.5 * edge for edge in solid.size])
        return -half, half
    if isinstance(solid, Capsule | Cylinder):
        half = 0.5 * (point_in_space(solid.end) - point_in_space(solid.start))
        along = half / max(float(np.linalg.norm(half)), 1e-12)
        # Extent of a disc across the axis along each coordinate axis.
        wide = solid.radius * np.sqrt(np.maximum(1.0 - along**2, 0.0)) if isinstance(solid, Cylinder) else solid.radius
        return -np.abs(half) - wide, np.abs(half) + wide
    if isinstance(solid, Union | Intersection | Difference):
        boxes = [bounds_of(part) for part in solid.parts]
        lower, upper = (np.stack(side) for side in zip(*boxes, strict=True))
        if isinstance(solid, Union):
            return lower.min(axis=0), upper.max(axis=0)
        if isinstance(solid, Intersection):
            low = lower.max(axis=0)
            return low, np.maximum(upper.min(axis=0), low)
        return lower[0], upper[0]
    reach = solid.reach() if isinstance(solid, Sphere) else np.inf
    return np.full(3, -reach), np.full(3, reach)

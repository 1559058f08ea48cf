"""Unit quaternions (w, x, y, z) on the host."""

import math
from collections.abc import Sequence

import numpy as np

from wavetank.foundation.errors import WavetankError


def length_of(vector: np.ndarray) -> float:
    """Return the length of a vector [n], also where the squares of its components overflow."""
    largest = float(np.abs(vector).max())
    return float(np.linalg.norm(vector)) if 1e-100 < largest < 1e100 else math.hypot(*vector.tolist())


def unit_quaternion(rotation: Sequence[float] | float) -> np.ndarray:
    """Return (w, x, y, z) of unit length from a quaternion or from an angle about z [rad]."""
    if isinstance(rotation, int | float):
        if not math.isfinite(rotation):
            raise WavetankError(f"rotation = {rotation} is not an angle [rad]; it must be a finite number.")
        return np.array([np.cos(0.5 * rotation), 0.0, 0.0, np.sin(0.5 * rotation)])
    q = np.asarray(rotation, float)
    length = length_of(q) if q.shape == (4,) else math.nan
    if not math.isfinite(length) or length < 1e-12:
        raise WavetankError(f"rotation = {rotation} is not a quaternion (w, x, y, z) of non-zero length.")
    return q / length


def product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the Hamilton product: the rotation by `b`, then by `a`."""
    w, v = a[0] * b[0] - a[1:] @ b[1:], a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:])
    return np.concatenate([[w], v])


def inverse(q: np.ndarray) -> np.ndarray:
    """Return the inverse of a unit quaternion."""
    return q * (1.0, -1.0, -1.0, -1.0)


def turned(q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Return vector `v`, or vectors [n, 3], rotated by the unit quaternion `q`."""
    # Written out: `np.cross` takes 20 us per vector, and a scene with many bodies rotates many in each step.
    w, x, y, z = q.tolist()
    a, b, c = v[..., 0], v[..., 1], v[..., 2]
    d, e, f = y * c - z * b + w * a, z * a - x * c + w * b, x * b - y * a + w * c
    return np.stack([a + 2.0 * (y * f - z * e), b + 2.0 * (z * d - x * f), c + 2.0 * (x * e - y * d)], axis=-1)


def matrix_of(rotations: np.ndarray) -> np.ndarray:
    """Return the rotation matrices [n, 3, 3] of unit quaternions [n, 4]."""
    w, x, y, z = rotations.T
    rows = [
        [w * w + x * x - y * y - z * z, 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), w * w - x * x + y * y - z * z, 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ]
    return np.moveaxis(np.array(rows), -1, 0)


def turn_from_y(axis: np.ndarray) -> np.ndarray:
    """Return the smallest rotation from the y axis to the direction of `axis` (identity for a zero vector)."""
    length = length_of(axis)
    if length < 1e-12:
        return np.array([1.0, 0.0, 0.0, 0.0])
    y = np.array([0.0, 1.0, 0.0])
    direction = axis / length
    if direction[1] < -1.0 + 1e-9:
        return np.array([0.0, 0.0, 0.0, 1.0])
    q = np.concatenate([[1.0 + y @ direction], np.cross(y, direction)])
    return q / np.linalg.norm(q)


def interpolate(a: np.ndarray, b: np.ndarray, share: float) -> np.ndarray:
    """Return the unit quaternion at `share` (0 to 1) of the shortest rotation from `a` to `b` (slerp)."""
    cosine = float(a @ b)
    b = -b if cosine < 0 else b
    angle = float(np.arccos(min(abs(cosine), 1.0)))
    if angle < 1e-6:
        q = (1.0 - share) * a + share * b
    else:
        q = (np.sin((1.0 - share) * angle) * a + np.sin(share * angle) * b) / np.sin(angle)
    return q / np.linalg.norm(q)


def quaternion_of(matrix: np.ndarray) -> tuple[float, ...]:
    """Return (w, x, y, z) of a rotation matrix (Bar-Itzhack 2000, 10.2514/2.4654)."""
    m = matrix
    whole = np.array(
        [
            [m[0, 0] - m[1, 1] - m[2, 2], 0.0, 0.0, 0.0],
            [m[1, 0] + m[0, 1], m[1, 1] - m[0, 0] - m[2, 2], 0.0, 0.0],
            [m[2, 0] + m[0, 2], m[2, 1] + m[1, 2], m[2, 2] - m[0, 0] - m[1, 1], 0.0],
            [m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], np.trace(m)],
        ]
    )
    x, y, z, w = np.linalg.eigh(whole / 3.0)[1][:, -1]
    return (float(w), float(x), float(y), float(z))

"""The engine that moves bodies (Rapier), and what it says of all of them at once.

Each number that is asked of the engine by itself takes half a microsecond, and there are thirteen to a body and a step.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from wavetank.foundation.errors import WavetankError


def import_engine() -> Any:
    """Return the module of the engine; raise `WavetankError` where it is not installed."""
    try:
        import rapier3d
    except ImportError:
        raise WavetankError(
            "this scene has bodies, and these need the package rapier3d; install it with: pip install wavetank[bodies]"
        ) from None
    return rapier3d


def isometry(engine: Any, position: np.ndarray, rotation: np.ndarray) -> Any:
    """Return a pose, place [3] [m] and quaternion (w, x, y, z), as the engine's."""
    return engine.Isometry3(position.tolist(), engine.Rotation3(*rotation.tolist()))


def velocities_of(rigid: Sequence[Any]) -> np.ndarray:
    """Return velocities [m/s] and angular velocities [rad/s] of bodies, [n, 6]."""
    return np.array([now.linvel.to_tuple() + now.angvel.to_tuple() for now in rigid])


def poses_of(rigid: Sequence[Any]) -> tuple[np.ndarray, np.ndarray]:
    """Return places [n, 3] [m] and quaternions (w, x, y, z) [n, 4] of bodies."""
    rows = np.array([now.translation.to_tuple() + now.rotation.to_tuple() for now in rigid])
    return rows[:, :3].copy(), rows[:, [6, 3, 4, 5]]


def keep_in_plane(engine: Any, rigid: Sequence[Any]) -> None:
    """Take from the bodies of a 2-D world what contacts have moved and turned them out of its plane by."""
    for now in rigid:
        (x, y, z), (i, j, k, w) = now.translation.to_tuple(), now.rotation.to_tuple()
        if z or i or j:
            length = math.hypot(k, w)
            now.position = isometry(engine, np.array([x, y, 0.0]), np.array([w, 0.0, 0.0, k]) / length)
        velocity, spin = now.linvel, now.angvel
        if velocity.z or spin.x or spin.y:
            now.linvel, now.angvel = [velocity.x, velocity.y, 0.0], [0.0, 0.0, spin.z]

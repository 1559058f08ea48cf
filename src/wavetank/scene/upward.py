"""Which way is up: what pictures, levels, tools and files take as the vertical."""

from collections.abc import Sequence
from typing import Literal

import numpy as np

Up = Literal["x", "y", "z", "-x", "-y", "-z"]

#: Rotation matrices [3, 3] that turn a world with that axis up so that y is up.
TURNS: dict[str, np.ndarray] = {
    "y": np.eye(3),
    "z": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]),
    "x": np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
    "-y": np.diag([-1.0, -1.0, 1.0]),
    "-z": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
    "-x": np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
}


def nearest_axis(vector: Sequence[float]) -> str:
    """Return the axis that a vector points along most, y where two are equal or all are 0."""
    length = max(map(abs, vector))
    for number in (1, 0, 2):
        if number < len(vector) and length and abs(vector[number]) >= length * (1.0 - 1e-9):
            return ("-" if vector[number] < 0.0 else "") + "xyz"[number]
    return "y"


def upward_of(gravity: Sequence[float], periodic: Sequence[int]) -> str:
    """Return the axis against gravity [m/s^2]; along a periodic axis it drives the water and counts for nothing."""
    return nearest_axis([0.0 if number in periodic else -part for number, part in enumerate(gravity)])

"""Particles as NumPy archives: everything, exactly."""

from pathlib import Path

import numpy as np

from wavetank.foundation.replacing import replacing
from wavetank.simulation.frame import Frame

SUFFIXES = (".npz",)
KIND = "particles"


def write_npz(path: str | Path, frame: Frame) -> None:
    """Write positions [m], velocities [m/s], densities [kg/m^3], materials, ordered by particle id; time [s], number.

    Spray, foam and bubbles follow: `foam_positions`, `foam_velocities`, `foam_kinds` (1 spray, 2 foam, 3 bubble),
    `foam_ages` [s] and `foam_ids`, which stay with a particle from file to file.
    """
    with replacing(path) as partial, partial.open("wb") as file:
        np.savez_compressed(
            file, positions=frame.positions, velocities=frame.velocities, densities=frame.densities,
            materials=frame.materials, time=np.float64(frame.time), number=np.int64(frame.number),
            foam_positions=frame.foam_positions, foam_velocities=frame.foam_velocities, foam_kinds=frame.foam_kinds,
            foam_ages=frame.foam_ages, foam_ids=frame.foam_ids,
        )  # fmt: skip


def read_npz(path: str | Path) -> dict[str, np.ndarray]:
    """Return the arrays of a file by name."""
    with np.load(path) as file:
        return {name: file[name] for name in file.files}


write = write_npz

"""Particles as NumPy archives: everything, exactly."""

from pathlib import Path

import numpy as np

from wavetank.export.replacing import replacing
from wavetank.frame import Frame

SUFFIXES = (".npz",)
KIND = "particles"


def write_npz(path: str | Path, frame: Frame) -> None:
    """Write positions [m], velocities [m/s], densities [kg/m^3], ordered by particle id, time [s] and frame number."""
    with replacing(path) as partial, partial.open("wb") as file:
        np.savez_compressed(
            file, positions=frame.positions, velocities=frame.velocities, densities=frame.densities,
            time=np.float64(frame.time), number=np.int64(frame.number),
        )  # fmt: skip


def read_npz(path: str | Path) -> dict[str, np.ndarray]:
    """Return the arrays of a file by name."""
    with np.load(path) as file:
        return {name: file[name] for name in file.files}


write = write_npz

"""Particles as a point cloud in binary PLY: for Blender, MeshLab, ParaView and splashsurf.

Greg Turk, "The PLY Polygon File Format" (1994). A 2-D world lies in the plane z = 0.
"""

from pathlib import Path

import numpy as np

from wavetank.errors import WavetankError
from wavetank.export.replacing import replacing
from wavetank.frame import Frame

SUFFIXES = (".ply",)
KIND = "particles"

COLUMNS = ("x", "y", "z", "vx", "vy", "vz", "density")
_RECORD = np.dtype([(name, "<f4") for name in COLUMNS])


def write_ply(path: str | Path, frame: Frame) -> None:
    """Write position [m], velocity [m/s] and density [kg/m^3] of every particle, ordered by id, little endian."""
    records = np.zeros(frame.count, _RECORD)
    for k in range(frame.dim):
        records[COLUMNS[k]] = frame.positions[:, k]
        records[COLUMNS[3 + k]] = frame.velocities[:, k]
    records["density"] = frame.densities
    header = [
        "ply", "format binary_little_endian 1.0", "comment wavetank, SI units", f"comment time {frame.time!r} s",
        f"element vertex {frame.count}", *(f"property float {name}" for name in COLUMNS), "end_header",
    ]  # fmt: skip
    with replacing(path) as partial:
        partial.write_bytes("\n".join(header).encode("ascii") + b"\n" + records.tobytes())


def read_ply(path: str | Path) -> np.ndarray:
    """Return the records of a file that `write_ply` wrote, a structured array [count] with fields `COLUMNS`."""
    header, _, body = Path(path).read_bytes().partition(b"end_header\n")
    if "format binary_little_endian 1.0" not in header.decode("ascii", "replace"):
        raise WavetankError(f"{str(path)!r} is not a binary little endian PLY file.")
    return np.frombuffer(body, _RECORD)


write = write_ply

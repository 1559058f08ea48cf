"""Particles as a point cloud in binary PLY: for Blender, MeshLab, ParaView and splashsurf.

Greg Turk, "The PLY Polygon File Format" (1994). A 2-D world lies in the plane z = 0.
"""

from pathlib import Path

import numpy as np

from wavetank.foundation.errors import WavetankError
from wavetank.foundation.replacing import replacing
from wavetank.simulation.frame import Frame

SUFFIXES = (".ply",)
KIND = "particles"

COLUMNS = ("x", "y", "z", "vx", "vy", "vz", "density", "material")
FOAM_COLUMNS = ("x", "y", "z", "vx", "vy", "vz", "age", "kind", "id")
_RECORD = np.dtype([(name, "<i4" if name == "material" else "<f4") for name in COLUMNS])
_FOAM_RECORD = np.dtype([(name, "<i4" if name in ("kind", "id") else "<f4") for name in FOAM_COLUMNS])


def write_ply(path: str | Path, frame: Frame) -> None:
    """Write position [m], velocity [m/s], density [kg/m^3], material of every particle, ordered by id, little endian.

    Spray, foam and bubbles, if there are any, are an element of their own, `foam`, with age [s], kind (1 spray, 2 foam,
    3 bubble) and id: who asks for vertices, such as a surface reconstruction, gets the water alone.
    """
    water = _records(_RECORD, frame.positions, frame.velocities)
    water["density"], water["material"] = frame.densities, frame.materials
    foam = _records(_FOAM_RECORD, frame.foam_positions, frame.foam_velocities)
    foam["age"], foam["kind"], foam["id"] = frame.foam_ages, frame.foam_kinds, frame.foam_ids
    header = [
        "ply", "format binary_little_endian 1.0", "comment wavetank, SI units", f"comment time {frame.time!r} s",
        *_element("vertex", water), *(_element("foam", foam) if len(foam) else ()), "end_header",
    ]  # fmt: skip
    with replacing(path) as partial:
        partial.write_bytes("\n".join(header).encode("ascii") + b"\n" + water.tobytes() + foam.tobytes())


def _records(kind: np.dtype, positions: np.ndarray, velocities: np.ndarray) -> np.ndarray:
    records = np.zeros(len(positions), kind)
    for k in range(positions.shape[1]):
        records["xyz"[k]], records["v" + "xyz"[k]] = positions[:, k], velocities[:, k]
    return records


def _element(name: str, records: np.ndarray) -> list[str]:
    assert records.dtype.names is not None
    kinds = {"f": "float", "i": "int"}
    properties = [f"property {kinds[records.dtype[column].kind]} {column}" for column in records.dtype.names]
    return [f"element {name} {len(records)}", *properties]


def read_ply(path: str | Path) -> np.ndarray:
    """Return the water of a file that `write_ply` wrote, a structured array [count] with fields `COLUMNS`."""
    return _parts(path)[0]


def read_foam(path: str | Path) -> np.ndarray:
    """Return its spray, foam and bubbles, a structured array with fields `FOAM_COLUMNS`."""
    return _parts(path)[1]


def _parts(path: str | Path) -> tuple[np.ndarray, np.ndarray]:
    header, _, body = Path(path).read_bytes().partition(b"end_header\n")
    lines = header.decode("ascii", "replace").splitlines()
    if "format binary_little_endian 1.0" not in lines:
        raise WavetankError(f"{str(path)!r} is not a binary little endian PLY file.")
    counts = {line.split()[1]: int(line.split()[2]) for line in lines if line.startswith("element ")}
    water = np.frombuffer(body, _RECORD, counts["vertex"])
    return water, np.frombuffer(body, _FOAM_RECORD, counts.get("foam", 0), offset=water.nbytes)


write = write_ply

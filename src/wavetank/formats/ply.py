"""Particles as a point cloud in binary PLY: for Blender, MeshLab, ParaView and splashsurf.

Greg Turk, "The PLY Polygon File Format" (1994). A 2-D world lies in the plane z = 0.
"""

from pathlib import Path
from typing import Any

import numpy as np

from wavetank.formats.surface import surfaces_of
from wavetank.foundation.atomic_write import atomic_write

SUFFIXES = (".ply",)
KIND = "particles"

COLUMNS = ("x", "y", "z", "vx", "vy", "vz", "density", "material", "id", "red", "green", "blue")
FOAM_COLUMNS = ("x", "y", "z", "vx", "vy", "vz", "age", "kind", "id")
MESH_COLUMNS = ("x", "y", "z", "nx", "ny", "nz", "vx", "vy", "vz", "red", "green", "blue")
_KINDS = {"material": "<i4", "kind": "<i4", "id": "<i4", "red": "u1", "green": "u1", "blue": "u1"}
_RECORD, _FOAM_RECORD, _MESH_RECORD = (
    np.dtype([(name, _KINDS.get(name, "<f4")) for name in columns]) for columns in (COLUMNS, FOAM_COLUMNS, MESH_COLUMNS)
)
_FACE = np.dtype([("count", "u1"), ("corners", "<i4", 3)])


def write_ply(path: str | Path, frame: Any) -> None:
    """Write position [m], velocity [m/s], density [kg/m^3], material, id and colour of every particle, little endian.

    Spray, foam and bubbles, if there are any, are an element of their own, `foam`, with age [s], kind (1 spray, 2 foam,
    3 bubble) and id: who asks for vertices, such as a surface reconstruction, gets the water alone.
    Solids are comments: name, position [m], quaternion (w, x, y, z). `frame` is a `Frame` or a `State`.
    """
    water = _records(_RECORD, frame.positions, frame.velocities)
    water["density"], water["material"], water["id"] = frame.densities, frame.materials, frame.ids
    water["red"], water["green"], water["blue"] = frame.colors.T
    foam = _records(_FOAM_RECORD, frame.foam_positions, frame.foam_velocities)
    foam["age"], foam["kind"], foam["id"] = frame.foam_ages, frame.foam_kinds, frame.foam_ids
    header = [
        *_opening(frame),
        *_element("vertex", water),
        *(_element("foam", foam) if len(foam) else ()),
        "end_header",
    ]
    with atomic_write(path) as partial:
        partial.write_bytes("\n".join(header).encode("ascii") + b"\n" + water.tobytes() + foam.tobytes())


def write_surface(path: str | Path, instant: Any) -> None:
    """Write the surfaces of all fluids as one mesh: position [m], normal, velocity [m/s] and colour of each vertex."""
    surfaces = surfaces_of(instant)
    firsts = np.cumsum([0, *(len(surface.vertices) for surface in surfaces)])
    vertices = np.zeros(firsts[-1], _MESH_RECORD)
    faces = np.zeros(sum(len(surface.triangles) for surface in surfaces), _FACE)
    faces["count"], done = 3, 0
    for surface, first in zip(surfaces, firsts, strict=False):
        own = vertices[first : first + len(surface.vertices)]
        for prefix, rows in (("", surface.vertices), ("n", surface.normals), ("v", surface.velocities)):
            for k in range(3):
                own[prefix + "xyz"[k]] = rows[:, k]
        for k, name in enumerate(("red", "green", "blue")):
            own[name] = int(surface.color[1 + 2 * k : 3 + 2 * k], 16)
        faces["corners"][done : done + len(surface.triangles)] = surface.triangles + first
        done += len(surface.triangles)
    header = [
        *_opening(instant),
        *_element("vertex", vertices),
        f"element face {len(faces)}",
        "property list uchar int vertex_indices",
        "end_header",
    ]
    with atomic_write(path) as partial:
        partial.write_bytes("\n".join(header).encode("ascii") + b"\n" + vertices.tobytes() + faces.tobytes())


def _opening(frame: Any) -> list[str]:
    poses = [
        f"comment solid {'_'.join(one.name.split())} " + " ".join(f"{x:.9g}" for x in (*one.position, *one.rotation))
        for one in frame.placed
    ]
    poses = [line.encode("ascii", "replace").decode() for line in poses]
    start = ["ply", "format binary_little_endian 1.0", "comment wavetank, SI units", f"comment time {frame.time!r} s"]
    return [*start, *poses]


def _records(kind: np.dtype, positions: np.ndarray, velocities: np.ndarray) -> np.ndarray:
    records = np.zeros(len(positions), kind)
    for k in range(positions.shape[1]):
        records["xyz"[k]], records["v" + "xyz"[k]] = positions[:, k], velocities[:, k]
    return records


def _element(name: str, records: np.ndarray) -> list[str]:
    assert records.dtype.names is not None
    kinds = {"f": "float", "i": "int", "u": "uchar"}
    properties = [f"property {kinds[records.dtype[column].kind]} {column}" for column in records.dtype.names]
    return [f"element {name} {len(records)}", *properties]


write = write_ply

"""HDF5 for analysis: all frames in one file of plain tables; the layout is in docs/formats.md.

Rows of all frames lie one after the other; `first` and `count` of a table say which are those of a frame. The attribute
`NFrames` is written last: a file whose run was killed has all frames that it counts.
"""

import dataclasses
import itertools
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from wavetank.formats.growing import (
    Columns,
    GrowingFile,
    Table,
    damaged,
    fitting,
    frames_of,
    import_h5py,
    open_hdf5,
    table_rows,
)
from wavetank.formats.plan import Plan
from wavetank.formats.surface import WaterSurface
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.version import VERSION
from wavetank.scene.scene import Scene
from wavetank.simulation.instant import FOAM, PARTICLES, Field, PlacedSolid, solids_by_name
from wavetank.simulation.state import State

SUFFIXES = (".h5", ".hdf5")
KIND = "series"
VERSION_OF_LAYOUT = 1
COUNTER = "NFrames"
SOLIDS: Columns = {
    "names": ("S64", ()),
    "positions": ("f8", (3,)),
    "rotations": ("f8", (4,)),
    "velocities": ("f8", (3,)),
    "angular_velocities": ("f8", (3,)),
}
VERTICES: Columns = {
    "positions": ("f4", (3,)),
    "normals": ("f4", (3,)),
    "velocities": ("f4", (3,)),
    "materials": ("i4", ()),
}
TRIANGLES: Columns = {"corners": ("i4", (3,))}


def check(scene: Scene) -> None:
    """Raise `WavetankError` where the package that writes HDF5 is missing."""
    import_h5py()


class Hdf5Series:
    """Writes all frames into one file."""

    repeatable = False

    def __init__(self, plan: Plan) -> None:
        path = plan.path(SUFFIXES[0])
        self.files = [str(path)]
        file = self.file = GrowingFile(path, "/", COUNTER, plan.retry)
        about = {
            "format": "wavetank",
            "layout": VERSION_OF_LAYOUT,
            "wavetank": VERSION,
            "dim": plan.scene.dim,
            "spacing": plan.scene.spacing,
            "fps": plan.fps,
        }
        for name, value in about.items():
            file.file.attrs[name] = value
        file.file.create_dataset("scene", data=np.bytes_(plan.scene.text().encode()), track_times=False)
        for name, kind in (("time", "f8"), ("number", "i8")):
            file.column(f"frames/{name}", kind, each_frame=True)
        self.water = Table(file, "water", _columns(PARTICLES, plan.scene.dim, ""))
        self.foam = Table(file, "foam", _columns(FOAM, plan.scene.dim, "foam_"))
        self.solids = Table(file, "solids", SOLIDS)
        self.surface: tuple[Table, Table] | None = None
        if "surface" in plan.parts:
            self.surface = Table(file, "surface", VERTICES), Table(file, "triangles", TRIANGLES)
        self._keep(path, plan.kept)

    def _keep(self, path: Path, frames: int) -> None:
        """Begin with the first frames of the file that is there: the same calls make the same bytes."""
        self.file.hidden = True
        for number, instant in enumerate(itertools.islice(read(path), frames) if frames else ()):
            self.write(number, instant)
        self.file.hidden = False
        if self.file.frames != frames:
            raise WavetankError(f"{path} has {self.file.frames} frames, and {frames} of them are to be kept.")

    def write(self, number: int, instant: State) -> None:
        """Append a frame."""
        self.file.append("frames/time", [instant.time])
        self.file.append("frames/number", [instant.number])
        self.water.append({field.name: getattr(instant, field.name) for field in PARTICLES})
        self.foam.append({field.name.removeprefix("foam_"): getattr(instant, field.name) for field in FOAM})
        standing = instant.placed
        self.solids.append(
            {
                "names": np.array([one.name.encode()[:64] for one in standing], "S64"),
                "positions": _rows([one.position for one in standing], 3),
                "rotations": _rows([one.rotation for one in standing], 4),
                "velocities": _rows([one.velocity for one in standing], 3),
                "angular_velocities": _rows([one.angular_velocity for one in standing], 3),
            }
        )
        if self.surface is not None:
            vertices, corners = _joined(instant)
            self.surface[0].append(vertices)
            self.surface[1].append({"corners": corners})
        self.file.commit()

    def close(self) -> None:
        """Close the file."""
        self.file.close()


def _columns(fields: tuple[Field, ...], dim: int, prefix: str) -> Columns:
    return {field.name.removeprefix(prefix): (np.dtype(field.kind), field.shape(0, dim)[1:]) for field in fields}


def _rows(values: list[np.ndarray], width: int) -> np.ndarray:
    return np.array(values, float).reshape(-1, width)


def _joined(instant: State) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """The surfaces of all fluids as one: vertices by column, and corners."""
    surfaces = instant.surfaces
    firsts = np.cumsum([0, *(len(surface.vertices) for surface in surfaces)])
    none = np.zeros((0, 3), np.float32)
    vertices = {
        "positions": np.concatenate([none, *(surface.vertices for surface in surfaces)]),
        "normals": np.concatenate([none, *(surface.normals for surface in surfaces)]),
        "velocities": np.concatenate([none, *(surface.velocities for surface in surfaces)]),
        "materials": np.concatenate(
            [np.zeros(0, np.int32), *(np.full(len(s.vertices), s.material, np.int32) for s in surfaces)]
        ),
    }
    corners = [s.triangles + first for s, first in zip(surfaces, firsts, strict=False)]
    return vertices, np.concatenate([np.zeros((0, 3), np.int32), *corners])


def _surfaces(file: Any, frame: int, scene: Scene) -> tuple[WaterSurface, ...]:
    """What `_joined` joined."""
    if "surface" not in file:
        return ()
    rows = fitting(table_rows(file["surface"], frame), VERTICES, "surface")
    corners = fitting(table_rows(file["triangles"], frame), TRIANGLES, "triangles")["corners"]
    if len(corners) and not 0 <= corners.min() <= corners.max() < len(rows["positions"]):
        raise ValueError(f"triangles have corners from {corners.min()} to {corners.max()}, which are not there")
    found, palette = [], scene.palette()
    for number in np.unique(rows["materials"]).tolist():
        own = np.flatnonzero(rows["materials"] == number)  # those of a fluid are together
        triangles = corners[np.isin(corners[:, 0], own)] - own[0]
        points, normals, velocities = (rows[name][own] for name in ("positions", "normals", "velocities"))
        if not 0 <= number < len(palette):
            raise ValueError(f"a surface is of material {number}; it has {len(palette)}")
        fluid = palette[number]
        found.append(WaterSurface(fluid.name, number, str(fluid.color), points, normals, velocities, triangles))
    return tuple(found)


def read(path: str | Path, first: int = 0) -> Iterator[State]:
    """Yield the frames of a file that was written here, from number `first` on.

    Raises `WavetankError` for another file.
    """
    with open_hdf5(path) as file, damaged(path):
        if file.attrs.get("format") != "wavetank" or COUNTER not in file.attrs:
            raise WavetankError(f"{path}: this HDF5 file was not written by wavetank; it has no format and {COUNTER}.")
        if file.attrs["layout"] != VERSION_OF_LAYOUT:
            raise WavetankError(
                f"{path}: its layout is {file.attrs['layout']}, and this version of wavetank reads "
                f"{VERSION_OF_LAYOUT}; use the version that wrote it, {file.attrs.get('wavetank', 'a later one')}."
            )
        scene = Scene.from_text(bytes(file["scene"][()]).decode(), str(path), files=False)
    known = solids_by_name(scene)

    def instant(file: Any, frame: int) -> State:
        foam = {f"foam_{name}": rows for name, rows in table_rows(file["foam"], frame).items()}
        solids = fitting(table_rows(file["solids"], frame), SOLIDS, "solids")
        standing = tuple(
            PlacedSolid(
                name,
                known[name],
                solids["positions"][k],
                solids["rotations"][k],
                solids["velocities"][k],
                solids["angular_velocities"][k],
            )
            for k, name in enumerate(row.decode() for row in solids["names"])
            if name in known
        )
        arrays = table_rows(file["water"], frame) | foam
        frames = file["frames"]
        read = State.read(scene, int(frames["number"][frame]), float(frames["time"][frame]), arrays, standing)
        return dataclasses.replace(read, surfaces=_surfaces(file, frame, scene))

    return frames_of(path, instant, COUNTER, first)


def times(path: str | Path) -> list[float]:
    """Return the time of the water [s] at each frame of such a file."""
    with open_hdf5(path) as file, damaged(path):
        return [float(time) for time in file["frames/time"][: int(file.attrs.get(COUNTER, 0))]]


def rate(path: str | Path) -> float:
    """Return the frames per second of water of such a file."""
    with open_hdf5(path) as file, damaged(path):
        fps = float(file.attrs.get("fps", 30.0))
    if not 0.0 < fps <= 1000.0:
        raise WavetankError(f"{path}: {fps} frames per second are not allowed; a rate lies between 0 and 1000.")
    return fps


write = Hdf5Series

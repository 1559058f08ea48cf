"""VTKHDF for ParaView 5.12 and later, and everything else made of VTK: a file a part, all frames in it.

"VTKHDF File Format", version 2.0, docs.vtk.org: PolyData with `Steps`. `NSteps` is written last, so that a file whose
run was killed opens with all frames that it counts.
"""

from pathlib import Path
from typing import Any

import numpy as np

from wavetank.formats.growing import GrowingFile, import_h5py, open_hdf5
from wavetank.formats.plan import Plan
from wavetank.formats.polydata import Piece, pieces_of
from wavetank.foundation.errors import WavetankError
from wavetank.scene.scene import Scene
from wavetank.simulation.instant import PARTS
from wavetank.simulation.state import State

SUFFIXES = (".vtkhdf",)
KIND = "series"
COUNTER = "NSteps"
CELLS = ("Vertices", "Lines", "Polygons", "Strips")  # in the order of `Steps/CellOffsets`


def check(scene: Scene) -> None:
    """Raise `WavetankError` where the package that writes HDF5 is missing."""
    import_h5py()


class VtkHdfSeries:
    """Writes a file for each part: the particles in the one without an addition to its name."""

    repeatable = False

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self.files: list[str] = []
        self._parts: dict[str, _Part] = {}
        if plan.kept:
            for name in PARTS:
                self._keep(name)

    def _part(self, name: str, piece: Piece) -> "_Part":
        """Return the file of a part, made for its first piece."""
        if name not in self._parts:
            path = self._path(name)
            self.files.append(str(path))
            self._parts[name] = _Part(GrowingFile(path, "VTKHDF/Steps", COUNTER, self.plan.retry), piece)
        return self._parts[name]

    def _path(self, name: str) -> Path:
        return self.plan.path(SUFFIXES[0], "" if name == "particles" else name)

    def _keep(self, name: str) -> None:
        """Begin with the first frames of the file that is there: the same calls make the same bytes."""
        path, kept = self._path(name), self.plan.kept
        if name not in self.plan.parts or not path.is_file():
            return
        with open_hdf5(path) as file:
            if int(file["VTKHDF/Steps"].attrs[COUNTER]) < kept:
                raise WavetankError(f"{path} has fewer than the {kept} frames that are to be kept.")
            for step in range(kept):
                piece = read_piece(file, step)
                part = self._part(name, piece)
                part.file.hidden = True
                part.append(float(file["VTKHDF/Steps/Values"][step]), piece)
                part.file.hidden = False

    def write(self, number: int, instant: State) -> None:
        """Append a frame."""
        for name, piece in pieces_of(self.plan, instant):
            self._part(name, piece).append(instant.time, piece)

    def close(self) -> None:
        """Close the files."""
        for part in self._parts.values():
            part.file.close()


class _Part:
    """A file of PolyData."""

    def __init__(self, file: GrowingFile, first: Piece) -> None:
        self.file = file
        root = file.file["VTKHDF"]
        root.attrs["Version"] = np.array([2, 0], np.int64)
        root.attrs.create("Type", np.bytes_(b"PolyData"))
        file.column("VTKHDF/Points", "f4", 3)
        file.column("VTKHDF/NumberOfPoints", "i8", each_frame=True)
        for cells in CELLS:
            for name in ("NumberOfCells", "NumberOfConnectivityIds", "Offsets", "Connectivity"):
                file.column(f"VTKHDF/{cells}/{name}", "i8", each_frame=name.startswith("Number"))
        for name, rows in sorted(first.data.items()):
            file.column(f"VTKHDF/PointData/{name}", rows.dtype, *rows.shape[1:])
            file.column(f"VTKHDF/Steps/PointDataOffsets/{name}", "i8", each_frame=True)
        root.require_group("CellData")
        root.require_group("FieldData")
        file.column("VTKHDF/Steps/Values", "f8", each_frame=True)
        for name in ("PartOffsets", "NumberOfParts", "PointOffsets"):
            file.column(f"VTKHDF/Steps/{name}", "i8", each_frame=True)
        for name in ("CellOffsets", "ConnectivityIdOffsets"):
            file.column(f"VTKHDF/Steps/{name}", "i8", len(CELLS), each_frame=True)

    def append(self, time: float, piece: Piece) -> None:
        """Append a step."""
        file, first = self.file, self.file.length("VTKHDF/Points")
        # Connectivity and cells before this step; `Offsets` has one entry more for each step before.
        ids = [file.length(f"VTKHDF/{cells}/Connectivity") for cells in CELLS]
        numbers = [file.length(f"VTKHDF/{cells}/Offsets") - file.frames for cells in CELLS]
        file.append("VTKHDF/Steps/Values", [time])
        file.append("VTKHDF/Steps/PartOffsets", [file.frames])
        file.append("VTKHDF/Steps/NumberOfParts", [1])
        file.append("VTKHDF/Steps/PointOffsets", [first])
        file.append("VTKHDF/Steps/CellOffsets", [numbers])
        file.append("VTKHDF/Steps/ConnectivityIdOffsets", [ids])
        file.append("VTKHDF/NumberOfPoints", [len(piece.points)])
        file.append("VTKHDF/Points", piece.points)
        for cells in CELLS:
            corners = piece.cells if cells == piece.kind else piece.cells[:0]
            count, width = corners.shape
            file.append(f"VTKHDF/{cells}/NumberOfCells", [count])
            file.append(f"VTKHDF/{cells}/NumberOfConnectivityIds", [count * width])
            file.append(f"VTKHDF/{cells}/Offsets", width * np.arange(count + 1))
            file.append(f"VTKHDF/{cells}/Connectivity", corners.reshape(-1))
        for name, rows in sorted(piece.data.items()):
            file.append(f"VTKHDF/Steps/PointDataOffsets/{name}", [first])
            file.append(f"VTKHDF/PointData/{name}", rows)
        file.commit()


def read_piece(file: Any, step: int) -> Piece:
    """Return the points of a step of such a file, open for reading, with their data and cells."""
    root, steps = file["VTKHDF"], file["VTKHDF/Steps"]
    first, count = int(steps["PointOffsets"][step]), int(root["NumberOfPoints"][step])
    numbers = {cells: int(root[f"{cells}/NumberOfCells"][step]) for cells in CELLS}
    kind, width = ("Vertices", 1) if "id" in root["PointData"] else ("Polygons", 3)  # as `pieces_of` makes them
    start = int(steps["ConnectivityIdOffsets"][step][CELLS.index(kind)])
    return Piece(
        root["Points"][first : first + count],
        {name: root[f"PointData/{name}"][first : first + count] for name in root["PointData"]},
        kind,
        root[f"{kind}/Connectivity"][start : start + width * numbers[kind]].reshape(-1, width),
    )


write = VtkHdfSeries

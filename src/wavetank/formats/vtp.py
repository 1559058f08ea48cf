"""VTK XML files for any ParaView: a `.vtp` for each part of each frame, and a `.vtp.series` that lists them."""

import json
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from wavetank.formats.plan import Plan
from wavetank.formats.polydata import Piece, pieces_of
from wavetank.foundation.atomic_write import atomic_write
from wavetank.simulation.instant import PARTS
from wavetank.simulation.state import State

SUFFIXES = (".vtp",)
KIND = "series"
TYPES = {"f4": "Float32", "f8": "Float64", "i4": "Int32", "i8": "Int64", "u1": "UInt8"}


class VtpSeries:
    """Writes the files of each frame, then the list with this one as the last."""

    repeatable = True

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self.files: list[str] = []
        self._lists: dict[str, dict[int, dict[str, object]]] = {}
        for name in PARTS if plan.kept else ():
            series = plan.path(".vtp.series", "" if name == "particles" else name)
            if name in plan.parts and series.is_file():
                entries = json.loads(series.read_text("utf-8"))["files"][: plan.kept]
                self._lists[name] = dict(enumerate(entries))

    def write(self, number: int, instant: State) -> None:
        """Write a frame."""
        for name, piece in pieces_of(self.plan, instant):
            part = "" if name == "particles" else name
            path = self.plan.path(f"-{number:05d}{SUFFIXES[0]}", part)
            write_piece(path, piece, instant.time)
            entries = self._lists.setdefault(name, {})
            entries[number] = {"name": path.name, "time": instant.time}
            series = self.plan.path(".vtp.series", part)
            with atomic_write(series) as partial:
                text = json.dumps({"file-series-version": "1.0", "files": [*entries.values()]}, indent=1)
                partial.write_text(text + "\n", encoding="utf-8")
            if str(series) not in self.files:
                self.files.append(str(series))

    def close(self) -> None:
        """Do nothing: every frame is complete."""


def write_piece(path: str | Path, piece: Piece, time: float) -> None:
    """Write points, cells and data as a `.vtp` file; `time` [s] is its field `TimeValue`."""
    blocks: list[bytes] = []

    def array(name: str, rows: np.ndarray) -> str:
        values = np.ascontiguousarray(rows, rows.dtype.newbyteorder("<"))
        offset = sum(map(len, blocks))
        blocks.append(np.uint64(values.nbytes).tobytes() + values.tobytes())
        width = values.shape[1] if values.ndim == 2 else 1
        tuples = f' NumberOfTuples="{len(values)}"' if name == "TimeValue" else ""
        return (
            f'<DataArray type="{TYPES[values.dtype.str[1:]]}" Name={quoteattr(name)} NumberOfComponents="{width}"'
            f'{tuples} format="appended" offset="{offset}"/>'
        )

    corners, width = piece.cells, piece.cells.shape[1]
    verts, polys = (len(corners) if piece.kind == kind else 0 for kind in ("Vertices", "Polygons"))
    cells = {"Verts" if verts or piece.kind == "Vertices" else "Polys": corners}
    text = [
        '<?xml version="1.0"?>',
        '<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="UInt64">',
        "<PolyData>",
        "<FieldData>",
        array("TimeValue", np.array([time])),
        "</FieldData>",
        f'<Piece NumberOfPoints="{len(piece.points)}" NumberOfVerts="{verts}" NumberOfLines="0" NumberOfStrips="0" '
        f'NumberOfPolys="{polys}">',
        "<PointData>",
        *(array(name, rows) for name, rows in piece.data.items()),
        "</PointData>",
        "<Points>",
        array("Points", piece.points),
        "</Points>",
    ]
    for name, rows in cells.items():
        offsets = width * np.arange(1, len(rows) + 1, dtype=np.int64)
        text += [f"<{name}>", array("connectivity", rows.reshape(-1).astype(np.int64)), array("offsets", offsets)]
        text += [f"</{name}>"]
    text += ["</Piece>", "</PolyData>", '<AppendedData encoding="raw">']
    with atomic_write(path) as partial, partial.open("wb") as file:
        file.write("\n".join(text).encode() + b"\n_")
        for block in blocks:
            file.write(block)
        file.write(b"\n</AppendedData>\n</VTKFile>\n")


write = VtpSeries

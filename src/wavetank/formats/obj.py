"""The surface of the water as a mesh of triangles: an OBJ file an instant, for Blender, Houdini, Unity."""

import io
from pathlib import Path
from typing import Any

import numpy as np

from wavetank.formats.surface import check_surface, surfaces_of
from wavetank.foundation.atomic_write import atomic_write

SUFFIXES = (".obj",)
KIND = "surface"
check = check_surface


def write_obj(path: str | Path, frame: Any) -> None:
    """Write the surface of each fluid of a `Frame` or an `Instant` as an object of its material's name.

    Positions in m, with normals. Raises `WavetankError` for a 2-D world and where the extra `surface` is not installed.
    """
    text, first = io.StringIO(), 1
    surfaces = surfaces_of(frame)
    text.write(f"# wavetank, SI units, t = {frame.time:.6g} s\n")
    for surface in surfaces:
        text.write(f"o {'_'.join(surface.name.split())}\n")
        np.savetxt(text, surface.vertices, "v %.7g %.7g %.7g")
        np.savetxt(text, surface.normals, "vn %.3f %.3f %.3f")
        corners = np.repeat(surface.triangles.astype(np.int64) + first, 2, axis=1)
        np.savetxt(text, corners, "f %d//%d %d//%d %d//%d")
        first += len(surface.vertices)
    with atomic_write(path) as partial:
        partial.write_text(text.getvalue(), encoding="ascii", errors="replace")


write = write_obj

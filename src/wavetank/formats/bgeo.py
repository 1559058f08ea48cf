"""Particles in Houdini's classic geometry files (.bgeo, version 5), as Partio and SPlisHSPlasH write them."""

import gzip
import struct
import zlib
from pathlib import Path

import numpy as np

from wavetank.foundation.errors import WavetankError

LARGEST = 2_000_000_000  # bytes of a file that is unpacked
VERSION = 5
INDEXED = 4  # type of an attribute whose default is a list of names


def read_bgeo(path: str | Path) -> np.ndarray:
    """Return the positions [m], float64 [n, 3], of the points of a file; raises `WavetankError` for another one."""
    try:
        with Path(path).open("rb") as file:
            packed = file.read(2) == b"\x1f\x8b"
        with gzip.open(path) if packed else Path(path).open("rb") as file:
            data = file.read(LARGEST)
    except (OSError, EOFError, zlib.error) as error:
        raise WavetankError(f"{path}: these particles cannot be read: {error}.") from None
    try:
        return _points(data)
    except (struct.error, ValueError, IndexError) as error:
        raise WavetankError(f"{path}: this is no .bgeo file of version {VERSION}: {error}.") from None


def _points(data: bytes) -> np.ndarray:
    magic, letter, version, points, _, _, _, attributes = struct.unpack_from(">4scIIIIII", data)
    if magic != b"Bgeo" or letter != b"V" or version != VERSION:
        raise ValueError("it begins otherwise")
    place = 5 + 4 * 9
    width = 4
    for _ in range(attributes):
        (length,) = struct.unpack_from(">H", data, place)
        size, kind = struct.unpack_from(">HI", data, place + 2 + length)
        place += 2 + length + 6
        if kind == INDEXED:
            (names,) = struct.unpack_from(">I", data, place)
            place += 4
            for _ in range(names):
                place += 2 + struct.unpack_from(">H", data, place)[0]
            size = 1
        else:
            place += 4 * size
        width += size
    if len(data) < place + 4 * width * points:
        raise ValueError("it ends too early")
    rows = np.frombuffer(data, ">f4", width * points, place).reshape(points, width)[:, :4].astype(np.float64)
    if not np.isfinite(rows).all():
        raise ValueError("a position is not finite")
    return rows[:, :3] / np.where(rows[:, 3:] == 0.0, 1.0, rows[:, 3:])

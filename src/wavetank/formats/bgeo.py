"""Particles in Houdini's classic geometry files (.bgeo, version 5), as Partio and SPlisHSPlasH write them."""

import gzip
import os
import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from wavetank.foundation.errors import WavetankError
from wavetank.foundation.input_limits import TIMES, UNPACKED, explain_errors, one_line, open_regular, printable
from wavetank.foundation.memory import free_memory, in_words

LARGEST = 2_000_000_000  # bytes of points
MOST_ATTRIBUTES, MOST_NAMES = 1000, 100_000
VERSION = 5
INDEXED = 4  # type of an attribute whose default is a list of names


def read_bgeo(path: str | Path) -> np.ndarray:
    """Return the positions [m], float64 [n, 3], of the points of a file; raises `WavetankError` for another one.

    What it says of itself is compared with its size and with free memory before the points are unpacked.
    """
    origin = printable(path)
    with explain_errors(origin, "particle file"), open_regular(path, LARGEST, "particle file") as file:
        size = os.fstat(file.fileno()).st_size
        packed = file.read(2) == b"\x1f\x8b"
        file.seek(0)
        try:
            return _points(gzip.GzipFile(fileobj=file) if packed else file, size)
        except (OSError, EOFError, zlib.error) as error:
            raise WavetankError(f"{origin}: these particles cannot be read: {one_line(error)}.") from None
        except (struct.error, ValueError) as error:
            raise WavetankError(f"{origin}: this is not a .bgeo file of version {VERSION}: {error}.") from None


def _points(file: Any, size: int) -> np.ndarray:
    """Return the points of an open file of `size` bytes; raises `ValueError`."""

    def unpacked(form: str) -> tuple[Any, ...]:
        return struct.unpack(form, file.read(struct.calcsize(form)))

    magic, letter, version, points, _, _, _, attributes, *_ = unpacked(">4sc9I")
    if magic != b"Bgeo" or letter != b"V" or version != VERSION:
        raise ValueError("it begins otherwise")
    if attributes > MOST_ATTRIBUTES:
        raise ValueError(f"it has {attributes:,} attributes")
    width = 4
    for _ in range(attributes):
        file.read(unpacked(">H")[0])
        count, kind = unpacked(">HI")
        if kind == INDEXED:
            (names,) = unpacked(">I")
            if names > MOST_NAMES:
                raise ValueError(f"an attribute has {names:,} names")
            for _ in range(names):
                file.read(unpacked(">H")[0])
            count = 1
        else:
            file.read(4 * count)
        width += count
    needed, free = 4 * width * points, free_memory()
    if needed > max(UNPACKED, TIMES * size) or needed > LARGEST or (free is not None and 4 * needed > free):
        raise ValueError(f"its points take {in_words(needed)}, too much for a file of this size, or for this machine")
    data = file.read(needed)
    if len(data) < needed:
        raise ValueError("it ends too early")
    with np.errstate(invalid="ignore"):  # a NaN that signals: refused below
        rows = np.frombuffer(data, ">f4").reshape(points, width)[:, :4].astype(np.float64)
    if not np.isfinite(rows).all():
        raise ValueError("a position is not finite")
    return rows[:, :3] / np.where(rows[:, 3:] == 0.0, 1.0, rows[:, 3:])

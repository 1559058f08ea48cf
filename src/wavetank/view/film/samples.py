"""The samples of an unfinished picture: progress callback, and the file that keeps them."""

import dataclasses
import hashlib
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from wavetank.device.compiler import download, upload
from wavetank.foundation.atomic_write import atomic_write
from wavetank.foundation.version import VERSION
from wavetank.view.film.paths import Film
from wavetank.view.matter import matter_of

NAMES = ("mean", "half", "albedo", "shape")
FORMAT = 2  # of the meaning of samples; those of another format are discarded


@dataclasses.dataclass
class Watch:
    """Progress of a picture that takes minutes: callback, file of its samples, and whether it is complete."""

    tell: Callable[[int, int], bool] | None = None  # called with samples done and wanted; False stops
    path: Path | None = None  # where the samples are kept when it is stopped
    begun: int = 0  # samples that were loaded
    done: int = 0  # samples done
    whole: bool = True  # whether all are done


def digest_of(shot: Any, options: tuple[Any, ...]) -> str:
    """Return a hash of all that a picture depends on: water, solids, eye, light and options."""
    frame = shot.frame
    found = hashlib.sha256(repr((VERSION, FORMAT, options, frame.time, frame.count)).encode())
    count, foam = frame.count, frame.foam_count
    arrays = [download(array)[:count] for array in (frame.x, frame.v, frame.id, frame.dye, frame.material)]
    if frame.diffuse is not None and foam:
        arrays += [download(getattr(frame.diffuse, name))[:foam] for name in ("x", "v", "kind", "id")]
    solids = frame.solids
    arrays += [download(getattr(solids, name)) for name in ("op", "size", "offset", "turn", "position", "rotation")]
    for of in (shot.lens, shot.look):
        arrays += [np.asarray(getattr(of, field.name)) for field in dataclasses.fields(of)]
    arrays += [np.asarray(shot.absorption), np.asarray(shot.tint), np.asarray(shot.scattering)]
    arrays.append(matter_of(frame, shot.extent))
    for array in arrays:
        found.update(np.ascontiguousarray(array).tobytes())
    found.update("".join(solid.finish + (solid.color or "-") for solid in frame.scene.solids).encode())
    return found.hexdigest()


def store(path: Path, film: Film, digest: str, done: int) -> None:
    """Write the samples to a file atomically."""
    with atomic_write(path) as partial, partial.open("wb") as out:
        arrays: dict[str, Any] = {name: download(getattr(film, name)) for name in NAMES}
        np.savez(out, digest=digest, done=done, **arrays)


def load(path: Path, film: Film, digest: str) -> int:
    """Fill `film` from a file and return how many samples it holds; 0 where it is missing or of another picture."""
    try:
        with np.load(path, allow_pickle=False) as kept:
            if str(kept["digest"]) != digest:
                return 0
            arrays = {name: kept[name] for name in NAMES}
            if any(value.shape[:2] != tuple(film.mean.shape) for value in arrays.values()):
                return 0
            for name, value in arrays.items():
                upload(getattr(film, name), value)
            return int(kept["done"])
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return 0

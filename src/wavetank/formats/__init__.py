"""Files that wavetank writes and reads: one module per format, listed in `EXPORTERS`.

A module of this package has ``SUFFIXES`` (with the dot, lower case), ``KIND`` and ``write``:

    kind          write
    picture       write(path, image, metadata=None): uint8 [height, width, 3], one file a picture
    video         write(path, width, height, fps): a context manager with write(image)
    particles     write(path, frame): one file an instant
    surface       likewise
    series        write(plan): a `plan.Series`, which takes one frame after the other

and may have `check(scene)`, which raises `WavetankError` before a run whose worlds it cannot write.
"""

from pathlib import Path
from types import ModuleType

from wavetank.formats import csv, gif, hdf5, mp4, npz, obj, ply, png, usd, vtkhdf, vtp
from wavetank.foundation.errors import WavetankError

EXPORTERS: tuple[ModuleType, ...] = (png, mp4, npz, csv, ply, obj, gif, usd, vtkhdf, vtp, hdf5)
INSTANTS = ("particles", "surface", "series")  # kinds that write a frame


def suffixes(*kinds: str) -> tuple[str, ...]:
    """Return the suffixes that can be written, of these kinds or of all."""
    return tuple(suffix for module in EXPORTERS if not kinds or module.KIND in kinds for suffix in module.SUFFIXES)


def exporter_named(name: str, *kinds: str) -> ModuleType:
    """Return the module of a format such as ``npz``, of these kinds or of `INSTANTS`; raises `WavetankError`."""
    kinds = kinds or INSTANTS
    for module in EXPORTERS:
        if f".{name.lstrip('.').lower()}" in module.SUFFIXES and module.KIND in kinds:
            return module
    names = ", ".join(suffix[1:] for suffix in suffixes(*kinds))
    raise WavetankError(f"{name!r} is not a format for {' or '.join(kinds)}; use one of {names}.")


def exporter_for(path: str | Path, *kinds: str) -> ModuleType:
    """Return the module that writes files with the suffix of `path`; raises `WavetankError` for an unknown one."""
    for module in EXPORTERS:
        if Path(path).suffix.lower() in module.SUFFIXES and (not kinds or module.KIND in kinds):
            return module
    what = f"{' or '.join(kinds)} files" if kinds else "files"
    raise WavetankError(f"{str(path)!r} cannot be written; {what} end in one of {', '.join(suffixes(*kinds))}.")

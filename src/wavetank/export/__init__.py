"""Files that wavetank writes: one module per format, listed in `EXPORTERS`.

A module of this package has ``SUFFIXES`` (with the dot, lower case), ``KIND`` and ``write``:

    kind          write
    picture       write(path, image, metadata=None): uint8 [height, width, 3], one file a picture
    video         write(path, width, height, fps): a context manager with write(image)
    particles     write(path, frame): one file an instant
"""

from pathlib import Path
from types import ModuleType

from wavetank.errors import WavetankError
from wavetank.export import csv, gif, mp4, npz, ply, png

EXPORTERS: tuple[ModuleType, ...] = (png, mp4, npz, csv, ply, gif)


def suffixes(kind: str | None = None) -> tuple[str, ...]:
    """Return the suffixes that can be written, of one kind or of all."""
    return tuple(suffix for module in EXPORTERS if kind in (None, module.KIND) for suffix in module.SUFFIXES)


def exporter_named(name: str, kind: str = "particles") -> ModuleType:
    """Return the module of a format such as ``npz``; raises `WavetankError` if there is none of that kind."""
    for module in EXPORTERS:
        if f".{name.lstrip('.').lower()}" in module.SUFFIXES and kind == module.KIND:
            return module
    names = ", ".join(suffix[1:] for suffix in suffixes(kind))
    raise WavetankError(f"{name!r} is not a format for {kind}; use one of {names}.")


def exporter_for(path: str | Path, kind: str | None = None) -> ModuleType:
    """Return the module that writes `path`, chosen by its suffix; raises `WavetankError` if there is none."""
    for module in EXPORTERS:
        if Path(path).suffix.lower() in module.SUFFIXES and kind in (None, module.KIND):
            return module
    what = f"{kind} files" if kind else "files"
    raise WavetankError(f"{str(path)!r} cannot be written; {what} end in one of {', '.join(suffixes(kind))}.")

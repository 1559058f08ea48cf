"""Files appear complete or not at all."""

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

from wavetank.foundation.errors import WavetankError


def partial_path(path: str | Path) -> Path:
    """Return the name beside `path` under which it grows; raises `WavetankError` if its folder does not exist."""
    target = Path(path)
    if not target.parent.is_dir():
        raise WavetankError(f"{str(target)!r} cannot be written: there is no folder {str(target.parent)!r}.")
    # The process's number keeps two writers of one file apart.
    return target.with_name(f".{target.name}.{os.getpid()}.partial")


def make_folder(path: str | Path) -> Path:
    """Make a folder, and those that it is in, where there is none; raises `WavetankError` if that is not possible."""
    try:
        Path(path).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise WavetankError(f"the folder {str(path)!r} cannot be made: {error.strerror or error}.") from None
    return Path(path)


@contextlib.contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """Give a temporary path to write to; it takes the place of `path` on success and is removed on an error."""
    partial = partial_path(path)
    try:
        yield partial
        partial.replace(path)
    except OSError as error:
        raise WavetankError(f"{str(path)!r} cannot be written: {error.strerror or error}.") from error
    finally:
        partial.unlink(missing_ok=True)

"""Files appear complete or not at all; what a killed process left is removed at the next start."""

import contextlib
import functools
import hashlib
import itertools
import os
import re
import socket
import stat
from collections.abc import Iterator
from pathlib import Path

from wavetank.foundation.arguments import path_of
from wavetank.foundation.errors import WavetankError

_LEFT = re.compile(r"\..+\.([0-9a-f]{6})-(\d+)(-\d+)?\.partial(\.\w+)?")
_numbers = itertools.count()
_swept: set[Path] = set()


def partial_path(path: str | Path) -> Path:
    """Return a new temporary path next to `path`; raises `WavetankError` if its folder does not exist."""
    target = Path(path_of(path))
    if not target.name:
        raise WavetankError(f"{str(path)!r} is not the name of a file.")
    if not target.parent.is_dir():
        raise WavetankError(f"{str(target)!r} cannot be written: there is no folder {str(target.parent)!r}.")
    with contextlib.suppress(OSError):  # a file that is there is replaced, and nothing else
        if not stat.S_ISREG(target.stat().st_mode):
            kind = "a folder" if target.is_dir() else "a device or a pipe"
            raise WavetankError(f"{str(target)!r} cannot be written: it is {kind}; name a file.")
    sweep(target.parent)
    # The process id tells later whether the writer still runs; the counter keeps writers of one process apart.
    return target.with_name(f".{target.name[:200]}.{_here()}-{os.getpid()}-{next(_numbers)}.partial")


def sweep(folder: Path) -> None:
    """Remove what ended processes of this machine left in a folder; once per folder and process."""
    folder = folder.absolute()
    if folder in _swept:
        return
    _swept.add(folder)
    with contextlib.suppress(OSError):
        for entry in os.scandir(folder):
            match = _LEFT.fullmatch(entry.name)
            if match and match[1] == _here() and not _lives(int(match[2])):
                with contextlib.suppress(OSError):
                    Path(entry.path).unlink()


@functools.cache
def _here() -> str:
    """Identify this machine and its namespace of process ids among those that share a disk."""
    try:
        space = str(Path("/proc/self/ns/pid").readlink())
    except OSError:
        space = ""
    return hashlib.sha256(f"{socket.gethostname()} {space}".encode()).hexdigest()[:6]


def _lives(process: int) -> bool:
    if os.name == "nt":  # there, asking a process whether it lives would end it
        return True
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):
        return True
    return True


def make_folder(path: str | Path) -> Path:
    """Make a folder and its parents if missing; raises `WavetankError` if that is not possible."""
    try:
        Path(path).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise WavetankError(f"the folder {str(path)!r} cannot be made: {error.strerror or error}.") from None
    return Path(path)


@contextlib.contextmanager
def atomic_write(path: str | Path, *, lasting: bool = False, suffixed: bool = False) -> Iterator[Path]:
    """Yield a temporary path to write to; it replaces `path` on success and is removed on an error.

    A `lasting` file is flushed to disk before it gets its name, so that it survives a power cut too. The temporary path
    of a `suffixed` one has the suffix of `path`, for writers that tell the format by the name.
    """
    partial = partial_path(path)
    if suffixed:
        partial = partial.with_name(partial.name + Path(path).suffix)
    try:
        yield partial
        if lasting:
            flush(partial)
        partial.replace(path)
        if lasting:
            flush(Path(path).parent)
    except OSError as error:
        raise WavetankError(f"{str(path)!r} cannot be written: {error.strerror or error}.") from error
    finally:
        with contextlib.suppress(OSError):
            partial.unlink()


def flush(path: Path) -> None:
    """Flush a file or folder to disk (fsync); does nothing where that is not possible."""
    with contextlib.suppress(OSError):
        number = os.open(path, os.O_RDONLY)
        try:
            os.fsync(number)
        finally:
            os.close(number)

"""The compiler's list of the kernels that it keeps on disk, looked at before the compiler reads it.

It believes the lengths in the list: a damaged one asks for any number of bytes, and ends the process. The file is

    length of the file u64 | version 3 x u16 | size of all kernels u64 | count u64 | count x entry
    entry: 65 u64 | key, 65 characters | 65 u64 | key again | size u64 | made u64 | used u64

as Quadrants 1.3 and 1.4 write it. Without the list kernels are compiled anew, which costs time and nothing else.
"""

import contextlib
import shutil
import tempfile
from pathlib import Path

import numpy as np

NAME = "kernel_compilation_manager/qdcache.qdb"
HEAD, KEY = 30, 65  # bytes
ENTRY = np.dtype(
    [("length", "<u8"), ("key", "u1", KEY), ("again_length", "<u8"), ("again", "u1", KEY), ("numbers", "<u8", 3)]
)


def is_whole(content: bytes) -> bool:
    """Say whether a list is one that the compiler can read."""
    if len(content) < HEAD or int.from_bytes(content[:8], "little") != len(content):
        return False
    count = int.from_bytes(content[22:HEAD], "little")
    if HEAD + count * ENTRY.itemsize != len(content):
        return False
    entries = np.frombuffer(content, ENTRY, offset=HEAD)
    lengths = bool((entries["length"] == KEY).all() and (entries["again_length"] == KEY).all())
    return lengths and bool((entries["key"] == entries["again"]).all())


def sweep_damaged(folder: Path) -> None:
    """Remove a list that is damaged."""
    path = folder / NAME
    with contextlib.suppress(OSError):
        if not is_whole(path.read_bytes()):
            path.unlink()


def writable(folder: Path) -> Path:
    """Return `folder`, made if missing; where it cannot be written to, a copy, which its user removes.

    The compiler ends a run at the first kernel that it cannot keep.
    """
    with contextlib.suppress(OSError):
        folder.mkdir(parents=True, exist_ok=True)
        for part in (folder, *(part for part in folder.iterdir() if part.is_dir())):
            with tempfile.TemporaryFile(dir=part):
                pass
        return folder
    own = Path(tempfile.mkdtemp(prefix="wavetank-kernels-"))
    with contextlib.suppress(OSError, shutil.Error):
        shutil.copytree(folder, own, dirs_exist_ok=True)
    return own

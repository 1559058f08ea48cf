"""Free memory, and numbers of bytes and seconds in words."""

import contextlib
import ctypes
import os
from pathlib import Path

from wavetank.foundation.errors import WavetankError

_LIMITS = (  # of the group of processes that this one is in, and what they take
    ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory.current"),
    ("/sys/fs/cgroup/memory/memory.limit_in_bytes", "/sys/fs/cgroup/memory/memory.usage_in_bytes"),
)
SHARE = 0.9  # of free memory that may be used
_ARENA_MAX = -8  # M_ARENA_MAX of malloc.h


def free_memory() -> int | None:
    """Estimate the bytes that this process may still allocate; None where the system does not tell."""
    found = [free for free in (_of_machine(), *map(_of_group, *zip(*_LIMITS, strict=True)), _of_process()) if free]
    return min(found) if found else None


def check_free(needed: float, what: str, remedy: str = "") -> None:
    """Raise `WavetankError` where `what` needs more bytes than are free, before it allocates them."""
    free = free_memory()
    if free is not None and needed > SHARE * free:
        raise WavetankError(f"{what} needs {in_words(needed)} of memory, and {in_words(free)} are free{remedy}.")


def give_back() -> None:
    """Return freed memory to the system where the C library keeps it (glibc; malloc_trim(3))."""
    with contextlib.suppress(OSError, AttributeError, TypeError):
        ctypes.CDLL(None).malloc_trim(0)


def share_arenas() -> None:
    """Limit the heap to two arenas, so that threads reuse what others freed (glibc; mallopt(3))."""
    with contextlib.suppress(OSError, AttributeError, TypeError):
        ctypes.CDLL(None).mallopt(_ARENA_MAX, 2)


def _of_machine() -> int | None:
    with contextlib.suppress(OSError, ValueError):
        for line in Path("/proc/meminfo").read_text("ascii").splitlines():
            if line.startswith("MemAvailable:"):
                return 1024 * int(line.split()[1])
    with contextlib.suppress(OSError, ValueError, AttributeError):
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    return None


def _of_group(limit: str, used: str) -> int | None:
    with contextlib.suppress(OSError, ValueError):
        return max(1, int(Path(limit).read_text("ascii")) - int(Path(used).read_text("ascii")))
    return None


def _of_process() -> int | None:
    """Return what `ulimit -v` leaves."""
    try:
        import resource

        most = resource.getrlimit(resource.RLIMIT_AS)[0]
        if most == resource.RLIM_INFINITY:
            return None
        pages = int(Path("/proc/self/statm").read_text("ascii").split()[0])
        return max(1, most - pages * resource.getpagesize())
    except (ImportError, OSError, ValueError):
        return None


def in_words(number: float) -> str:
    """Return a number of bytes with its unit, such as ``3.2 GB``."""
    for unit, size in (("TB", 1e12), ("GB", 1e9), ("MB", 1e6), ("kB", 1e3)):
        if number >= size:
            return f"{number / size:,.3g} {unit}" if number < 1e15 else f"{number / size:.3g} {unit}"
    return f"{number:.0f} bytes"


def time_in_words(seconds: float) -> str:
    """Return a time with its unit, such as ``3.2 hours``."""
    for unit, size in (("years", 31_557_600.0), ("days", 86400.0), ("hours", 3600.0), ("minutes", 60.0)):
        if seconds >= 1.5 * size:
            return f"{seconds / size:,.3g} {unit}"
    return f"{seconds:.3g} seconds"

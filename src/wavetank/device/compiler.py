"""The one file that imports the kernel compiler (Quadrants, the maintained continuation of Taichi).

Everything else writes ``from wavetank.device.compiler import qd`` and calls `start` once before the first array is
made. The compiler keeps one device program per process, so the back end is chosen once: asking for another one later
is an error. Until `start` the compiler is as its makers wrote it: another program in this process may use it by itself.
"""

import atexit
import contextlib
import functools
import inspect
import io
import itertools
import os
import pathlib
import shutil
import warnings
from collections.abc import Callable, Iterator
from threading import get_ident
from typing import Any

import numpy as np

from wavetank.device import patches
from wavetank.device.compile_log import CompileLog
from wavetank.device.kernel_cache import sweep_damaged, writable
from wavetank.device.turns import TURN
from wavetank.foundation.errors import WavetankError

os.environ.setdefault("QD_LOG_LEVEL", "error")
os.environ.setdefault("QD_ENABLE_PYBUF", "0")  # no kernel prints, and none needs to be asked whether it has

# The compiler prints a banner on import; a library should be silent.
with contextlib.redirect_stdout(io.StringIO()), patches.short_frames():
    import quadrants as qd
    from quadrants.lang.util import to_numpy_type

# At each function that is declared while a module is imported, the compiler asks `inspect` for the module of a frame of
# the import system. It is looked for among all modules, each time, unless `inspect` has it in its own table.
for _frozen in ("_bootstrap", "_bootstrap_external"):
    getattr(inspect, "modulesbyfile", {}).setdefault(f"<frozen importlib.{_frozen}>", f"importlib.{_frozen}")
# A damaged cache of kernels costs time; nobody needs to hear of it.
warnings.filterwarnings("ignore", module=r"quadrants\.lang\._fast_caching")

__all__ = [
    "BACKENDS",
    "LANES",
    "Mirror",
    "available_backends",
    "borrowed",
    "cache_folder",
    "current_backend",
    "download",
    "lanes",
    "on_compile",
    "qd",
    "shares_memory",
    "start",
    "synchronize",
    "threads",
    "upload",
    "watched",
    "worth_sharing",
]

#: Names a user may pass as ``arch``; ``gpu`` means the best one present.
BACKENDS = ("cpu", "gpu", "cuda", "vulkan", "metal", "amdgpu")
_GPU_ORDER = ("cuda", "metal", "amdgpu", "vulkan")
_BY_LLVM = ("cpu", "cuda", "amdgpu")
LANES = 8
FEW = 50_000
_current: str | None = None


def available_backends() -> list[str]:
    """Return the concrete back ends that this machine can start, best first, ``cpu`` last."""
    with contextlib.redirect_stdout(io.StringIO()), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = [name for name in _GPU_ORDER if _supported(name)]
    return [*found, "cpu"]


def current_backend() -> str | None:
    """Return the concrete back end that is running, or None before `start`."""
    return _current


def cache_folder() -> pathlib.Path:
    """Return the folder where compiled kernels are kept, for all programs of this user; it may be deleted.

    The environment's QD_OFFLINE_CACHE_FILE_PATH names another one.
    """
    from quadrants.lang import impl

    return pathlib.Path(os.environ.get("QD_OFFLINE_CACHE_FILE_PATH") or impl.default_cfg().offline_cache_file_path)


@TURN
def start(arch: str = "cpu", *, threads: int | None = None) -> str:
    """Start the compiler on `arch` and return the concrete back end that came up.

    A second call with the same back end does nothing. Raises `WavetankError` for an unknown name, for a back end
    that this machine does not have, and for a change of back end within a process.
    """
    global _current
    if arch not in BACKENDS:
        raise WavetankError(f"arch = {arch!r} is not a back end; use one of {', '.join(BACKENDS)}.")
    if arch == "gpu" and _current in _GPU_ORDER:
        return _current
    if arch == _current:
        return arch
    wanted = next(iter(available_backends())) if arch == "gpu" else arch
    if (arch == "gpu" and wanted == "cpu") or not _supported(wanted):
        raise WavetankError(
            f"arch = {arch!r} cannot be started on this machine; available: "
            f"{', '.join(available_backends())} (see `wavetank doctor`)."
        )
    if _current is not None:
        raise WavetankError(
            f"arch = {arch!r} was asked for, but this process already computes on {_current!r}; "
            "one process has one back end, start another process for another one."
        )
    options: dict[str, object] = {"arch": getattr(qd, wanted), "enable_fallback": False, "log_level": "error"}
    if wanted in _BY_LLVM:
        # LLVM does again what this pass does, in a fraction of the time: kernels are as fast without it.
        options["cfg_optimization"] = False
    if threads is not None:
        options["cpu_max_num_threads"] = threads
    version = ".".join(map(str, qd.__version__))
    if patches.apply_all(version) and version not in patches.VERSIONS:
        warnings.warn(
            f"Quadrants {version} is not one that wavetank's patches are made for ({', '.join(patches.VERSIONS)}): "
            "kernels work, and start slower.",
            RuntimeWarning,
            stacklevel=3,
        )
    before = _thread_ids()
    sweep_damaged(cache_folder())
    kept = writable(cache_folder())
    options["offline_cache_file_path"] = str(kept)
    if kept != cache_folder():
        atexit.register(_forget, kept)
    with contextlib.redirect_stdout(io.StringIO()):
        qd.init(**options)
    came_up = {"x64": "cpu", "arm64": "cpu"}.get(_name(qd.lang.impl.current_cfg().arch), wanted)
    if came_up != wanted:
        raise WavetankError(f"arch = {arch!r} was asked for, but the compiler came up on {came_up!r}.")
    _current = wanted
    _bind_threads(_thread_ids() - before)
    _launch_in_turn()
    return wanted


@functools.cache
def _launch_in_turn() -> None:
    """Let every launch wait for its turn, and refuse those of forked processes."""
    from quadrants.lang.kernel import Kernel

    call = Kernel.__call__

    def launch(self: Any, *args: Any, **kwargs: Any) -> Any:
        if TURN.owner == get_ident():
            return call(self, *args, **kwargs)
        with TURN:
            return call(self, *args, **kwargs)

    Kernel.__call__ = launch
    patches.LISTENERS.append(CompileLog(patches.LISTENERS).hear)
    TURN.refuse_after_fork()


@contextlib.contextmanager
def borrowed() -> Iterator[None]:
    """Have a back end while the context lasts: the one that is running, else the processor's, which is stopped again.

    For those who only measure data before it is known where the water will be computed. No array may outlive it.
    """
    global _current
    with TURN:
        if _current is not None:
            yield
            return
        start("cpu")
        try:
            yield
        finally:
            _current = None
            qd.reset()


def threads() -> int:
    """Return how many threads of the processor compute, 0 where a graphics processor does."""
    return int(qd.lang.impl.current_cfg().cpu_max_num_threads) if _current == "cpu" else 0


def lanes() -> int:
    """Return how many particles or nodes are computed together: as vectors on a processor, each by a thread on others.

    More than eight are no faster, where vectors are twice as long (notebook/performance.md).
    """
    return LANES if _current == "cpu" else 1


def worth_sharing(number: int) -> bool:
    """Whether threads gain more on so many things, none of them much work, than it costs to wake them."""
    return _current != "cpu" or number > FEW


def _forget(folder: pathlib.Path) -> None:
    """Stop the compiler, which writes to its cache when it ends, and remove that."""
    qd.reset()
    shutil.rmtree(folder, ignore_errors=True)


def _thread_ids() -> set[int]:
    """Return the numbers of this process's threads, none where the system does not tell."""
    try:
        return {int(path.name) for path in pathlib.Path("/proc/self/task").iterdir()}
    except OSError:
        return set()


def _bind_threads(made: set[int]) -> None:
    """Give every thread that computes a core of its own, where Linux lets us and each can have one.

    They are the last of those that the compiler has `made`, its pool. The pool sleeps between loops. Woken, two of its
    threads often start on one core, and the loop is over before the system has moved one of them: two cores were as
    slow as one for loops of less than a few milliseconds.
    """
    if not hasattr(os, "sched_setaffinity") or os.environ.get("WAVETANK_BIND_THREADS") == "0":
        return
    pool, cores = sorted(made)[-threads() :] if threads() else [], sorted(os.sched_getaffinity(0))
    if len(pool) != len(cores):
        return  # fewer threads than cores: which to take is the system's choice
    for thread, core in zip(pool, cores, strict=True):
        with contextlib.suppress(OSError):
            os.sched_setaffinity(thread, {core})


def synchronize() -> None:
    """Wait until the device has finished everything launched so far."""
    qd.sync()


def download(array: Any) -> np.ndarray:
    """Return what a device array holds, to be read at once: where the host shares its memory it is that memory."""
    synchronize()
    values: np.ndarray = array.to_numpy(copy=None)
    return values


def shares_memory() -> bool:
    """Whether what the host writes to an array of the device is there at once."""
    return _current == "cpu"


def upload(array: Any, values: Any) -> None:
    """Write `values` to the front of a device array; what is beyond becomes zero."""
    # A kernel that copies takes tens of milliseconds to load, one for each type and number of axes.
    memory = (
        download(array) if shares_memory() else np.zeros(tuple(array.arr.total_shape()), to_numpy_type(array.dtype))
    )
    memory[len(values) :] = 0
    if len(values):
        memory[: len(values)] = values
    if not shares_memory():
        array.from_numpy(memory)


class Mirror:
    """What a device array holds, read and written again and again: where the host shares its memory it is that memory.

    To look for that memory each time takes ten times as long as to write a few numbers to it. Whoever reads or writes
    waits for the device before, with `synchronize`.
    """

    def __init__(self, array: Any) -> None:
        self._array = array
        self._memory: np.ndarray | None = download(array) if shares_memory() else None

    def read(self) -> np.ndarray:
        """Return what the array holds, to be read at once."""
        return download(self._array) if self._memory is None else self._memory

    def write(self, values: Any) -> None:
        """Write `values` to the front; what is beyond becomes zero."""
        if self._memory is None:
            upload(self._array, values)
        else:
            self._memory[: len(values)] = values
            self._memory[len(values) :] = 0

    def clear(self) -> None:
        """Make it all zero."""
        if self._memory is None:
            self._array.fill(0)
        else:
            self._memory[:] = 0


@contextlib.contextmanager
def on_compile(callback: Callable[[int, str], None]) -> Iterator[None]:
    """Call ``callback(number, kernel)`` before each kernel that is compiled while the context lasts, in its thread.

    `number` counts from 1 within the context, `kernel` is the name of its function. A kernel is compiled at its first
    launch, or loaded where an earlier process of this user has compiled it, which takes some hundredths of the time.
    How many there will be is not known: that depends on what the world comes to. The callback should be quick.
    """
    numbers = itertools.count(1)

    def listen(kernel: str) -> None:
        callback(next(numbers), kernel)

    patches.LISTENERS.append(listen)
    try:
        yield
    finally:
        patches.LISTENERS.remove(listen)


@contextlib.contextmanager
def watched(around: Callable[[str, str, Callable[[], Any]], Any]) -> Iterator[None]:
    """Launch every kernel through `around` while the context lasts, to count or to time.

    ``around(module, name, launch)`` names the kernel and returns what ``launch()`` returns.
    """
    from quadrants.lang.kernel import Kernel

    call = Kernel.__call__

    def watch(self: Any, *args: Any, **kwargs: Any) -> Any:
        return around(self.func.__module__, self.func.__name__, lambda: call(self, *args, **kwargs))

    Kernel.__call__ = watch
    try:
        yield
    finally:
        Kernel.__call__ = call


def _supported(name: str) -> bool:
    return name == "cpu" or bool(qd.lang.misc.is_arch_supported(getattr(qd, name)))


def _name(arch: object) -> str:
    return str(getattr(arch, "name", arch)).split(".")[-1]

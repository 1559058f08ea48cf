"""The one file that imports the kernel compiler (Quadrants, the maintained continuation of Taichi).

Everything else writes ``from wavetank.device.compiler import qd`` and calls `start` once before the first array is
made. The compiler keeps one device program per process, so the back end is chosen once: asking for another one later
is an error while arrays of the first are alive.
"""

import contextlib
import functools
import inspect
import io
import linecache
import os
import pathlib
import sys
import textwrap
import types
import warnings
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from wavetank.device.launches import keep_prepared_launches
from wavetank.foundation.errors import WavetankError

os.environ.setdefault("QD_LOG_LEVEL", "error")
os.environ.setdefault("QD_ENABLE_PYBUF", "0")  # no kernel prints, and none needs to be asked whether it has


@contextlib.contextmanager
def _short_frames() -> Iterator[None]:
    """Let `inspect` tell a frame's line without a walk over all modules, which the compiler asks for hundreds of times.

    It wants to know whether a function that it decorates, one of its own, stands in the body of a class.
    """
    whole = inspect.getframeinfo

    def line_only(frame: Any, context: int = 1) -> inspect.Traceback:
        name, line = frame.f_code.co_filename, frame.f_lineno
        return inspect.Traceback(name, line, frame.f_code.co_name, [linecache.getline(name, line)] * context, 0)

    inspect.getframeinfo = line_only
    try:
        yield
    finally:
        inspect.getframeinfo = whole


# The compiler prints a banner on import; a library should be silent.
with contextlib.redirect_stdout(io.StringIO()), _short_frames():
    import quadrants as qd
    from quadrants.lang import (
        _func_base,
        _kernel_impl_dataclass,
        _template_mapper,
        _template_mapper_hotpath,
        _wrap_inspect,
        expr,
        impl,
        kernel_impl,
        matrix,
        matrix_ops,
    )
    from quadrants.lang._fast_caching import function_hasher
    from quadrants.lang.ast import ast_transformer_utils

__all__ = [
    "BACKENDS", "LANES", "available_backends", "current_backend", "download", "lanes", "qd", "start", "synchronize",
    "threads", "upload", "watched", "worth_sharing",
]  # fmt: skip

#: Names a user may pass as ``arch``; ``gpu`` means the best one present.
BACKENDS = ("cpu", "gpu", "cuda", "vulkan", "metal", "amdgpu")
_GPU_ORDER = ("cuda", "metal", "amdgpu", "vulkan")
LANES = 8
FEW = 50_000
_current: str | None = None


def _is_in_class_body(level_of_class_stackframe: int) -> bool:
    """Say whether the frame below that level is the body of a class: only there a namespace has a qualified name."""
    return "__qualname__" in sys._getframe(level_of_class_stackframe - 1).f_locals


def _place_in_source(context: Any, node: Any) -> str:
    """Return what error messages show of a node: its line, and marks below it. One line needs no wrapping."""
    line = context.src[node.lineno - 1] if node.lineno == node.end_lineno <= len(context.src) else ""
    if not 0 < len(line) <= 120 or not line.isprintable():
        return str(_place_in_lines(context, node))
    first, last = context.indent + node.col_offset, context.indent + node.end_col_offset
    where = f'File "{context.file}", line {node.lineno + context.lineno_offset}, in {context.func.func.__name__}:'
    return f"{where}\n{line.rstrip()}\n{' ' * first}{'^' * (last - first)}\n"


def _flatten_fields(tree: Any, struct_locals: set[str]) -> Any:
    """Do what the compiler's function of that place does, less a walk for places that are all there.

    Most functions have no fields to flatten.
    """
    if not struct_locals:
        return tree
    return _kernel_impl_dataclass.FlattenAttributeNameTransformer(struct_locals=struct_locals).visit(tree)


# The compiler asks Python's `inspect` for the source of a function each time it inlines it, and for the module of each
# decorated one; wraps every line of it as text, for error messages; asks for the range of a type with each number; and
# reads the same functions again for each kernel, to see whether they have changed. A third of a cold start went there,
# and half a second of a warm one (docs/performance.md). The answers stay the same.
for _name_of_lookup in ("getsourcelines", "getsourcefile"):
    if hasattr(_wrap_inspect, _name_of_lookup):
        setattr(_wrap_inspect, _name_of_lookup, functools.cache(getattr(_wrap_inspect, _name_of_lookup)))
if hasattr(kernel_impl, "_inside_class"):
    kernel_impl._inside_class = _is_in_class_body
if hasattr(function_hasher, "_hash_function"):
    function_hasher._hash_function = functools.cache(function_hasher._hash_function)
if getattr(_func_base, "textwrap", None) is textwrap:
    _func_base.textwrap = types.ModuleType("textwrap")
    _func_base.textwrap.__dict__.update(vars(textwrap), fill=functools.cache(textwrap.fill))
if hasattr(expr, "_check_in_range"):
    expr._check_in_range = functools.cache(expr._check_in_range)
_place_in_lines: Any = getattr(ast_transformer_utils.ASTTransformerFuncContext, "_build_pos_info", None)
if _place_in_lines:
    ast_transformer_utils.ASTTransformerFuncContext._build_pos_info = _place_in_source
# Where numbers of a frozen object are compiled into a kernel (`Final`), the compiler reads it anew in each launch, lest
# their class has changed meanwhile: ours are plain integers.
for _module, _asks in (
    (_func_base, "subtree_has_final_fields"), (_template_mapper_hotpath, "subtree_has_final_fields"),
    (_template_mapper, "annotation_has_final_subtree"),
):  # fmt: skip
    if hasattr(_module, _asks):
        setattr(_module, _asks, lambda _: False)
if hasattr(_kernel_impl_dataclass, "FlattenAttributeNameTransformer"):
    _kernel_impl_dataclass.unpack_ast_struct_expressions = _flatten_fields


def _shape(value: Any) -> tuple[int, ...]:
    return tuple(value.get_shape()) if isinstance(value, expr.Expr) and value.is_tensor() else ()


def _in_kernels(name: str, *lengths: int) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Put a function in the place of the compiler's of that name, where a kernel gives it vectors of those `lengths`.

    The compiler reads the source of its own `dot`, and of the functions that this calls, each time that a kernel has a
    dot product in it, and makes variables of their arguments: a quarter of the time it took to read kernels. The same
    sums without the reading:
    """

    def replaced(of_vectors: Callable[..., Any]) -> Callable[..., Any]:
        of_anything = getattr(matrix_ops, name, None)
        if of_anything is None:
            return of_vectors

        @functools.wraps(of_anything)
        def chosen(*args: Any, **kwargs: Any) -> Any:
            shapes = {_shape(value) for value in args} if impl.inside_kernel() and not kwargs else set()
            known = len(shapes) == 1 and shapes <= {(length,) for length in lengths}
            return (of_vectors if known else of_anything)(*args, **kwargs)

        setattr(matrix_ops, name, chosen)
        return of_vectors

    return replaced


def _components(vector: Any) -> list[Any]:
    """Return the components of a vector that is computed once."""
    value = impl.expr_init(vector)
    return [impl.subscript(None, value, k) for k in range(value.n)]


@_in_kernels("sum", 2, 3, 4)
def _sum(vector: Any) -> Any:
    return functools.reduce(lambda total, x: impl.expr_init(total + x), _components(vector))


@_in_kernels("dot", 2, 3, 4)
def _dot(a: Any, b: Any) -> Any:
    return _sum(a * b)


@_in_kernels("norm_sqr", 2, 3, 4)
def _norm_sqr(vector: Any) -> Any:
    value = impl.expr_init(vector)
    return _sum(value * value)


@_in_kernels("norm", 2, 3, 4)
def _norm(vector: Any) -> Any:
    return qd.sqrt(_norm_sqr(vector))


@_in_kernels("normalized", 2, 3, 4)
def _normalized(vector: Any) -> Any:
    value = impl.expr_init(vector)
    return impl.expr_init(1 / _norm(value)) * value


@_in_kernels("cross", 3)
def _cross(a: Any, b: Any) -> Any:
    ax, ay, az = _components(a)
    bx, by, bz = _components(b)
    return matrix.make_matrix([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


_kernels = sys.modules["quadrants.lang.kernel"]
if not keep_prepared_launches(_kernels, impl.get_runtime) and hasattr(_kernels, "LaunchContextBufferCache"):
    # What the compiler itself keeps may be stale (`launches.py`): it shall keep nothing.
    _kernels.LaunchContextBufferCache.cache = lambda *_: None


def available_backends() -> list[str]:
    """Return the concrete back ends that this machine can start, best first, ``cpu`` last."""
    with contextlib.redirect_stdout(io.StringIO()), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = [name for name in _GPU_ORDER if _supported(name)]
    return [*found, "cpu"]


def current_backend() -> str | None:
    """Return the concrete back end that is running, or None before `start`."""
    return _current


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
    if wanted == "cpu":
        # LLVM does again what this pass does, in a fraction of the time: kernels are as fast without it.
        options["cfg_optimization"] = False
    if threads is not None:
        options["cpu_max_num_threads"] = threads
    before = _thread_ids()
    with contextlib.redirect_stdout(io.StringIO()):
        qd.init(**options)
    came_up = {"x64": "cpu", "arm64": "cpu"}.get(_name(qd.lang.impl.current_cfg().arch), wanted)
    if came_up != wanted:
        raise WavetankError(f"arch = {arch!r} was asked for, but the compiler came up on {came_up!r}.")
    _current = wanted
    _keep_apart(_thread_ids() - before)
    return wanted


def threads() -> int:
    """Return how many threads of the processor compute, 0 where a graphics processor does."""
    return int(qd.lang.impl.current_cfg().cpu_max_num_threads) if _current == "cpu" else 0


def lanes() -> int:
    """Return how many particles or nodes are computed together: as vectors on a processor, each by a thread on others.

    More than eight are no faster, where vectors are twice as long (docs/notebook/performance.md).
    """
    return LANES if _current == "cpu" else 1


def worth_sharing(number: int) -> bool:
    """Whether threads gain more on so many things, none of them much work, than it costs to wake them."""
    return _current != "cpu" or number > FEW


def _thread_ids() -> set[int]:
    """Return the numbers of this process's threads, none where the system does not tell."""
    try:
        return {int(path.name) for path in pathlib.Path("/proc/self/task").iterdir()}
    except OSError:
        return set()


def _keep_apart(made: set[int]) -> None:
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


def upload(array: Any, values: Any) -> None:
    """Write `values` to the front of a device array; what is beyond becomes zero."""
    # A kernel that copies takes tens of milliseconds to load, one for each type and number of axes.
    shares = _current == "cpu"
    memory = download(array) if shares else np.zeros_like(array.to_numpy())
    memory[len(values) :] = 0
    if len(values):
        memory[: len(values)] = values
    if not shares:
        array.from_numpy(memory)


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

"""Prepared launches are kept: what a kernel has been given before is not prepared once more.

The compiler looks at every array and number of the dataclasses that a kernel is given, 0.05 to 0.1 ms for a launch, and
can keep what it made of them only where all arguments are objects; it keeps that under their addresses, and does not
notice when an object of numbers is gone and another one has taken its address. Here plain numbers are written over
those of the kept launch, so that every launch of a step can be a kept one, and it goes with the first of its objects to
go. A kept launch is done at once: what the compiler asks before it looks at arguments takes longer than to copy the
prepared ones (`tests/device/test_compiler.py`).
"""

import dataclasses
import weakref
from operator import index
from typing import Any

import numpy as np

NUMBERS = (int, float, bool)
MOST = 64  # launches of a kernel that are kept; when there are more, all are forgotten
#: of the compiler's module of kernels
NEEDED = (
    "Kernel.__call__",
    "Kernel._recursive_set_args",
    "Kernel.construct_kernel_ret",
    "LaunchContextBufferCache.cache",
    "LaunchContextBufferCache.populate_launch_ctx_from_cache",
    "primitive_types.integer_type_ids",
    "primitive_types.real_type_ids",
    "runtime_ops.sync",
)


@dataclasses.dataclass
class Prepared:
    """A launch that is ready to be done again."""

    program: Any
    read: Any  # the kernel, as the compiler has read it
    compiled: Any
    context: Any  # its arguments
    integers: tuple[int, ...]  # slots of plain numbers among these, which depend on what the kernel is compiled for
    reals: tuple[int, ...]
    watchers: list[weakref.ref[Any]]  # of its objects


@dataclasses.dataclass
class Launches:
    """The prepared launches of a kernel, by their objects and by the numbers that it is compiled for."""

    fixed: tuple[int, ...]  # places of these among the arguments
    integers: tuple[int, ...]  # places of other numbers
    reals: tuple[int, ...]
    known: dict[tuple[Any, ...], Prepared] = dataclasses.field(default_factory=dict)
    latest: tuple[Any, Any] | None = None  # the kernel and the arguments of the launch that was prepared last

    def key(self, args: tuple[Any, ...]) -> tuple[Any, ...]:
        """Return what a launch is kept by."""
        return tuple([args[k] if type(args[k]) in NUMBERS else id(args[k]) for k in self.fixed])

    def context(self, prepared: Prepared, args: tuple[Any, ...]) -> Any:
        """Return the arguments of a prepared launch with these numbers."""
        context = prepared.read.make_launch_context()
        context.copy(prepared.context)
        if self.integers:
            context.set_args_int(prepared.integers, tuple([index(args[k]) for k in self.integers]))
        if self.reals:
            context.set_args_float(prepared.reals, tuple([float(args[k]) for k in self.reals]))
        return context

    def remember(self, args: tuple[Any, ...], program: Any, compiled: Any, slots: dict[int, int]) -> None:
        """Keep the launch that has been prepared until one of its objects goes; numbers have the `slots`."""
        if self.latest is None or not slots.keys() >= {*self.integers, *self.reals}:
            return
        key, launches = self.key(args), self.known

        def forget(_: Any) -> None:
            launches.pop(key, None)

        try:
            watchers = [weakref.ref(args[k], forget) for k in self.fixed if type(args[k]) not in NUMBERS]
        except TypeError:
            return  # an object that cannot tell when it goes
        if len(launches) >= MOST:
            launches.clear()
        integers, reals = (tuple(slots[k] for k in places) for places in (self.integers, self.reals))
        launches[key] = Prepared(program, self.latest[0], compiled, self.latest[1], integers, reals, watchers)


def keep_prepared_launches(kernels: Any, runtime: Any) -> None:
    """Let the compiler's module `kernels`, which has what is `NEEDED`, keep prepared launches.

    ``runtime()`` is what holds the compiler's program.
    """
    kernel, cache, types = kernels.Kernel, kernels.LaunchContextBufferCache, kernels.primitive_types
    call, prepare = kernel.__call__, kernel._recursive_set_args
    numbers: dict[str, int] = {}  # slots of the launch that is prepared, by the names of the arguments

    def launches_of(self: Any) -> Launches:
        kinds = [id(meta.annotation) for meta in self.arg_metas]
        integers = tuple(k for k, kind in enumerate(kinds) if kind in types.integer_type_ids)
        reals = tuple(k for k, kind in enumerate(kinds) if kind in types.real_type_ids)
        return Launches(tuple(k for k in range(len(kinds)) if k not in (*integers, *reals)), integers, reals)

    def launch(self: Any, *args: Any, **options: Any) -> Any:
        buffers = self.launch_context_buffer_cache
        launches = buffers.__dict__.get("launches")
        if launches is None:
            launches = buffers.launches = launches_of(self)
        complete = len(args) == len(self.arg_metas) and not options
        prepared = launches.known.get(launches.key(args)) if complete else None
        if prepared is None or prepared.program is not runtime().prog:
            numbers.clear()
            launches.latest = None
            result = call(self, *args, **options)
            slots = {k: numbers[meta.name] for k, meta in enumerate(self.arg_metas) if meta.name in numbers}
            exchangeable = getattr(self, "_mutable_nd_cached_val", None)  # arrays within an object
            if complete and not exchangeable:
                launches.remember(args, runtime().prog, self._last_compiled_kernel_data, slots)
            return result
        context = launches.context(prepared, args)
        prepared.program.launch_kernel(prepared.compiled, context)
        if not self.return_type:
            return None
        kernels.runtime_ops.sync()
        values = [self.construct_kernel_ret(context, kind, (k,)) for k, kind in enumerate(self.return_type)]
        return values[0] if len(values) == 1 else tuple(values)

    def prepare_one(*args: Any) -> tuple[int, bool]:
        needed, value = args[4], args[6]
        taken, may_be_kept = prepare(*args)
        if type(value) in NUMBERS:
            numbers[args[1]], may_be_kept = args[7], True
        elif isinstance(value, np.ndarray) and hasattr(needed, "set_kernel_struct_args"):
            may_be_kept = not value.flags.writeable  # a vector that nobody can change
        return taken, may_be_kept

    def keep(self: Any, read: Any, _: Any, context: Any, __: Any) -> None:
        copied = read.make_launch_context()
        copied.copy(context)
        self.launches.latest = read, copied

    kernel.__call__, kernel._recursive_set_args = launch, staticmethod(prepare_one)
    cache.cache, cache.populate_launch_ctx_from_cache = keep, lambda *_: False

"""Launches that are known: what a kernel has been given before is not prepared once more.

The compiler looks at every array and number of the dataclasses that a kernel is given, 0.05 to 0.1 ms for a launch, and
can keep what it made of them only where all arguments are objects; it keeps that under their addresses, and does not
notice when an object of numbers is gone and another one has taken its address. Here plain numbers count by their value,
so that every launch of a step can be known, and what is kept goes with the first of its objects to go
(`tests/test_compiler.py`).
"""

import weakref
from typing import Any

NUMBERS = (int, float, bool)
MOST = 64  # launches of a kernel that are kept; when there are more, all are forgotten


def keep_prepared_launches(kernels: Any) -> bool:
    """Let the compiler's module `kernels` keep prepared launches this way; say whether it has what that takes."""
    kernel: Any = getattr(kernels, "Kernel", None)
    cache: Any = getattr(kernels, "LaunchContextBufferCache", None)
    needed = ("launch_kernel", "_recursive_set_args"), ("cache", "populate_launch_ctx_from_cache")
    if not all(hasattr(owner, name) for owner, names in zip((kernel, cache), needed, strict=True) for name in names):
        return False
    launch, prepare = kernel.launch_kernel, kernel._recursive_set_args
    keep, find = cache.cache, cache.populate_launch_ctx_from_cache

    def launch_with(self: Any, key: Any, compiled_for: Any, compiled: Any, *args: Any, **options: Any) -> Any:
        self.launch_context_buffer_cache.args = args
        try:
            return launch(self, key, compiled_for, compiled, *args, **options)
        finally:
            self.launch_context_buffer_cache.args = ()

    def prepare_one(*args: Any) -> tuple[int, bool]:
        slots, known = prepare(*args)
        return slots, known or type(args[6]) in NUMBERS

    def find_known(self: Any, addresses: tuple[int, ...], launch_context: Any) -> bool:
        values = (arg if type(arg) in NUMBERS else id(arg) for arg in self.args)
        self.name = (addresses[0], *values, *addresses[1 + len(self.args) :])
        return bool(find(self, self.name, launch_context))

    def keep_known(self: Any, compiled_for: Any, addresses: Any, launch_context: Any, arguments: Any) -> None:
        entries, watchers, name = self._launch_ctx_cache, self._launch_ctx_cache_tracker, self.name

        def forget(_: Any) -> None:
            entries.pop(name, None)
            watchers.pop(name, None)

        try:
            watched = [weakref.ref(arg, forget) for arg in self.args if type(arg) not in NUMBERS]
        except TypeError:
            return  # an object that cannot tell when it goes
        if len(entries) >= MOST:
            entries.clear()
            watchers.clear()
        keep(self, compiled_for, name, launch_context, arguments)
        watchers[name].extend(watched)

    kernel.launch_kernel, kernel._recursive_set_args = launch_with, staticmethod(prepare_one)
    cache.cache, cache.populate_launch_ctx_from_cache = keep_known, find_known
    return True

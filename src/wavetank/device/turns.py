"""One thread computes at a time.

The compiler reads, compiles and launches kernels with one program and one set of tables per process, whichever thread
asks; two threads at once mixed up their arguments and ended in segmentation faults. So a launch waits for its turn, and
whoever needs many launches together (a frame of water, what is read of a world, a picture) keeps the turn for all of
them. Threads that wait are served before the one that has just had its turn.
"""

import contextlib
import functools
import inspect
import os
import threading
from collections.abc import Callable
from typing import Any, TypeVar

from wavetank.foundation.errors import WavetankError

Class = TypeVar("Class", bound=type)


class Turn(contextlib.ContextDecorator):
    """A lock that a thread may take again while it has it, and that goes to who waits before who comes back.

    Raises `WavetankError` in a forked process: the threads that compute stayed in its parent.
    """

    def __init__(self) -> None:
        self._lock, self._next = threading.Lock(), threading.Lock()
        self.owner, self._depth = 0, 0  # of the thread that has it: its number, and how often
        self.is_forked = False

    def __enter__(self) -> None:
        if self.owner != threading.get_ident():
            if self.is_forked:
                raise WavetankError(
                    "this process was forked from one that had already computed, and the compiler's threads did not "
                    'come along; start workers with multiprocessing.get_context("spawn") or "forkserver", or fork '
                    "before the first wavetank.Simulation is made."
                )
            with self._next:  # who waits here comes before who asks again
                self._lock.acquire()
            self.owner = threading.get_ident()
        self._depth += 1

    def __exit__(self, *_: object) -> None:
        self._depth -= 1
        if not self._depth:
            self.owner = 0
            self._lock.release()

    def refuse_after_fork(self) -> None:
        """Refuse every turn in processes that are forked from now on."""

        def refuse() -> None:
            self.__init__()  # type: ignore[misc]
            self.is_forked = True

        if hasattr(os, "register_at_fork"):
            os.register_at_fork(after_in_child=refuse)


TURN = Turn()


def one_at_a_time(*but: str) -> Callable[[Class], Class]:
    """Let all public methods and properties of a class, and its making, keep the turn; `but` those named.

    Those are methods that take it for each of their parts, so that other threads come between.
    """

    def keep_turn(call: Any) -> Any:
        @functools.wraps(call)
        def in_turn(*args: Any, **kwargs: Any) -> Any:
            with TURN:
                return call(*args, **kwargs)

        return in_turn

    def declare(cls: Class) -> Class:
        for name, member in list(vars(cls).items()):
            if name in but or (name.startswith("_") and name not in ("__init__", "__setattr__")):
                continue
            if isinstance(member, property):
                reading, writing = (keep_turn(part) if part else None for part in (member.fget, member.fset))
                setattr(cls, name, property(reading, writing, doc=member.__doc__))
            elif inspect.isfunction(member):
                setattr(cls, name, keep_turn(member))
        return cls

    return declare

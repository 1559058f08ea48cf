"""A writer beside the simulation: a thread that compresses and writes what waits, in order, and nothing is dropped.

Where more waits than there is room for, the simulation waits too. What fails for a while is tried again.
"""

import queue
import threading
import time
from collections.abc import Callable
from typing import TypeVar

Work = TypeVar("Work")
Job = Callable[[], None]
MOST_WAITING = 8  # frames
MOST_BYTES = 256_000_000  # of frames that wait; at least one may


class Background:
    """Does jobs one after the other in a thread of its own."""

    def __init__(self) -> None:
        self.waited = 0.0  # s that who had work waited for room
        self._bytes = 0  # of what waits or is being written
        self._room = threading.Condition()
        self._jobs: queue.SimpleQueue[tuple[Job, int] | None] = queue.SimpleQueue()
        self._number = 0
        self._error: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name="wavetank writer", daemon=True)
        self._thread.start()

    def put(self, job: Job, size: int) -> None:
        """Have `job` done, which holds `size` bytes; waits for room, and raises what went wrong with one before."""
        began = time.perf_counter()
        with self._room:
            while self._error is None and self._number and not self._fits(size):
                self._room.wait()
            if self._error is None:
                self._bytes, self._number = self._bytes + size, self._number + 1
        self.waited += time.perf_counter() - began
        self._raise()
        self._jobs.put((job, size))

    def drain(self) -> None:
        """Wait until nothing waits; raises what went wrong."""
        with self._room:
            while self._number:
                self._room.wait(0.2)
        self._raise()

    def finish(self) -> None:
        """Wait until all is done; raises what went wrong."""
        self._jobs.put(None)
        while self._thread.is_alive():
            self._thread.join(0.2)  # so that a second Ctrl-C is heard
        self._raise()

    def _fits(self, size: int) -> bool:
        return self._number < MOST_WAITING and self._bytes + size <= MOST_BYTES

    def _raise(self) -> None:
        error, self._error = self._error, None
        if error is not None:
            raise error

    def _run(self) -> None:
        while (entry := self._jobs.get()) is not None:
            job, size = entry
            try:
                if self._error is None:
                    job()
            except BaseException as error:  # belongs to who waits for it
                self._error = error
            finally:
                with self._room:
                    self._bytes, self._number = self._bytes - size, self._number - 1
                    self._room.notify_all()
            del job, entry

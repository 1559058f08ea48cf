"""A thread that compresses and writes frames in order, in parallel with the simulation.

The queue is bounded: where it is full, the simulation waits. Nothing is dropped.
"""

import queue
import threading
import time
from collections.abc import Callable
from typing import TypeVar

Work = TypeVar("Work")
Job = Callable[[], None]
MOST_WAITING = 8  # frames
MOST_BYTES = 256_000_000  # of queued frames; a single larger one is accepted


class BackgroundWriter:
    """Runs jobs one after the other in a thread of its own."""

    def __init__(self) -> None:
        self.waited = 0.0  # s that callers of `put` waited
        self._bytes = 0  # of queued jobs, with the running one
        self._room = threading.Condition()
        self._jobs: queue.SimpleQueue[tuple[Job, int] | None] = queue.SimpleQueue()
        self._number = 0
        self._error: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name="wavetank writer", daemon=True)
        self._thread.start()

    def put(self, job: Job, size: int) -> None:
        """Queue a job that holds `size` bytes; wait while the queue is full, and raise the error of an earlier job."""
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
        """Wait until the queue is empty; raises the error of a job."""
        with self._room:
            while self._number:
                self._room.wait(0.2)
        self._raise()

    def finish(self) -> None:
        """Wait until all jobs are done, and end the thread; raises the error of a job."""
        self._jobs.put(None)
        while self._thread.is_alive():
            self._thread.join(0.2)  # short, so that a second Ctrl-C is handled
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
            except BaseException as error:  # raised by the next call
                self._error = error
            finally:
                with self._room:
                    self._bytes, self._number = self._bytes - size, self._number - 1
                    self._room.notify_all()
            del job, entry

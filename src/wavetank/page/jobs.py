"""What other threads want to have done in that of the simulation, the only one that may look at its arrays."""

import concurrent.futures
import queue
from collections.abc import Callable
from typing import Any


class Jobs:
    """Jobs in the order in which they were asked for; `wake` is called after each."""

    def __init__(self, wake: Callable[[], None]) -> None:
        self._wake = wake
        self._waiting: queue.SimpleQueue[tuple[Callable[[], Any], concurrent.futures.Future[Any]]] = queue.SimpleQueue()

    def ask(self, job: Callable[[], Any]) -> concurrent.futures.Future[Any]:
        """Have `job` done between two frames."""
        future: concurrent.futures.Future[Any] = concurrent.futures.Future()
        self._waiting.put((job, future))
        self._wake()
        return future

    def do_all(self) -> None:
        """Do what waits; a failure belongs to who asked: the water goes on."""
        while not self._waiting.empty():
            job, future = self._waiting.get()
            try:
                future.set_result(job())
            except Exception as error:
                future.set_exception(error)

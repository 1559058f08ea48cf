"""Signals that end a command: Ctrl-C, SIGTERM, a closed terminal.

The first one lets the current frame be finished and every file be completed; a second one stops at once, and a video
plays as far as it got. The exit code is 128 plus the number of the first signal, as shells have it: 130 after Ctrl-C,
143 after SIGTERM, 129 after a closed terminal (docs/promises.md).
"""

import contextlib
import os
import signal
import stat
import sys
import threading
from collections.abc import Callable, Iterator
from typing import Any

SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP")
RETRY = 0.01  # s after which a signal that arrived in a finalizer is sent again


class StopRequest:
    """Whether, and by which signal, this process was asked to end; true once it was."""

    def __init__(self) -> None:
        self.signal = 0  # number of the first one
        self._event = threading.Event()

    def __bool__(self) -> bool:
        return self._event.is_set()

    @property
    def code(self) -> int:
        """The exit code."""
        return 128 + self.signal if self.signal else 0

    def receive(self, number: int) -> None:
        """Record a signal; raises `KeyboardInterrupt` where one came before."""
        if number == getattr(signal, "SIGHUP", None):
            _leave_terminal()
        if self._event.is_set():
            raise KeyboardInterrupt
        self.signal = number
        self._event.set()


@contextlib.contextmanager
def stop_on_signal(then: Callable[[], None] = lambda: None, say: str = "") -> Iterator[StopRequest]:
    """Catch signals within the context; at the first one call `then` and print the line `say`."""
    stop = StopRequest()
    if threading.current_thread() is not threading.main_thread():
        yield stop
        return

    def handle(number: int, frame: Any) -> None:
        if stop and _is_in_finalizer(frame):  # which would swallow a KeyboardInterrupt
            threading.Timer(RETRY, os.kill, (os.getpid(), number)).start()
            return
        stop.receive(number)
        if say:
            with contextlib.suppress(OSError, ValueError, RuntimeError):
                os.write(sys.stderr.fileno(), f"\nwavetank: {say}\n".encode())
        then()

    before = {}
    for name in SIGNALS:
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is not signal.SIG_IGN:  # set by nohup
            before[number] = signal.signal(number, handle)
    try:
        yield stop
    finally:
        for number, action in before.items():
            signal.signal(number, action)


def _is_in_finalizer(frame: Any) -> bool:
    while frame is not None:
        if frame.f_code.co_name == "__del__":
            return True
        frame = frame.f_back
    return False


def _leave_terminal() -> None:
    """Send output to the null device where it went to the terminal, which is gone: writing to it would fail."""
    for number in (0, 1, 2):
        with contextlib.suppress(OSError):
            if stat.S_ISCHR(os.fstat(number).st_mode):
                nowhere = os.open(os.devnull, os.O_RDWR)
                os.dup2(nowhere, number)
                os.close(nowhere)

"""Being asked to end: Ctrl-C, SIGTERM, a closed terminal.

The first of them lets the frame at hand be finished and every file be completed; a second one stops at once, and what
is finished so far plays. The exit code is 128 plus the number of the first signal, as shells have it: 130 after Ctrl-C,
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

ASKED = ("SIGINT", "SIGTERM", "SIGHUP")
AGAIN = 0.01  # s after which a signal comes again that came in a finalizer


class Asked:
    """Whether, and by what, this process was asked to end."""

    def __init__(self) -> None:
        self.signal = 0  # the first that came
        self._event = threading.Event()

    def __bool__(self) -> bool:
        return self._event.is_set()

    @property
    def code(self) -> int:
        """The exit code."""
        return 128 + self.signal if self.signal else 0

    def note(self, number: int) -> None:
        """Take note of a signal; raises `KeyboardInterrupt` where one came before."""
        if number == getattr(signal, "SIGHUP", None):
            _leave_terminal()
        if self._event.is_set():
            raise KeyboardInterrupt
        self.signal = number
        self._event.set()


@contextlib.contextmanager
def asked_to_end(then: Callable[[], None] = lambda: None, say: str = "") -> Iterator[Asked]:
    """Tell whether the process is asked to end while the context lasts; call `then`, and `say` a line, at the first."""
    asked = Asked()
    if threading.current_thread() is not threading.main_thread():
        yield asked
        return

    def note(number: int, frame: Any) -> None:
        if asked and _is_in_finalizer(frame):  # where an interrupt would be printed and forgotten
            threading.Timer(AGAIN, os.kill, (os.getpid(), number)).start()
            return
        asked.note(number)
        if say:
            with contextlib.suppress(OSError, ValueError, RuntimeError):
                os.write(sys.stderr.fileno(), f"\nwavetank: {say}\n".encode())
        then()

    before = {}
    for name in ASKED:
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is not signal.SIG_IGN:  # as of nohup, which is to be kept
            before[number] = signal.signal(number, note)
    try:
        yield asked
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
    """Write nowhere from now on, where a terminal was: it is gone, and a line to it would be an error."""
    for number in (0, 1, 2):
        with contextlib.suppress(OSError):
            if stat.S_ISCHR(os.fstat(number).st_mode):
                nowhere = os.open(os.devnull, os.O_RDWR)
                os.dup2(nowhere, number)
                os.close(nowhere)

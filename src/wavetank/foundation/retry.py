"""Repeat what fails for a reason that may pass: a full disk, a network folder that is away."""

import errno
import threading
import time
from collections.abc import Callable
from typing import TypeVar

from wavetank.foundation.errors import WavetankError

Result = TypeVar("Result")

#: errors that may be over soon
TRANSIENT = {
    errno.EAGAIN,
    errno.EBUSY,
    errno.EINTR,
    errno.ENOSPC,
    errno.EDQUOT,
    errno.ETIMEDOUT,
    errno.ENFILE,
    errno.EMFILE,
    getattr(errno, "ESTALE", errno.ETIMEDOUT),
    getattr(errno, "EHOSTDOWN", errno.ETIMEDOUT),
}
LONGEST = 60.0  # s of waiting, in total
FIRST, MOST = 0.2, 5.0  # s between two attempts


class Retry:
    """Repeats a job that failed with a transient error, for `longest` [s]; tells once what it waits for."""

    def __init__(self, tell: Callable[[str], None] = lambda text: None, longest: float = LONGEST) -> None:
        self.tell, self.longest = tell, longest
        self.stop = threading.Event()  # set: fail at once

    def call(self, job: Callable[[], Result]) -> Result:
        """Return what `job` returns; raises its error where that lasts or is not transient."""
        began, pause, told = time.monotonic(), FIRST, False
        while True:
            try:
                return job()
            except (OSError, WavetankError) as error:
                cause = error if isinstance(error, OSError) else error.__cause__
                transient = isinstance(cause, OSError) and cause.errno in TRANSIENT
                if not transient or self.stop.is_set() or time.monotonic() - began > self.longest:
                    raise
                if not told:
                    self.tell(f"waiting, and trying again for {self.longest:g} s: {error}")
                    told = True
            self.stop.wait(pause)
            pause = min(2.0 * pause, MOST)

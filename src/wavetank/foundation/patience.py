"""What fails for a while only is tried again: a full disk, a folder on a network that is away."""

import errno
import threading
import time
from collections.abc import Callable
from typing import TypeVar

from wavetank.foundation.errors import WavetankError

Result = TypeVar("Result")

#: what may be over soon
PASSING = {
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
LONGEST = 60.0  # s of waiting, all in all
FIRST, MOST = 0.2, 5.0  # s between two tries


class Patience:
    """Tries again what failed for a reason that may pass; says once what it waits for."""

    def __init__(self, tell: Callable[[str], None] = lambda text: None, longest: float = LONGEST) -> None:
        self.tell, self.longest = tell, longest
        self.hurry = threading.Event()  # set where nobody waits any more

    def do(self, job: Callable[[], Result]) -> Result:
        """Return what `job` returns; raises its error where that lasts, or is of another kind."""
        began, pause, told = time.monotonic(), FIRST, False
        while True:
            try:
                return job()
            except (OSError, WavetankError) as error:
                cause = error if isinstance(error, OSError) else error.__cause__
                passing = isinstance(cause, OSError) and cause.errno in PASSING
                if not passing or self.hurry.is_set() or time.monotonic() - began > self.longest:
                    raise
                if not told:
                    self.tell(f"waiting, and trying again for {self.longest:g} s: {error}")
                    told = True
            self.hurry.wait(pause)
            pause = min(2.0 * pause, MOST)

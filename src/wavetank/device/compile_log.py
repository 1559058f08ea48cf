"""One line in the log where compiling takes seconds and nobody else says so: a script would seem to hang."""

import dataclasses
import logging
import math
import time
from collections.abc import Sequence

PATIENCE = 3.0  # s of compiling without a word
PAUSE = 10.0  # s without a kernel after which another wait begins: one may take some seconds

log = logging.getLogger("wavetank")


@dataclasses.dataclass
class CompileLog:
    """Counts kernels, and tells the log once."""

    listeners: Sequence[object]  # all that hear of kernels; where there are others, these tell people
    began: float = 0.0  # s: when this wait did
    latest: float = -math.inf  # s: when the last kernel was heard of
    count: int = 0
    has_told: bool = False

    def hear(self, kernel: str) -> None:
        """Count a kernel that is about to be compiled or loaded."""
        now = time.monotonic()
        if now - self.latest > PAUSE:
            self.began, self.count = now, 0
        self.latest, self.count = now, self.count + 1
        if now - self.began > PATIENCE and not self.has_told and len(self.listeners) == 1:
            self.has_told = True
            log.warning(
                "wavetank: preparing kernels, %d so far; this takes up to a minute once, later starts load them.",
                self.count,
            )

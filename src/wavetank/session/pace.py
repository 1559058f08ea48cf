"""Real time: when the next frame is due, how fast water time passes, and that nobody waits for the interpreter."""

import sys

SMOOTHING = 0.95  # share of the past in the measured pace
LONGEST = 8.0  # of the average: what a single frame may count for, as when kernels are loaded or a computer slept
MADE_GOOD = 0.07  # s of lateness that are: as long as a picture may keep the water waiting
LATE = 0.9  # pace below which a machine is too slow
TURN = 0.0005  # s


class Pace:
    """Holds frames back to the wall clock. Where the machine is too slow, time slows down.

    What a picture took is caught up before the next one, and no more than that.
    """

    def __init__(self) -> None:
        self.due = 0.0  # s on the wall clock
        self._last: float | None = None
        self._water = self._took = 0.0  # s, of a frame on average

    @property
    def measured(self) -> float:
        """Seconds of water in a second: of averages, because frames with a picture between them take longer."""
        return self._water / self._took if self._took > 0.0 else 1.0

    @property
    def frames_per_second(self) -> float:
        """Frames that are computed in a second."""
        return 1.0 / self._took if self._took > 0.0 else 0.0

    def wait(self, now: float) -> float:
        """Return how long [s] the next frame is to be held back."""
        return max(0.0, self.due - now)

    def passed(self, now: float, water: float, wall: float) -> None:
        """Note that `water` [s] were computed for which `wall` [s] should pass."""
        if self._took == 0.0:
            self._water, self._took = water, wall
        if self._last is not None and now > self._last:
            took = min(now - self._last, LONGEST * self._took)
            self._water += (1.0 - SMOOTHING) * (water - self._water)
            self._took += (1.0 - SMOOTHING) * (took - self._took)
        self._last = now
        # What is later than that is lost time, never hurried after.
        self.due = max(self.due + wall, now - max(0.5 * wall, MADE_GOOD))

    def stop(self) -> None:
        """Time stands still."""
        self._last, self.due = None, 0.0

    def is_late(self, wanted: float) -> bool:
        """Say whether the machine is too slow for the pace that is wanted."""
        return self.measured < LATE * wanted


def share_interpreter() -> None:
    """Let threads beside the water have Python's lock within milliseconds; for this process, from now on.

    A launch gives the lock away and takes it again within a kernel's time, which begins the usual 5 ms of waiting anew:
    without this a server's or a window's thread waits for 0.1 s and more, at every message.
    """
    sys.setswitchinterval(min(sys.getswitchinterval(), TURN))

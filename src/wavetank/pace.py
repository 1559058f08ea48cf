"""Real time: when the next frame is due, how fast water time passes, and that nobody waits for the interpreter."""

import sys

SMOOTHING = 0.9  # share of the past in the measured pace
LATE = 0.9  # pace below which a machine is too slow
TURN = 0.0005  # s


class Pace:
    """Holds frames back to the wall clock. Where the machine is too slow, time slows down; nothing is caught up."""

    def __init__(self) -> None:
        self.due = 0.0  # s on the wall clock
        self.measured = 1.0  # seconds of water in a second
        self.frames_per_second = 0.0
        self._last: float | None = None

    def wait(self, now: float) -> float:
        """Return how long [s] the next frame is to be held back."""
        return max(0.0, self.due - now)

    def passed(self, now: float, water: float, wall: float) -> None:
        """Note that `water` [s] were computed for which `wall` [s] should pass."""
        if self._last is not None and now > self._last:
            took = now - self._last
            if took < 1.0:
                self.measured += (1.0 - SMOOTHING) * (water / took - self.measured)
                self.frames_per_second += (1.0 - SMOOTHING) * (1.0 / took - self.frames_per_second)
        self._last = now
        # Half a frame of lateness is made good; what is later than that is lost time, never hurried after.
        self.due = max(self.due + wall, now - 0.5 * wall)

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

"""Real time: when the next frame is due, how fast simulated time passes, and fair use of the interpreter."""

import sys

SMOOTHING = 0.95  # weight of the past in the moving average
LONGEST = 8.0  # averages: limit of a single frame, as when kernels are loaded or a computer slept
CATCH_UP = 0.07  # s of lateness that are caught up: as long as a picture may delay a frame
LATE = 0.9  # of the wanted pace: below it a machine is too slow
SWITCH_INTERVAL = 0.0005  # s


class Pace:
    """Delays frames to match the wall clock. Where the machine is too slow, simulated time slows down.

    Only the time of a picture is caught up, before the next one.
    """

    def __init__(self) -> None:
        self.due = 0.0  # s on the wall clock
        self._last: float | None = None
        self._water = self._took = 0.0  # s, of a frame on average

    @property
    def measured(self) -> float:
        """Seconds of water in a second, by moving averages, as frames with a picture between them take longer."""
        return self._water / self._took if self._took > 0.0 else 1.0

    @property
    def frames_per_second(self) -> float:
        """Frames computed in a second."""
        return 1.0 / self._took if self._took > 0.0 else 0.0

    def wait(self, now: float) -> float:
        """Return the time until the next frame is due [s]."""
        return max(0.0, self.due - now)

    def passed(self, now: float, water: float, wall: float) -> None:
        """Record that `water` [s] were computed, which should take `wall` [s]."""
        if self._took == 0.0:
            self._water, self._took = water, wall
        if self._last is not None and now > self._last:
            took = min(now - self._last, LONGEST * self._took)
            self._water += (1.0 - SMOOTHING) * (water - self._water)
            self._took += (1.0 - SMOOTHING) * (took - self._took)
        self._last = now
        # Lateness beyond that is never caught up.
        self.due = max(self.due + wall, now - max(0.5 * wall, CATCH_UP))

    def stop(self) -> None:
        """Forget the schedule, as time is paused."""
        self._last, self.due = None, 0.0

    def is_late(self, wanted: float) -> bool:
        """Return whether the machine is too slow for the pace `wanted` [s of water in a second]."""
        return self.measured < LATE * wanted


def share_interpreter() -> None:
    """Lower the interpreter's switch interval, so that other threads get its lock within milliseconds.

    A launch releases the lock and takes it again within a kernel's time, which restarts the usual 5 ms of waiting:
    without this a server's or a window's thread waits for 0.1 s and more for each message.
    """
    sys.setswitchinterval(min(sys.getswitchinterval(), SWITCH_INTERVAL))

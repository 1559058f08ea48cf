"""The history of a world in memory: a ring of instants to go back to, and bookmarks."""

import bisect

from wavetank.simulation.state import PackedState, State

EVERY = 0.1  # s of water between two instants
MEMORY = 256 * 2**20  # bytes of the ring
BOOKMARKS = 20


class History:
    """Instants in the order of their time; after going back, later ones stay until time passes."""

    def __init__(self, memory: int = MEMORY) -> None:
        self.memory = memory
        self.instants: list[PackedState] = []
        self.times: list[float] = []
        self.bookmarks: dict[str, PackedState] = {}
        self._size = 0

    def is_due(self, time: float) -> bool:
        """Return whether the instant at `time` [s], the latest so far, is due to be recorded."""
        return not self.times or time >= self.times[-1] + EVERY - 1e-9

    def record(self, snapshot: State) -> None:
        """Record an instant; later ones are dropped, and the oldest where memory is exceeded."""
        self.forget_from(snapshot.time)
        packed = snapshot.pack()
        self.instants.append(packed)
        self.times.append(snapshot.time)
        self._size += packed.size
        while self._size > self.memory and len(self.instants) > 1:
            self._size -= self.instants.pop(0).size
            del self.times[0]

    def forget_from(self, time: float) -> None:
        """Drop the instants from `time` [s] on."""
        first = bisect.bisect_left(self.times, time - 1e-9)
        self._size -= sum(packed.size for packed in self.instants[first:])
        del self.instants[first:], self.times[first:]

    def before(self, time: float) -> State | None:
        """Return the last instant not after `time` [s], else the first one; None without any."""
        if not self.instants:
            return None
        return self.instants[max(0, bisect.bisect_right(self.times, time + 1e-9) - 1)].unpack()

    def last_finite(self) -> State | None:
        """Return the last instant without non-finite values; later ones are dropped."""
        while self.instants:
            instant = self.instants[-1].unpack()
            if instant.is_finite:
                return instant
            self.forget_from(self.times[-1])
        return None

    def clear(self) -> None:
        """Drop all instants and bookmarks."""
        self.instants, self.times, self.bookmarks, self._size = [], [], {}, 0

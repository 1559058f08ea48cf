"""The past of a world in memory: a ring of instants to go back to, and bookmarks."""

import bisect

from wavetank.simulation.snapshot import Packed, Snapshot

EVERY = 0.1  # s of water between two instants
MEMORY = 256 * 2**20  # bytes that the ring may take
BOOKMARKS = 20


class History:
    """Instants in the order of their time. What lies after the present is kept until time goes on."""

    def __init__(self, memory: int = MEMORY) -> None:
        self.memory = memory
        self.instants: list[Packed] = []
        self.times: list[float] = []
        self.bookmarks: dict[str, Packed] = {}
        self._size = 0

    def wants(self, time: float) -> bool:
        """Say whether the instant at `time` [s], the latest so far, is one to keep."""
        return not self.times or time >= self.times[-1] + EVERY - 1e-9

    def keep(self, snapshot: Snapshot) -> None:
        """Add an instant; what was kept from here on was another future and goes, and the oldest where room ends."""
        self.forget_from(snapshot.time)
        packed = Packed(snapshot)
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

    def before(self, time: float) -> Snapshot | None:
        """Return the last instant that is not after `time` [s], the first there is if all are; None without any."""
        if not self.instants:
            return None
        return self.instants[max(0, bisect.bisect_right(self.times, time + 1e-9) - 1)].unpack()

    def last_finite(self) -> Snapshot | None:
        """Return the last instant whose numbers are numbers; those behind it are forgotten."""
        while self.instants:
            instant = self.instants[-1].unpack()
            if instant.is_finite:
                return instant
            self.forget_from(self.times[-1])
        return None

    def clear(self) -> None:
        """Forget all, bookmarks too: the world is another."""
        self.instants, self.times, self.bookmarks, self._size = [], [], {}, 0

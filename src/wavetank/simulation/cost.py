"""The cost of a world, computed before it is created: particles, grid nodes, bytes of memory, seconds.

Bytes are counted from the declarations of `device/state.py`; seconds are a lower bound by what one thread of a fast
processor needs for a particle and a step, so that only what is really long is refused.
"""

import contextlib
import dataclasses
import functools
import os
from collections.abc import Iterator

from wavetank.device import compiler
from wavetank.foundation.arguments import finite
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.memory import SHARE, free_memory, in_words, time_in_words
from wavetank.physics.neighbors import MAX_ENTRIES, list_room
from wavetank.physics.pressure.grid import OPEN_CELLS, bytes_per_node, count_nodes
from wavetank.scene.scene import Scene

SCRATCH = 12  # numbers of `Temporaries` for each particle
PER_PARTICLE = 2.0e-7  # s of a step of one thread, at the least
PER_STEP = 1.0e-4  # s, however few particles
LONGEST = 3600.0  # s: largest expected time of a run without `large_worlds_allowed`
_allowed = False


@contextlib.contextmanager
def large_worlds_allowed(allowed: bool = True) -> Iterator[None]:
    """Allow worlds that need more memory than is free, and runs of more than an hour, within this context."""
    global _allowed
    before, _allowed = _allowed, allowed
    try:
        yield
    finally:
        _allowed = before


@dataclasses.dataclass(frozen=True)
class Cost:
    """Size of a world and the memory that it needs."""

    particles: int
    nodes: int  # of the tank's grid
    bytes: int

    def sentence(self) -> str:
        """Return it as a sentence for people."""
        return (
            f"{self.particles:,} particles and {self.nodes:,} cells of the tank need {in_words(self.bytes)} of memory"
        )


def cost_of(scene: Scene, capacity: int | None = None) -> Cost:
    """Return the cost of a world of `scene` for `capacity` particles; where None, as many as its fluids have."""
    dim = scene.dim
    estimate = sum(fluid.estimate(scene.spacing) for fluid in scene.fluids)
    particles = int(min(estimate, 1e18)) if capacity is None else capacity
    own = 2 * (4 * dim + 5) + SCRATCH + 2 + 1 + -(-list_room(dim, scene.support) // 8)
    cells = 2 * max(4 * particles, 4096)
    host = 6 * dim if capacity is None else 2 * dim  # positions in double precision while they are chosen
    h = scene.support * scene.spacing
    nodes = count_nodes(scene.tank.beyond(OPEN_CELLS * h), h, scene.tank.periods().axes) if scene.tank else 0
    return Cost(particles, nodes, 4 * (particles * (own + host) + cells) + nodes * bytes_per_node())


def check_cost(scene: Scene, capacity: int | None = None) -> None:
    """Raise `WavetankError` for a world with too many cells, or that needs more memory than is free."""
    cost = cost_of(scene, capacity)
    if cost.nodes * 16 > MAX_ENTRIES:
        raise WavetankError(
            f"spacing = {scene.spacing:g} divides the tank into {cost.nodes:,} cells; at most {MAX_ENTRIES // 16:,} "
            "are possible: use a larger spacing or a smaller tank."
        )
    free = free_memory()
    if free is not None and cost.bytes > SHARE * free and not _allowed:
        raise WavetankError(
            f"{cost.sentence()}, and {in_words(free)} are free: use a larger spacing, or --allow-large "
            "(`with wavetank.large_worlds_allowed():`) to try it all the same."
        )


@functools.cache
def processors() -> int:
    """Return the number of processors; asking the system takes as long as a kernel launch, so it is cached."""
    return os.cpu_count() or 1


def expected_seconds(particles: int, scene: Scene, seconds: float) -> float:
    """Return a lower bound of the time [s] that `seconds` of water take to compute."""
    steps = scene.substeps * seconds / scene.frame_time
    threads = compiler.threads() or 64
    return steps * (PER_STEP + particles * PER_PARTICLE / min(threads, processors()))


def check_time(particles: int, scene: Scene, seconds: float, what: str) -> None:
    """Raise `WavetankError` for `seconds` of water that take more than an hour, unless that is allowed."""
    expected = expected_seconds(particles, scene, seconds)
    if expected > LONGEST and not _allowed:
        raise WavetankError(
            f"{what} is {time_in_words(seconds)} of {particles:,} particles and will take {time_in_words(expected)} or "
            "more; --allow-large (`with wavetank.large_worlds_allowed():`) begins it all the same."
        )


def check_frames(particles: int, scene: Scene, seconds: float, fps: float) -> None:
    """Raise `WavetankError` for a time [s] or rate [1/s] that is not finite, and for what takes more than an hour."""
    if finite("fps", fps, 0.0) == 0.0:
        raise WavetankError("fps = 0 is not allowed; it must be a positive number.")
    finite("seconds", seconds, 0.0)
    work = max(seconds, 0.05 * seconds * fps * scene.frame_time)  # a frame is work, however short
    check_time(particles, scene, work, f"frames({seconds:g}, {fps:g})")

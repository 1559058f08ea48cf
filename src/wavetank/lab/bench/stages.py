"""Where the time of a frame goes: a clock around every kernel, summed by the file that the kernel lives in.

The clock waits for the device before and after each launch, so watched frames are slower than others and are never
used for a total. What is left of a watched frame is the host's: Python between the launches.
"""

import collections
import contextlib
import dataclasses
import functools
import time
from collections.abc import Callable, Iterator
from typing import Any

from wavetank.device import compiler

#: Stages and the modules, or packages of them, whose kernels they are. There is no rest: a kernel that has moved must
#: not count as something else unnoticed.
STAGES: dict[str, tuple[str, ...]] = {
    "contact": (
        "wavetank.physics.broad_phase",
        "wavetank.physics.contact",
        "wavetank.physics.retry",
        "wavetank.physics.near_solids",
    ),
    "neighbours": ("wavetank.physics.sorting", "wavetank.physics.neighbors", "wavetank.physics.pairs"),
    "grid": ("wavetank.physics.pressure",),
    "constraint": ("wavetank.physics.density_constraint",),
    "velocities": (
        "wavetank.physics.integrate",
        "wavetank.physics.mixture",
        "wavetank.physics.population",
        "wavetank.physics.terms",
    ),
    "foam": ("wavetank.physics.foam",),
    "time step": ("wavetank.physics.time_step",),
    "render": ("wavetank.view",),
    "other": ("wavetank.physics.forces", "wavetank.session.tools", "wavetank.solids", "wavetank.lab", "quadrants"),
}
#: In the order of a frame, as tables show them.
STAGE_NAMES = ("contact", "neighbours", "grid", "constraint", "velocities", "foam", "time step", "other", "host")


@functools.cache
def stage_of(module: str) -> str:
    """Name the stage of a kernel that lives in `module`; raises `LookupError` where none is declared."""
    parents = {module[:end] for end in (*(k for k, sign in enumerate(module) if sign == "."), len(module))}
    for stage, homes in STAGES.items():
        if parents & {*homes}:
            return stage
    raise LookupError(
        f"kernels of {module} belong to no stage; say to which in STAGES of wavetank/lab/bench/stages.py."
    )


@dataclasses.dataclass
class Clock:
    """Seconds and launches of each kernel, by (stage, name of the kernel)."""

    seconds: collections.defaultdict[tuple[str, str], float] = dataclasses.field(
        default_factory=lambda: collections.defaultdict(float)
    )
    launches: collections.Counter[tuple[str, str]] = dataclasses.field(default_factory=collections.Counter)

    @contextlib.contextmanager
    def running(self) -> Iterator[None]:
        """Time every kernel while the context lasts; the time between kernels is the host's."""

        def around(module: str, name: str, launch: Callable[[], Any]) -> Any:
            compiler.synchronize()
            began = time.perf_counter()
            result = launch()
            compiler.synchronize()
            key = stage_of(module), name
            self.seconds[key] += time.perf_counter() - began
            self.launches[key] += 1
            return result

        began, before = time.perf_counter(), sum(self.seconds.values())
        with compiler.watched(around):
            yield
        elapsed = time.perf_counter() - began
        self.seconds["host", ""] += elapsed - (sum(self.seconds.values()) - before)

    def stages(self) -> dict[str, float]:
        """Return the seconds of each stage."""
        total: dict[str, float] = dict.fromkeys(STAGE_NAMES, 0.0)
        for (stage, _), seconds in self.seconds.items():
            total[stage] = total.get(stage, 0.0) + seconds
        return total

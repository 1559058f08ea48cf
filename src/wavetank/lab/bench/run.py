"""What `wavetank bench` does with its options: which measurement, which tables."""

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rich.table import Table

from wavetank.foundation.errors import WavetankError
from wavetank.lab.bench.scenes import SCENES, SIZES, bench
from wavetank.lab.bench.startup import start_up
from wavetank.lab.bench.tables import comparison_table, figures_table, load_result, save_result, start_table

__all__ = ["Order", "perform", "save_result"]

SECONDS = 0.5


@dataclasses.dataclass(frozen=True)
class Order:
    """The options as they were given."""

    scenes: list[str]
    sizes: str
    seconds: float | None
    repeats: int
    threads: int | None
    roofline: bool
    search: bool
    bodies: bool
    start_up: bool
    compare: Path | None
    arch: str


def perform(order: Order, say: Callable[[str], None]) -> tuple[dict[str, Any], list[Table]]:
    """Measure what was ordered; return the figures as plain data, and tables that show them.

    Raises `WavetankError` for options that do not go together or are out of range.
    """
    kinds = order.roofline + order.search + order.bodies + (order.compare is not None)
    if kinds > 1:
        raise WavetankError("--roofline, --search, --bodies and --compare are four things; give one of them.")
    names, sizes = split(order.scenes, order.sizes)
    if order.bodies:
        return _bodies(order, names, sizes, say)
    if order.search:
        from wavetank.lab.bench import search

        if names:
            raise WavetankError(
                "--search compares neighbour searches on lattices of its own; give sizes, but no scene."
            )
        result = search.search(
            sizes or search.SIZES, arch=order.arch, repeats=order.repeats, threads=order.threads, say=say
        )
        return result, [search.search_table(result)]
    if order.roofline:
        from wavetank.lab.bench.roofline import roofline, roofline_table

        result = roofline(
            names[0] if names else SCENES[0],
            sizes[0] if sizes else SIZES[-1],
            arch=order.arch,
            seconds=0.2 if order.seconds is None else order.seconds,
            repeats=order.repeats,
            threads=order.threads,
            say=say,
        )
        return result, roofline_table(result)
    earlier = load_result(order.compare) if order.compare else None
    result = bench(
        names or SCENES,
        sizes or SIZES,
        arch=order.arch,
        seconds=SECONDS if order.seconds is None else order.seconds,
        repeats=order.repeats,
        threads=order.threads,
        say=say,
    )
    tables = [figures_table(result)]
    if order.start_up:
        say("start-up: a cold process, then warm ones")
        result["start_up"] = start_up(order.arch)
        tables.append(start_table(result["start_up"]))
    if earlier is not None:
        tables.append(comparison_table(earlier, result))
    return result, tables


def split(words: list[str], sizes: str) -> tuple[list[str], list[int]]:
    """Return names of scenes and sizes; a bare whole number among the words is one more size."""
    numbers = [part for part in sizes.replace(",", " ").split() if part]
    for number in numbers:
        if not number.isdigit():
            raise WavetankError(f"--sizes = {sizes!r} is not allowed; write whole numbers, as in --sizes 10000,100000.")
    more = [word for word in words if word.isdigit()]
    return [word for word in words if not word.isdigit()], [int(number) for number in [*numbers, *more]]


def _bodies(
    order: Order, names: list[str], sizes: list[int], say: Callable[[str], None]
) -> tuple[dict[str, Any], list[Table]]:
    from wavetank.lab.bench import bodies

    if names or len(sizes) > 1:
        raise WavetankError("--bodies measures a pool of its own; give no scene, and at most one of --sizes.")
    result = bodies.bodies(
        sizes[0] if sizes else bodies.PARTICLES,
        seconds=bodies.SECONDS if order.seconds is None else order.seconds,
        arch=order.arch,
        threads=order.threads,
        say=say,
    )
    return result, [bodies.bodies_table(result)]

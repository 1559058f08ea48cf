"""How a kernel walks over a picture: strips of a row, one after the other in one thread.

A thread that has a strip to itself does once what all pixels of it share. Processors get a contiguous part of a
kernel's tasks each, one half of the picture where there are two; so rows are dealt out in turns, because the lower
half, where the water is, takes longer. Graphics processors want many threads: there a strip is one pixel, or what
shares something in it.
"""

import dataclasses
import functools
import math
from typing import Any

from wavetank.device.compiler import qd, threads

LEAST_TASKS = 512  # that the compiler gives to a processor's thread, whatever they cost
WHOLE = 96  # a strip is as wide as eight pixels of 1 to 4 samples: what these share depends on no thread


@dataclasses.dataclass(frozen=True, eq=False)
class Strips:
    """Strips of one picture, on the device."""

    count: qd.i32  # tasks; some of the last may lie below the picture
    parts: qd.i32  # strips in a row
    width: qd.i32  # px
    turns: qd.i32  # threads that take turns
    run: qd.i32  # rows of each


def strips_of(array: Any, together: int = 1, tall: int = 1) -> Strips:
    """Return the strips of a device array [rows, columns, ...]; so many columns share something and stay together, and
    a strip is that many rows `tall`.
    """
    return _strips(int(array.shape[0]) // tall, int(array.shape[1]), threads(), together)


@functools.lru_cache(maxsize=64)
def _strips(rows: int, columns: int, turns: int, together: int) -> Strips:
    if turns == 0:
        parts = math.ceil(columns / together)
        return Strips(count=rows * parts, parts=parts, width=together, turns=1, run=rows)
    parts = min(columns, math.ceil(LEAST_TASKS * turns / rows)) if turns > 1 else 1
    width = min(WHOLE * math.ceil(columns / parts / WHOLE), columns)
    parts, run = math.ceil(columns / width), math.ceil(rows / turns)
    return Strips(count=run * turns * parts, parts=parts, width=width, turns=turns, run=run)


@qd.func
def strip(strips: Strips, task, rows, columns):
    """(row, first column, column after the last) of a task; no columns where there is no such row."""
    number = task // strips.parts
    row = number % strips.run * strips.turns + number // strips.run
    first = (task - number * strips.parts) * strips.width
    last = qd.min(first + strips.width, columns)
    if row >= rows:
        last = first
    return row, first, last

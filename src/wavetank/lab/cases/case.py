"""What a case of `wavetank validate` is made of, and what several of them measure."""

import csv
import dataclasses
import importlib.resources
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

Series = Mapping[str, Sequence[float]]


@dataclasses.dataclass(frozen=True)
class Figure:
    """A measured number, what it should be and who says so. Without bounds it is for information only."""

    name: str
    value: float
    unit: str
    low: float | None = None
    high: float | None = None
    reference: str = ""
    source: str = ""

    @property
    def passed(self) -> bool | None:
        """Return whether the value is within its bounds; None if it has none."""
        if self.low is None and self.high is None:
            return None
        low = -math.inf if self.low is None else self.low
        high = math.inf if self.high is None else self.high
        return math.isfinite(self.value) and bool(low <= self.value <= high)

    def as_dict(self) -> dict[str, Any]:
        """Return plain data for JSON; a number that is not finite becomes None."""
        return {
            "name": self.name,
            "value": float(self.value) if math.isfinite(self.value) else None,
            "unit": self.unit,
            "low": self.low,
            "high": self.high,
            "reference": self.reference,
            "source": self.source,
            "pass": self.passed,
        }


@dataclasses.dataclass(frozen=True)
class Outcome:
    """What a run of a case gives: figures, the columns of its table, and a function that draws into a plot."""

    figures: list[Figure]
    series: Series
    draw: Callable[[Any], None]


@dataclasses.dataclass(frozen=True)
class Case:
    """An experiment with a known answer; `run(quick, arch)` performs it."""

    name: str
    title: str
    run: Callable[[bool, str], Outcome]
    is_long: bool = False  # takes half an hour, unless quick: run where it is named


def measured(name: str) -> dict[str, np.ndarray]:
    """Read the columns of a table in `data/`, whose lines of comment name their source."""
    text = (importlib.resources.files("wavetank.lab.cases") / "data" / name).read_text("utf-8")
    rows = list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))
    return {key: np.array([float(row[key]) for row in rows]) for key in rows[0]}


def columns(name: object, **rows: np.ndarray) -> dict[str, Sequence[float]]:
    """Return columns of a case's table, one for each of the `rows`, as KEY_NAME."""
    return {f"{key}_{name}": row.tolist() for key, row in rows.items()}


def surface(x: np.ndarray, spacing: float, size: Sequence[float]) -> np.ndarray:
    """Return the height [m] of the topmost particle and half a spacing, for each column two spacings wide.

    Columns without a particle count as height 0, float64 [columns].
    """
    across = [axis for axis in range(x.shape[1]) if axis != 1]
    counts = [max(1, round(size[axis] / (2.0 * spacing))) for axis in across]
    column = np.zeros(len(x), int)
    for axis, count in zip(across, counts, strict=True):
        place = np.floor(x[:, axis] / size[axis] * count).astype(int)
        column = column * count + np.clip(place, 0, count - 1)
    height = np.zeros(math.prod(counts))
    np.maximum.at(height, column, x[:, 1] + 0.5 * spacing)
    return height

"""A number or vector over time as plain data: constant, expressions, or keyframes.

    5.0                                     constant
    "3 + 2*sin(2*pi*t)"                     an expression of t [s], see `expressions.py`
    ["0.2*sin(t)", -9.81, 0]                one for each component
    [{time=0, value=2.0}, {time=1.5, value=0.0}]                     keyframes, straight lines between them, then held
    {keyframes=[...], between="smooth", after="loop"}                the same, chosen

Smooth keyframes are joined by monotone cubics, which do not overshoot: Fritsch and Carlson 1980, doi:10.1137/0717021,
with the slopes of Fritsch and Butland 1984, doi:10.1137/0905021.
"""

import functools
import itertools
import json
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from wavetank.foundation.errors import WavetankError
from wavetank.foundation.expressions import expression

BETWEEN, AFTER = ("linear", "smooth"), ("hold", "loop")
MOST_KEYFRAMES = 100_000
Track = Callable[[float], np.ndarray]  # of the time [s]


class Keys:
    """Values [k, n] at rising times [s]; before the first and after the last they hold, or repeat."""

    def __init__(
        self, times: Sequence[float], values: np.ndarray, between: str = "linear", after: str = "hold"
    ) -> None:
        self.times, self.values = np.array(times, float), np.array(values, float)
        self.between, self.after = between, after
        self._slopes = _slopes(self.times, self.values) if between == "smooth" else None

    def __call__(self, time: float) -> np.ndarray:
        """Return the value at `time` [s], shape [n]."""
        section, share, _ = self.place(time)
        a, b = self.values[section], self.values[min(section + 1, len(self.values) - 1)]
        if self._slopes is None or share in (0.0, 1.0):
            return a + share * (b - a)
        step, s = self.times[section + 1] - self.times[section], share
        m, n = step * self._slopes[section], step * self._slopes[section + 1]
        bend = s * (1.0 - s) * ((1.0 - s) * m - s * n) + s * s * (3.0 - 2.0 * s) * (b - a)
        return np.asarray(a + bend)

    def place(self, time: float) -> tuple[int, float, int]:
        """Return the keyframe before `time` [s], the share of the way to the next, and how many loops have passed."""
        first, last = float(self.times[0]), float(self.times[-1])
        loops = 0
        if self.after == "loop" and time > last > first:
            loops = math.floor((time - first) / (last - first))
            time -= loops * (last - first)
        if time <= first or len(self.times) == 1:
            return 0, 0.0, loops
        if time >= last:
            return len(self.times) - 2, 1.0, loops
        section = int(np.searchsorted(self.times, time, side="right")) - 1
        return section, (time - self.times[section]) / (self.times[section + 1] - self.times[section]), loops


def _slopes(times: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Slopes [k, n] at the keyframes, zero at the ends and wherever the values turn back."""
    slopes = np.zeros_like(values)
    if len(times) > 2:
        step = np.diff(times)[:, None]
        secant = np.diff(values, axis=0) / step
        a, b = secant[:-1], secant[1:]
        w = (step[:-1] + 2.0 * step[1:]) / (3.0 * (step[:-1] + step[1:]))
        same = a * b > 0.0
        slopes[1:-1] = np.where(same, a * b / np.where(same, w * b + (1.0 - w) * a, 1.0), 0.0)
    return slopes


def check_times(times: Sequence[float], what: str) -> None:
    """Raise `WavetankError` where keyframes are missing, too many, or not in order."""
    if not 1 <= len(times) <= MOST_KEYFRAMES:
        raise WavetankError(f"{what} has {len(times)} keyframes; 1 to {MOST_KEYFRAMES:,} are allowed.")
    for number, (before, time) in enumerate(itertools.pairwise(times), 1):
        if not time > before:
            raise WavetankError(
                f"{what}: keyframe {number} is at time = {time:g} s and the one before it at {before:g} s; "
                "times must rise, so put the keyframes in order."
            )


def varies(plain: Any) -> bool:
    """Return whether plain data, where a number or a vector is expected, changes with time."""
    if isinstance(plain, list | tuple):
        return any(isinstance(part, str | dict) for part in plain)
    return isinstance(plain, str | dict)


def checked_track(plain: Any, what: str, size: int | None = None) -> Any:
    """Return the plain form of a track of `size` components (None: one number), as TOML and JSON hold it.

    Raises `WavetankError` in one sentence that begins with `what`.
    """
    if callable(plain):
        raise WavetankError(
            f"{what} is a Python function, which a file cannot hold; write an expression such as '0.3*sin(2*pi*t)', "
            "or keyframes, which wt.sampled(function, seconds) makes of it."
        )
    try:
        tidy = _tidy(plain)
        value = track(tidy)(0.0)
    except WavetankError as error:
        raise WavetankError(f"{what}: {error}") from None
    if value.shape != (() if size is None else (size,)):
        asked = "one number" if size is None else f"{size} numbers"
        given = "one number" if not value.shape else f"{value.shape[0]} numbers"
        raise WavetankError(f"{what} gives {given}; it must give {asked}.")
    return tidy


def track(plain: Any) -> Track:
    """Return the function of time that plain data describes; raises `WavetankError` for other data."""
    return _track(json.dumps(plain))


@functools.lru_cache(maxsize=1024)
def _track(text: str) -> Track:
    plain = json.loads(text)
    if isinstance(plain, list) and plain and all(isinstance(part, dict) for part in plain):
        plain = {"keyframes": plain}
    if isinstance(plain, dict):
        return _keyed(plain)
    if isinstance(plain, list) and plain:
        parts = [_number(part) for part in plain]
        return lambda time: np.array([part(time) for part in parts])
    only = _number(plain)
    return lambda time: np.array(only(time))


def _keyed(plain: dict[str, Any]) -> Track:
    unknown = next((key for key in plain if key not in ("keyframes", "between", "after")), None)
    if unknown is not None or not isinstance(plain.get("keyframes"), list):
        raise WavetankError(f"unknown key {unknown!r}; a track has keyframes, between and after.")
    for key, allowed in (("between", BETWEEN), ("after", AFTER)):
        if plain.get(key, allowed[0]) not in allowed:
            raise WavetankError(f"{key} = {plain[key]!r} is not allowed; it must be one of {', '.join(allowed)}.")
    rows = plain["keyframes"]
    if any(not isinstance(row, dict) or set(row) != {"time", "value"} for row in rows):
        raise WavetankError("every keyframe must be a table with time [s] and value.")
    times = [float(track(row["time"])(0.0)) for row in rows]
    check_times(times, "keyframes")
    values = [track(row["value"])(time) for row, time in zip(rows, times, strict=True)]
    if len({value.shape for value in values}) > 1:
        raise WavetankError("every keyframe must have a value of the same number of components.")
    keys = Keys(
        times,
        np.array([np.atleast_1d(value) for value in values]),
        *(plain.get(key, allowed[0]) for key, allowed in (("between", BETWEEN), ("after", AFTER))),
    )
    return (lambda time: keys(time)) if values[0].shape else (lambda time: np.array(keys(time)[0]))


def _number(plain: Any) -> Callable[[float], float]:
    if isinstance(plain, str):
        return expression(plain)
    if isinstance(plain, bool) or not isinstance(plain, int | float) or not math.isfinite(plain):
        raise WavetankError(f"{str(plain)[:40]} is not a finite number, an expression or keyframes.")
    return lambda time: float(plain)


def scaled(plain: Any, factor: float) -> Any:
    """Return the plain form of a track whose values are `factor` times as large."""
    if isinstance(plain, str):
        return f"{factor!r}*({plain})"
    if isinstance(plain, dict):
        return {key: scaled(part, factor) if key in ("value", "keyframes") else part for key, part in plain.items()}
    if isinstance(plain, list | tuple):
        return [scaled(part, factor) for part in plain]
    return plain * factor


def _tidy(plain: Any) -> Any:
    """Return lists for tuples and arrays, and Python's numbers for NumPy's."""
    if isinstance(plain, np.ndarray | np.generic):
        plain = plain.tolist()
    if isinstance(plain, dict):
        return {str(key): _tidy(part) for key, part in plain.items()}
    if isinstance(plain, list | tuple):
        return [_tidy(part) for part in plain]
    if isinstance(plain, bool) or not isinstance(plain, str | int | float):
        raise WavetankError(f"{str(plain)[:40]} is not a finite number, an expression or keyframes.")
    return plain

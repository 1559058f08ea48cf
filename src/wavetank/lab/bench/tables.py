"""What `wavetank bench` shows and keeps: tables of figures, result files, the ratio of two of them."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rich.table import Table

from wavetank.foundation.atomic_write import atomic_write
from wavetank.foundation.errors import WavetankError
from wavetank.lab.bench.stages import STAGE_NAMES

Figures = dict[str, Any]

#: Figures that a comparison shows: name, where it stands, whether more is better.
COMPARED: tuple[tuple[str, tuple[str, ...], bool], ...] = (
    ("ms per frame", ("milliseconds_per_frame", "median"), False),
    *((f"  {name} ms", ("stages", name, "median"), False) for name in (*STAGE_NAMES, "render")),
    ("particle-iterations/s", ("particle_iterations_per_second", "median"), True),
    ("pairs/s", ("pairs_per_second", "median"), True),
    ("s of water per s", ("water_per_second", "median"), True),
    ("density error, mean", ("density_error_mean",), False),
    ("density error, 99 %", ("density_error_p99",), False),
    ("substeps per frame", ("substeps_per_frame",), False),
    ("launches per frame", ("launches_per_frame",), False),
    ("distance tests per particle", ("tests_per_particle",), False),
    ("bytes per particle", ("bytes_per_particle",), False),
)


def figures_table(result: Figures) -> Table:
    """Return one column for each run."""
    table = Table("", *(f"{run['scene']}\n{run['particles']:,}" for run in result["runs"]))
    rows: list[tuple[str, Callable[[Figures], str]]] = [
        ("ms per frame", lambda run: _spread(run["milliseconds_per_frame"])),
        *((f"  {name}", _stage(name)) for name in STAGE_NAMES),
        ("a picture", _stage("render")),
        ("substeps x iterations per frame", lambda run: f"{run['substeps_per_frame']:.1f} x {run['iterations']}"),
        ("launches per frame", lambda run: f"{run['launches_per_frame']:.0f}"),
        ("M particle-iterations/s", lambda run: _spread(run["particle_iterations_per_second"], 1e-6)),
        ("M pairs/s in the constraint", lambda run: _spread(run["pairs_per_second"], 1e-6, 0)),
        (
            "neighbours; tests per particle",
            lambda run: f"{run['pairs_per_particle']:.1f}; {run['tests_per_particle']:.1f}",
        ),
        ("s of water per s", lambda run: _spread(run["water_per_second"], 1.0, 3)),
        (
            "density error: mean; 99 %",
            lambda run: f"{100 * run['density_error_mean']:.2f} %; {100 * run['density_error_p99']:.2f} %",
        ),
        ("bytes per particle", lambda run: f"{run['bytes_per_particle']:.0f}"),
    ]
    for name, cell in rows:
        table.add_row(name, *(cell(run) for run in result["runs"]))
    return table


def start_table(times: dict[str, float]) -> Table:
    """Return the start-up times [s]."""
    table = Table("start-up, obstacle-tank", "s")
    for name, seconds in times.items():
        table.add_row(name.replace("_", " "), f"{seconds:.2f}")
    return table


def comparison_table(old: Figures, new: Figures) -> Table:
    """Return old, new and new / old of every run that both results have; a star marks what got worse by over 5 %."""
    table = Table("run", "figure", "old", "new", "new / old")
    before = {_key(old, run): run for run in old["runs"]}
    if not before.keys() & {_key(new, run) for run in new["runs"]}:
        known = ", ".join(f"{scene} {size:,} on {arch}" for scene, size, arch in before) or "none"
        table.add_row("no run in common", f"the old result has: {known}")
    for run in new["runs"]:
        earlier = before.get(_key(new, run))
        if earlier is None:
            continue
        title = f"{run['scene']} {run['particles']:,} {new['machine']['arch']}"
        for name, place, more_is_better in COMPARED:
            was, now = _at(earlier, place), _at(run, place)
            if was is None or now is None or not was:
                continue
            ratio = now / was
            worse = ratio < 0.95 if more_is_better else ratio > 1.05
            table.add_row(title, name, _number(was), _number(now), f"{ratio:.3f}{' *' if worse else ''}")
            title = ""
    for name, now in new.get("start_up", {}).items():
        was = old.get("start_up", {}).get(name)
        if was:
            table.add_row("start-up", name.replace("_", " "), f"{was:.2f}", f"{now:.2f}", f"{now / was:.3f}")
    return table


def load_result(path: Path) -> Figures:
    """Read a file that `wavetank bench --out` wrote; raise `WavetankError` for any other file."""
    try:
        result = json.loads(path.read_text("utf-8"))
        if not isinstance(result["runs"], list) or not isinstance(result["machine"], dict):
            raise TypeError("no runs")
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise WavetankError(
            f"--compare {path}: this is not a result of `wavetank bench --out FILE`: {_reason(error)}."
        ) from None
    return result


def _reason(error: Exception) -> str:
    missing = f"no {error}" if isinstance(error, KeyError) else str(error)
    return (isinstance(error, OSError) and error.strerror) or missing


def save_result(result: Figures, path: Path) -> None:
    """Write a result, complete or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_write(path) as partial:
        partial.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")


def _key(result: Figures, run: Figures) -> tuple[str, int, str]:
    return run["scene"], run["size"], result["machine"]["arch"]


def _at(run: Figures, place: tuple[str, ...]) -> float | None:
    value: Any = run
    for key in place:
        value = value.get(key) if isinstance(value, dict) else None
    return value


def _stage(name: str) -> Callable[[Figures], str]:
    return lambda run: _spread(run["stages"][name])


def _spread(values: dict[str, float], factor: float = 1.0, digits: int = 2) -> str:
    low, middle, high = (factor * values[key] for key in ("low", "median", "high"))
    return f"{middle:.{digits}f} [{low:.{digits}f}, {high:.{digits}f}]"


def _number(value: float) -> str:
    return f"{value:.4g}" if abs(value) < 1e5 else f"{value:.3e}"

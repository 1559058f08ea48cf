"""Experiments with a known answer: run them, compare, write the series and a picture of each."""

import csv
import itertools
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from wavetank.foundation.atomic_write import make_folder
from wavetank.foundation.errors import WavetankError
from wavetank.lab.cases import CASES
from wavetank.lab.cases.case import Case, Figure, Outcome
from wavetank.lab.cases.known import known
from wavetank.lab.plots import pyplot


def validate(
    names: Sequence[str] = (),
    *,
    quick: bool = False,
    out: Path | None = None,
    arch: str = "cpu",
    console: Console | None = None,
) -> dict[str, Any]:
    """Run the named cases, or all but the long ones, and return {"cases": {name: {...}}, "passed": n, "failed": n}.

    `quick` takes coarser or shorter runs with bounds of their own. With `out`, each case leaves a table and a picture
    in a folder of its own there.
    """
    chosen = [case_named(name) for name in names] or [case for case in CASES if quick or not case.is_long]
    plt = pyplot() if out is not None else None
    console = console or Console(quiet=True)
    cases: dict[str, Any] = {}
    for case in chosen:
        with console.status(f"{case.name}: {case.title}"):
            began = time.perf_counter()
            outcome = case.run(quick, arch)
            seconds = time.perf_counter() - began
        if out is not None:
            _write(out / case.name, case, outcome, plt)
        cases[case.name] = {
            "title": case.title,
            "figures": [_told(case, figure, quick) for figure in outcome.figures],
            "seconds_of_machine": round(seconds, 2),
        }
    verdicts = [figure["pass"] for case in cases.values() for figure in case["figures"]]
    return {"cases": cases, "passed": verdicts.count(True), "failed": verdicts.count(False)}


def _told(case: Case, figure: Figure, quick: bool) -> dict[str, Any]:
    """Return a figure as plain data, with what is known about one of a quick run that does not pass."""
    why = known(case.name, figure.name, figure.value) if quick and figure.passed is False else ""
    return figure.as_dict() | ({"known": why} if why else {})


def case_named(name: str) -> Case:
    """Return the case of that name; raises `WavetankError` if there is none."""
    for case in CASES:
        if case.name == name:
            return case
    raise WavetankError(f"there is no case named {name!r}; cases are: {', '.join(case.name for case in CASES)}.")


def out_of_bounds(result: dict[str, Any]) -> list[str]:
    """Name every figure of a result that does not pass; of those that are known say why in brackets."""
    return [
        f"{name}: {figure['name']}" + (f" (known: {figure['known']})" if figure.get("known") else "")
        for name, case in result["cases"].items()
        for figure in case["figures"]
        if figure["pass"] is False
    ]


def table(result: dict[str, Any]) -> Table:
    """Lay a result out for the terminal."""
    rows = Table("case", "figure", "value", "to reach", "reference", "source", "")
    for name, case in result["cases"].items():
        for number, figure in enumerate(case["figures"]):
            failed = "[yellow]known[/yellow]" if figure.get("known") else "[bold red]fail[/bold red]"
            verdict = {True: "[green]pass[/green]", False: failed, None: ""}[figure["pass"]]
            rows.add_row(
                name if number == 0 else "",
                figure["name"],
                number_text(figure["value"], figure["unit"]),
                bounds_text(figure),
                figure["reference"],
                figure["source"],
                verdict,
            )
        rows.add_section()
    return rows


def number_text(value: float | None, unit: str) -> str:
    """Write a value with its unit."""
    return "not finite" if value is None else f"{value:.4g} {unit}".rstrip()


def bounds_text(figure: dict[str, Any]) -> str:
    """Write the bounds of a figure, nothing where there are none."""
    low, high = figure["low"], figure["high"]
    if low is None and high is None:
        return ""
    if low is None:
        return f"<= {high:g}"
    return f">= {low:g}" if high is None else f"{low:g}" if low == high else f"{low:g} .. {high:g}"


def _write(folder: Path, case: Case, outcome: Outcome, plt: Any) -> None:
    make_folder(folder)
    with (folder / f"{case.name}.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(outcome.series)
        # Columns of a case may be of different lengths, where one is measured and another computed.
        writer.writerows(itertools.zip_longest(*outcome.series.values(), fillvalue=""))
    plot = plt.figure(figsize=(10, 4.4), layout="constrained")
    outcome.draw(plot)
    plot.suptitle(f"{case.title}: {_summary(outcome.figures)}", fontsize=11)
    plot.savefig(folder / f"{case.name}.png", dpi=110)
    plt.close(plot)


def _summary(figures: list[Figure]) -> str:
    verdicts = [figure.passed for figure in figures if figure.passed is not None]
    return f"{verdicts.count(True)} of {len(verdicts)} figures within bounds"

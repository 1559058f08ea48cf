"""Commands that measure: converge, validate, bench, doctor."""

import sys
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Column, Table

from wavetank import Scene, WavetankError
from wavetank.cli.options import Arch, Json, Plain, SceneName, app, console
from wavetank.foundation.json_text import json_text

CASE_NAMES = (
    "buckling, buoyancy, calm-vorticity, coiling, column, creep, cup, drop, elliptical-drop, emitter, energy, "
    "frame-rate, gate, gravity-current, heave, hull, jurin, layers, lobovsky, lock-exchange, martin-moyce, "
    "momentum, nusselt-film, pipe, plates, rayleigh-taylor, resolution, resonance, rest, scale, seeds, shear-wave, "
    "solids-at-rest, standing-wave, still-tank, submerged-inlet, tension-drop, torricelli, u-tube, vortex, "
    "water-entry, weir"
)
Cases = Annotated[list[str], typer.Argument(metavar="[CASE]...", help=f"{CASE_NAMES}; not rest, creep without one.")]


@app.command()
def converge(
    scene: SceneName = "obstacle-tank",
    out: Annotated[Path, typer.Option(help="Folder for the plots and tables.")] = Path("out"),
    seconds: Annotated[float, typer.Option(help="Seconds of water of each run.")] = 2.0,
    iterations: Annotated[int, typer.Option(help="Iterations to show within a step.")] = 20,
    arch: Arch = "cpu",
    as_json: Json = False,
) -> None:
    """Plot largest and mean density over iterations and steps, for the preset paper and the default."""
    from wavetank.lab.converge import converge as study

    result = study(Scene.load(scene), out, seconds=seconds, iterations=iterations, arch=arch, console=console)
    if as_json:
        print(json_text(result))
    else:
        for path in result["files"]:
            print(path)


@app.command(cls=Plain)
def validate(
    cases: Cases = [],  # noqa: B006
    quick: Annotated[bool, typer.Option("--quick", help="Coarser and shorter runs with bounds of their own.")] = False,
    out: Annotated[Path | None, typer.Option(help="Folder for a picture and a table of each case.")] = None,
    arch: Arch = "cpu",
    as_json: Json = False,
) -> None:
    """Compare with measurements and exact solutions; exit code 1 if a figure is out of its bounds."""
    from wavetank.lab.validate import out_of_bounds, table
    from wavetank.lab.validate import validate as compare

    result = compare(cases, quick=quick, out=out, arch=arch, console=console)
    if as_json:
        print(json_text(result))
    else:
        Console(width=None if sys.stdout.isatty() else 150).print(table(result))
    if wrong := out_of_bounds(result):
        total, known = result["passed"] + result["failed"], sum("(known: " in figure for figure in wrong)
        news = f", {'all' if known == len(wrong) else known} of them known" if known else ""
        raise WavetankError(f"{len(wrong)} of {total} figures are out of their bounds{news}: {'; '.join(wrong)}.")


@app.command(cls=Plain)
def bench(
    scenes: Annotated[
        list[str], typer.Argument(metavar="[SCENE]... [SIZE]...", help="Scenes, and further sizes.")
    ] = [],  # noqa: B006
    sizes: Annotated[str, typer.Option(help="Numbers of particles, as in 10000,100000.")] = "",
    seconds: Annotated[float | None, typer.Option(help="Seconds of water of each run [0.5].")] = None,
    repeats: Annotated[int, typer.Option(help="Passes over which medians are taken, 2 or more.")] = 3,
    threads: Annotated[int | None, typer.Option(min=1, max=1024, help="Threads on the CPU; by default all.")] = None,
    roofline: Annotated[
        bool, typer.Option("--roofline", help="Compare each kernel with the limits of this machine.")
    ] = False,
    search: Annotated[bool, typer.Option("--search", help="Compare the neighbour search with a k-d tree.")] = False,
    bodies: Annotated[
        bool, typer.Option("--bodies", help="Compare a pool with itself when fifty bodies rain into it.")
    ] = False,
    start_up: Annotated[bool, typer.Option(help="Measure the start of a fresh process too.")] = True,
    out: Annotated[Path | None, typer.Option(help="Write the result to this JSON file.")] = None,
    compare: Annotated[Path | None, typer.Option(metavar="OLD.json", help="Print ratios to an earlier result.")] = None,
    arch: Arch = "cpu",
    as_json: Json = False,
) -> None:
    """Measure milliseconds per stage, rates, start-up; compare with an earlier run, the machine's ceilings."""
    from wavetank.lab.bench import run as bench_run

    order = bench_run.Order(
        scenes=scenes,
        sizes=sizes,
        seconds=seconds,
        repeats=repeats,
        threads=threads,
        roofline=roofline,
        search=search,
        bodies=bodies,
        start_up=start_up,
        compare=compare,
        arch=arch,
    )
    result, tables = bench_run.perform(order, console.print)
    if out is not None:
        bench_run.save_result(result, out)
    for table in tables:
        Console(width=None if sys.stdout.isatty() else 150).print(table)
    if as_json:
        print(json_text(result))


@app.command()
def doctor(
    compare: Annotated[
        str | None,
        typer.Option(metavar="ARCH", help="Compare water and pictures of the CPU with those of this back end."),
    ] = None,
    as_json: Json = False,
) -> None:
    """Report what is installed, which back ends work, and how to get what is missing."""
    if compare is not None:
        _compare_backends(compare, as_json)
        return
    from wavetank.lab.doctor import examine, told
    from wavetank.page.play import why_no_window

    findings = examine(why_no_window())
    if as_json:
        print(json_text(findings))
        return
    table = Table("what", "found", Column("note", overflow="fold"))
    for row in told(findings["checks"]):
        table.add_row(*(escape(row[key]) for key in ("name", "found", "note")))  # wavetank[window] is not markup
    Console().print(table)


def _compare_backends(arch: str, as_json: bool) -> None:
    from wavetank.lab import backends

    with console.status(f"the same water on cpu and {arch}"):
        result = backends.compare(arch)
    if as_json:
        print(json_text(result))
        return
    table = Table(f"{result['scene']}, {result['particles']:,} particles, {result['seconds']:g} s", "cpu", arch)
    for name, values in {**result["figures"], "mean height, m": result["height"]}.items():
        table.add_row(name, *(f"{value:.4g}" for value in values))
    for view, seen in result["views"].items():
        text = f"{100 * seen['close']:.3f} % within {backends.CLOSE}/255, largest {seen['largest']}"
        table.add_row(f"picture: {view}", "", text)
    Console().print(table)

"""What the commands of this folder share: result files, tables, mistakes as one line."""

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from wavetank.foundation.errors import WavetankError
from wavetank.lab.bench.tables import save_result

Out = Annotated[Path | None, typer.Option(help="Write the result to this JSON file.")]
Json = Annotated[bool, typer.Option("--json", help="Print the result as one JSON object.")]
Seconds = Annotated[float, typer.Option(help="Seconds of each run.")]
Threads = Annotated[int | None, typer.Option(min=1, max=1024, help="Threads on the CPU; all without it.")]

#: tells how far it is, on stderr
say: Callable[[str], None] = Console(stderr=True).print


def report(result: dict[str, Any], table: Table, out: Path | None, as_json: bool) -> None:
    """Print a result as a table, and as JSON where asked; write it to `out` where given."""
    if out is not None:
        save_result(result, out)
    Console(width=None if sys.stdout.isatty() else 150).print(table)
    if as_json:
        print(json.dumps(result))


def run(app: typer.Typer) -> None:
    """Run a command line; a mistake is one line on stderr and exit code 1."""
    try:
        app()
    except WavetankError as error:
        sys.exit(f"benchmarks: {error}")

"""`python -m benchmarks.browser`."""

from typing import Annotated

import typer

from benchmarks.browser import page
from benchmarks.command import Json, Out, Seconds, report, run, say

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)


@app.command()
def browser(
    scene: Annotated[str, typer.Argument(help="A bundled scene, or a file.")] = page.SCENE,
    particles: Annotated[int, typer.Option(help="Number of particles.")] = page.SIZE,
    seconds: Seconds = page.SECONDS,
    arch: Annotated[str, typer.Option(help="Back end of the server.")] = "cpu",
    out: Out = None,
    as_json: Json = False,
) -> None:
    """Measure pictures per second and the delay from a click to the next picture in a headless Chromium."""
    result = page.measure(scene, particles, seconds=seconds, arch=arch, say=say)
    report(result, page.page_table(result), out, as_json)


if __name__ == "__main__":
    run(app)

"""`python -m benchmarks.peers dam` and `python -m benchmarks.peers scenes`."""

from pathlib import Path
from typing import Annotated

import typer

from benchmarks.command import Json, Out, Seconds, Threads, report, run, say
from benchmarks.peers import compare
from benchmarks.peers import scenes as their_scenes

app = typer.Typer(
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    help="Compare with SPlisHSPlasH on the CPU.",
)


@app.command()
def dam(
    pbf_count: Annotated[int, typer.Argument(metavar="[PBF]", help="Particles next to its PBF.")] = 60_000,
    dfsph_count: Annotated[int, typer.Argument(metavar="[DFSPH]", help="Particles next to its DFSPH.")] = 8_000,
    seconds: Seconds = 0.5,
    repeats: Annotated[int, typer.Option(help="Turns that the medians are taken over, 2 or more.")] = 3,
    threads: Threads = None,
    out: Out = None,
    as_json: Json = False,
) -> None:
    """Run the same dam break alternately: work per second (PBF), water per second at equal error (DFSPH)."""
    result = compare.compare_peers(pbf_count, dfsph_count, seconds=seconds, repeats=repeats, threads=threads, say=say)
    report(result, compare.peers_table(result), out, as_json)


@app.command()
def scenes(
    names: Annotated[list[str], typer.Argument(metavar="[SCENE]...", help="Names; five without.")] = [],  # noqa: B006
    pictures: Annotated[Path, typer.Option(help="Folder for the pictures.")] = Path("out/peers"),
    seconds: Seconds = their_scenes.SECONDS,
    threads: Threads = None,
    out: Out = None,
    as_json: Json = False,
) -> None:
    """Run scenes of SPlisHSPlasH with both solvers: pictures next to each other, heights over time."""
    result = their_scenes.compare_scenes(
        names or their_scenes.SCENES, pictures, seconds=seconds, threads=threads, say=say
    )
    report(result, their_scenes.scenes_table(result), out, as_json)


if __name__ == "__main__":
    run(app)

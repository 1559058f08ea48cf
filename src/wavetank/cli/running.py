"""Commands that compute: scenes, run, resume, render."""

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from wavetank import Scene, WavetankError, bundled_scenes
from wavetank.cli.options import (
    AllowLarge,
    Arch,
    ColorBy,
    Cut,
    Environment,
    Exports,
    Floor,
    Json,
    Only,
    Quality,
    Settings,
    Size,
    Sun,
    View,
    app,
    as_text,
    changes_in,
    configured,
    console,
    names_in,
    picture_name,
    say,
    size_of,
)
from wavetank.foundation.json_text import json_text
from wavetank.scene.scene import bundled_levels, scene_schema
from wavetank.scene.summary import bundled_counts, bundled_title


@app.command()
def scenes(
    schema: Annotated[bool, typer.Option("--schema", help="Print the JSON Schema of a scene file.")] = False,
    as_json: Json = False,
) -> None:
    """List the bundled scenes, and the levels with their best scores."""
    if schema:
        print(scene_schema())
        return
    from wavetank.session.scores import scores

    rows, missing = [], []
    for name in bundled_scenes():
        try:
            rows.append((name, Scene.load(name)))
        except WavetankError as error:  # a package that it needs
            missing.append((name, str(error).rpartition(": pip")[2]))
    levels, best = [(name, Scene.load(name)) for name in bundled_levels()], scores()
    if as_json:
        about = {
            name: {"title": s.title, "dim": s.dim, "spacing": s.spacing, "particles": bundled_counts()[name]}
            for name, s in rows
        }
        games = {name: {"title": s.title, "goal": s.goal.text, "best": best.get(name)} for name, s in levels if s.goal}
        print(json_text({**about, "levels": games}))
        return
    table = Table("scene", "title", "world", "particles")
    for name, scene in rows:
        table.add_row(name, scene.title, f"{scene.dim}-D", f"{bundled_counts()[name]:,}")
    for name, command in missing:
        table.add_row(name, bundled_title(name), "", f"{bundled_counts()[name]:,}")
    Console().print(table)
    for name, command in missing:
        print(f"{name}: first pip{command}")
    board = Table("level", "goal", "particles", "stars")
    for name, scene in levels:
        stars = best.get(name, {}).get("stars", 0)
        board.add_row(name, scene.goal.text if scene.goal else "", f"{bundled_counts()[name]:,}", "*" * stars)
    Console().print(board)


@app.command()
def run(
    scene: Annotated[
        str,
        typer.Argument(
            metavar="SCENE|STATE.npz|RUN", help="A bundled scene, a TOML file, a saved state, or another run's folder."
        ),
    ],
    seconds: Annotated[float, typer.Option(help="Seconds of water.")] = 4.0,
    out: Annotated[
        Path | None, typer.Option(help="Folder for the files; by default out/ and the scene's name.")
    ] = None,
    video: Annotated[bool, typer.Option("--video", help="Write an MP4.")] = False,
    gif: Annotated[bool, typer.Option("--gif", help="Write an animated GIF.")] = False,
    frames: Annotated[bool, typer.Option("--frames", help="Write a PNG for each frame.")] = False,
    export: Exports = [],  # noqa: B006
    only: Only = "",
    every: Annotated[int, typer.Option(help="Export every Nth frame only.")] = 1,
    fps: Annotated[float, typer.Option(help="Frames per second of water in video and files.")] = 30.0,
    size: Annotated[
        str, typer.Option(metavar="WIDTHxHEIGHT", help="Size of a picture [px]; by default 1280x720, of a GIF 640x360.")
    ] = "",
    view: View = None,
    color_by: ColorBy = None,
    cut: Cut = None,
    environment: Environment = None,
    sun: Sun = None,
    floor: Floor = None,
    quality: Quality = "draft",
    name: Annotated[str, typer.Option(help="Prefix of file names.")] = "",
    checkpoint_every: Annotated[
        float,
        typer.Option(metavar="SECONDS", help="Write a checkpoint after every so many seconds of water: see resume."),
    ] = 0.0,
    allow_large: AllowLarge = False,
    settings: Settings = [],  # noqa: B006
    at: Annotated[
        float | None, typer.Option(help="Where another run is left [s of water]; by default at its end.")
    ] = None,
    arch: Arch = "cpu",
    as_json: Json = False,
) -> None:
    """Simulate a scene, or go on from a state or another run, and write video, pictures, particles and figures."""
    from wavetank.run.compile_status import compile_status
    from wavetank.run.options import RunOptions
    from wavetank.run.record import record
    from wavetank.run.starting import start_world
    from wavetank.simulation.cost import large_worlds_allowed

    changes, name = changes_in(settings), as_text(name or Path(scene).stem)
    order = RunOptions(
        out or Path("out", name),
        seconds,
        fps,
        size_of(size or "1280x720"),
        name,
        small_gif=not size,
        video=video,
        gif=gif,
        frames=frames,
        exports=names_in(export),
        only=names_in([only]),
        every=every,
        quality=quality,
        look={"view": view, "color_by": color_by, "cut": cut, "environment": environment, "sun": sun, "floor": floor},
        checkpoint_every=checkpoint_every,
    )
    with large_worlds_allowed(allow_large):
        with compile_status(console):
            sim = start_world(scene, changes, at, arch)
        _finish(record(sim, order, console), as_json)


@app.command()
def resume(
    folder: Annotated[Path, typer.Argument(help="The folder of a run.")],
    seconds: Annotated[
        float | None, typer.Option(help="Seconds of water in all; extends a run that is complete.")
    ] = None,
    arch: Annotated[str, typer.Option(help="Back end; by default that of the run.")] = "",
    allow_large: AllowLarge = False,
    as_json: Json = False,
) -> None:
    """Resume a run that ended early, from its last checkpoint, to the same bits; with --seconds extend it."""
    from wavetank.run.record import resume_run
    from wavetank.simulation.cost import large_worlds_allowed

    with large_worlds_allowed(allow_large):
        figures = resume_run(folder, arch, console, seconds)
    if figures.pop("complete", False):
        say(f"{folder}: this run is complete; --seconds {2.0 * figures['seconds_of_water']:g} extends it.")
    _finish(figures, as_json)


def _finish(figures: dict[str, Any], as_json: bool) -> None:
    if as_json:
        print(json_text(figures))
    else:
        _report(figures)
    if figures["interrupted"]:
        raise typer.Exit(figures["exit_code"])


@app.command()
def render(
    world: Annotated[
        str,
        typer.Argument(
            metavar="SCENE|RUN|STATE.npz|FRAMES.h5", help="What to draw: a scene, a run's folder, a state or frames."
        ),
    ],
    at: Annotated[
        float | None,
        typer.Option("--at", "--time", help="Time [s]; by default a scene's best moment, a state's own, a run's last."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="The picture, PNG, by default named after its contents; of a run also a film, MP4 or GIF."),
    ] = None,
    size: Size = "1280x720",
    width: Annotated[int | None, typer.Option(hidden=True)] = None,  # both: older names of --size
    height: Annotated[int | None, typer.Option(hidden=True)] = None,
    view: View = None,
    color_by: ColorBy = None,
    cut: Cut = None,
    environment: Environment = None,
    sun: Sun = None,
    floor: Floor = None,
    quality: Annotated[
        str, typer.Option(help="draft, standard, high or film, as for run; standard for a picture, draft for a film.")
    ] = "",
    samples: Annotated[int | None, typer.Option(help="Samples per pixel, of high and film; by default 64.")] = None,
    eye: Annotated[
        str | None, typer.Option(help="Position of the camera [m], as in 2,1,3; it looks at --target.")
    ] = None,
    target: Annotated[
        str | None, typer.Option(help="Point that the camera looks at [m]; by default the middle.")
    ] = None,
    timings: Annotated[bool, typer.Option("--timings", help="Print the milliseconds of every pass.")] = False,
    settings: Settings = [],  # noqa: B006
    arch: Annotated[str, typer.Option(help="Back end; by default cpu, or that of the run.")] = "",
    as_json: Json = False,
) -> None:
    """Render a picture of a scene, a saved state or an instant of a run; or a film of a finished run."""
    from wavetank.run.archived import FILMS
    from wavetank.run.starting import kind_of
    from wavetank.run.still import render_still

    out = out or picture_name(world, at, view, color_by)
    kind = kind_of(world)
    archived = kind in ("run", "frames") or (world.endswith(".toml") and out.suffix.lower() in FILMS)
    scene = None if archived or kind in ("state", "frame") else configured(world, settings)
    if scene is None and settings:
        raise WavetankError("--set cannot be used with a saved state or a run, which contains its scene.")
    across, down = size_of(size)
    across, down = (across if width is None else width), (down if height is None else height)
    if out.suffix.lower() in FILMS:
        _film(
            world,
            out,
            (across, down),
            at,
            archived,
            as_json,
            arch=arch,
            quality=quality or "draft",
            view=view,
            color_by=color_by,
            cut=cut,
            environment=environment,
            sun=sun,
            floor=floor,
        )
        return
    figures = render_still(
        world,
        scene,
        out,
        across,
        down,
        at=at,
        arch=arch,
        quality=quality or "standard",
        samples=samples,
        eye=eye,
        target=target,
        timings=timings,
        view=view,
        color_by=color_by,
        cut=cut,
        environment=environment,
        sun=sun,
        floor=floor,
    )
    if as_json:
        print(json_text(figures))
    if figures.get("interrupted"):
        if not as_json:
            print(f"{figures['samples']} of {figures['of']} samples are done; the same command continues.")
        raise typer.Exit(figures["exit_code"])
    if as_json:
        return
    for name, milliseconds in figures.get("milliseconds", {}).items():
        print(f"{name:12s} {milliseconds:8.1f} ms")
    if timings:
        print(f"{'together':12s} {sum(figures['milliseconds'].values()):8.1f} ms")
    print(out)


def _film(
    world: str, out: Path, size: tuple[int, int], at: float | None, archived: bool, as_json: bool, **options: Any
) -> None:
    from wavetank.run.archived import film_archived

    if not archived:
        raise WavetankError(
            f"--out {out}: films are made of a run's folder, a recording or an .h5; wavetank run {world} --video "
            "makes one of a scene."
        )
    if at is not None:
        raise WavetankError(f"--at cannot be used with a film, {out}, which shows all frames; name a .png.")
    figures = film_archived(world, out, *size, console=console, **options)
    print(json_text(figures) if as_json else f"{figures['frames']:,} frames\n{out}")
    if figures["interrupted"]:
        raise typer.Exit(figures["exit_code"])


def _report(figures: dict[str, Any]) -> None:
    from wavetank.run.outputs import bytes_of

    last, worst = figures["last"], figures["worst"]
    print(f"{figures['seconds_of_water']:.2f} s of water, {last['count']:,} particles on {figures['arch']}")
    print(
        f"density error: mean {100 * figures['mean']['density_error_mean']:.2f} %, "
        f"worst frame {100 * worst['density_error_mean']:.2f} % and 99th percentile "
        f"{100 * worst['density_error_p99']:.2f} %"
    )
    for path in figures["files"]:
        size = bytes_of([path])
        print(f"  {path}{f'  {size / 1e6:,.0f} MB' if size > 1_000_000 else ''}")

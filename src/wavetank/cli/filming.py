"""The command that films a scene."""

from pathlib import Path
from typing import Annotated

import typer

from wavetank.cli.options import (
    AllowLarge,
    Arch,
    Environment,
    Floor,
    Json,
    SceneName,
    Settings,
    Sun,
    app,
    configured,
    console,
    size_of,
)
from wavetank.foundation.json_text import json_text


@app.command()
def film(
    scene: SceneName,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="The film, MP4 or GIF; by default named after the scene.")
    ] = None,
    quality: Annotated[
        str | None, typer.Option(help="draft, standard, high or film; by default that of the scene's film.")
    ] = None,
    samples: Annotated[int | None, typer.Option(help="Samples per pixel, of high and film.")] = None,
    size: Annotated[str | None, typer.Option(metavar="WIDTHxHEIGHT", help="Size of a picture [px].")] = None,
    fps: Annotated[float | None, typer.Option(help="Frames per second of film.")] = None,
    duration: Annotated[float | None, typer.Option(help="Seconds of film.")] = None,
    speed: Annotated[float | None, typer.Option(help="Seconds of water in a second of film.")] = None,
    keep: Annotated[bool, typer.Option("--keep", help="Do not delete the frames.")] = False,
    environment: Environment = None,
    sun: Sun = None,
    floor: Floor = None,
    allow_large: AllowLarge = False,
    settings: Settings = [],  # noqa: B006
    arch: Arch = "cpu",
    as_json: Json = False,
) -> None:
    """Film a scene with the camera and slow motion of its table [film]; an interrupted film is continued."""
    from wavetank.run.film import film_scene
    from wavetank.simulation.cost import large_worlds_allowed

    world, path = configured(scene, settings), out or Path(Path(scene).stem + ".mp4")
    changes = {"quality": quality, "samples": samples, "fps": fps, "duration": duration, "speed": speed}
    with large_worlds_allowed(allow_large):
        figures = film_scene(
            world,
            path,
            arch=arch,
            console=console,
            keep=keep,
            environment=environment,
            sun=sun,
            floor=floor,
            size=size_of(size) if size else None,
            **changes,
        )
    if as_json:
        print(json_text(figures))
    elif figures["interrupted"]:
        print(f"{figures['frames']:,} of {figures['of']:,} frames are done; the same command continues.")
    else:
        print(f"{figures['frames']:,} frames, {figures['rendered']:,} of them rendered now\n{path}")
    if figures["interrupted"]:
        raise typer.Exit(figures["exit_code"])

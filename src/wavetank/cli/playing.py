"""Interactive commands: play, and replay of a recording."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from wavetank import WavetankError
from wavetank.cli.options import Arch, Json, Settings, Size, app, configured, console, size_of
from wavetank.foundation.json_text import json_text
from wavetank.scene.scene import bundled_levels, with_particles


@app.command()
def play(
    scene: Annotated[str, typer.Argument(help="A bundled scene, a level, a TOML file or a run's folder.")] = "",
    level: Annotated[str, typer.Option(help="A level, by name or number: wavetank scenes lists them.")] = "",
    web: Annotated[bool, typer.Option("--web", help="Serve the page for a browser.")] = False,
    window: Annotated[bool, typer.Option("--window", help="Open a window, or fail with the reason.")] = False,
    port: Annotated[int | None, typer.Option(min=0, max=65535, help="Port of the page; 0 takes any free one.")] = None,
    host: Annotated[
        str, typer.Option(help="Address to listen on; others than 127.0.0.1 let other machines connect.")
    ] = "127.0.0.1",
    token: Annotated[
        str, typer.Option(envvar="WAVETANK_TOKEN", help="Token of the page's link; by default a random one.")
    ] = "",
    no_browser: Annotated[bool, typer.Option("--no-browser", help="Do not open a browser.")] = False,
    record: Annotated[Path | None, typer.Option(help="Write the session to this TOML file, every few seconds.")] = None,
    particles: Annotated[
        int | None,
        typer.Option(min=0, help="Approximate number of particles; 0 keeps the scene's spacing. Without SCENE: 6000."),
    ] = None,
    most: Annotated[int, typer.Option(min=1, help="Largest number of particles.")] = 200_000,
    settings: Settings = [],  # noqa: B006
    arch: Arch = "cpu",
) -> None:
    """Play with the water in a window or, without a display, a browser: pour, stir, freeze, carry, rewind."""
    from wavetank.page.play import play as begin
    from wavetank.run.archived import scene_path

    name = _chosen(scene, level)
    world = configured(scene_path(name or "obstacle-tank"), settings)
    wanted = particles if particles is not None else 0 if name or settings else 6000
    if wanted:
        world = with_particles(world, wanted)
    begin(
        world,
        arch,
        window=window,
        web=web,
        host=host,
        port=port,
        browser=not no_browser,
        record=record,
        most=most,
        token=token,
    )


@app.command()
def replay(
    session: Annotated[Path, typer.Argument(help="A recording of play or of the page.")],
    video: Annotated[Path | None, typer.Option(help="Write an MP4.")] = None,
    fps: Annotated[float, typer.Option(help="Frames per second of the video.")] = 60.0,
    size: Size = "1280x720",
    arch: Annotated[str, typer.Option(help="Back end; by default that of the recording.")] = "",
    as_json: Json = False,
) -> None:
    """Replay a recorded session and report whether its particles are the same, bit for bit."""
    from wavetank.run.replay import replay_session

    figures = replay_session(session, video=video, fps=fps, size=size_of(size), arch=arch, console=console)
    if as_json:
        print(json_text(figures))
    if figures["interrupted"]:
        print(f"the replay was interrupted after {figures['frames']:,} frames", file=sys.stderr)
        raise typer.Exit(figures["exit_code"])
    if as_json:
        return
    same = "the same particles, bit for bit" if figures["same"] else "other particles than recorded"
    print(f"{figures['frames']:,} frames, {figures['seconds_of_water']:.2f} s of water on {figures['arch']}: {same}")
    if video is not None:
        print(f"  {video}")


def _chosen(scene: str, level: str) -> str:
    """Return the name of the given scene or level (or its number), else ""."""
    if not level:
        return scene
    levels = bundled_levels()
    if scene:
        raise WavetankError(f"both the scene {scene} and --level {level} are given; give one of them.")
    if level.isdigit() and 1 <= int(level) <= len(levels):
        return levels[int(level) - 1]
    if level not in levels and not Path(level).is_file():
        raise WavetankError(
            f"--level {level} is not known; it must be 1 to {len(levels)}, {', '.join(levels)}, or a scene's file."
        )
    return level

"""Commands for people: play, and replay of what was played."""

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from wavetank import WavetankError
from wavetank.cli.options import Arch, Json, Settings, Size, app, configured, console, size_of
from wavetank.scene.scene import bundled_levels, with_particles


@app.command()
def play(
    scene: Annotated[str, typer.Argument(help="A bundled scene, a level, a TOML file or a run's folder.")] = "",
    level: Annotated[str, typer.Option(help="A level, by name or number: wavetank scenes lists them.")] = "",
    web: Annotated[bool, typer.Option("--web", help="Serve a page for a browser, whatever there is.")] = False,
    window: Annotated[bool, typer.Option("--window", help="Open a window, or say why there can be none.")] = False,
    port: Annotated[int | None, typer.Option(min=0, max=65535, help="Port of the page; 0 takes any free one.")] = None,
    host: Annotated[str, typer.Option(help="Address to listen on; beyond 127.0.0.1 others may come in.")] = "127.0.0.1",
    token: Annotated[
        str, typer.Option(envvar="WAVETANK_TOKEN", help="Token of the page's link; made anew each time without.")
    ] = "",
    no_browser: Annotated[bool, typer.Option("--no-browser", help="Do not open a browser.")] = False,
    record: Annotated[Path | None, typer.Option(help="Write the session to this TOML file, every few seconds.")] = None,
    particles: Annotated[
        int | None,
        typer.Option(min=0, help="Choose the spacing for about so many; 0 keeps the scene's. Without SCENE: 6000."),
    ] = None,
    most: Annotated[int, typer.Option(min=1, help="Particles that a session may have.")] = 200_000,
    settings: Settings = [],  # noqa: B006
    arch: Arch = "cpu",
) -> None:
    """Play with the water in a window or, without a display, a browser: pour, stir, freeze, carry, rewind."""
    from wavetank.page.play import play as begin
    from wavetank.run.archived import as_scene

    name = _chosen(scene, level)
    world = configured(as_scene(name or "obstacle-tank"), settings)
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
    session: Annotated[Path, typer.Argument(help="A session that play or the page recorded.")],
    video: Annotated[Path | None, typer.Option(help="Write an MP4.")] = None,
    fps: Annotated[float, typer.Option(help="Frames per second of the video.")] = 60.0,
    size: Size = "1280x720",
    arch: Annotated[str, typer.Option(help="Back end; that of the recording unless given.")] = "",
    as_json: Json = False,
) -> None:
    """Do a recorded session again and say whether its particles are the same, bit for bit."""
    from wavetank.run.record import replay_session

    figures = replay_session(session, video=video, fps=fps, size=size_of(size), arch=arch, console=console)
    if as_json:
        print(json.dumps(figures))
    if figures["interrupted"]:
        print(f"the replay was stopped after {figures['frames']:,} frames", file=sys.stderr)
        raise typer.Exit(figures["exit_code"])
    if as_json:
        return
    same = "the same particles, bit for bit" if figures["same"] else "other particles than recorded"
    print(f"{figures['frames']:,} frames, {figures['seconds_of_water']:.2f} s of water on {figures['arch']}: {same}")
    if video is not None:
        print(f"  {video}")


def _chosen(scene: str, level: str) -> str:
    """Return the one name of a scene or a level (or its number) that is given, or an empty one."""
    if not level:
        return scene
    levels = bundled_levels()
    if scene:
        raise WavetankError(f"both the scene {scene} and --level {level} are given; give one of them.")
    if level.isdigit() and 1 <= int(level) <= len(levels):
        return levels[int(level) - 1]
    if level not in levels:
        raise WavetankError(f"--level {level} is not known; it must be 1 to {len(levels)}, or {', '.join(levels)}.")
    return level

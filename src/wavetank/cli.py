"""The command `wavetank`: thin, every command calls one room."""

import json
import sys
import tomllib
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from wavetank import Scene, WavetankError, __version__, bundled_scenes
from wavetank.scene import scene_schema

app = typer.Typer(no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)
console = Console(stderr=True)

SceneName = Annotated[str, typer.Argument(help="A bundled scene or the path of a TOML file.")]
Settings = Annotated[list[str], typer.Option("--set", metavar="NAME=VALUE", help="Set a key of the scene.")]
Arch = Annotated[str, typer.Option(help="Back end: cpu, gpu (the best there is), cuda, vulkan, metal, amdgpu.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object as the last line.")]


@app.callback(invoke_without_command=True)
def _root(version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False) -> None:
    """Real-time, interactive, position-based fluids."""
    if version:
        print(__version__)
        raise typer.Exit


@app.command()
def scenes(
    schema: Annotated[bool, typer.Option("--schema", help="Print the JSON Schema of a scene file.")] = False,
    as_json: Json = False,
) -> None:
    """List the bundled scenes."""
    if schema:
        print(scene_schema())
        return
    rows = [(name, Scene.load(name)) for name in bundled_scenes()]
    if as_json:
        print(json.dumps({name: {"title": s.title, "dim": s.dim, "spacing": s.spacing} for name, s in rows}))
        return
    table = Table("scene", "title", "world", "particles")
    for name, scene in rows:
        table.add_row(name, scene.title, f"{scene.dim}-D", f"{len(scene.particles()[0]):,}")
    Console().print(table)


@app.command()
def run(
    scene: SceneName,
    seconds: Annotated[float, typer.Option(help="Seconds of water.")] = 4.0,
    out: Annotated[Path, typer.Option(help="Folder for what is written.")] = Path("out"),
    video: Annotated[bool, typer.Option("--video", help="Write an MP4.")] = False,
    frames: Annotated[bool, typer.Option("--frames", help="Write a PNG for each frame.")] = False,
    export: Annotated[list[str], typer.Option(help="Write particles: npz, csv, ply.")] = [],  # noqa: B006
    fps: Annotated[float, typer.Option(help="Frames per second of water in video and files.")] = 30.0,
    size: Annotated[str, typer.Option(help="Width x height of pictures.")] = "1280x720",
    color_by: Annotated[str, typer.Option(help="speed, density or a colour such as #3f99da.")] = "speed",
    name: Annotated[str, typer.Option(help="Front part of the files' names.")] = "",
    settings: Settings = [],  # noqa: B006
    arch: Arch = "cpu",
    as_json: Json = False,
) -> None:
    """Simulate a scene and write video, pictures, particles and figures."""
    from wavetank.front.headless import record
    from wavetank.simulation import Simulation

    world = _configured(scene, settings)
    figures = record(
        Simulation(world, arch=arch), out, seconds=seconds, fps=fps, size=_size(size), name=name or Path(scene).stem,
        video=video, frames=frames, exports=export, console=console, color_by=color_by,
    )  # fmt: skip
    if as_json:
        print(json.dumps(figures))
    else:
        _report(figures)


@app.command()
def converge(
    scene: SceneName = "obstacle-tank",
    out: Annotated[Path, typer.Option(help="Folder for the plots and tables.")] = Path("out"),
    seconds: Annotated[float, typer.Option(help="Seconds of water of each run.")] = 2.0,
    iterations: Annotated[int, typer.Option(help="Iterations shown within a step.")] = 20,
    arch: Arch = "cpu",
    as_json: Json = False,
) -> None:
    """Plot largest and mean density over iterations and steps, for the preset paper and the default."""
    from wavetank.lab.converge import converge as study

    result = study(Scene.load(scene), out, seconds=seconds, iterations=iterations, arch=arch, console=console)
    if as_json:
        print(json.dumps(result))
    else:
        for path in result["files"]:
            print(path)


@app.command()
def validate(
    cases: Annotated[list[str], typer.Argument(metavar="[CASE]...", help="Names of cases; all without a name.")] = [],  # noqa: B006
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
        print(json.dumps(result))
    else:
        Console(width=None if sys.stdout.isatty() else 150).print(table(result))
    if wrong := out_of_bounds(result):
        total = result["passed"] + result["failed"]
        raise WavetankError(f"{len(wrong)} of {total} figures are out of their bounds: {'; '.join(wrong)}.")


@app.command()
def doctor(as_json: Json = False) -> None:
    """Say what is installed, which back ends work, and how to get what is missing."""
    from wavetank.lab.doctor import examine

    findings = examine()
    if as_json:
        print(json.dumps(findings))
        return
    table = Table("what", "found", "note")
    for row in findings["checks"]:
        table.add_row(row["name"], row["found"], row["note"])
    Console().print(table)


def main() -> None:
    """Run the command line; a mistake is one line on stderr and exit code 1."""
    try:
        app(standalone_mode=True)
    except WavetankError as error:
        print(f"wavetank: {error}", file=sys.stderr)
        sys.exit(1)
    except (OSError, MemoryError) as error:
        print(f"wavetank: {type(error).__name__}: {error}", file=sys.stderr)
        sys.exit(1)
    except KeyboardInterrupt:
        print("wavetank: stopped.", file=sys.stderr)
        sys.exit(1)


def _configured(name: str, settings: list[str]) -> Scene:
    scene = Scene.load(name)
    changes: dict[str, Any] = {}
    for setting in settings:
        key, equals, text = setting.partition("=")
        if not equals or not key:
            raise WavetankError(f"--set {setting} is not allowed; write it as NAME=VALUE, as in --set viscosity=0.1.")
        changes[key.strip()] = _value(text.strip())
    return scene.changed(**changes) if changes else scene


def _value(text: str) -> Any:
    """Read a value as TOML does; what is not TOML is a string."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text


def _size(text: str) -> tuple[int, int]:
    width, _, height = text.lower().partition("x")
    if not (width.isdigit() and height.isdigit() and 1 <= int(width) <= 16384 and 1 <= int(height) <= 16384):
        raise WavetankError(f"--size = {text!r} is not allowed; write it as 1280x720, from 1x1 to 16384x16384.")
    return int(width), int(height)


def _report(figures: dict[str, Any]) -> None:
    last, worst = figures["last"], figures["worst"]
    print(f"{figures['seconds_of_water']:.2f} s of water, {last['count']:,} particles on {figures['arch']}")
    print(
        f"density error: mean {100 * figures['mean']['density_error_mean']:.2f} %, "
        f"worst frame {100 * worst['density_error_mean']:.2f} % and 99th percentile "
        f"{100 * worst['density_error_p99']:.2f} %"
    )
    for path in figures["files"]:
        print(f"  {path}")


if __name__ == "__main__":
    main()

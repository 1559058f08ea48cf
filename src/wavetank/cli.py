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
from wavetank.scene.scene import bundled_levels, scene_schema

app = typer.Typer(no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)
console = Console(stderr=True)

CASE_NAMES = (
    "buckling, buoyancy, calm-vorticity, coiling, column, creep, cup, drop, elliptical-drop, emitter, energy, "
    "gravity-current, heave, layers, lobovsky, lock-exchange, martin-moyce, momentum, resolution, rest, seeds, "
    "shear-wave, standing-wave, still-tank, tension-drop, water-entry"
)
Cases = Annotated[list[str], typer.Argument(metavar="[CASE]...", help=f"{CASE_NAMES}; not rest, creep without one.")]
SceneName = Annotated[str, typer.Argument(help="A bundled scene or the path of a TOML file.")]
Settings = Annotated[list[str], typer.Option("--set", metavar="NAME=VALUE", help="Set a key of the scene.")]
Arch = Annotated[str, typer.Option(help="Back end: cpu, gpu (the best there is), cuda, vulkan, metal, amdgpu.")]
View = Annotated[str | None, typer.Option(help="water, particles, slice or foam; water unless particles are coloured.")]
Quality = Annotated[str, typer.Option(help="draft, standard (2 x 2 samples a pixel) or film (64 pictures averaged).")]
ColorBy = Annotated[str | None, typer.Option(help="speed, density, material, foam, or a colour such as #3f99da.")]
Cut = Annotated[str | None, typer.Option(help="Where a slice lies: z=0.35 for example.")]
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
    """List the bundled scenes, and the levels with the best that was reached."""
    if schema:
        print(scene_schema())
        return
    from wavetank.session.scores import scores

    rows = [(name, Scene.load(name)) for name in bundled_scenes()]
    levels, best = [(name, Scene.load(name)) for name in bundled_levels()], scores()
    if as_json:
        about = {name: {"title": s.title, "dim": s.dim, "spacing": s.spacing} for name, s in rows}
        games = {name: {"title": s.title, "goal": s.goal.text, "best": best.get(name)} for name, s in levels if s.goal}
        print(json.dumps({**about, "levels": games}))
        return
    table = Table("scene", "title", "world", "particles")
    for name, scene in rows:
        table.add_row(name, scene.title, f"{scene.dim}-D", f"{len(scene.particles()[0]):,}")
    Console().print(table)
    board = Table("level", "goal", "particles", "stars")
    for name, scene in levels:
        stars = best.get(name, {}).get("stars", 0)
        board.add_row(name, scene.goal.text if scene.goal else "", f"{len(scene.particles()[0]):,}", "*" * stars)
    Console().print(board)


@app.command()
def run(
    scene: SceneName,
    seconds: Annotated[float, typer.Option(help="Seconds of water.")] = 4.0,
    out: Annotated[Path, typer.Option(help="Folder for what is written.")] = Path("out"),
    video: Annotated[bool, typer.Option("--video", help="Write an MP4.")] = False,
    gif: Annotated[bool, typer.Option("--gif", help="Write an animated GIF.")] = False,
    frames: Annotated[bool, typer.Option("--frames", help="Write a PNG for each frame.")] = False,
    export: Annotated[list[str], typer.Option(help="Write particles: npz, csv, ply; or their surface: obj.")] = [],  # noqa: B006
    fps: Annotated[float, typer.Option(help="Frames per second of water in video and files.")] = 30.0,
    size: Annotated[str, typer.Option(help="Width x height of pictures.")] = "1280x720",
    view: View = None,
    color_by: ColorBy = None,
    cut: Cut = None,
    quality: Quality = "draft",
    name: Annotated[str, typer.Option(help="Front part of the files' names.")] = "",
    settings: Settings = [],  # noqa: B006
    arch: Arch = "cpu",
    as_json: Json = False,
) -> None:
    """Simulate a scene and write video, pictures, particles and figures."""
    from wavetank.front.headless import Order, record
    from wavetank.simulation.simulation import Simulation

    world = _configured(scene, settings)
    order = Order(
        out, seconds, fps, _size(size), name or Path(scene).stem, video=video, gif=gif, frames=frames,
        exports=tuple(export), quality=quality, look={"view": view, "color_by": color_by, "cut": cut},
    )  # fmt: skip
    figures = record(Simulation(world, arch=arch), order, console)
    if as_json:
        print(json.dumps(figures))
    else:
        _report(figures)
    if figures["interrupted"]:
        raise typer.Exit(130)


@app.command()
def render(
    world: Annotated[str, typer.Argument(metavar="SCENE|STATE.npz", help="A scene, or a state that was saved.")],
    at: Annotated[
        float | None, typer.Option(help="Time [s], to which a saved state goes on; its own, or a scene's best moment.")
    ] = None,
    out: Annotated[Path, typer.Option(help="The picture, PNG.")] = Path("picture.png"),
    width: Annotated[int, typer.Option(help="Pixels.")] = 1280,
    height: Annotated[int, typer.Option(help="Pixels.")] = 720,
    view: View = None,
    color_by: ColorBy = None,
    cut: Cut = None,
    quality: Quality = "standard",
    eye: Annotated[
        str | None, typer.Option(help="Where the camera is [m], as 2,1,3; what it looks at is --target.")
    ] = None,
    target: Annotated[str | None, typer.Option(help="What the camera looks at [m]; the middle unless told.")] = None,
    timings: Annotated[bool, typer.Option("--timings", help="Print the milliseconds of every pass.")] = False,
    settings: Settings = [],  # noqa: B006
    arch: Arch = "cpu",
    as_json: Json = False,
) -> None:
    """Draw one picture of a scene or of a saved state."""
    from wavetank.front.still import take

    scene = None if world.endswith(".npz") else _configured(world, settings)
    if scene is None and settings:
        raise WavetankError("--set does not go with a saved state, which has its scene with it.")
    figures = take(
        world, scene, out, width, height, at=at, arch=arch, quality=quality, eye=eye, target=target, timings=timings,
        view=view, color_by=color_by, cut=cut,
    )  # fmt: skip
    if as_json:
        print(json.dumps(figures))
        return
    for name, milliseconds in figures.get("milliseconds", {}).items():
        print(f"{name:12s} {milliseconds:8.1f} ms")
    if timings:
        print(f"{'together':12s} {sum(figures['milliseconds'].values()):8.1f} ms")
    print(out)


@app.command()
def play(
    scene: Annotated[str, typer.Argument(help="A bundled scene, a level or the path of a TOML file.")] = "",
    level: Annotated[str, typer.Option(help="A level, by name or number: wavetank scenes lists them.")] = "",
    web: Annotated[bool, typer.Option("--web", help="Serve a page for a browser, whatever there is.")] = False,
    window: Annotated[bool, typer.Option("--window", help="Open a window, or say why there can be none.")] = False,
    port: Annotated[int | None, typer.Option(min=0, max=65535, help="Port of the page; 0 takes any free one.")] = None,
    host: Annotated[str, typer.Option(help="Address to listen on; beyond 127.0.0.1 others may come in.")] = "127.0.0.1",
    no_browser: Annotated[bool, typer.Option("--no-browser", help="Do not open a browser.")] = False,
    record: Annotated[Path | None, typer.Option(help="Write the session to this TOML file at the end.")] = None,
    particles: Annotated[
        int | None,
        typer.Option(min=0, help="Choose the spacing for about so many; 0 keeps the scene's. Without SCENE: 6000."),
    ] = None,
    most: Annotated[int, typer.Option(min=1, help="Particles that a session may have.")] = 200_000,
    settings: Settings = [],  # noqa: B006
    arch: Arch = "cpu",
) -> None:
    """Play with the water in a window or, without a display, a browser: pour, stir, freeze, carry, rewind."""
    from wavetank.front.play import play as begin
    from wavetank.front.play import with_particles

    name = _chosen(scene, level)
    world = _configured(name or "obstacle-tank", settings)
    wanted = particles if particles is not None else 0 if name or settings else 6000
    if wanted:
        world = with_particles(world, wanted)
    begin(
        world, arch, window=window, web=web, host=host, port=port, browser=not no_browser, record=record, most=most
    )  # fmt: skip


@app.command()
def replay(
    session: Annotated[Path, typer.Argument(help="A session that play or the page recorded.")],
    video: Annotated[Path | None, typer.Option(help="Write an MP4.")] = None,
    fps: Annotated[float, typer.Option(help="Frames per second of the video.")] = 60.0,
    size: Annotated[str, typer.Option(help="Width x height of the video.")] = "1280x720",
    arch: Annotated[str, typer.Option(help="Back end; that of the recording unless given.")] = "",
    as_json: Json = False,
) -> None:
    """Do a recorded session again and say whether its particles are the same, bit for bit."""
    from wavetank.front.headless import replay_session

    figures = replay_session(session, video=video, fps=fps, size=_size(size), arch=arch, console=console)
    if as_json:
        print(json.dumps(figures))
        return
    same = "the same particles, bit for bit" if figures["same"] else "other particles than recorded"
    print(f"{figures['frames']:,} frames, {figures['seconds_of_water']:.2f} s of water on {figures['arch']}: {same}")
    if video is not None:
        print(f"  {video}")


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
        print(json.dumps(result))
    else:
        Console(width=None if sys.stdout.isatty() else 150).print(table(result))
    if wrong := out_of_bounds(result):
        total = result["passed"] + result["failed"]
        raise WavetankError(f"{len(wrong)} of {total} figures are out of their bounds: {'; '.join(wrong)}.")


@app.command()
def bench(
    scenes: Annotated[
        list[str], typer.Argument(metavar="[SCENE]... [SIZE]...", help="Scenes, and further sizes.")
    ] = [],  # noqa: B006
    sizes: Annotated[str, typer.Option(help="Numbers of particles, as 10000,100000.")] = "",
    seconds: Annotated[float | None, typer.Option(help="Seconds of water of each run [0.5].")] = None,
    repeats: Annotated[int, typer.Option(help="Passes that the medians are taken over, 2 or more.")] = 3,
    threads: Annotated[int | None, typer.Option(min=1, max=1024, help="Threads on the CPU; all without it.")] = None,
    peers: Annotated[bool, typer.Option("--peers", help="Compare with SPlisHSPlasH on the same dam break.")] = False,
    roofline: Annotated[
        bool, typer.Option("--roofline", help="Compare each kernel with what this machine can do.")
    ] = False,
    search: Annotated[bool, typer.Option("--search", help="Compare the neighbour search with a k-d tree.")] = False,
    page: Annotated[bool, typer.Option("--page", help="Measure the page in a headless Chromium.")] = False,
    start_up: Annotated[bool, typer.Option(help="Measure the start of a fresh process too.")] = True,
    out: Annotated[Path | None, typer.Option(help="Write the result to this JSON file.")] = None,
    compare: Annotated[Path | None, typer.Option(metavar="OLD.json", help="Print ratios to an earlier result.")] = None,
    arch: Arch = "cpu",
    as_json: Json = False,
) -> None:
    """Measure milliseconds per stage, rates, start-up; compare with an earlier run, a peer, the machine's ceilings."""
    from wavetank.lab.bench import run as bench_run

    order = bench_run.Order(
        scenes=scenes, sizes=sizes, seconds=seconds, repeats=repeats, threads=threads, peers=peers, roofline=roofline,
        search=search, page=page, start_up=start_up, compare=compare, arch=arch,
    )  # fmt: skip
    result, tables = bench_run.perform(order, console.print)
    if out is not None:
        bench_run.save_result(result, out)
    for table in tables:
        Console(width=None if sys.stdout.isatty() else 150).print(table)
    if as_json:
        print(json.dumps(result))


@app.command()
def doctor(
    compare: Annotated[
        str | None, typer.Option(metavar="ARCH", help="Compute and draw the same on the CPU and on this back end.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Say what is installed, which back ends work, and how to get what is missing."""
    if compare is not None:
        _compare_backends(compare, as_json)
        return
    from wavetank.lab.doctor import examine

    findings = examine()
    if as_json:
        print(json.dumps(findings))
        return
    table = Table("what", "found", "note")
    for row in findings["checks"]:
        table.add_row(row["name"], row["found"], row["note"])
    Console().print(table)


def _compare_backends(arch: str, as_json: bool) -> None:
    from wavetank.front import backends

    with console.status(f"the same water on cpu and {arch}"):
        result = backends.compare(arch)
    if as_json:
        print(json.dumps(result))
        return
    table = Table(f"{result['scene']}, {result['particles']:,} particles, {result['seconds']:g} s", "cpu", arch)
    for name, values in {**result["figures"], "mean height, m": result["height"]}.items():
        table.add_row(name, *(f"{value:.4g}" for value in values))
    for view, seen in result["views"].items():
        text = f"{100 * seen['close']:.3f} % within {backends.CLOSE}/255, largest {seen['largest']}"
        table.add_row(f"picture: {view}", "", text)
    Console().print(table)


def main() -> None:
    """Run the command line; a mistake is one line on stderr and exit code 1, Ctrl-C exit code 130."""
    try:
        app(standalone_mode=True)
    except SystemExit as end:
        if end.code == 130:
            print("wavetank: stopped.", file=sys.stderr)
        raise
    except WavetankError as error:
        print(f"wavetank: {error}", file=sys.stderr)
        sys.exit(1)
    except (OSError, MemoryError) as error:
        place, reason = getattr(error, "filename", None), getattr(error, "strerror", None)
        print(f"wavetank: {f'{place}: {reason}.' if place else f'{type(error).__name__}: {error}'}", file=sys.stderr)
        sys.exit(1)
    except KeyboardInterrupt:
        print("wavetank: stopped.", file=sys.stderr)
        sys.exit(130)


def _configured(name: str, settings: list[str]) -> Scene:
    scene = Scene.load(name)
    changes: dict[str, Any] = {}
    for setting in settings:
        key, equals, text = setting.partition("=")
        if not equals or not key:
            raise WavetankError(f"--set {setting} is not allowed; write it as NAME=VALUE, as in --set viscosity=0.1.")
        changes[key.strip()] = _value(text.strip())
    return scene.changed(**changes) if changes else scene


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


def _value(text: str) -> Any:
    """Read a value as TOML does; what is not TOML is a string."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text


def _size(text: str) -> tuple[int, int]:
    from wavetank.view.renderer import LARGEST_SIDE as LARGEST

    width, _, height = text.lower().partition("x")
    if not all(side.isdigit() and 1 <= int(side) <= LARGEST for side in (width, height)):
        raise WavetankError(f"--size = {text!r} is not allowed; write it as 1280x720, from 1x1 to {LARGEST}x{LARGEST}.")
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

"""What several commands share: the application, common options, and how texts become values."""

import tomllib
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from typer.core import TyperCommand

from wavetank import Scene, WavetankError, __version__

app = typer.Typer(
    context_settings={"help_option_names": ["-h", "--help"]},
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
console = Console(stderr=True)
PYTHONS = "<list[str]>"

SceneName = Annotated[str, typer.Argument(help="A bundled scene or the path of a TOML file.")]
Settings = Annotated[
    list[str],
    typer.Option(
        "--set",
        metavar="NAME=VALUE",
        help="Set a key of the scene, as viscosity=0.1, tank.size=[2,1], solids[0].size=[1,1].",
    ),
]
Arch = Annotated[str, typer.Option(help="Back end: cpu, gpu (the best available), cuda, vulkan, metal, amdgpu.")]
Size = Annotated[str, typer.Option(metavar="WIDTHxHEIGHT", help="Size of a picture [px].")]
View = Annotated[
    str | None, typer.Option(help="water, particles, slice or foam; by default water, or particles with --color-by.")
]
Quality = Annotated[
    str,
    typer.Option(help="draft, standard (2 x 2 samples a pixel), high (64 pictures averaged) or film (paths of light)."),
]
ColorBy = Annotated[
    str | None, typer.Option(help="speed, density, pressure, material, foam, or a colour such as #3f99da.")
]
Environment = Annotated[
    str | None,
    typer.Option(
        help="studio, pool, paper, sky, evening, overcast or a picture (.hdr); by default the scene's or the view's."
    ),
]
Sun = Annotated[str | None, typer.Option(help="Direction of the sun [deg]: azimuth,elevation, as in 40,25.")]
Floor = Annotated[str | None, typer.Option(help="plain, tiles, stone, sand or table.")]
Cut = Annotated[str | None, typer.Option(help="Position of a slice [m], as in z=0.35.")]
Exports = Annotated[
    list[str],
    typer.Option(
        metavar="FORMATS", help="Write each frame: usd, vtkhdf, vtp, h5, npz, csv, ply, obj; several as in usd,npz."
    ),
]
Only = Annotated[
    str, typer.Option(help="Parts to write: particles, foam, solids, surface; by default all but the surface.")
]
AllowLarge = Annotated[
    bool, typer.Option("--allow-large", help="Start even if it needs more memory than is free, or hours.")
]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object as the last line.")]


def as_text(name: str) -> str:
    """Return the name of a file as text: bytes of it that are no UTF-8 become question marks."""
    return name.encode("utf-8", "surrogateescape").decode("utf-8", "replace")


def say(text: str) -> None:
    """Print a sentence on stderr, in one line however long it is."""
    console.print(text, markup=False, highlight=False, soft_wrap=True)


class Plain(TyperCommand):
    """A command whose help does not show Python's types of its arguments."""

    def get_help(self, ctx: Any) -> str:
        """Return the help, with its columns aligned."""
        return super().get_help(ctx).replace(PYTHONS, " " * len(PYTHONS))


@app.callback(invoke_without_command=True)
def _root(version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False) -> None:
    """Real-time, interactive, position-based fluids."""
    if version:
        print(__version__)
        raise typer.Exit


def configured(name: str, settings: list[str]) -> Scene:
    """Return a scene with the changes of `--set`."""
    scene, changes = Scene.load(name), changes_in(settings)
    return scene.changed(**changes) if changes else scene


def changes_in(settings: list[str]) -> dict[str, Any]:
    """Return the keys and values of `--set`."""
    changes: dict[str, Any] = {}
    for setting in settings:
        key, equals, text = setting.partition("=")
        if not equals or not key:
            raise WavetankError(f"--set {setting} is not allowed; write it as NAME=VALUE, as in --set viscosity=0.1.")
        changes[key.strip()] = value_of(text.strip())
    return changes


def value_of(text: str) -> Any:
    """Parse a value as TOML; anything else is a string."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text


def names_in(texts: list[str]) -> tuple[str, ...]:
    """Return the names in texts such as "usd,npz", without repeats."""
    return tuple(dict.fromkeys(name.strip() for text in texts for name in text.split(",") if name.strip()))


def picture_name(world: str, at: float | None, view: str | None, color_by: str | None) -> Path:
    """Return a file name for a picture from its scene, time, view and colouring."""
    seconds = None if at is None else f"{at:g}s"
    parts = [Path(world).resolve().stem, seconds, view, color_by.lstrip("#") if color_by else None]
    return Path("-".join(part for part in parts if part) + ".png")


def size_of(text: str) -> tuple[int, int]:
    """Parse width and height [px]; raises `WavetankError`."""
    from wavetank.view.renderer import LARGEST_SIDE as LARGEST

    width, _, height = text.lower().partition("x")
    if not all(side.isdigit() and 1 <= int(side) <= LARGEST for side in (width, height)):
        raise WavetankError(f"--size = {text!r} is not allowed; write it as 1280x720, from 1x1 to {LARGEST}x{LARGEST}.")
    return int(width), int(height)

"""Commands between wavetank and other programs: export, import."""

import math
from pathlib import Path
from typing import Annotated

import typer

from wavetank.cli.options import Json, Only, app, configured, console, names_in
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.input_limits import visible
from wavetank.foundation.json_text import json_text


@app.command()
def export(
    source: Annotated[Path, typer.Argument(metavar="RUN|STATE.npz|RECORDING.toml|FRAMES.h5", help="What to export.")],
    to: Annotated[
        list[str],
        typer.Option(metavar="FORMATS", help="Formats: usd, vtkhdf, vtp, h5, npz, csv, ply, obj; several as a,b."),
    ],
    out: Annotated[Path | None, typer.Option(help="Folder for the files; by default that of the source.")] = None,
    only: Only = "",
    every: Annotated[int, typer.Option(help="Write every Nth frame only.")] = 1,
    arch: Annotated[
        str, typer.Option(help="Back end, where frames are computed again; by default that of the source.")
    ] = "",
    as_json: Json = False,
) -> None:
    """Export the frames of a run's folder, a saved state, a recording or an HDF5 file to other programs."""
    from wavetank.run.export import export as convert

    figures = convert(source, names_in(to), out=out, only=names_in([only]), every=every, arch=arch, console=console)
    if as_json:
        print(json_text(figures))
        return
    print(f"{figures['frames']:,} frames, {figures['fps']:g} a second of water")
    for path in figures["files"]:
        print(f"  {path}")


@app.command("import")
def import_scene(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="FILE",
            help="SCENE.json of SPlisHSPlasH, CASE_Def.xml of DualSPHysics, ROBOT.urdf or ROBOT.xml (MJCF).",
        ),
    ],
    out: Annotated[Path, typer.Option("--out", "-o", help="The TOML scene file to write.")],
    spacing: Annotated[float | None, typer.Option(help="Particle spacing [m] instead of its own.")] = None,
    into: Annotated[str, typer.Option(help="Scene to place a robot in.")] = "still-tank",
    at: Annotated[str, typer.Option(help="Position of a robot [m], as in 0.2,0,0.3.")] = "",
    as_json: Json = False,
) -> None:
    """Convert a scene of SPlisHSPlasH or DualSPHysics, or a robot, to a scene; list what was not converted."""
    from wavetank.formats.robots import is_mjcf, load_robot

    if file.suffix.lower() == ".urdf" or (file.suffix.lower() in (".xml", ".mjcf") and is_mjcf(file)):
        robot = load_robot(file, _place(at))
        scene, notes = robot.joined(configured(into, [f"spacing={spacing}"] if spacing else [])), robot.notes
    else:
        from wavetank import load_dualsphysics, load_splishsplash

        load = load_dualsphysics if file.suffix.lower() == ".xml" else load_splishsplash
        imported = load(file, spacing)
        scene, notes = imported.scene, imported.notes
    scene.save(out)
    if as_json:
        print(json_text({"file": str(out), "notes": notes}))
        return
    print(out)
    for note in notes:
        print(f"  {visible(note)}")


def _place(text: str) -> tuple[float, ...]:
    parts = text.split(",") if text else ["0", "0", "0"]
    try:
        place = tuple(float(part) for part in parts)
    except ValueError:
        place = ()
    if len(place) != 3 or not all(math.isfinite(part) for part in place):
        raise WavetankError(f"--at = {text!r} is not allowed; write three numbers [m], as in 0.2,0,0.3.")
    return place

"""Commands between wavetank and other programs: export, import."""

import json
from pathlib import Path
from typing import Annotated

import typer

from wavetank.cli.options import Json, Only, app, console, names_in


@app.command()
def export(
    source: Annotated[Path, typer.Argument(metavar="RUN|STATE.npz|RECORDING.toml|FRAMES.h5", help="What was kept.")],
    to: Annotated[
        list[str],
        typer.Option(metavar="FORMATS", help="Formats: usd, vtkhdf, vtp, h5, npz, csv, ply, obj; several as a,b."),
    ],
    out: Annotated[Path | None, typer.Option(help="Folder for the files; where the source is unless told.")] = None,
    only: Only = "",
    every: Annotated[int, typer.Option(help="Write only each so manyth frame.")] = 1,
    arch: Annotated[str, typer.Option(help="Back end, where something is computed; that of the source.")] = "",
    as_json: Json = False,
) -> None:
    """Write the frames of a run's folder, a saved state, a recording or an HDF5 file for other programs."""
    from wavetank.front.exporting import export as convert

    figures = convert(
        source, names_in(to), out=out, only=names_in([only]), every=every, arch=arch, console=console
    )  # fmt: skip
    if as_json:
        print(json.dumps(figures))
        return
    print(f"{figures['frames']:,} frames, {figures['fps']:g} a second of water")
    for path in figures["files"]:
        print(f"  {path}")


@app.command("import")
def import_scene(
    file: Annotated[Path, typer.Argument(metavar="SCENE.json", help="A scene of SPlisHSPlasH.")],
    out: Annotated[Path, typer.Option("--out", "-o", help="The scene file to be written, TOML.")],
    spacing: Annotated[float | None, typer.Option(help="Distance of particles [m] in place of its own.")] = None,
    as_json: Json = False,
) -> None:
    """Read a scene of SPlisHSPlasH, write it as one of wavetank, and say what has no counterpart."""
    from wavetank.formats.splishsplash import read_splishsplash

    imported = read_splishsplash(file, spacing)
    imported.scene.save(out)
    if as_json:
        print(json.dumps({"file": str(out), "notes": imported.notes}))
        return
    print(out)
    for note in imported.notes:
        print(f"  {note}")

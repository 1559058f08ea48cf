"""Opens a run in ParaView: particles as balls, coloured by speed; foam in white; solids, surface, tank, eye and frames.

    wavetank run obstacle-tank --seconds 2 --export vtp --out out      # or vtkhdf, for ParaView 5.12 and later
    WAVETANK_RUN=out paraview --script=examples/paraview/open_run.py
    pvpython examples/paraview/open_run.py out picture.png             # a picture of the last frame, without a window

It is a state: what it sets up can be changed in the window and saved as a state file of ParaView's own.
"""

import os
import sys
import tomllib
from pathlib import Path

from paraview import simple

SUFFIXES = (".vtkhdf", ".vtp.series")  # the first kind there is
BLUE, FOAM, SOLID = (0.10, 0.36, 0.62), (0.97, 0.98, 1.0), (0.80, 0.58, 0.42)
BACKGROUND = (0.93, 0.94, 0.95)


def open_run(folder: Path, picture: Path | None = None) -> None:
    """Show the run in a folder; raises `SystemExit` where it has no frames that ParaView reads."""
    try:
        scene = tomllib.loads((folder / "scene.toml").read_text(encoding="utf-8"))
        name = tomllib.loads((folder / "run.toml").read_text(encoding="utf-8"))["name"]
    except OSError as error:
        raise SystemExit(f"{folder} is no folder of a run: {error.strerror}, {error.filename}") from None
    suffix = next((suffix for suffix in SUFFIXES if any(folder.glob(f"{name}*{suffix}"))), None)
    if suffix is None:
        raise SystemExit(f"{folder} has no frames for ParaView; write them with: wavetank export {folder} --to vtp")
    view = simple.GetActiveViewOrCreate("RenderView")
    view.UseColorPaletteForBackground = 0
    view.Background, view.OrientationAxesVisibility = BACKGROUND, 0
    spacing, parts = scene["spacing"], {}
    for part in ("", "foam", "solids", "surface"):
        path = folder / f"{name}{'-' * bool(part)}{part}{suffix}"
        if path.is_file():
            parts[part] = simple.OpenDataFile(str(path.resolve()))
            simple.RenameSource(part or "water", parts[part])
    for part, source in parts.items():
        shown = simple.Show(source, view)
        if part in ("", "foam"):
            show_balls(shown, source, view, 0.5 * spacing if not part else 0.2 * spacing, by_speed=not part)
        else:
            shown.DiffuseColor = shown.AmbientColor = SOLID if part == "solids" else BLUE
            shown.Specular, shown.Opacity = 0.3, 1.0 if part == "solids" else 0.85
    if "surface" in parts and "" in parts:
        simple.Hide(parts[""], view)
    show_tank(scene, view)
    look(scene, view)
    scenes = simple.GetAnimationScene()
    scenes.UpdateAnimationUsingDataTimeSteps()
    if picture is not None:
        scenes.GoToLast()
        view.ViewSize = [1280, 720]
        simple.SaveScreenshot(str(picture), view)


def show_balls(shown: object, source: object, view: object, radius: float, *, by_speed: bool) -> None:
    """Draw points as balls of a radius [m]."""
    shown.SetRepresentationType("Point Gaussian")
    shown.ShaderPreset, shown.GaussianRadius = "Sphere", radius
    if not by_speed:
        shown.DiffuseColor = shown.AmbientColor = FOAM
        return
    simple.ColorBy(shown, ("POINTS", "velocity", "Magnitude"))
    colors = simple.GetColorTransferFunction("velocity")
    colors.ApplyPreset("Blues", True)
    shown.RescaleTransferFunctionToDataRangeOverTime()
    bar = simple.GetScalarBar(colors, view)
    bar.AutoOrient, bar.Orientation, bar.WindowLocation = 0, "Horizontal", "Lower Left Corner"
    bar.TitleFontSize, bar.LabelFontSize, bar.ScalarBarLength, bar.ScalarBarThickness = 14, 12, 0.2, 10
    bar.Title, bar.ComponentTitle, bar.TitleColor, bar.LabelColor = "speed [m/s]", "", [0.2] * 3, [0.2] * 3
    shown.SetScalarBarVisibility(view, True)


def extent(scene: dict) -> tuple[list[float], list[float]] | None:
    """Return the corners of the tank [m], in space; None without a tank."""
    tank = scene.get("tank")
    if not tank:
        return None
    lower, size = ([*tank.get(key, [0.0] * len(tank["size"])), 0.0][:3] for key in ("lower", "size"))
    return lower, [low + edge for low, edge in zip(lower, size, strict=True)]


def show_tank(scene: dict, view: object) -> None:
    """Draw the edges of the tank."""
    corners = extent(scene)
    if corners is None:
        return
    lower, upper = corners
    size = [high - low for low, high in zip(lower, upper, strict=True)]
    box = simple.Box(
        XLength=size[0],
        YLength=size[1],
        ZLength=max(size[2], 1e-6),
        Center=[0.5 * (low + high) for low, high in zip(lower, upper, strict=True)],
    )
    simple.RenameSource("tank", box)
    edges = simple.Show(box, view)
    edges.SetRepresentationType("Outline")
    edges.AmbientColor = edges.DiffuseColor = [0.45] * 3


def look(scene: dict, view: object) -> None:
    """Look at it from before, from the right and from above, with y up; at a world in a plane straight on."""
    corners = extent(scene)
    flat = len(scene.get("tank", {}).get("size", [0, 0, 0])) == 2
    view.CameraViewUp, view.CameraViewAngle = [0.0, 1.0, 0.0], 30.0
    if corners is None:
        simple.ResetCamera(view)
        return
    lower, upper = corners
    middle = [0.5 * (low + high) for low, high in zip(lower, upper, strict=True)]
    far = sum((high - low) ** 2 for low, high in zip(lower, upper, strict=True)) ** 0.5
    way = (0.0, 0.0, 2.0) if flat else (0.85, 0.6, 1.65)
    view.CameraFocalPoint = middle
    view.CameraPosition = [place + far * step for place, step in zip(middle, way, strict=True)]
    simple.ResetCamera(view)
    view.CenterOfRotation = middle
    camera = simple.GetActiveCamera()
    camera.Dolly(1.25)


given = sys.argv[1:] or [os.environ.get("WAVETANK_RUN", "out")]
open_run(Path(given[0]), Path(given[1]) if len(given) > 1 else None)

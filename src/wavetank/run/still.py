"""Still pictures of a scene, a saved state or an archived run."""

import time
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeRemainingColumn

from wavetank.device.compiler import current_backend
from wavetank.formats import exporter_for
from wavetank.foundation.atomic_write import partial_path
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.version import VERSION
from wavetank.run.archived import frame_at, is_archive
from wavetank.run.compile_status import compile_status
from wavetank.run.signals import StopRequest, stop_on_signal
from wavetank.scene.scene import Scene
from wavetank.simulation.frame import Frame
from wavetank.simulation.simulation import Simulation
from wavetank.view.camera import Camera
from wavetank.view.film.samples import Watch
from wavetank.view.renderer import Renderer, affordable
from wavetank.view.style import Style, quality_options

SAMPLES = ".samples.npz"  # suffix of the samples of an interrupted picture
STOPS = "interrupted; saving the samples (once more stops at once)"
COLUMNS = ("{task.description}", BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
USUAL_TIME = 0.5  # s: time of a scene's picture by default
#: the same for bundled scenes with another best moment
SHOWN_AT = {
    "still-tank": 1.0,
    "still-tank-2d": 1.0,
    "drop": 0.42,
    "drop-2d": 0.35,
    "obstacle-tank": 0.62,
    "knot": 0.35,
    "fountain": 2.0,
    "fountain-2d": 1.5,
    "sluice": 2.0,
    "sluice-2d": 1.5,
    "wave-machine": 4.0,
    "wave-machine-2d": 4.0,
    "ducks": 3.0,
    "boats": 4.0,
    "sinking-ship": 4.0,
    "deer-scarer": 6.3,
    "robot": 6.6,
    "logs": 2.0,
    "paddle-boat": 4.5,
    "lighthouse": 0.62,
    "rain": 0.32,
    "jug": 2.4,
    "river": 5.0,
    "honey": 0.4,
    "mountain-lake": 0.8,
    "vase": 0.28,
}


def render_still(
    world: str,
    scene: Scene | None,
    path: Path,
    width: int,
    height: int,
    *,
    at: float | None = None,
    arch: str = "",
    quality: str = "standard",
    eye: str | None = None,
    target: str | None = None,
    timings: bool = False,
    samples: int | None = None,
    console: Console | None = None,
    **options: Any,
) -> dict[str, Any]:
    """Render a picture to `path`, with scene, time and view as metadata; return its figures.

    `world` is the name of `scene`, or without one the file of a saved state or an archived run. With `timings` it is
    rendered a second time, with compiled kernels, and each pass is timed.
    """
    writer = exporter_for(path, "picture")
    partial_path(path)  # raises before the work where the file cannot be written
    supersample, chosen = quality_options(quality, samples)
    style = {**chosen, **options}
    view = Style(**style).kind
    console = console or Console(stderr=True)
    with compile_status(console):
        if scene is None and is_archive(world):
            frame = frame_at(world, at, arch)
        else:
            frame = _simulation_at(world, scene, at, arch or "cpu").frame(view.coloured)
    renderer = Renderer(width, height, affordable(width, height, supersample))
    camera = _camera_at(frame, eye, target, width / max(height, 1))
    began = time.perf_counter()
    with (
        stop_on_signal(say=STOPS if style["traced"] else "") as stop,
        nullcontext() if style["traced"] else compile_status(console),
        Progress(*COLUMNS, console=console, transient=True, disable=not style["traced"]) as bar,
    ):
        watch = Watch(path=path.with_name(path.name + SAMPLES) if style["traced"] else None)
        watch.tell = progress_callback(bar, stop)
        image = renderer.render(frame, camera, watch=watch, **style)
    if not watch.whole:
        return {
            "file": str(watch.path),
            "samples": watch.done,
            "of": style["samples"],
            "interrupted": True,
            "exit_code": stop.code,
        }
    figures: dict[str, Any] = {
        "file": str(path),
        "scene": frame.scene.title,
        "time": frame.time,
        "view": view.name,
        "particles": frame.count,
        "seconds_to_draw": time.perf_counter() - began,
        "arch": current_backend(),
    }
    if timings:
        measured: dict[str, float] = {}
        figures["milliseconds"] = measured
        renderer.render(frame, camera, timings=measured, **style)
    about = {"scene": frame.scene.title, "time": f"{frame.time:.4f} s", "view": view.name, "particles": frame.count}
    if watch.done:
        figures |= {"samples": watch.done, "samples_kept": watch.begun}
    writer.write(path, image, about | {"Software": f"wavetank {VERSION}"})
    return figures


def progress_callback(bar: Progress, stop: StopRequest, name: str = "samples") -> Callable[[int, int], bool]:
    """Return a callback that shows finished samples in `bar`, and returns False to stop."""
    task = bar.add_task(name, total=None)

    def tell(done: int, of: int) -> bool:
        bar.update(task, completed=done, total=of)
        return not stop

    return tell


def _simulation_at(world: str, scene: Scene | None, at: float | None, arch: str) -> Simulation:
    """Return the simulation at the time `at` [s]."""
    sim = Simulation(scene, arch=arch) if scene is not None else Simulation.restore(world, arch=arch)
    if at is None:
        at = SHOWN_AT.get(world, USUAL_TIME) if scene is not None else sim.time
    if not sim.time - 1e-9 <= at <= 86400.0:
        raise WavetankError(
            f"--at = {at} is not allowed; {world} starts at {sim.time:g} s, so it must be a number from there to 86400."
        )
    sim.advance(max(0.0, at - sim.time))
    return sim


def _camera_at(frame: Frame, eye: str | None, target: str | None, aspect: float) -> Camera:
    """Return the camera with `eye` and `target` as texts of the form ``2,1,3``; by default it frames the water."""
    at, toward = (_point(name, text) if text else None for name, text in (("eye", eye), ("target", target)))
    return Camera.looking(frame, at, toward, aspect)


def _point(name: str, text: str) -> tuple[float, float, float]:
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        raise WavetankError(f"--{name} = {text!r} is not allowed; write three numbers [m], as in 2,1,3.") from None
    return x, y, z

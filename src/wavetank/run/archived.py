"""Frames of archived runs (a run's folder, an HDF5 file, a recording), and films of them."""

from collections import deque
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import Progress

from wavetank.formats import exporter_for
from wavetank.foundation.errors import WavetankError
from wavetank.run.checkpoints import FILE, FOLDER, load_run
from wavetank.run.export import open_source
from wavetank.run.folder import SCENE, RunFolder
from wavetank.run.signals import stop_on_signal
from wavetank.run.starting import kind_of
from wavetank.scene.scene import Scene
from wavetank.simulation.frame import Frame, FrameBuffer
from wavetank.simulation.simulation import Simulation
from wavetank.simulation.state import State
from wavetank.view.renderer import Renderer, affordable
from wavetank.view.style import quality_options

FILMS = (".mp4", ".gif")


def is_archive(world: str) -> bool:
    """Say whether this is a run's folder or an HDF5 file of frames; names of bundled scenes are not."""
    return kind_of(world) in ("run", "frames")


def scene_path(world: str) -> str:
    """Return the scene file of a run's folder; any other name unchanged."""
    return str(Path(world) / SCENE) if is_archive(world) and Path(world).is_dir() else world


def frame_at(world: str, at: float | None, arch: str = "") -> Frame:
    """Return the frame of an archived run nearest to the time `at` [s of water], the last one where it is None.

    A frame that was written is read; otherwise it is computed, from the last checkpoint before it or from the start.
    Raises `WavetankError`.
    """
    if not Path(world).is_dir():
        source = open_source(Path(world), arch)
        last = at is None
        found = deque(source.frames, 1)[-1] if last else min(source.frames, key=lambda one: abs(one.time - at))
        return FrameBuffer(source.scene, arch or "cpu").frame(found)
    folder = RunFolder.open(world)
    run = folder.run
    done = len(folder.stats()) - 1  # number of the last frame that was finished
    end = run.start + (done / run.fps if done >= 0 else run.seconds)
    at = end if at is None else at
    if not run.start - 1e-9 <= at <= end + 0.5 / run.fps:
        raise WavetankError(
            f"--at = {at} is not allowed; the run in {world} is from {run.start:g} to {end:g} s; "
            "name a time between them."
        )
    if folder.has_instants():
        return FrameBuffer(folder.scene, arch or run.arch).frame(folder.instant_at(at))
    number, sim, done = round((at - run.start) * run.fps), None, -1
    if (folder.path / FOLDER / FILE).exists():
        kept = load_run(folder.path, arch)
        if kept.checkpoint.frame <= number:
            sim, done = kept.sim, kept.checkpoint.frame
            if done == number:
                return sim.frame()
    if sim is None:
        if run.start > 0.0:
            raise WavetankError(
                f"{world}: this run started from a saved state and wrote no frames; run it again with --export h5."
            )
        sim = Simulation(folder.scene, arch or run.arch)
    frame = None
    for _, frame in sim.numbered_frames(number / run.fps, run.fps, run.start, done):
        pass
    assert frame is not None
    return frame


def film_archived(
    world: str,
    path: Path,
    width: int,
    height: int,
    *,
    arch: str = "",
    quality: str = "draft",
    console: Console | None = None,
    **options: Any,
) -> dict[str, Any]:
    """Write a film of all frames of a run's folder, a recording or an HDF5 file, and return what it shows.

    Nothing is computed again where frames were written. Raises `WavetankError`.
    """
    console = console or Console(stderr=True)
    supersample, chosen = quality_options(quality)
    writer = exporter_for(path, "video")
    source = open_source(Path(world), arch)
    if source.note:
        console.print(source.note, markup=False)
    style, count, time = {**chosen, **options}, 0, 0.0
    frames = _shown(source.scene, source.frames, arch)
    first = next(frames, None)
    if first is None:
        raise WavetankError(f"{world}: no frame of this run was finished.")
    renderer = Renderer(width, height, affordable(width, height, supersample))
    with (
        stop_on_signal(say="interrupted; completing the film (once more stops at once)") as stop,
        writer.write(path, width, height, source.fps) as out,
        Progress(console=console, transient=True) as bar,
    ):
        task = bar.add_task("film", total=source.count)
        frame: Frame | None = first
        while frame is not None and not stop:
            out.write(renderer.render(frame, **style))
            count, time = count + 1, frame.time
            bar.update(task, completed=count)
            frame = next(frames, None)
    return {
        "file": str(path),
        "scene": source.scene.title,
        "frames": count,
        "fps": source.fps,
        "time": time,
        "interrupted": bool(stop),
        "exit_code": stop.code,
    }


def _shown(scene: Scene, frames: Any, arch: str) -> Iterator[Frame]:
    shown: FrameBuffer | None = None
    for one in frames:
        if isinstance(one, State):
            shown = shown or FrameBuffer(scene, arch or "cpu")
            yield shown.frame(one)
        else:
            yield one

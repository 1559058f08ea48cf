"""Run a scene without a screen: video, pictures, particle files and figures into a folder."""

import itertools
import json
import math
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, ProgressColumn, Task, TextColumn, TimeRemainingColumn
from rich.text import Text

from wavetank.formats import exporter_named
from wavetank.formats.gif import LARGEST_RATE, GifWriter
from wavetank.formats.mp4 import VideoWriter
from wavetank.formats.png import write_png
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.replacing import make_folder
from wavetank.simulation.frame import Frame
from wavetank.simulation.simulation import Simulation
from wavetank.view.renderer import Renderer
from wavetank.view.style import QUALITIES, quality_named

Sink = Callable[[int, Frame, Any], None]  # takes the number of a frame, the frame and its picture (or None)


class _Figures(ProgressColumn):
    """Water time, speed, particles and density error of the running simulation."""

    def render(self, task: Task) -> Text:
        figures = task.fields
        return Text(
            f"{figures['time']:5.2f} s of water  {figures['fps']:5.1f} fps  {figures['count']:,} particles  "
            f"density error {100 * figures['error']:.2f} %"
        )


def record(
    sim: Simulation,
    out: Path,
    *,
    seconds: float,
    fps: float = 30.0,
    size: tuple[int, int] = (1280, 720),
    name: str = "run",
    video: bool = True,
    gif: bool = False,
    quality: str = "draft",
    frames: bool = False,
    exports: Sequence[str] = (),
    console: Console | None = None,
    **look: Any,
) -> dict[str, Any]:
    """Advance `sim` by `seconds` [s], write what was asked for into `out` and return the figures of the run.

    Ctrl-C ends the run early; every file is complete then, and the figures say `interrupted`.
    """
    if not (math.isfinite(seconds) and 0 <= seconds <= 86400):
        raise WavetankError(f"--seconds = {seconds} is not allowed; it must be a number from 0 to 86400.")
    if not 1.0 <= fps <= 240.0:
        raise WavetankError(f"--fps = {fps} is not allowed; it must be a number from 1 to 240.")
    if gif and fps > LARGEST_RATE:
        raise WavetankError(f"--fps = {fps} is too fast for --gif; at most {LARGEST_RATE:g}.")
    if not name or Path(name).name != name:
        raise WavetankError(f"--name = {name!r} is not allowed; it is the front part of file names, --out the folder.")
    writers = [exporter_named(format_) for format_ in exports]
    for writer in writers:
        if hasattr(writer, "check"):
            writer.check(sim.scene)
    supersample, samples = QUALITIES[quality_named(quality)]
    look = {**look, "samples": samples}
    renderer = Renderer(*size, supersample)
    renderer.render(sim.frame(), **look)  # what is wrong with the look shows before anything is written
    make_folder(out)
    files: list[str] = []
    summary = _Summary(sim, seconds)
    with ExitStack() as stack:
        sinks: list[Sink] = []
        if video:
            film = stack.enter_context(VideoWriter(out / f"{name}.mp4", *size, fps))
            sinks.append(lambda number, frame, image: film.write(image))
            files.append(str(out / f"{name}.mp4"))
        if gif:
            loop = stack.enter_context(GifWriter(out / f"{name}.gif", *size, fps))
            sinks.append(lambda number, frame, image: loop.write(image))
            files.append(str(out / f"{name}.gif"))
        if frames:
            sinks.append(lambda number, frame, image: write_png(out / f"{name}-{number:05d}.png", image))
            files.append(str(out / f"{name}-#####.png"))
        for writer in writers:
            sinks.append(_particle_sink(writer, out, name))
            files.append(str(out / f"{name}-#####{writer.SUFFIXES[0]}"))
        _loop(sim, seconds, fps, renderer if video or gif or frames else None, sinks, summary, console, look)
    still = out / f"{name}.png"
    image = Renderer(*size, 2 if quality == "draft" else supersample).render(sim.frame(), **look)
    write_png(still, image, {"scene": sim.scene.title, "time": f"{sim.time:.4f} s"})
    figures = summary.figures() | {"files": [*files, str(still)]}
    stats = out / "stats.json"
    figures["files"].append(str(stats))
    stats.write_text(json.dumps(figures, indent=2) + "\n", encoding="utf-8")
    return figures


def _particle_sink(writer: ModuleType, out: Path, name: str) -> Sink:
    def write(number: int, frame: Frame, image: Any) -> None:
        writer.write(out / f"{name}-{number:05d}{writer.SUFFIXES[0]}", frame)

    return write


def _loop(
    sim: Simulation, seconds: float, fps: float, renderer: Renderer | None, sinks: list[Sink], summary: "_Summary",
    console: Console | None, look: dict[str, Any],
) -> None:  # fmt: skip
    progress = Progress(
        TextColumn("{task.description}"), BarColumn(), _Figures(), TimeRemainingColumn(),
        console=console or Console(stderr=True), transient=False,
    )  # fmt: skip
    with progress:
        task = progress.add_task("wavetank", total=seconds or 1.0, time=sim.time, fps=0.0, count=sim.count, error=0.0)
        first = 0.0  # s until the first frame was done, with the kernels that it compiled
        with _interruptible() as interrupted:
            for number, frame in enumerate(sim.frames(seconds, fps)):
                image = renderer.render(frame, **look) if renderer is not None else None
                for sink in sinks:
                    sink(number, frame, image)
                summary.add()
                elapsed = progress.tasks[0].elapsed or 0.0
                first = elapsed if number == 0 else first
                speed = number / (elapsed - first) if elapsed > first else 0.0
                progress.update(
                    task, completed=sim.time - summary.begin, time=sim.time, fps=speed, count=sim.count,
                    error=summary.last["density_error_mean"],
                )  # fmt: skip
                if interrupted.is_set():
                    summary.interrupted = True
                    break


@contextmanager
def _interruptible() -> Iterator[threading.Event]:
    """Turn the first Ctrl-C into an event, so that the frame at hand is finished; a second one stops at once."""
    event = threading.Event()
    before = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or before is signal.SIG_IGN:
        yield event
        return

    def note(number: int, frame: Any) -> None:
        if event.is_set():
            raise KeyboardInterrupt
        event.set()

    signal.signal(signal.SIGINT, note)
    try:
        yield event
    finally:
        signal.signal(signal.SIGINT, before)


def replay_session(
    path: Path, *, video: Path | None = None, fps: float = 60.0, size: tuple[int, int] = (1280, 720), arch: str = "",
    console: Console | None = None,
) -> dict[str, Any]:  # fmt: skip
    """Do a recorded session again, with a video if `video` is given, and return what came out.

    The video follows the recorded camera and shows one frame of the session in each of its own, so slow motion is slow.
    """
    from wavetank.session.recording import Recording, replay
    from wavetank.view.choices import options

    if not 1.0 <= fps <= 240.0:
        raise WavetankError(f"--fps = {fps} is not allowed; it must be a number from 1 to 240.")
    recording = Recording.load(path)
    session = None
    with ExitStack() as stack:
        film = stack.enter_context(VideoWriter(video, *size, fps)) if video is not None else None
        renderer: Renderer | None = None
        progress = stack.enter_context(Progress(console=console or Console(stderr=True), transient=True))
        task = progress.add_task("replay", total=recording.frames)
        interrupted = stack.enter_context(_interruptible())
        for session in replay(recording, arch or recording.arch, str(path)):
            session.aspect = size[0] / size[1]
            if film is not None:
                renderer = renderer or Renderer(*size)
                look = options(session.view, session.color_by)
                film.write(renderer.render(session.sim.frame(), session.camera, **look))
            progress.update(task, completed=session.ticks)
            if interrupted.is_set():
                raise WavetankError(f"{path}: the replay was stopped after {session.ticks} frames.")
    assert session is not None
    digest = session.sim.digest()
    return {
        "frames": session.ticks, "seconds_of_water": session.sim.time, "count": session.sim.count,
        "arch": session.sim.arch, "same": digest == recording.digest, "digest": digest,
    }  # fmt: skip


class _Summary:
    """Collects the figures of a run."""

    def __init__(self, sim: Simulation, seconds: float) -> None:
        self.sim, self.begin, self.seconds = sim, sim.time, seconds
        self.history: list[dict[str, float]] = []
        self.interrupted = False

    @property
    def last(self) -> dict[str, float]:
        return self.history[-1]

    def add(self) -> None:
        self.history.append(self.sim.stats())

    def figures(self) -> dict[str, Any]:
        """Return the last instant, and what was worst on the way."""
        rows = self.history or [self.sim.stats()]
        energies = [row["kinetic_energy"] + row["potential_energy"] for row in rows]
        return {
            "scene": self.sim.scene.title,
            "arch": self.sim.arch,
            "interrupted": self.interrupted,
            "seconds_of_water": self.sim.time - self.begin,
            "energy_start": energies[0],
            "worst": {
                "density_error_mean": max(row["density_error_mean"] for row in rows),
                "density_error_p99": max(row["density_error_p99"] for row in rows),
                "speed_max": max(row["speed_max"] for row in rows),
                "energy_rise": max((b - a for a, b in itertools.pairwise(energies)), default=0.0),
            },
            "mean": {
                "density_error_mean": sum(row["density_error_mean"] for row in rows) / len(rows),
                "milliseconds_per_frame": _mean([row["milliseconds_per_frame"] for row in rows[1:]]),
            },
            "last": rows[-1],
        }


def _mean(values: list[float]) -> float | None:
    return sum(values) / len(values) if values else None

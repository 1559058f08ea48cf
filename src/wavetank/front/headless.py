"""Run a scene without a screen: video, pictures, particle files and figures into a folder."""

import dataclasses
import itertools
import json
import math
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, ProgressColumn, Task, TextColumn, TimeRemainingColumn
from rich.text import Text

from wavetank.formats.gif import LARGEST_RATE, GifWriter
from wavetank.formats.mp4 import VideoWriter
from wavetank.formats.outputs import Outputs, check_exports, parts_named
from wavetank.formats.plan import Viewpoint
from wavetank.formats.png import write_png
from wavetank.formats.run_folder import SUMMARY, Run, RunFolder
from wavetank.foundation.errors import WavetankError
from wavetank.scene.scene import Scene
from wavetank.simulation.frame import Frame
from wavetank.simulation.simulation import Simulation
from wavetank.view.camera import Camera
from wavetank.view.extent import extent_of
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


@dataclasses.dataclass(frozen=True)
class Order:
    """What is to be written of a run. Raises `WavetankError` for what is not allowed."""

    out: Path  # folder
    seconds: float  # of water
    fps: float = 30.0  # frames per second of water in video and files
    size: tuple[int, int] = (1280, 720)  # px, of pictures
    name: str = "run"  # front part of the files' names
    video: bool = False
    gif: bool = False
    frames: bool = False  # a picture each
    exports: tuple[str, ...] = ()  # formats of frames
    only: tuple[str, ...] = ()  # parts of a frame that these hold, see `instant.PARTS`; all but the surface without any
    every: int = 1  # only each so manyth frame goes into these
    quality: str = "draft"
    look: dict[str, Any] = dataclasses.field(default_factory=dict)  # options of a picture: see `Style`

    def __post_init__(self) -> None:
        """Check what needs no world to be checked."""
        if not (math.isfinite(self.seconds) and 0 <= self.seconds <= 86400):
            raise WavetankError(f"--seconds = {self.seconds} is not allowed; it must be a number from 0 to 86400.")
        if not 1.0 <= self.fps <= 240.0:
            raise WavetankError(f"--fps = {self.fps} is not allowed; it must be a number from 1 to 240.")
        if self.gif and self.fps > LARGEST_RATE:
            raise WavetankError(f"--fps = {self.fps} is too fast for --gif; at most {LARGEST_RATE:g}.")
        if not self.name or Path(self.name).name != self.name:
            raise WavetankError(
                f"--name = {self.name!r} is not allowed; it is the front part of file names, --out the folder."
            )
        if not 1 <= self.every <= 1_000_000:
            raise WavetankError(f"--every = {self.every} is not allowed; it must be a whole number of at least 1.")
        parts_named(self.only)
        quality_named(self.quality)

    @property
    def has_pictures(self) -> bool:
        """Whether every frame needs a picture."""
        return self.video or self.gif or self.frames

    @property
    def style(self) -> dict[str, Any]:
        """Options of every picture."""
        return {**self.look, "samples": QUALITIES[self.quality][1]}

    def run(self, sim: Simulation) -> Run:
        """Return this as the file of a run's folder has it."""
        return Run(
            name=self.name, arch=sim.arch or "cpu", seconds=self.seconds, start=sim.time, fps=self.fps, size=self.size,
            video=self.video, gif=self.gif, frames=self.frames, exports=[*self.exports], only=[*self.only],
            every=self.every, quality=self.quality,
            look={name: str(value) for name, value in self.look.items() if value is not None},
        )  # fmt: skip

    def path(self, suffix: str) -> Path:
        """Return the file of that suffix."""
        return self.out / f"{self.name}{suffix}"


def record(sim: Simulation, order: Order, console: Console | None = None) -> dict[str, Any]:
    """Advance `sim`, write what is ordered and return the figures of the run.

    Ctrl-C ends the run early; every file is complete then, and the figures say `interrupted`.
    """
    check_exports(order.exports, order.only, sim.scene)
    supersample = QUALITIES[order.quality][0]
    renderer = Renderer(*order.size, supersample)
    renderer.render(sim.frame(), **order.style)  # what is wrong with the look shows before anything is written
    folder = RunFolder.create(order.out, order.run(sim), sim.scene)
    outputs = Outputs(
        folder.base, sim.scene, order.exports, fps=order.fps / order.every, only=order.only, view=view_of(sim.scene),
        tell=(console or Console(stderr=True)).print,
    )  # fmt: skip
    with ExitStack() as stack:
        sinks = _open_sinks(order, stack)
        stack.enter_context(outputs)
        writers = [*sinks.values(), lambda number, frame, image: _export(outputs, order.every, number, frame)]
        summary = _run(sim, order, renderer if order.has_pictures else None, writers, console, folder)
    files = [*sinks, *outputs.files]
    still = order.path(".png")
    image = Renderer(*order.size, 2 if order.quality == "draft" else supersample).render(sim.frame(), **order.style)
    write_png(still, image, {"scene": sim.scene.title, "time": f"{sim.time:.4f} s"})
    stats = order.out / SUMMARY
    figures = summary.figures() | {"files": [*files, str(still), str(stats)], "waited_for_files": outputs.waited}
    stats.write_text(json.dumps(figures, indent=2) + "\n", encoding="utf-8")
    return figures


def view_of(scene: Scene) -> Viewpoint:
    """Return where pictures of a scene are taken from."""
    camera = Camera.framing_extent(extent_of(scene))
    return Viewpoint(camera.eye, camera.target, camera.field_of_view, camera.height)


def _export(outputs: Outputs, every: int, number: int, frame: Frame) -> None:
    if number % every == 0:
        outputs.write(number // every, frame)


def _open_sinks(order: Order, stack: ExitStack) -> dict[str, Sink]:
    """Open what frames go into, by the files' names; the `stack` closes it."""
    sinks: dict[str, Sink] = {}
    if order.video:
        film = stack.enter_context(VideoWriter(order.path(".mp4"), *order.size, order.fps))
        sinks[str(order.path(".mp4"))] = lambda number, frame, image: film.write(image)
    if order.gif:
        loop = stack.enter_context(GifWriter(order.path(".gif"), *order.size, order.fps))
        sinks[str(order.path(".gif"))] = lambda number, frame, image: loop.write(image)
    if order.frames:
        sinks[str(order.path("-#####.png"))] = lambda number, frame, image: write_png(
            order.path(f"-{number:05d}.png"), image
        )
    return sinks


def _run(
    sim: Simulation,
    order: Order,
    renderer: Renderer | None,
    sinks: Sequence[Sink],
    console: Console | None,
    folder: RunFolder,
) -> "_Summary":
    """Let the water move and every sink have each frame, with its picture where there is a renderer."""
    summary = _Summary(sim)
    progress = Progress(
        TextColumn("{task.description}"), BarColumn(), _Figures(), TimeRemainingColumn(),
        console=console or Console(stderr=True), transient=False,
    )  # fmt: skip
    with progress:
        total = order.seconds or 1.0
        task = progress.add_task("wavetank", total=total, time=sim.time, fps=0.0, count=sim.count, error=0.0)
        first = 0.0  # s until the first frame was done, with the kernels that it compiled
        with _interruptible() as interrupted:
            for number, frame in enumerate(sim.frames(order.seconds, order.fps)):
                image = renderer.render(frame, **order.style) if renderer is not None else None
                for sink in sinks:
                    sink(number, frame, image)
                summary.add()
                folder.add_stats(summary.last)
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
    return summary


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

    def __init__(self, sim: Simulation) -> None:
        self.sim, self.begin = sim, sim.time
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
            **({"notes": [*self.sim.notes]} if self.sim.notes else {}),
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

"""Run a scene without a screen: video, pictures, particle files and figures into a folder."""

import dataclasses
import json
import math
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, ProgressColumn, Task, TextColumn, TimeRemainingColumn
from rich.text import Text

from wavetank.formats.gif import LARGEST_RATE, GifWriter, resized
from wavetank.formats.mp4 import VideoWriter
from wavetank.formats.plan import Viewpoint
from wavetank.formats.png import write_png
from wavetank.foundation.atomic_write import atomic_write
from wavetank.foundation.errors import NotFiniteError, WavetankError
from wavetank.foundation.input_limits import explain_errors, printable
from wavetank.run.checkpoints import Begun, Checkpoints, FilmInParts, begun
from wavetank.run.folder import SUMMARY, Run, RunFolder
from wavetank.run.outputs import Outputs, check_exports, parts_named
from wavetank.run.signals import Asked, asked_to_end
from wavetank.scene.scene import Scene
from wavetank.simulation.cost import check_time
from wavetank.simulation.frame import Frame
from wavetank.simulation.simulation import Simulation
from wavetank.view.camera import Camera
from wavetank.view.extent import extent_of
from wavetank.view.renderer import Renderer
from wavetank.view.style import quality_named, quality_options

GIF_WIDTH = 640  # px
WORST = ("density_error_mean", "density_error_p99", "speed_max")
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
    small_gif: bool = False  # a GIF has pictures of at most GIF_WIDTH: it packs worse than any video
    frames: bool = False  # a picture each
    exports: tuple[str, ...] = ()  # formats of frames
    only: tuple[str, ...] = ()  # parts of a frame that these hold, see `instant.PARTS`; all but the surface without any
    every: int = 1  # only each so manyth frame goes into these
    quality: str = "draft"
    look: dict[str, Any] = dataclasses.field(default_factory=dict)  # options of a picture: see `Style`
    checkpoint_every: float = 0.0  # s of water between two states from which the run can go on; 0: none

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
        if not (self.checkpoint_every == 0.0 or 1e-3 <= self.checkpoint_every <= 86400.0):
            raise WavetankError(
                f"--checkpoint-every = {self.checkpoint_every} is not allowed; it must be seconds of water, from "
                "0.001 to 86400."
            )
        if self.gif and self.checkpoint_every:
            raise WavetankError("--gif does not go with --checkpoint-every: a GIF is made in one go; write a --video.")
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
        return {**quality_options(self.quality)[1], **self.look}

    def run(self, sim: Simulation, start: float) -> Run:
        """Return this as the file of a run's folder has it, which began at the time `start` [s] of the water."""
        return Run(
            name=self.name,
            arch=sim.arch or "cpu",
            seconds=self.seconds,
            start=start,
            fps=self.fps,
            size=self.size,
            video=self.video,
            gif=self.gif,
            frames=self.frames,
            exports=[*self.exports],
            only=[*self.only],
            every=self.every,
            quality=self.quality,
            look={name: str(value) for name, value in self.look.items() if value is not None},
        )

    @property
    def gif_size(self) -> tuple[int, int]:
        """Pixels of a GIF."""
        share = min(1.0, GIF_WIDTH / self.size[0]) if self.small_gif else 1.0
        return max(1, round(share * self.size[0])), max(1, round(share * self.size[1]))

    def path(self, suffix: str) -> Path:
        """Return the file of that suffix."""
        return self.out / f"{self.name}{suffix}"


def record(sim: Simulation, order: Order, console: Console | None = None, begun: Begun | None = None) -> dict[str, Any]:
    """Advance `sim`, write what is ordered and return the figures of the run, which may have `begun` before.

    Ctrl-C and other wishes to end (`signals.py`) end the run early; every file is complete then, and the figures say
    `interrupted`. So it is where the water has become what is no number, which is then raised.
    """
    check_exports(order.exports, order.only, sim.scene)
    check_time(sim.count, sim.scene, order.seconds, "this run")
    with asked_to_end(say="asked to end; the files are being completed (once more stops at once)") as asked:
        supersample, _ = quality_options(order.quality)
        renderer = Renderer(*order.size, supersample)
        # What is wrong with the look shows before anything is written.
        renderer.render(sim.frame(), **order.style | {"samples": 1})
        work = _Work(sim, order, asked, begun)
        with ExitStack() as stack:
            sinks = _open_sinks(order, stack, work)
            work.open_outputs(stack, (console or Console(stderr=True)).print)
            summary = _run(work, renderer if order.has_pictures else None, [*sinks.values(), work.export], console)
        still = order.path(".png")
        if summary.broken is None:
            fine = Renderer(*order.size, 2 if order.quality == "draft" else supersample)
            write_png(
                still, fine.render(sim.frame(), **order.style), {"scene": sim.scene.title, "time": f"{sim.time:.4f} s"}
            )
            sinks[str(still)] = lambda number, frame, image: None
        stats = order.out / SUMMARY
        files = [*sinks, *work.outputs.files, str(work.folder.write_table()), str(stats)]
        figures = summary.figures() | {"files": files, "waited_for_files": work.outputs.waited, "exit_code": asked.code}
        with atomic_write(stats) as partial:
            partial.write_text(json.dumps(figures, indent=2) + "\n", encoding="utf-8")
        if work.checkpoints and not asked and summary.broken is None:
            work.checkpoints.finish()
    if summary.broken is not None:
        raise summary.broken
    return figures


def go_on(out: Path, arch: str = "", console: Console | None = None) -> dict[str, Any]:
    """Go on with the run of a folder at its last good checkpoint; return its figures, as `record` does."""
    run = begun(out, arch)
    if run.note and console is not None:
        console.print(f"the checkpoint before the last one is taken: {run.note}", markup=False)
    with explain_errors(printable(out), "checkpoint"):
        table = dict(run.progress.order)
        for name in ("size", "exports", "only"):
            table[name] = tuple(table[name])
        order = Order(**table | {"out": out})
    return record(run.sim, order, console, run)


def view_of(scene: Scene) -> Viewpoint:
    """Return where pictures of a scene are taken from."""
    camera = Camera.framing_extent(extent_of(scene))
    return Viewpoint(camera.eye, camera.target, camera.field_of_view, camera.height)


class _Work:
    """A run under way: the world, what is ordered, whether it is to end, and its checkpoints."""

    def __init__(self, sim: Simulation, order: Order, asked: Asked, begun: Begun | None) -> None:
        self.sim, self.order, self.asked, self.begun = sim, order, asked, begun
        self.start = begun.progress.start if begun else sim.time
        self.done = begun.checkpoint.frame if begun else -1  # number of the last frame that was written
        self.film: FilmInParts | None = None
        self.folder = self._folder(order.run(sim, self.start))
        self.folder.keep_stats(self.done + 1)
        self.checkpoints: Checkpoints | None = None
        if order.checkpoint_every:
            plain = dataclasses.asdict(order)
            del plain["out"]
            self.checkpoints = Checkpoints(order.out, order.checkpoint_every, self.start, plain)
            if begun:
                self.checkpoints.kept = [begun.checkpoint]
                self.checkpoints.next = sim.time + order.checkpoint_every

    def _folder(self, run: Run) -> RunFolder:
        """Return the folder of this run; another one's that lies in its place is begun anew."""
        if self.begun is not None and RunFolder.is_one(self.order.out):
            folder, other = RunFolder.open(self.order.out), {"wavetank", "arch"}
            if folder.run.model_dump(exclude=other) == run.model_dump(exclude=other):
                return folder
        return RunFolder.create(self.order.out, run, self.sim.scene)

    def open_film(self, stack: ExitStack) -> Any:
        """Open the video, in parts where there are checkpoints."""
        path, size, fps = self.order.path(".mp4"), self.order.size, self.order.fps
        if self.checkpoints is None:
            return stack.enter_context(VideoWriter(path, *size, fps))
        folder = self.checkpoints.folder
        parts = [folder / part for part in self.begun.checkpoint.parts] if self.begun else []
        self.film = stack.enter_context(FilmInParts(path, size, fps, folder, parts))
        return self.film

    def open_outputs(self, stack: ExitStack, tell: Callable[[str], None]) -> None:
        """Open the files of frames; those before a checkpoint are kept."""
        order = self.order
        self.outputs = Outputs(
            self.folder.base,
            self.folder.scene,
            order.exports,
            fps=order.fps / order.every,
            only=order.only,
            view=view_of(self.folder.scene),
            kept=self.done // order.every + 1,
            tell=tell,
            frames=int(order.seconds * order.fps / order.every) + 1,
        )
        stack.enter_context(self.outputs)

    def export(self, number: int, frame: Frame, image: Any) -> None:
        """Write a frame for other programs."""
        if number % self.order.every == 0:
            self.outputs.write(number // self.order.every, frame)

    def keep(self, number: int, summary: "_Summary") -> None:
        """Write a checkpoint where one is due, and where the run ends early."""
        self.folder.add_stats(summary.last)
        if self.checkpoints and (self.asked or self.checkpoints.is_due(self.sim.time)):
            self.outputs.drain()
            parts = self.film.cut(number) if self.film else []
            self.checkpoints.keep(self.sim, number, summary.plain(), parts)


def _open_sinks(order: Order, stack: ExitStack, work: _Work) -> dict[str, Sink]:
    """Open what frames go into, by the files' names; the `stack` closes it."""
    sinks: dict[str, Sink] = {}
    if order.video:
        film = work.open_film(stack)
        sinks[str(order.path(".mp4"))] = lambda number, frame, image: film.write(image)
    if order.gif:
        size = order.gif_size
        loop = stack.enter_context(GifWriter(order.path(".gif"), *size, order.fps))
        sinks[str(order.path(".gif"))] = lambda number, frame, image: loop.write(resized(image, size))
    if order.frames:
        sinks[str(order.path("-#####.png"))] = lambda number, frame, image: write_png(
            order.path(f"-{number:05d}.png"), image
        )
    return sinks


def _run(work: _Work, renderer: Renderer | None, sinks: Sequence[Sink], console: Console | None) -> "_Summary":
    """Let the water move and every sink have each frame, with its picture where there is a renderer."""
    sim, order = work.sim, work.order
    summary = _Summary(sim, work.begun.checkpoint.figures if work.begun else None)
    moving = order.style | {"shutter": min(sim.scene.frame_time, 1.0 / order.fps)}
    progress = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        _Figures(),
        TimeRemainingColumn(),
        console=console or Console(stderr=True),
        transient=False,
    )
    with progress:
        total = order.seconds or 1.0
        task = progress.add_task("wavetank", total=total, time=sim.time, fps=0.0, count=sim.count, error=0.0)
        first, shown = 0.0, 0  # s until the first frame was done, with the kernels that it compiled
        try:
            for number, frame in sim.numbered_frames(order.seconds, order.fps, work.start, work.done):
                frame.check_finite()
                image = renderer.render(frame, **moving) if renderer is not None else None
                for sink in sinks:
                    sink(number, frame, image)
                summary.add()
                elapsed = progress.tasks[0].elapsed or 0.0
                first = elapsed if shown == 0 else first
                speed, shown = shown / (elapsed - first) if elapsed > first else 0.0, shown + 1
                progress.update(
                    task,
                    completed=sim.time - work.start,
                    time=sim.time,
                    fps=speed,
                    count=sim.count,
                    error=summary.last["density_error_mean"],
                )
                work.keep(number, summary)
                if work.asked:
                    summary.interrupted = True
                    break
        except NotFiniteError as error:
            summary.broken = error
    return summary


def replay_session(
    path: Path,
    *,
    video: Path | None = None,
    fps: float = 60.0,
    size: tuple[int, int] = (1280, 720),
    arch: str = "",
    console: Console | None = None,
) -> dict[str, Any]:
    """Do a recorded session again, with a video if `video` is given, and return what came out.

    The video follows the recorded camera and shows one frame of the session in each of its own, so slow motion is slow.
    """
    from wavetank.session.recording import Recording, replay
    from wavetank.view.choices import options

    if not 1.0 <= fps <= 240.0:
        raise WavetankError(f"--fps = {fps} is not allowed; it must be a number from 1 to 240.")
    recording = Recording.load(path)
    session = None
    say = "asked to end; the video is being completed (once more stops at once)" if video is not None else ""
    with asked_to_end(say=say) as asked, ExitStack() as stack:
        film = stack.enter_context(VideoWriter(video, *size, fps)) if video is not None else None
        renderer: Renderer | None = None
        progress = stack.enter_context(Progress(console=console or Console(stderr=True), transient=True))
        task = progress.add_task("replay", total=recording.frames)
        for session in replay(recording, arch or recording.arch, str(path)):
            session.aspect = size[0] / size[1]
            if film is not None:
                renderer = renderer or Renderer(*size)
                look = options(session.view, session.color_by) | session.light
                film.write(
                    renderer.render(session.sim.frame(), session.sight, shutter=session.sim.scene.frame_time, **look)
                )
            progress.update(task, completed=session.ticks)
            if asked:
                break
    assert session is not None
    digest = session.sim.digest()
    return {
        "frames": session.ticks,
        "seconds_of_water": session.sim.time,
        "count": session.sim.count,
        "arch": session.sim.arch,
        "same": digest == recording.digest,
        "digest": digest,
        "interrupted": bool(asked),
        "exit_code": asked.code,
    }


class _Summary:
    """Collects the figures of a run, of which a part may have been computed before."""

    def __init__(self, sim: Simulation, before: dict[str, Any] | None = None) -> None:
        self.sim, self.interrupted = sim, False
        self.broken: NotFiniteError | None = None
        self.last: dict[str, float] = {}
        self._sums: dict[str, float] = {"frames": 0, "error": 0.0, "milliseconds": 0.0, "begin": sim.time}
        self._sums |= {f"worst {name}": 0.0 for name in WORST} | {"rise": 0.0}
        for name, value in (before or {}).items():
            if (name in (*self._sums, "energy_start", "energy") or name.startswith("power ")) and isinstance(
                value, int | float
            ):
                self._sums[name] = value

    def plain(self) -> dict[str, float]:
        """Return what is known so far, for a checkpoint."""
        return {**self._sums}

    def add(self) -> None:
        """Take the figures of the present frame."""
        row, sums = self.sim.stats(), self._sums
        energy = row["kinetic_energy"] + row["potential_energy"]
        if sums["frames"]:
            sums["milliseconds"] += row["milliseconds_per_frame"]
            sums["rise"] = max(sums["rise"], energy - sums["energy"])
        else:
            sums["energy_start"] = energy
        for name in WORST:
            sums[f"worst {name}"] = max(sums[f"worst {name}"], row[name])
        for name in self.sim.joints.motors:  # joints in a ring have no power of their own
            sums[f"power {name}"] = sums.get(f"power {name}", 0.0) + row.get(f"joints.{name}.power", 0.0)
        sums["error"] += row["density_error_mean"]
        sums["frames"], sums["energy"], self.last = sums["frames"] + 1, energy, row

    def figures(self) -> dict[str, Any]:
        """Return the last instant, and what was worst on the way."""
        if not self.last and self.broken is None:
            self.add()
        sums, frames = self._sums, int(self._sums["frames"])
        joints = {name.removeprefix("power "): total for name, total in sums.items() if name.startswith("power ")}
        return {
            "scene": self.sim.scene.title,
            "arch": self.sim.arch,
            "interrupted": self.interrupted,
            **({"broken": str(self.broken)} if self.broken is not None else {}),
            **({"notes": [*self.sim.notes]} if self.sim.notes else {}),
            "seconds_of_water": self.sim.time - sums["begin"],
            "energy_start": sums.get("energy_start", 0.0),
            "worst": {name: sums[f"worst {name}"] for name in WORST} | {"energy_rise": sums["rise"]},
            "mean": {
                "density_error_mean": sums["error"] / max(frames, 1),
                "milliseconds_per_frame": sums["milliseconds"] / (frames - 1) if frames > 1 else None,
                **({"power": {name: total / max(frames - 1, 1) for name, total in joints.items()}} if joints else {}),
            },
            "last": self.last,
            **({} if self.broken is not None else {"digest": self.sim.digest()}),
        }

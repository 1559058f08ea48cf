"""Runs without a screen: video, pictures, particle files and figures into a folder."""

import dataclasses
import shutil
from collections.abc import Callable, Sequence
from contextlib import ExitStack, nullcontext
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, ProgressColumn, Task, TextColumn, TimeRemainingColumn
from rich.table import Column
from rich.text import Text

from wavetank.device.compiler import on_compile
from wavetank.formats.gif import GifWriter, resized
from wavetank.formats.mp4 import VideoWriter
from wavetank.formats.plan import Viewpoint
from wavetank.formats.png import write_png
from wavetank.foundation.atomic_write import atomic_write, make_folder
from wavetank.foundation.errors import NotFiniteError, WavetankError
from wavetank.foundation.input_limits import explain_errors, parse_json, printable, read_text
from wavetank.foundation.json_text import json_text
from wavetank.run.checkpoints import FOLDER, Checkpoints, ResumedRun, SegmentedVideo, load_run, name_of_run
from wavetank.run.compile_status import compile_status
from wavetank.run.folder import SUMMARY, Run, RunFolder, claimed
from wavetank.run.options import RunOptions
from wavetank.run.outputs import Outputs, check_exports
from wavetank.run.signals import StopRequest, stop_on_signal
from wavetank.run.summary import Summary
from wavetank.scene.scene import Scene
from wavetank.simulation.cost import check_time
from wavetank.simulation.frame import Frame
from wavetank.simulation.simulation import Simulation
from wavetank.view.camera import Camera
from wavetank.view.renderer import Renderer
from wavetank.view.style import quality_options

STOPPING = "interrupted; completing the files (once more stops at once)"
Sink = Callable[[int, Frame, Any], None]  # takes the number of a frame, the frame and its picture (or None)


class _Figures(ProgressColumn):
    """Water time, speed, particles and density error of the running simulation."""

    def render(self, task: Task) -> Text:
        figures = task.fields
        return Text(
            f"{figures['time']:.2f} s  {figures['fps']:.1f} fps  {figures['count']:,} particles  "
            f"error {100 * figures['error']:.2f} %"
        )


def record(
    sim: Simulation, options: RunOptions, console: Console | None = None, resumed: ResumedRun | None = None
) -> dict[str, Any]:
    """Advance `sim`, write what `options` ask for and return the figures of the run; `resumed` is a run to continue.

    Ctrl-C and other signals (`signals.py`) end the run early; every file is complete then, and the figures say
    `interrupted`. Non-finite values end it likewise, and then raise `NotFiniteError`.
    """
    check_exports(options.exports, options.only, sim.scene)
    check_time(sim.count, sim.scene, options.seconds, "this run")
    with stop_on_signal(say=STOPPING) as stop, ExitStack() as claim:
        supersample, _ = quality_options(options.quality)
        renderer = Renderer(*options.size, supersample)
        with compile_status(console) if console else nullcontext():
            # Wrong options of a picture raise before anything is written.
            renderer.render(sim.frame(), **options.style | {"samples": 1})
        claim.enter_context(claimed(options.out))
        work = _ActiveRun(sim, options, stop, resumed)
        with ExitStack() as stack:
            sinks = _open_sinks(options, stack, work)
            work.open_outputs(stack, (console or Console(stderr=True)).print)
            summary = _run(work, renderer if options.has_pictures else None, [*sinks.values(), work.export], console)
        still = options.path(".png")
        if summary.broken is None:
            fine = Renderer(*options.size, 2 if options.quality == "draft" else supersample)
            write_png(
                still,
                fine.render(sim.frame(), **options.style),
                {"scene": sim.scene.title, "time": f"{sim.time:.4f} s"},
            )
            sinks[str(still)] = lambda number, frame, image: None
        stats = options.out / SUMMARY
        files = [*sinks, *work.outputs.files, str(work.folder.write_table()), str(stats)]
        figures = summary.figures() | {"files": files, "waited_for_files": work.outputs.waited, "exit_code": stop.code}
        with atomic_write(stats) as partial:
            partial.write_text(json_text(figures, indent=2) + "\n", encoding="utf-8")
        if not stop and summary.broken is None:
            work.finish(summary)
    if summary.broken is not None:
        raise summary.broken
    return figures


def resume_run(
    out: Path, arch: str = "", console: Console | None = None, seconds: float | None = None
) -> dict[str, Any]:
    """Continue the run of a folder from its last good checkpoint; return its figures, as `record` does.

    With `seconds` it becomes a run of so many [s of water] in all, also where it is complete. The figures of a complete
    one have the key `complete`. Raises `WavetankError`.
    """
    run = load_run(out, arch)
    if run.note and console is not None:
        console.print(f"continuing from the checkpoint before the last one: {run.note}", markup=False)
    with explain_errors(printable(out), "checkpoint"):
        table = dict(run.progress.order)
        for name in ("size", "exports", "only"):
            table[name] = tuple(table[name])
        options = RunOptions(**table | {"out": out} | ({} if seconds is None else {"seconds": seconds}))
    done, wanted = run.checkpoint.frame, round(options.seconds * options.fps)
    if seconds is not None and wanted < done:
        raise WavetankError(
            f"--seconds = {seconds:g} is less than the {done / options.fps:g} s that the run in {printable(out)} has."
        )
    is_finished = len(run.progress.checkpoints) == 1 and not run.checkpoint.parts  # see `Checkpoints.finish`
    if done == wanted and is_finished and (out / SUMMARY).is_file():
        figures: dict[str, Any] = parse_json(read_text(out / SUMMARY, "figures"), printable(out / SUMMARY))
        return figures | {"complete": True}
    if options.gif:
        raise WavetankError(f"{printable(out)}: a GIF cannot be continued; run it again with --seconds {seconds:g}.")
    if options.video and not run.checkpoint.parts and options.path(".mp4").is_file():
        part = f"film-{done:05d}.mp4"
        shutil.copyfile(options.path(".mp4"), out / FOLDER / part)
        run.checkpoint.parts = [part]
    return record(run.sim, options, console, run)


def viewpoint_of(scene: Scene) -> Viewpoint:
    """Return the camera of a scene's pictures, for files."""
    camera = Camera.framing(scene)
    return Viewpoint(camera.eye, camera.target, camera.field_of_view, camera.height, camera.upward)


class _ActiveRun:
    """A run in progress: its simulation, options, folder, outputs and checkpoints."""

    def __init__(self, sim: Simulation, options: RunOptions, stop: StopRequest, resumed: ResumedRun | None) -> None:
        self.sim, self.options, self.stop, self.resumed = sim, options, stop, resumed
        self.start = resumed.progress.start if resumed else sim.time
        self.done = resumed.checkpoint.frame if resumed else -1  # number of the last frame that was written
        self.film: SegmentedVideo | None = None
        self.folder = self._folder(options.run(sim, self.start))
        self.last = self.folder.keep_stats(self.done + 1)  # figures of that frame
        self.checkpoints: Checkpoints | None = None
        if options.checkpoint_every:
            self.checkpoints = self._checkpoints()
            if resumed:
                self.checkpoints.written = [resumed.checkpoint]
                self.checkpoints.next = sim.time + options.checkpoint_every

    def _checkpoints(self) -> Checkpoints:
        plain = dataclasses.asdict(self.options)
        del plain["out"]
        return Checkpoints(self.options.out, self.options.checkpoint_every, self.start, plain)

    def finish(self, summary: "Summary") -> None:
        """Keep the last instant of a complete run, unless the folder has the checkpoints of another one."""
        if self.checkpoints is None and name_of_run(self.options.out) not in ("", self.options.name):
            return
        number = round(self.options.seconds * self.options.fps)
        (self.checkpoints or self._checkpoints()).finish(self.sim, number, summary.plain())

    def _folder(self, run: Run) -> RunFolder:
        """Return the folder of this run; that of another run is overwritten."""
        if self.resumed is not None and RunFolder.is_one(self.options.out):
            folder, ignored = RunFolder.open(self.options.out), {"wavetank", "arch", "seconds"}
            if folder.run.model_dump(exclude=ignored) == run.model_dump(exclude=ignored):
                folder.extend(run.seconds)
                return folder
        return RunFolder.create(self.options.out, run, self.sim.scene)

    def open_film(self, stack: ExitStack) -> Any:
        """Open the video, in segments where there are checkpoints."""
        path, size, fps = self.options.path(".mp4"), self.options.size, self.options.fps
        if self.checkpoints is None and self.resumed is None:
            return stack.enter_context(VideoWriter(path, *size, fps))
        folder = make_folder(self.options.out / FOLDER)
        parts = [folder / part for part in self.resumed.checkpoint.parts] if self.resumed else []
        self.film = stack.enter_context(SegmentedVideo(path, size, fps, folder, parts))
        return self.film

    def open_outputs(self, stack: ExitStack, tell: Callable[[str], None]) -> None:
        """Open the files of frames; frames before a checkpoint stay."""
        options = self.options
        self.outputs = Outputs(
            self.folder.base,
            self.folder.scene,
            options.exports,
            fps=options.fps / options.every,
            only=options.only,
            view=viewpoint_of(self.folder.scene),
            kept=self.done // options.every + 1,
            tell=tell,
            frames=int(options.seconds * options.fps / options.every) + 1,
        )
        stack.enter_context(self.outputs)

    def export(self, number: int, frame: Frame, image: Any) -> None:
        """Write every Nth frame in the formats for other programs."""
        if number % self.options.every == 0:
            self.outputs.write(number // self.options.every, frame)

    def checkpoint(self, number: int, summary: "Summary") -> None:
        """Append the frame's figures; write a checkpoint where one is due, and where the run ends early."""
        self.folder.add_stats(summary.last)
        if self.checkpoints and (self.stop or self.checkpoints.is_due(self.sim.time)):
            self.outputs.drain()
            parts = self.film.end_segment(number) if self.film else []
            self.checkpoints.write(self.sim, number, summary.plain(), parts)


def _open_sinks(options: RunOptions, stack: ExitStack, work: _ActiveRun) -> dict[str, Sink]:
    """Open what takes frames, by file name; the `stack` closes it."""
    sinks: dict[str, Sink] = {}
    if options.video:
        film = work.open_film(stack)
        sinks[str(options.path(".mp4"))] = lambda number, frame, image: film.write(image)
    if options.gif:
        size = options.gif_size
        loop = stack.enter_context(GifWriter(options.path(".gif"), *size, options.fps))
        sinks[str(options.path(".gif"))] = lambda number, frame, image: loop.write(resized(image, size))
    if options.frames:
        sinks[str(options.path("-#####.png"))] = lambda number, frame, image: write_png(
            options.path(f"-{number:05d}.png"), image
        )
    return sinks


def progress_bar(console: Console) -> Progress:
    """Return the line that shows a run: time, speed, particles and density error, one line at any width."""
    return Progress(
        TextColumn("{task.description}", table_column=Column(no_wrap=True)),
        BarColumn(bar_width=None, table_column=Column(min_width=4, ratio=1)),
        _Figures(table_column=Column(no_wrap=True)),
        TimeRemainingColumn(table_column=Column(no_wrap=True)),
        console=console,
        transient=False,
        expand=True,
    )


def _run(work: _ActiveRun, renderer: Renderer | None, sinks: Sequence[Sink], console: Console | None) -> "Summary":
    """Advance the water and give each frame to every sink, with its picture where there is a renderer."""
    sim, options = work.sim, work.options
    summary = Summary(sim, work.resumed.checkpoint.figures if work.resumed else None, work.last)
    moving = options.style | {"shutter": min(sim.scene.frame_time, 1.0 / options.fps)}
    progress = progress_bar(console or Console(stderr=True))

    def show_compile(number: int, _: str) -> None:
        progress.update(task, description=f"compiling kernel {number}")

    with progress, on_compile(show_compile):
        total = options.seconds or 1.0
        task = progress.add_task("wavetank", total=total, time=sim.time, fps=0.0, count=sim.count, error=0.0)
        first, shown = 0.0, 0  # s until the first frame was done, compilation included
        try:
            for number, frame in sim.numbered_frames(options.seconds, options.fps, work.start, work.done):
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
                    description="wavetank",
                    completed=sim.time - work.start,
                    time=sim.time,
                    fps=speed,
                    count=sim.count,
                    error=summary.last["density_error_mean"],
                )
                work.checkpoint(number, summary)
                if work.stop:
                    summary.interrupted = True
                    break
        except NotFiniteError as error:
            summary.broken = error
    return summary

"""Checkpoints of a run: complete states on disk, from which `wavetank resume` continues to the same bits.

A run's folder has them in `states/`: `NUMBER.npz`, states (`simulation/state_file.py`) after that many frames, the last
two; `film-NUMBER.mp4`, the segments of a video that end there; and `run.json`, which names both states with their
SHA-256, the options of the run and the figures so far. `run.json` is replaced atomically after the state is on disk:
whenever the process ends, it names complete states.

It repeats the options that `run.toml` (`folder.py`) has, because state, options and figures have to change atomically,
and `run.toml` belongs to the last run in this folder, which may have written no checkpoint. A run is always resumed
from `run.json`.
"""

import dataclasses
import hashlib
import json
import math
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from wavetank.formats.mp4 import VideoWriter, join
from wavetank.foundation.atomic_write import atomic_write, make_folder
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.input_limits import explain_errors, parse_json, printable, read_text
from wavetank.foundation.model import Model
from wavetank.foundation.version import VERSION
from wavetank.simulation.simulation import Simulation

FOLDER, FILE = "states", "run.json"
FORMAT = 1
Name = Annotated[str, Field(pattern=r"^[0-9]{5,9}\.npz$")]
Part = Annotated[str, Field(pattern=r"^film-[0-9]{5,9}\.mp4$")]


class Checkpoint(Model):
    """A saved state, and how far the run's files were then."""

    state: Name
    sha256: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
    frame: Annotated[int, Field(ge=0, le=100_000_000)]  # number of the last frame that was written
    figures: dict[str, Any]  # of the run so far
    parts: Annotated[list[Part], Field(max_length=1_000_000)] = []  # of the video


class Progress(Model):
    """What `run.json` holds."""

    format: Literal[1] = 1
    wavetank: str = VERSION
    arch: str = "cpu"
    start: Annotated[float, Field(ge=0, le=1e12, allow_inf_nan=False)] = 0.0  # s: time of the water at the first frame
    order: dict[str, Any]
    checkpoints: Annotated[list[Checkpoint], Field(min_length=1, max_length=2)]  # the last one first


class Checkpoints:
    """Writes the checkpoints of a running run."""

    def __init__(self, out: Path, every: float, start: float, order: dict[str, Any]) -> None:
        self.folder = make_folder(out / FOLDER)
        self.every, self.start, self.order = every, start, order
        self.written: list[Checkpoint] = []
        self.next = start + every  # s of water

    def is_due(self, time: float) -> bool:
        """Say whether the next one is due at `time` [s of water]."""
        return time >= self.next - 1e-9

    def write(self, sim: Simulation, frame: int, figures: dict[str, Any], parts: list[Path]) -> None:
        """Write one after `frame`; the one before stays, earlier ones are deleted."""
        path = self.folder / f"{frame:05d}.npz"
        sim.save(path, lasting=True)
        made = Checkpoint(
            state=path.name, sha256=_digest(path), frame=frame, figures=figures, parts=[part.name for part in parts]
        )
        self.written = [made, *(other for other in self.written if other.state != made.state)][:2]
        every = self.every or math.inf
        self.next = self.start + every * np.floor((sim.time - self.start) / every + 1.0 + 1e-9)
        about = Progress(arch=sim.arch or "cpu", start=self.start, order=self.order, checkpoints=self.written)
        with atomic_write(self.folder / FILE, lasting=True) as partial:
            partial.write_text(json.dumps(about.model_dump(), indent=1, allow_nan=False), encoding="utf-8")
        for other in self.folder.glob("*.npz"):
            if other.name not in {checkpoint.state for checkpoint in self.written}:
                other.unlink(missing_ok=True)

    def finish(self, sim: Simulation, frame: int, figures: dict[str, Any]) -> None:
        """Keep the last instant alone, from which a complete run can be extended."""
        self.written = []
        self.write(sim, frame, figures, [])
        for path in self.folder.glob("film-*.mp4"):
            path.unlink(missing_ok=True)


@dataclasses.dataclass(frozen=True)
class ResumedRun:
    """A run to be continued, at a checkpoint."""

    sim: Simulation
    progress: Progress
    checkpoint: Checkpoint
    note: str = ""  # why the last checkpoint could not be used


def load_run(out: Path, arch: str = "") -> ResumedRun:
    """Load the run of a folder at its last good checkpoint; raises `WavetankError` without one."""
    place = out / FOLDER / FILE
    origin = printable(place)
    if not place.exists():
        raise WavetankError(
            f"{printable(out)}: there is no run to resume; name the folder of a `wavetank run` that is complete, or "
            "that ended early with --checkpoint-every."
        )
    with explain_errors(origin, "checkpoint"):
        table = parse_json(read_text(place, "checkpoint", 64_000_000), origin)
        version = table.get("format") if isinstance(table, dict) else None
        if version != FORMAT:
            raise WavetankError(
                f"{origin}: this checkpoint has the format {str(version)[:20]}; this version of wavetank reads "
                f"{FORMAT}: use the one that wrote it, {str(table.get('wavetank') if version else None)[:20]}."
            )
        progress: Progress = Progress.parse(table, origin)
    problems = []
    for checkpoint in progress.checkpoints:
        path = out / FOLDER / checkpoint.state
        try:
            if not path.is_file() or _digest(path) != checkpoint.sha256:
                raise WavetankError(f"{printable(path)}: this state is missing or damaged: its SHA-256 does not match.")
            missing = next((part for part in checkpoint.parts if not (out / FOLDER / part).is_file()), None)
            if missing is not None:
                raise WavetankError(f"{printable(out / FOLDER / missing)}: this part of the video is missing.")
            sim = Simulation.restore(path, arch=arch or progress.arch)
        except WavetankError as error:
            problems.append(str(error))
            continue
        return ResumedRun(sim, progress, checkpoint, " ".join(problems))
    raise WavetankError(f"{origin}: no checkpoint can be used: {' '.join(problems)}")


def name_of_run(out: Path) -> str:
    """Return the name of the run whose checkpoints a folder has, "" without any that can be read."""
    try:
        table = parse_json(read_text(out / FOLDER / FILE, "checkpoint", 64_000_000), FILE)
        return str(table["order"]["name"])
    except (WavetankError, KeyError, TypeError):
        return ""


def _digest(path: Path) -> str:
    whole = hashlib.sha256()
    with path.open("rb") as file:
        while block := file.read(1 << 20):
            whole.update(block)
    return whole.hexdigest()


class SegmentedVideo:
    """A video in segments that end at checkpoints, so that a killed process leaves what was drawn before."""

    def __init__(self, path: Path, size: tuple[int, int], fps: float, folder: Path, parts: list[Path]) -> None:
        self.path, self.size, self.fps, self.folder, self.parts = path, size, fps, folder, [*parts]
        self._writer: VideoWriter | None = None

    def write(self, image: np.ndarray) -> None:
        """Append a picture, uint8 [height, width, 3]."""
        if self._writer is None:
            self._writer = VideoWriter(self.folder / "film-now.mp4", *self.size, self.fps)
        self._writer.write(image)

    def end_segment(self, frame: int) -> list[Path]:
        """End a segment after `frame`; return all segments."""
        if self._writer is not None:
            self._writer.path = self.folder / f"film-{frame:05d}.mp4"
            self._writer.close()
            self.parts.append(self._writer.path)
            self._writer = None
        return self.parts

    def __enter__(self) -> "SegmentedVideo":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: Any) -> None:
        """Join all segments, except after an error other than an interrupt."""
        if kind is None or not issubclass(kind, Exception):
            last = self.folder / "film-99999999.mp4"
            if self._writer is not None:
                self._writer.path = last
                self._writer.close()
            parts = [*self.parts, last] if last.exists() else self.parts
            if parts:
                join(parts, self.path)
            last.unlink(missing_ok=True)
        elif self._writer is not None:
            self._writer.discard()

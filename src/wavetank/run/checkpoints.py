"""Checkpoints of a run: whole states on disk, from which `wavetank resume` goes on to the same bits.

A run's folder has them in `states/`: `NUMBER.npz`, states (`simulation/saved.py`) after that many frames, the last two;
`film-NUMBER.mp4`, the parts of a video that end there; and `run.json`, which names both states with their SHA-256, what
was ordered and the figures so far. `run.json` is replaced in one move after the state is on the disk: whenever the
process ends, it names states that are complete.

It repeats what `run.toml` (`folder.py`) says was ordered, on purpose: state, order and figures have to
change in one move, and `run.toml` belongs to whatever ran in this folder last, which may be another run that wrote no
checkpoint. What goes on is always what `run.json` says.
"""

import dataclasses
import hashlib
import json
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
    """One of them."""

    state: Name
    sha256: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
    frame: Annotated[int, Field(ge=0, le=100_000_000)]  # that were written
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
    """Keeps those of a run that is under way."""

    def __init__(self, out: Path, every: float, start: float, order: dict[str, Any]) -> None:
        self.folder = make_folder(out / FOLDER)
        self.every, self.start, self.order = every, start, order
        self.kept: list[Checkpoint] = []
        self.next = start + every  # s of water

    def is_due(self, time: float) -> bool:
        """Say whether the next one is due at `time` [s of water]."""
        return time >= self.next - 1e-9

    def keep(self, sim: Simulation, frame: int, figures: dict[str, Any], parts: list[Path]) -> None:
        """Write one after so many frames; the one before is kept, and earlier ones go."""
        path = self.folder / f"{frame:05d}.npz"
        sim.save(path, lasting=True)
        made = Checkpoint(
            state=path.name, sha256=_digest(path), frame=frame, figures=figures, parts=[part.name for part in parts]
        )
        self.kept = [made, *(other for other in self.kept if other.state != made.state)][:2]
        self.next = self.start + self.every * np.floor((sim.time - self.start) / self.every + 1.0 + 1e-9)
        about = Progress(arch=sim.arch or "cpu", start=self.start, order=self.order, checkpoints=self.kept)
        with atomic_write(self.folder / FILE, lasting=True) as partial:
            partial.write_text(json.dumps(about.model_dump(), indent=1, allow_nan=False), encoding="utf-8")
        for other in self.folder.glob("*.npz"):
            if other.name not in {checkpoint.state for checkpoint in self.kept}:
                other.unlink(missing_ok=True)

    def finish(self) -> None:
        """Remove all of them: the run is complete."""
        for pattern in ("*.npz", "film-*.mp4"):
            for path in self.folder.glob(pattern):
                path.unlink(missing_ok=True)
        (self.folder / FILE).unlink(missing_ok=True)
        for path in (self.folder,):
            if not any(path.iterdir()):
                path.rmdir()


@dataclasses.dataclass(frozen=True)
class Begun:
    """A run that goes on."""

    sim: Simulation
    progress: Progress
    checkpoint: Checkpoint
    note: str = ""  # where the last checkpoint could not be taken


def begun(out: Path, arch: str = "") -> Begun:
    """Return the run whose folder this is, at its last good checkpoint; raises `WavetankError` where there is none."""
    place = out / FOLDER / FILE
    origin = printable(place)
    if not place.exists():
        raise WavetankError(
            f"{printable(out)}: there is no run to resume; name the folder of a `wavetank run --checkpoint-every` that "
            "ended early; a completed run keeps no checkpoints."
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
                raise WavetankError(f"{printable(path)}: this state is missing, or damaged: its SHA-256 is another.")
            missing = next((part for part in checkpoint.parts if not (out / FOLDER / part).is_file()), None)
            if missing is not None:
                raise WavetankError(f"{printable(out / FOLDER / missing)}: this part of the video is missing.")
            sim = Simulation.restore(path, arch=arch or progress.arch)
        except WavetankError as error:
            problems.append(str(error))
            continue
        return Begun(sim, progress, checkpoint, " ".join(problems))
    raise WavetankError(f"{origin}: no checkpoint can be taken: {' '.join(problems)}")


def _digest(path: Path) -> str:
    whole = hashlib.sha256()
    with path.open("rb") as file:
        while block := file.read(1 << 20):
            whole.update(block)
    return whole.hexdigest()


class FilmInParts:
    """A video that is cut at each checkpoint, so that what was drawn before it outlives the process."""

    def __init__(self, path: Path, size: tuple[int, int], fps: float, folder: Path, parts: list[Path]) -> None:
        self.path, self.size, self.fps, self.folder, self.parts = path, size, fps, folder, [*parts]
        self._writer: VideoWriter | None = None

    def write(self, image: np.ndarray) -> None:
        """Append a picture, uint8 [height, width, 3]."""
        if self._writer is None:
            self._writer = VideoWriter(self.folder / "film-now.mp4", *self.size, self.fps)
        self._writer.write(image)

    def cut(self, frame: int) -> list[Path]:
        """End a part after so many frames; return all parts."""
        if self._writer is not None:
            self._writer.path = self.folder / f"film-{frame:05d}.mp4"
            self._writer.close()
            self.parts.append(self._writer.path)
            self._writer = None
        return self.parts

    def __enter__(self) -> "FilmInParts":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: Any) -> None:
        """Make one file of all parts, but where something other than an interrupt went wrong."""
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

"""The folder of a run: its options and what it wrote; docs/formats.md.

run.toml       the options of the run, and the version of this layout
scene.toml     the scene as it was run, with meshes and heights embedded
stats.jsonl    one line of figures for each frame, the first one at the start
stats.json     figures of the whole run, written at its end
stats.csv      figures of all frames as a table, written at its end
states/        checkpoints: complete states, from which the run can be resumed bit for bit
NAME*          pictures, films and files of frames
"""

import contextlib
import csv
import json
import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Literal

import tomli_w
from pydantic import Field

from wavetank.formats import hdf5, npz
from wavetank.foundation.atomic_write import atomic_write, make_folder, partial_path
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.input_limits import explain_errors, parse_toml, printable, read_text
from wavetank.foundation.json_text import json_text
from wavetank.foundation.model import Model
from wavetank.foundation.version import VERSION
from wavetank.scene.scene import Scene
from wavetank.simulation.state import State

FILE, SCENE, STATS, SUMMARY = "run.toml", "scene.toml", "stats.jsonl", "stats.json"
TABLE = "stats.csv"
LARGEST_STATS = 4_000_000_000  # bytes: a day of water at 60 frames per second
NUMBER = "[0-9]" * 5  # of a frame in the name of its file
LONGEST_ROW = 400_000  # characters


class Run(Model):
    """The options of a run, as run.toml has them."""

    format: Literal[1] = 1
    wavetank: str = VERSION  # that started it
    name: str = "run"  # prefix of file names
    arch: str = "cpu"
    seconds: Annotated[float, Field(ge=0, le=86400, allow_inf_nan=False)] = 0.0  # of water
    start: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 0.0  # s: time of the water at the first frame
    fps: Annotated[float, Field(ge=1, le=240, allow_inf_nan=False)] = 30.0
    size: tuple[Annotated[int, Field(ge=1)], Annotated[int, Field(ge=1)]] = (1280, 720)  # px
    video: bool = False
    gif: bool = False
    frames: bool = False
    exports: Annotated[list[str], Field(max_length=100)] = []
    only: Annotated[list[str], Field(max_length=100)] = []
    every: Annotated[int, Field(ge=1, le=100_000_000)] = 1
    quality: str = "draft"
    look: dict[str, str] = {}


@contextlib.contextmanager
def claimed(folder: Path) -> Iterator[None]:
    """Have a folder for one run; raises `WavetankError` where a run of another process writes to it."""
    mark = partial_path(make_folder(folder) / "run")  # what a dead process left was swept
    others = [path for path in folder.glob(".run.*.partial") if path.name.split("-")[1] != mark.name.split("-")[1]]
    if others:
        raise WavetankError(
            f"{printable(folder)}: another run, process {others[0].name.split('-')[1]}, writes to this folder; name "
            "another one with --out, or wait."
        )
    mark.touch()
    try:
        yield
    finally:
        mark.unlink(missing_ok=True)


class RunFolder:
    """A run's folder, open for reading or writing."""

    def __init__(self, path: Path, run: Run, scene: Scene) -> None:
        self.path, self.run, self.scene = path, run, scene

    @classmethod
    def create(cls, path: str | Path, run: Run, scene: Scene) -> "RunFolder":
        """Create the folder of a new run, with what is needed to repeat it."""
        folder = cls(make_folder(path), run, scene)
        scene.save(folder.path / SCENE)
        for stale in (STATS, SUMMARY, TABLE):
            (folder.path / stale).unlink(missing_ok=True)
        for frame in folder.path.glob(f"{_escaped(run.name)}-{NUMBER}.*"):
            frame.unlink(missing_ok=True)  # of a longer run before
        folder.save_options()
        return folder

    def extend(self, seconds: float) -> None:
        """Make it a run of so many seconds of water in all."""
        self.run.seconds = seconds
        self.save_options()

    def save_options(self) -> None:
        """Write `run.toml`."""
        with atomic_write(self.path / FILE) as partial:
            partial.write_text(tomli_w.dumps(self.run.model_dump()), encoding="utf-8")

    @classmethod
    def is_one(cls, path: str | Path) -> bool:
        """Say whether a path is the folder of a run."""
        return (Path(path) / FILE).is_file()

    @classmethod
    def open(cls, path: str | Path) -> "RunFolder":
        """Open the folder of a run; raises `WavetankError` for any other path."""
        place = Path(path) / FILE
        origin = printable(place)
        with explain_errors(origin, "run"):
            table = parse_toml(read_text(place, "run"), origin, "this run")
            if table.get("format", 1) != 1:
                made = table.get("wavetank", "a later one")
                raise WavetankError(
                    f"{origin}: format = {str(table['format'])[:20]} is not known to this version of wavetank, which "
                    f"reads 1; use the one that wrote it, {str(made)[:20]}."
                )
            return cls(Path(path), Run.parse(table, origin), Scene.load(Path(path) / SCENE))

    @property
    def base(self) -> Path:
        """Prefix of the paths of the run's files."""
        return self.path / self.run.name

    # --- figures ---

    def add_stats(self, row: Mapping[str, float]) -> None:
        """Append the figures of a frame."""
        with (self.path / STATS).open("a", encoding="utf-8") as file:
            file.write(_line(row))

    def stats(self) -> list[dict[str, float]]:
        """Return the figures of all finished frames; raises `WavetankError` for malformed lines."""
        path = self.path / STATS
        if not path.exists():
            return []
        *lines, _ = read_text(path, "figures", LARGEST_STATS).split("\n")  # the last one is empty, or was not finished
        return [_row(line, f"{printable(path)}, line {number}") for number, line in enumerate(lines, 1)]

    def write_table(self) -> Path:
        """Write the figures of all frames as CSV and return its path."""
        rows = self.stats()
        names = list(dict.fromkeys(name for row in rows for name in row))
        with atomic_write(self.path / TABLE) as partial, partial.open("w", encoding="utf-8", newline="") as file:
            table = csv.DictWriter(file, names, restval="", lineterminator="\n")
            table.writeheader()
            table.writerows({name: "" if math.isnan(value) else value for name, value in row.items()} for row in rows)
        return self.path / TABLE

    def keep_stats(self, count: int) -> dict[str, float]:
        """Keep the figures of the first `count` frames only, from which the run continues; return those of the last."""
        rows = self.stats()[:count]
        with atomic_write(self.path / STATS) as partial:
            partial.write_text("".join(map(_line, rows)), encoding="utf-8")
        return rows[-1] if rows else {}

    # --- frames ---

    def has_instants(self) -> bool:
        """Say whether complete frames were written: npz or h5, with all parts that other formats need."""
        whole = not self.run.only or {"particles", "foam", "solids"} <= {*self.run.only}
        return whole and (self._has_tables() or any(self._archives()))

    def instants(self) -> Iterator[State]:
        """Yield the written frames."""
        if self._has_tables():
            return hdf5.read(self._hdf5())
        return (npz.read(path, self.scene) for path in self._archives())

    def instant_at(self, time: float) -> State:
        """Return the written frame nearest to a time of the water [s]; raises `WavetankError` without any."""
        between, archives = self.run.every / self.run.fps, self._archives()
        number = max(0, round((time - self.run.start) / between))
        if self._has_tables():
            number = min(number, len(hdf5.times(self._hdf5())) - 1)
            found = next(hdf5.read(self._hdf5(), number), None) if number >= 0 else None
            if found is not None:
                return found
        if not archives:
            raise WavetankError(f"{self.path}: no frame of this run was finished.")
        return npz.read(archives[min(number, len(archives) - 1)], self.scene)

    def _has_tables(self) -> bool:
        return bool({"h5", "hdf5"} & {*self.run.exports}) and self._hdf5().is_file()

    def _hdf5(self) -> Path:
        return self.base.with_name(f"{self.run.name}{hdf5.SUFFIXES[0]}")

    def _archives(self) -> list[Path]:
        if "npz" not in self.run.exports:
            return []
        return sorted(self.path.glob(f"{_escaped(self.run.name)}-{NUMBER}{npz.SUFFIXES[0]}"))


def _line(row: Mapping[str, float | None]) -> str:
    """Return a row as a line of JSON."""
    return json_text(row) + "\n"


def _row(line: str, origin: str) -> dict[str, float]:
    try:
        row = json.loads(line) if len(line) <= LONGEST_ROW else None
    except (ValueError, RecursionError):
        row = None
    if not isinstance(row, dict) or any(not isinstance(value, int | float | None) for value in row.values()):
        raise WavetankError(
            f"{origin} is not a table of numbers, which the figures of a frame are; restore or delete the file."
        )
    return {name: math.nan if value is None else value for name, value in row.items()}


def _escaped(name: str) -> str:
    return "".join(f"[{letter}]" if letter in "*?[" else letter for letter in name)

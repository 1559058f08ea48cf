"""Export of runs, states and recordings to files for other programs."""

import dataclasses
import itertools
import zipfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import Progress

from wavetank.formats import hdf5
from wavetank.foundation.atomic_write import make_folder
from wavetank.foundation.errors import WavetankError
from wavetank.run.folder import RunFolder
from wavetank.run.outputs import Outputs
from wavetank.run.record import viewpoint_of
from wavetank.run.starting import kind_of
from wavetank.scene.scene import Scene
from wavetank.session.recording import Recording, replay
from wavetank.simulation.simulation import Simulation
from wavetank.simulation.state import State


@dataclasses.dataclass(frozen=True)
class Source:
    """Frames to export."""

    scene: Scene
    frames: Iterable[Any]  # of `Frame` or `State`
    fps: float  # frames per second of water
    name: str  # prefix of file names
    folder: Path  # default folder of the files
    count: int | None = None
    note: str = ""  # for the user


def export(
    source: Path,
    names: tuple[str, ...],
    *,
    out: Path | None,
    only: tuple[str, ...] = (),
    every: int = 1,
    arch: str = "",
    console: Console | None = None,
) -> dict[str, Any]:
    """Export a run's folder, a saved state, a recording or an HDF5 file; return what was written.

    Every `every`-th frame is written in each of the formats `names`. Raises `WavetankError`.
    """
    console = console or Console(stderr=True)
    if not names:
        raise WavetankError("--to is missing; name one or several formats, as in --to usd or --to vtkhdf,ply.")
    if every < 1:
        raise WavetankError(f"--every = {every} is not allowed; it must be a whole number of at least 1.")
    found = open_source(source, arch)
    if found.note:
        console.print(found.note)
    folder, written = make_folder(out or found.folder), 0
    outputs = Outputs(
        folder / found.name,
        found.scene,
        names,
        fps=found.fps / every,
        only=only,
        view=viewpoint_of(found.scene),
        frames=(found.count or 0) // every,
        tell=console.print,
    )
    with outputs, Progress(console=console, transient=True) as progress:
        task = progress.add_task("export", total=found.count)
        for number, frame in enumerate(found.frames):
            if number % every == 0:
                outputs.write(number // every, frame)
                written += 1
            progress.update(task, completed=number + 1)
    return {"frames": written, "files": outputs.files, "fps": found.fps / every}


def open_source(path: Path, arch: str = "") -> Source:
    """Return the frames of a run's folder, a state, a recording or an HDF5 file; raises `WavetankError`."""
    if path.is_dir():
        return _from_run(RunFolder.open(path), arch)
    if not path.is_file():
        raise WavetankError(
            f"there is no file or folder {str(path)!r}; give a run's folder, a state, a recording or an .h5."
        )
    kind = kind_of(path)
    if kind in ("state", "frame"):
        return _from_state(path, arch)
    if kind == "recording" or path.suffix == ".toml":
        return _from_recording(path, arch)
    if kind == "frames":
        return _from_hdf5(path)
    raise WavetankError(
        f"{path}: frames are read from a run's folder, a state (.npz), a recording (.toml) or an HDF5 file "
        "(.h5); this is none of them."
    )


def _from_run(folder: RunFolder, arch: str) -> Source:
    run = folder.run
    if folder.has_instants():
        return Source(folder.scene, folder.instants(), run.fps / run.every, run.name, folder.path)
    if run.start > 0.0:
        raise WavetankError(
            f"{folder.path}: this run started from a saved state and wrote no frames; run it again with --export h5."
        )
    sim = Simulation(folder.scene, arch or run.arch)
    note = (
        f"{folder.path} holds no frames (write them with run --export h5 or npz): the {run.seconds:g} s of water "
        "are computed again."
    )
    frames = sim.frames(run.seconds, run.fps)
    return Source(folder.scene, frames, run.fps, run.name, folder.path, round(run.seconds * run.fps) + 1, note)


def _from_state(path: Path, arch: str) -> Source:
    if zipfile.is_zipfile(path):
        with zipfile.ZipFile(path) as file:
            if "positions.npy" in file.namelist() and "about.npy" not in file.namelist():
                raise WavetankError(
                    f"{path} holds the particles of a frame without their scene; give the run's folder."
                )
    sim = Simulation.restore(path, arch or "cpu")
    return Source(sim.scene, iter([sim.frame()]), 30.0, path.stem, path.parent, 1)


def _from_recording(path: Path, arch: str) -> Source:
    recording = Recording.load(path)
    sessions = replay(recording, arch or recording.arch, str(path))
    first = next(sessions)
    frames = (session.sim.frame() for session in itertools.chain([first], sessions))
    return Source(
        first.sim.scene, frames, 1.0 / first.sim.scene.frame_time, path.stem, path.parent, recording.frames + 1
    )


def _from_hdf5(path: Path) -> Source:
    instants: Iterator[State] = hdf5.read(path)
    first = next(instants, None)
    if first is None:
        raise WavetankError(f"{path} holds no frame.")
    return Source(first.scene, itertools.chain([first], instants), hdf5.rate(path), path.stem, path.parent)

"""Films of a scene, with a camera path and slow motion; finished frames are stored, so that a film can be continued.

While a film is made its frames are in a folder next to it, with the state of the water at the last of them. A film that
was interrupted continues from there and ends with the same bits.
"""

import hashlib
import json
import math
import shutil
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from wavetank.device.compiler import start
from wavetank.formats import exporter_for
from wavetank.formats.png import write_png
from wavetank.foundation.atomic_write import atomic_write, make_folder
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.version import VERSION
from wavetank.run.signals import StopRequest, stop_on_signal
from wavetank.scene.film import Film
from wavetank.scene.scene import Scene
from wavetank.simulation.simulation import Simulation
from wavetank.view.camera import ROOM, Camera
from wavetank.view.film.samples import Watch
from wavetank.view.renderer import Renderer, affordable
from wavetank.view.style import quality_options

FRAMES = ".frames"  # suffix of the folder of frames
STATE, ABOUT = "state.npz", "film.json"
STORE_EVERY = 8  # frames between two saved states of the water
COLUMNS = (
    TextColumn("{task.description}"),
    BarColumn(),
    TextColumn("{task.fields[frame]}"),
    TimeElapsedColumn(),
    TimeRemainingColumn(elapsed_when_finished=True),
)


def film_scene(
    scene: Scene, path: Path, *, arch: str = "cpu", console: Console | None = None, keep: bool = False, **changes: Any
) -> dict[str, Any]:
    """Simulate `scene`, write its film to `path` and return what it shows.

    `changes` replace what the scene's film or its light says; None changes nothing. With `keep` the folder of frames is
    not deleted. Raises `WavetankError`.
    """
    writer = exporter_for(path, "video")
    look = {name: changes.pop(name, None) for name in ("environment", "sun", "floor")}
    order = _film_with(scene, changes)
    if not path.absolute().parent.is_dir():
        raise WavetankError(f"{str(path)!r} cannot be written: there is no folder {str(path.parent)!r}.")
    supersample, style = quality_options(order.quality, order.samples)
    start(arch)
    renderer = Renderer(*order.size, affordable(*order.size, supersample))
    frames = _FrameFolder(path.with_name(path.name + FRAMES), scene, order, look)
    with stop_on_signal(say="interrupted; finished frames are kept (once more stops at once)") as stop:
        camera_work = _Filming(scene, order, frames, renderer, {**style, **look}, stop)
        rendered = camera_work.render_missing(arch, console or Console(stderr=True))
    figures = {
        "file": str(path),
        "scene": scene.title,
        "frames": len(rendered),
        "of": order.frames,
        "fps": order.fps,
        "rendered": sum(rendered),
        "interrupted": len(rendered) < order.frames,
        "exit_code": stop.code,
    }
    if figures["interrupted"]:
        return figures | {"file": str(frames.folder)}
    with writer.write(path, *order.size, order.fps) as out:
        for number in range(order.frames):
            out.write(np.asarray(Image.open(frames.picture(number)).convert("RGB")))
    if not keep:
        shutil.rmtree(frames.folder)
    return figures


def _film_with(scene: Scene, changes: dict[str, Any]) -> Film:
    """Return the scene's film with `changes`, of which None changes nothing; raises `WavetankError`."""
    table = (scene.film or Film()).model_dump(exclude_unset=True)
    chosen = {name: value for name, value in changes.items() if value is not None}
    over_time = {name: plain for name, plain in table.pop("over_time", {}).items() if name not in chosen}
    table |= chosen | ({"over_time": over_time} if over_time else {})
    order: Film = Film.parse(table, "film")
    if scene.dim == 2 and (order.eye or order.target):
        raise WavetankError("film: eye and target are for 3-D worlds; a 2-D world is always seen from the front.")
    return order


def camera_at(order: Film, scene: Scene, time: float, water: float) -> Camera:
    """Return the camera at a time of the film [s], when the water is at `water` [s]."""
    now, aspect = order.at(time), order.size[0] / order.size[1]
    usual = Camera.framing(scene, aspect)
    if scene.dim == 2:
        return usual
    camera = Camera(
        eye=now.eye or usual.eye,
        target=now.target or usual.target,
        field_of_view=math.radians(now.field_of_view),
        near=usual.near,
    )
    return camera.tilted(scene, water, 1.0 if now.eye else ROOM)


class _FrameFolder:
    """The folder of a film's frames, with the state of the water at one of them; frames of another film are deleted."""

    def __init__(self, folder: Path, scene: Scene, order: Film, look: dict[str, Any]) -> None:
        self.folder = make_folder(folder)
        plain = json.dumps([VERSION, scene.text(), order.model_dump(mode="json"), look], sort_keys=True, default=str)
        key = hashlib.sha256(plain.encode()).hexdigest()
        if self._about().get("key") == key:
            return
        for entry in self.folder.iterdir():
            if entry.name.startswith("frame-") or entry.name in (STATE, ABOUT):
                entry.unlink()
        self._write_about({"wavetank": VERSION, "key": key})

    def picture(self, number: int) -> Path:
        """Return the file of a frame."""
        return self.folder / f"frame-{number:05d}.png"

    def samples(self, number: int) -> Path:
        """Return the file of the samples of a frame whose rendering was interrupted."""
        return self.folder / f"frame-{number:05d}.samples.npz"

    def store(self, sim: Simulation, number: int) -> None:
        """Save the water of a frame."""
        state = self.folder / STATE
        sim.save(state)
        digest = hashlib.sha256(state.read_bytes()).hexdigest()
        self._write_about(self._about() | {"state": number, "sha256": digest})

    def restore(self, scene: Scene, arch: str, wanted: int) -> tuple[Simulation, int]:
        """Return the water at a stored frame not after `wanted`, and its number; else that of the start, and -1."""
        state, about = self.folder / STATE, self._about()
        try:
            number, good = int(about["state"]), hashlib.sha256(state.read_bytes()).hexdigest() == about["sha256"]
            if good and 0 <= number <= wanted:
                return Simulation.restore(state, arch=arch), number
        except (OSError, ValueError, KeyError, TypeError):
            pass
        return Simulation(scene, arch=arch), -1

    def _about(self) -> dict[str, Any]:
        try:
            about = json.loads((self.folder / ABOUT).read_text("utf-8"))
        except (OSError, ValueError):
            return {}
        return about if isinstance(about, dict) else {}

    def _write_about(self, about: dict[str, Any]) -> None:
        with atomic_write(self.folder / ABOUT) as partial:
            partial.write_text(json.dumps(about) + "\n", encoding="utf-8")


class _Filming:
    """Renders the frames of a film that are missing."""

    def __init__(
        self,
        scene: Scene,
        order: Film,
        frames: _FrameFolder,
        renderer: Renderer,
        style: dict[str, Any],
        stop: StopRequest,
    ) -> None:
        self.scene, self.order, self.frames, self.renderer, self.style = scene, order, frames, renderer, style
        self.stop = stop
        self.times = order.times()  # s of water at each frame
        self.samples = style["samples"] if style["traced"] else 1  # of a frame, as the progress bar counts
        self.made = 0  # samples so far

    def render_missing(self, arch: str, console: Console) -> list[bool]:
        """Render the missing frames until interrupted; say for every frame there is whether it was rendered now."""
        there = [self.frames.picture(number).exists() for number in range(self.order.frames)]
        if all(there):
            return [False] * len(there)
        self.sim, self.at = self.frames.restore(self.scene, arch, there.index(False))
        rendered: list[bool] = []
        with Progress(*COLUMNS, console=console, transient=True) as self.bar:
            self.task = self.bar.add_task("film", total=self.samples * there.count(False), frame="")
            for number in range(len(there)):
                if there[number]:
                    rendered.append(False)
                    continue
                if not (self._advance_to(number) and self._render(number)):
                    break
                rendered.append(True)
                if self.stop and number + 1 < len(there):
                    self.frames.store(self.sim, number)
                    break
        return rendered

    def _advance_to(self, number: int) -> bool:
        """Advance the water to a frame; say whether it got there before an interruption."""
        while self.at < number and not self.stop:
            self.at += 1
            self.sim.advance(max(0.0, self.times[self.at] - (self.times[self.at - 1] if self.at else 0.0)))
            if self.at == number and number % STORE_EVERY == 0:
                self.frames.store(self.sim, number)
        if self.stop:
            self.frames.store(self.sim, self.at)
        return not self.stop

    def _render(self, number: int) -> bool:
        """Render and write a frame; say whether it was finished before an interruption."""
        order, time = self.order, number / self.order.fps
        now, camera = order.at(time), camera_at(order, self.scene, time, self.sim.time)
        options = self.style | {"shutter": now.shutter * now.speed / order.fps, "edges": order.edges}
        watch = Watch(tell=lambda samples, of: self._report(number, samples))
        if self.style["traced"]:
            watch.path = self.frames.samples(number)
            options |= {"aperture": now.aperture, "focus": now.focus or camera.distance}
        image = self.renderer.render(self.sim.frame(), camera, watch=watch, legend=False, **options)
        if not watch.whole:
            self.frames.store(self.sim, number)
            return False
        write_png(self.frames.picture(number), image)
        self._report(number, self.samples)
        self.made += self.samples
        return True

    def _report(self, number: int, samples: int) -> bool:
        """Show how many samples of a frame there are; say whether to go on."""
        self.bar.update(self.task, completed=self.made + samples, frame=f"frame {number + 1} of {self.order.frames}")
        return not self.stop

"""The files that a run's frames are written to, by a thread of their own."""

import glob
from collections.abc import Callable, Collection, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

from wavetank.formats import exporter_named
from wavetank.formats.plan import Plan, Series, Shapes, Viewpoint
from wavetank.formats.surface import check_surface, with_surfaces
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.retry import Retry
from wavetank.run.background import BackgroundWriter
from wavetank.scene.scene import Scene
from wavetank.simulation.instant import PARTS
from wavetank.simulation.state import State

MEASURED_FRAMES, LARGE = 10, 1_000_000_000  # frames that predict the size of all; bytes worth a warning
USUAL = ("particles", "foam", "solids")


def parts_named(only: Collection[str]) -> frozenset[str]:
    """Return the parts that `--only` names, without any all but the surface; raises `WavetankError`."""
    wrong = next((name for name in only if name not in PARTS), None)
    if wrong is not None:
        raise WavetankError(f"--only {wrong} is not allowed; a frame has the parts {', '.join(PARTS)}.")
    return frozenset(only or USUAL)


def check_exports(names: Sequence[str], only: Collection[str], scene: Scene) -> list[ModuleType]:
    """Return the modules of formats; raises `WavetankError` for those that cannot hold this scene."""
    modules = [exporter_named(name) for name in names]
    if "surface" in parts_named(only) and modules:
        check_surface(scene)
    for module in modules:
        if hasattr(module, "check"):
            module.check(scene)
        if module.KIND == "particles" and only and not hasattr(module, "write_surface"):
            if "surface" in only and len(set(only)) == 1:
                raise WavetankError(f"{module.SUFFIXES[0][1:]} holds no surface; use obj, ply, usd, vtkhdf, vtp or h5.")
    return modules


def bytes_of(files: Sequence[str]) -> int:
    """Return the size of files and folders [bytes]; ##### in a name matches the number of any frame."""
    found = [
        path
        for name in map(Path, files)
        for path in name.parent.glob(glob.escape(name.name).replace("#####", "[0-9]*"))
    ]
    inside = [below for path in found if path.is_dir() for below in path.rglob("*")]
    return sum(path.stat().st_size for path in (*found, *inside) if path.is_file())


class Outputs:
    """Writes frames into files in parallel with the simulation."""

    def __init__(
        self,
        base: Path,
        scene: Scene,
        names: Sequence[str],
        *,
        fps: float,
        only: Collection[str] = (),
        view: Viewpoint | None = None,
        kept: int = 0,
        frames: int = 0,
        tell: Callable[[str], None] = lambda text: None,
    ) -> None:
        modules = check_exports(names, only, scene)
        self.parts, self.shapes, self.retry = parts_named(only), Shapes(scene), Retry(tell)
        plan = Plan(base, scene, fps, self.parts, self.shapes, view, kept, self.retry)
        self._needs_surface = bool(modules) and "surface" in self.parts
        self._needs_surface |= any(module.KIND == "surface" for module in modules)
        self._series: list[Series] = [
            module.write(plan) if module.KIND == "series" else _EachFrame(module, plan) for module in modules
        ]
        self._background = BackgroundWriter() if modules else None
        self._frames, self._tell = frames, tell

    @property
    def files(self) -> list[str]:
        """Names of the files, with ##### for the number of a frame."""
        return [name for series in self._series for name in series.files]

    @property
    def waited(self) -> float:
        """Time that the simulation waited for the writer [s]."""
        return self._background.waited if self._background else 0.0

    def write(self, number: int, frame: Any) -> None:
        """Queue a `Frame` or a `State` as number `number`; wait while the queue is full.

        Raises the error of an earlier frame.
        """
        if self._background is None:
            return
        instant = frame.state()
        self.shapes.learn(instant.placed)
        self._background.put(lambda: self._write(number, instant), instant.size)
        if number + 1 == MEASURED_FRAMES < self._frames:
            self.drain()
            expected = bytes_of(self.files) / MEASURED_FRAMES * self._frames
            if expected > LARGE:
                self._tell(f"all frames will take about {expected / 1e9:.1f} GB; --every 2 halves that.")

    def _write(self, number: int, instant: State) -> None:
        if self._needs_surface:
            instant = with_surfaces(instant)
        instant = instant.only(self.parts)
        for series in self._series:
            # A growing file retries itself, as a frame must be appended once.
            if series.repeatable:
                self.retry.call(lambda series=series: series.write(number, instant))  # type: ignore[misc]
            else:
                series.write(number, instant)

    def drain(self) -> None:
        """Wait until all frames are in the files; raises the error of one."""
        if self._background is not None:
            self._background.drain()

    def close(self, *, hurry: bool = False) -> None:
        """Write queued frames and complete the files; raises the error of one. In a `hurry` nothing is retried."""
        if hurry:
            self.retry.stop.set()
        try:
            if self._background is not None:
                self._background.finish()
        finally:
            for series in self._series:
                series.close()

    def __enter__(self) -> "Outputs":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: Any) -> None:
        self.close(hurry=kind is not None)


class _EachFrame:
    """One file for each frame."""

    repeatable = True

    def __init__(self, module: ModuleType, plan: Plan) -> None:
        self.module, self.plan = module, plan
        suffix, has_surface = module.SUFFIXES[0], "surface" in plan.parts and hasattr(module, "write_surface")
        self._writers: list[tuple[str, Any]] = []
        if module.KIND == "surface" or plan.parts != {"surface"}:
            self._writers.append(("", module.write))
        if has_surface:
            self._writers.append(("surface", module.write_surface))
        self.files = [str(plan.path(f"-#####{suffix}", part)) for part, _ in self._writers]

    def write(self, number: int, instant: State) -> None:
        """Write a frame."""
        for part, write in self._writers:
            write(self.plan.path(f"-{number:05d}{self.module.SUFFIXES[0]}", part), instant)

    def close(self) -> None:
        """Do nothing."""

"""What a run writes, checked before anything is computed."""

import dataclasses
import math
from pathlib import Path
from typing import Any

from wavetank.formats.gif import LARGEST_RATE
from wavetank.foundation.errors import WavetankError
from wavetank.run.folder import Run
from wavetank.run.outputs import parts_named
from wavetank.simulation.simulation import Simulation
from wavetank.view.style import quality_named, quality_options

GIF_WIDTH = 640  # px, at most, where a GIF's size is not given: it packs worse than any video


@dataclasses.dataclass(frozen=True)
class RunOptions:
    """What a run writes. Raises `WavetankError` for values that are not allowed."""

    out: Path  # folder
    seconds: float  # of water
    fps: float = 30.0  # frames per second of water in video and files
    size: tuple[int, int] = (1280, 720)  # px, of pictures
    name: str = "run"  # prefix of file names
    video: bool = False
    gif: bool = False
    small_gif: bool = False  # whether the width of a GIF is limited to GIF_WIDTH
    frames: bool = False  # one picture for each
    exports: tuple[str, ...] = ()  # formats that each frame is written in
    only: tuple[str, ...] = ()  # parts of a frame to write, of `instant.PARTS`; without any, all but the surface
    every: int = 1  # N: every Nth frame is exported
    quality: str = "draft"
    look: dict[str, Any] = dataclasses.field(default_factory=dict)  # options of a picture: see `Style`
    checkpoint_every: float = 0.0  # s of water between two checkpoints; 0: none

    def __post_init__(self) -> None:
        """Check what does not depend on the scene."""
        if not (math.isfinite(self.seconds) and 0 <= self.seconds <= 86400):
            raise WavetankError(f"--seconds = {self.seconds} is not allowed; it must be a number from 0 to 86400.")
        if not 1.0 <= self.fps <= 240.0:
            raise WavetankError(f"--fps = {self.fps} is not allowed; it must be a number from 1 to 240.")
        if self.gif and self.fps > LARGEST_RATE:
            raise WavetankError(f"--fps = {self.fps} is too fast for --gif; at most {LARGEST_RATE:g}.")
        if not self.name or Path(self.name).name != self.name or not self.name.isprintable():
            raise WavetankError(
                f"--name = {self.name!r} is not allowed; it is the prefix of file names, of printable characters; "
                "--out is the folder."
            )
        if not (self.checkpoint_every == 0.0 or 1e-3 <= self.checkpoint_every <= 86400.0):
            raise WavetankError(
                f"--checkpoint-every = {self.checkpoint_every} is not allowed; it must be seconds of water, from "
                "0.001 to 86400."
            )
        if self.gif and self.checkpoint_every:
            raise WavetankError(
                "--gif cannot be combined with --checkpoint-every, as a GIF cannot be resumed; use --video."
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
        """Options of every picture, for `Style`."""
        return {**quality_options(self.quality)[1], **self.look}

    def run(self, sim: Simulation, start: float) -> Run:
        """Return this as the run's folder stores it, for a run that started at the time `start` [s] of the water."""
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
        """Width and height of a GIF [px]."""
        share = min(1.0, GIF_WIDTH / self.size[0]) if self.small_gif else 1.0
        return max(1, round(share * self.size[0])), max(1, round(share * self.size[1]))

    def path(self, suffix: str) -> Path:
        """Return the file of that suffix."""
        return self.out / f"{self.name}{suffix}"

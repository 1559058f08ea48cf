"""A film of a scene: duration, speed, size and camera. It does not affect the simulation.

    [film]
    duration = 6
    speed = 0.4
    eye = [{time=0, value=[2.0, 0.5, 3.0]}, {time=6, value=[2.6, 0.4, 2.5]}]
    target = [1.2, 0.3, 0.5]
    field_of_view = "32 + 4*sin(0.5*t)"

Numbers may be expressions or keyframes of the time t [s] of the film, as those of `foundation/tracks.py`; so may be the
speed, which makes a film slow down.
"""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from wavetank.foundation.model import METRES, Number
from wavetank.foundation.timed import Timed

Point = tuple[Number, Number, Number]
LASTING = ("duration", "start", "fps")  # what is one number for the whole film
MOST_FRAMES = 100_000


class Film(Timed):
    """How a scene is filmed."""

    duration: Annotated[Number, Field(gt=0.0, le=3600.0)] = 4.0  # s of film
    start: Annotated[Number, Field(ge=0.0, le=86400.0)] = 0.0  # s of water when it begins
    speed: Annotated[Number, Field(ge=0.0, le=100.0)] = 1.0  # s of water in a second of film
    fps: Annotated[Number, Field(ge=1.0, le=240.0)] = 30.0  # frames per second of film
    size: tuple[Annotated[int, Field(ge=16, le=8192)], Annotated[int, Field(ge=16, le=8192)]] = (1280, 720)  # px
    quality: Literal["draft", "standard", "high", "film"] = "standard"
    samples: Annotated[int, Field(ge=1, le=4096)] | None = None  # a pixel, of high and film
    eye: Annotated[Point | None, METRES] = None  # m; without eye and target the camera frames the world
    target: Annotated[Point | None, METRES] = None  # m
    field_of_view: Annotated[Number, Field(gt=1.0, le=150.0)] = 28.0  # deg, from top to bottom
    aperture: Annotated[Number, Field(ge=0.0, le=10.0), METRES] = 0.0  # m: radius of the lens; 0 is sharp everywhere
    focus: Annotated[Number | None, Field(ge=1e-3), METRES] = None  # m from the eye; the distance of the target
    shutter: Annotated[Number, Field(ge=0.0, le=1.0)] = 0.5  # of the time between frames for which it is open

    edges: bool = True  # whether the edges of the tank are drawn

    @model_validator(mode="after")
    def _lasting(self) -> "Film":
        for name in LASTING:
            if name in self.over_time:
                raise ValueError(f"film.{name} changes with time; it must be one number.")
        if self.duration * self.fps > MOST_FRAMES:
            raise ValueError(
                f"film: duration = {self.duration:g} s at fps = {self.fps:g} makes {self.duration * self.fps:,.0f} "
                f"frames; at most {MOST_FRAMES:,} are allowed."
            )
        return self

    @property
    def frames(self) -> int:
        """Number of frames."""
        return max(1, round(self.duration * self.fps))

    def times(self) -> list[float]:
        """Return the time of the water [s] in every frame: what the speed adds up to, by the midpoint rule."""
        now, found = self.start, []
        for number in range(self.frames):
            found.append(now)
            now += self.at((number + 0.5) / self.fps).speed / self.fps
        return found

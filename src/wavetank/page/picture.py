"""Pictures for viewers: of a resolution that the machine can afford, full when paused, encoded as JPEG."""

import io
import math
import time
from typing import Any

import numpy as np
from PIL import Image

from wavetank.session.session import Session
from wavetank.view.choices import options
from wavetank.view.extent import extent_of
from wavetank.view.renderer import Renderer

PICTURE_TIME = 0.025  # s that a picture may take while the water moves
LONGEST_PAUSE = 1 / 15  # s between two pictures, at most, on a machine that is too slow for all of them
ENOUGH = 0.99  # of the wanted pace: below it there are fewer pictures
LARGEST = 1600 * 900  # pixels
SMALLEST = 32  # px
MULTIPLE = 8  # px: sizes are multiples of this
SHARES = (0.4, 0.5, 0.6, 0.72, 0.85, 1.0)  # of full width and height; few, as each needs a renderer
HYSTERESIS = 1.2  # factor by which a picture must miss PICTURE_TIME before its size changes
QUALITY = 84  # of JPEG


class Painter:
    """Makes the pictures of one session."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.asked = self.wanted = (960, 540)  # px
        self.detail = "auto"  # auto, full or half
        self.seconds = 0.0  # duration of the last picture
        self.last_size = (0, 0)  # px, of the last picture
        self._level, self._cost = len(SHARES) - 1, 0.0  # index of SHARES; s that such pictures take on average
        self._pause, self._next = 0.0, 0.0  # s, between two pictures; when the next one is due
        self._renderers: dict[tuple[int, int], Renderer] = {}

    def want(self, width: int, height: int) -> None:
        """Set the size of the picture on the screen [px]."""
        self.asked = (width, height)
        shrink = min(1.0, math.sqrt(LARGEST / (width * height)))
        self.wanted = (max(SMALLEST, int(width * shrink)), max(SMALLEST, int(height * shrink)))
        self.session.aspect = self.wanted[0] / self.wanted[1]
        self._cost = 0.0
        self.session.changes += 1

    @property
    def is_reduced(self) -> bool:
        """Whether the last picture had less than full resolution."""
        return self.detail == "auto" and SHARES[self._level] < 1.0

    @property
    def _needs_densities(self) -> bool:
        """Whether the picture shows densities, which take a neighbour search."""
        return options(self.session.view, self.session.color_by).get("color_by") == "density"

    def _options(self) -> dict[str, Any]:
        session = self.session
        chosen = options(session.view, session.color_by) | session.light
        if session.highlighted in session.sim.solids.names:
            chosen["lit"] = session.sim.solids.find(session.highlighted)
        if chosen["view"] == "slice":
            extent, (axis, place) = extent_of(session.sim.scene), session.cut
            axis = axis if extent.dim == 3 else "z"
            low, high = (float(side["xyz".index(axis)]) for side in (extent.lower, extent.upper))
            chosen["cut"] = f"{axis}={low + place * (high - low):.6g}"
        return chosen

    def is_due(self, now: float) -> bool:
        """Return whether it is time for a picture.

        On a machine that is too slow for both, the water gets most of the time: fewer pictures at its real pace, where
        more of them would show slow motion.
        """
        return self.session.paused or now >= self._next

    def _adapt_pause(self) -> None:
        """Lengthen the pause between pictures while the water is late, else shorten it."""
        session = self.session
        if session.paused or session.pace.measured >= ENOUGH * session.speed:
            self._pause *= 0.8
        else:
            self._pause += 0.2 * (LONGEST_PAUSE - self._pause)
        self._next = time.perf_counter() + self._pause - self.seconds

    def paint(self, sharp: bool = False) -> np.ndarray:
        """Return a current picture, uint8 [height, width, 3]; `sharp`: at full resolution."""
        share = {"auto": 1.0 if sharp else SHARES[self._level], "full": 1.0, "half": 0.5}[self.detail]
        width, height = (max(SMALLEST, int(side * share) // MULTIPLE * MULTIPLE) for side in self.wanted)
        is_first = (width, height) not in self._renderers
        self.last_size = (width, height)
        began, session = time.perf_counter(), self.session
        image = self._renderer(width, height).render(
            session.sim.frame(measured=self._needs_densities),
            session.tilted_camera,
            legend=False,
            hasty=share < 1.0,
            shutter=0.0 if sharp or session.paused else session.sim.scene.frame_time,
            **self._options(),
        )
        self.seconds = time.perf_counter() - began
        self.session.picture_seconds += 0.2 * (self.seconds - self.session.picture_seconds)
        self._adapt_pause()
        if self.detail == "auto" and not sharp and not is_first:
            self._fit_size()
        return image

    def _fit_size(self) -> None:
        """Choose the size of the next pictures by the average time that they take.

        The first picture of a size is not counted: it allocates buffers, which would make the size oscillate.
        """
        self._cost += (0.3 if self._cost else 1.0) * (self.seconds - self._cost)
        now = SHARES[self._level]
        costs = [self._cost * (share / now) ** 2 for share in SHARES]
        if self._cost > HYSTERESIS * PICTURE_TIME:
            self._level = max([k for k in range(self._level) if costs[k] <= PICTURE_TIME], default=0)
        elif self._level + 1 < len(SHARES) and HYSTERESIS * costs[self._level + 1] < PICTURE_TIME:
            self._level += 1
        self._cost = costs[self._level]

    def _renderer(self, width: int, height: int) -> Renderer:
        key = (width, height)
        renderer = self._renderers.pop(key, None) or Renderer(width, height)
        self._renderers[key] = renderer
        while len(self._renderers) > 4:
            del self._renderers[next(iter(self._renderers))]
        return renderer


def png(image: np.ndarray) -> bytes:
    """Encode a picture as PNG."""
    stream = io.BytesIO()
    Image.fromarray(image).save(stream, "PNG")
    return stream.getvalue()


def jpeg(image: np.ndarray) -> bytes:
    """Encode a picture as JPEG."""
    stream = io.BytesIO()
    Image.fromarray(image).save(stream, "JPEG", quality=QUALITY)
    return stream.getvalue()

"""The loop that page and window share: what is asked, a frame of water, a picture where one is due, how it all stands.

It runs in the one thread that may look at the simulation's arrays.
"""

import concurrent.futures
import dataclasses
import os
import threading
import time
from collections.abc import Callable
from typing import Any, Protocol

import numpy as np

from wavetank.foundation.input_limits import one_line
from wavetank.page.about import figures, status, world
from wavetank.page.hud import Hud
from wavetank.page.jobs import Jobs
from wavetank.page.picture import Painter
from wavetank.session.session import Session

STATUS_EVERY = 0.1  # s
FIGURES_SHARE = 0.03  # of the time goes into measuring
FIGURES_SELDOM = 2.0  # s between two measurements, at most
CALM = 0.25  # s without a change after which a sharp picture is worth it
REST = 0.05  # s, at most, without a look at what is asked


@dataclasses.dataclass(frozen=True)
class News:
    """How a session stands, as plain data."""

    status: dict[str, Any] = dataclasses.field(default_factory=dict)
    world: dict[str, Any] = dataclasses.field(default_factory=dict)
    figures: dict[str, float] = dataclasses.field(default_factory=dict)
    measured: int = 0  # how often figures were taken
    game: dict[str, Any] | None = None
    scores: dict[str, dict[str, Any]] = dataclasses.field(default_factory=dict)  # by level


class Audience(Protocol):
    """Who looks at a session."""

    @property
    def looks(self) -> bool:
        """Whether anyone does; time stands still while nobody is there."""

    @property
    def is_ready(self) -> bool:
        """Whether there is use for a picture."""

    @property
    def is_new(self) -> bool:
        """Whether someone has not seen one yet."""

    @property
    def size(self) -> tuple[int, int] | None:
        """Of the place for the picture [px]; None where nobody says."""

    @property
    def detail(self) -> str:
        """How fine pictures are: see `Painter.detail`."""

    def show(self, image: np.ndarray, regions: list[dict[str, Any]]) -> None:
        """Show a picture, uint8 [height, width, 3], with the regions of the game in it."""

    def tell(self, news: News, notes: list[str]) -> None:
        """Show how things stand, and sentences for the person."""


class Loop:
    """Turns a session, paints it and tells how it stands, until `stop`."""

    def __init__(self, session: Session, audience: Audience, figures_every: float = FIGURES_SELDOM) -> None:
        session.smooth = session.patient = True
        session.wait_for_hand()
        self.session, self.audience, self.figures_every = session, audience, figures_every
        self.painter, self.hud = Painter(session), Hud(session)
        self._jobs, self._stopped = Jobs(session.wake), threading.Event()
        self._painted, self._painted_at, self._sharp = -1, 0.0, False
        self._next_status = self._next_figures = 0.0
        self._figures: dict[str, float] = {}
        self._measured, self._measured_at = 0, (-1, 0)  # how often, and at which frame with how many particles

    def ask(self, job: Callable[[], Any]) -> concurrent.futures.Future[Any]:
        """Have `job` done between two frames, from any thread."""
        return self._jobs.ask(job)

    def run(self) -> None:
        """Let the water move until `stop`."""
        while not self._stopped.is_set():
            self.turn_or_pause()
            self.session.rest(REST, asleep=not self.audience.looks)
        self.session.drain()  # what was done while the last frame was computed belongs to the recording

    def turn_or_pause(self) -> None:
        """Turn; what nobody thought of stops the time, is told, and ends nothing."""
        try:
            self.turn()
        except Exception as error:
            if os.environ.get("WAVETANK_STRICT_INPUT"):
                raise
            self.session.paused, self.session.steps_left = True, 0
            self.session.note(f"The water is paused: {type(error).__name__}, {one_line(error)}; begin the scene anew.")
            self._stopped.wait(REST)

    def stop(self) -> None:
        """End `run`, from any thread."""
        self._stopped.set()
        self.session.wake()

    def turn(self) -> None:
        """Do what is due: jobs, commands, a frame, a picture, a status."""
        self._jobs.do_all()
        self.painter.detail = self.audience.detail
        size = self.audience.size
        if size is not None and size != self.painter.asked:
            self.painter.want(*size)
        if self.audience.looks:
            self.session.turn()
        else:  # who comes later sees the beginning
            self.session.drain()
            self.session.pace.stop()
        now = time.perf_counter()
        self._paint(now)
        if now >= self._next_status and self.audience.looks:
            self._next_status = now + STATUS_EVERY
            self._measure(now)
            news = self.news()  # first: a score that cannot be kept is one more note
            notes, self.session.notes = self.session.notes, []
            self.audience.tell(news, notes)

    def news(self) -> News:
        """Return how the session stands."""
        game = self.hud.status()
        return News(
            status(self.session, self.painter),
            world(self.session),
            self._figures,
            self._measured,
            game,
            self.hud.scores,
        )

    def _paint(self, now: float) -> None:
        """Show a picture where something has changed, or is to be seen sharply, and someone waits for it."""
        if not self.audience.is_ready:
            return
        changed = self.session.changes != self._painted
        calm = not changed and not self._sharp and self.painter.is_reduced and now - self._painted_at > CALM
        if not (self.audience.is_new or ((changed or calm) and self.painter.is_due(now))):
            return
        self._painted, self._painted_at, self._sharp = self.session.changes, now, calm
        image = self.painter.paint(sharp=calm)
        self.audience.show(image, self.hud.regions(self.painter.wanted))

    def _measure(self, now: float) -> None:
        """Take the figures anew where the water has moved, and not so often that it is felt."""
        instant = (self.session.ticks, self.session.sim.count)
        if now < self._next_figures or instant == self._measured_at:
            return
        began = time.perf_counter()
        self._figures, self._measured, self._measured_at = figures(self.session), self._measured + 1, instant
        took = time.perf_counter() - began
        self._next_figures = now + min(FIGURES_SELDOM, max(self.figures_every, took / FIGURES_SHARE))

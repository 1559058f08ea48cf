"""A session in a thread of its own, for a front that must never wait for the water.

Commands go in, pictures and figures come out.
"""

import dataclasses
import queue
import threading
import time
from typing import Any

import numpy as np

from wavetank.foundation.errors import WavetankError
from wavetank.front.about import figures, status, world
from wavetank.front.hud import Hud
from wavetank.front.jobs import Jobs
from wavetank.front.picture import Painter
from wavetank.session.commands import Command
from wavetank.session.pace import share_interpreter
from wavetank.session.session import Session

STATUS_EVERY = 0.1  # s
FIGURES_SHARE = 0.03  # of the time goes into measuring
FIGURES_EVERY, FIGURES_SELDOM = 0.2, 2.0  # s between two measurements, at least and at most
CALM = 0.25  # s without a change after which a sharp picture is worth it


@dataclasses.dataclass(frozen=True)
class Shown:
    """What a front draws: it never reads the session itself, which another thread is changing."""

    image: np.ndarray | None = None  # uint8 [height, width, 3]
    number: int = 0  # of the picture
    status: dict[str, Any] = dataclasses.field(default_factory=dict)
    world: dict[str, Any] = dataclasses.field(default_factory=dict)
    figures: dict[str, float] = dataclasses.field(default_factory=dict)
    measured: int = 0  # how often figures were taken
    game: dict[str, Any] | None = None
    scores: dict[str, dict[str, Any]] = dataclasses.field(default_factory=dict)  # by level
    regions: list[dict[str, Any]] = dataclasses.field(default_factory=list)  # of the game, in the picture


class Engine:
    """Turns a session and paints it until `stop`. `submit` and `do` may be called from any thread."""

    def __init__(self, session: Session) -> None:
        self.session, self.painter, self.hud = session, Painter(session), Hud(session)
        session.smooth = True
        self.shown = Shown(
            status=status(session, self.painter), world=world(session), game=self.hud.status(), scores=self.hud.scores
        )
        self.notes: queue.SimpleQueue[str] = queue.SimpleQueue()
        self.failure: BaseException | None = None
        self.size = self.painter.asked  # px of the place for the picture; the front sets it
        self.detail = "auto"
        self._jobs = Jobs(session.wake)
        self.ask = self._jobs.ask  # have something done between two frames
        self._stopped = threading.Event()
        self._thread = threading.Thread(target=self._run, name="wavetank water", daemon=True)
        self._painted, self._painted_at, self._sharp = -1, 0.0, False
        self._next_status = self._next_figures = 0.0
        self._measured_at = -1

    def start(self) -> None:
        """Let the water move."""
        share_interpreter()
        self._thread.start()

    def stop(self) -> None:
        """End the thread and wait for it, as long as a first frame may take to compile: the world is then ours."""
        self._stopped.set()
        self.session.wake()
        if self._thread.is_alive():
            self._thread.join()

    def do(self, kind: type[Command], **fields: Any) -> None:
        """Submit a command; one that is not allowed becomes a note."""
        try:
            self.session.submit(kind.parse(fields))
        except WavetankError as error:
            self.notes.put(str(error))

    def _run(self) -> None:
        try:
            while not self._stopped.is_set():
                self._turn()
                self.session.rest(0.05)
            self.session.drain()  # what was done while the last frame was computed belongs to the recording
        except BaseException as error:  # the front's thread raises it again
            self.failure = error

    def _turn(self) -> None:
        for _ in self._jobs.do_all():
            pass  # who asked has the failure
        self.painter.detail = self.detail
        if self.size != self.painter.asked:
            self.painter.want(*self.size)
        self.session.turn()
        now = time.perf_counter()
        self._paint(now)
        if now >= self._next_status:
            self._next_status = now + STATUS_EVERY
            self._tell(now)

    def _paint(self, now: float) -> None:
        changed = self.session.changes != self._painted
        calm = not changed and not self._sharp and self.painter.is_reduced and now - self._painted_at > CALM
        if not ((changed or calm) and self.painter.is_due(now)):
            return
        self._painted, self._painted_at, self._sharp = self.session.changes, now, calm
        image = self.painter.paint(sharp=calm)
        regions = self.hud.regions(self.painter.wanted)
        self.shown = dataclasses.replace(self.shown, image=image, number=self.shown.number + 1, regions=regions)

    def _tell(self, now: float) -> None:
        session = self.session
        # The game first: a score that cannot be kept is one more note.
        game = self.hud.status()
        notes, session.notes = session.notes, []
        for sentence in notes:
            self.notes.put(sentence)
        measured = self.shown.figures
        count = self.shown.measured
        # The first frames and pictures are compiled on the way; what they took would flatten every curve.
        if now >= self._next_figures and session.ticks != self._measured_at and session.ticks > 2:
            self._measured_at = session.ticks
            began = time.perf_counter()
            measured, count = figures(session), count + 1
            took = time.perf_counter() - began
            self._next_figures = now + min(FIGURES_SELDOM, max(FIGURES_EVERY, took / FIGURES_SHARE))
        self.shown = dataclasses.replace(
            self.shown, status=status(session, self.painter), world=world(session), figures=measured, measured=count,
            game=game, scores=self.hud.scores,
        )  # fmt: skip

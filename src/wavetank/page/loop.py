"""The loop that page, notebook and window share: calls from other threads, a frame, a picture, a status report.

It runs in the one thread that may read the simulation's arrays.
"""

import concurrent.futures
import dataclasses
import os
import queue
import threading
import time
from collections.abc import Callable, Hashable
from typing import Any, Protocol

import numpy as np

from wavetank.device.compiler import on_compile
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.input_limits import one_line
from wavetank.page.about import figures, status, world
from wavetank.page.hud import Hud
from wavetank.page.picture import Painter
from wavetank.session.session import Session

STATUS_EVERY = 0.1  # s
FIGURES_SHARE = 0.03  # of the time that measuring may take
FIGURES_EVERY = 2.0  # s between two measurements, at most
ASKED_SHARE = 0.15  # of the time that answers to viewers may take
MOST_ASKED = 64  # questions that wait
SIZE_EVERY = 0.2  # s between two sizes of pictures
CALM = 0.25  # s without a change after which a sharp picture is made
REST = 0.05  # s, at most, between two looks at the queue of calls


@dataclasses.dataclass(frozen=True)
class Report:
    """The status of a session, as plain data."""

    status: dict[str, Any] = dataclasses.field(default_factory=dict)
    world: dict[str, Any] = dataclasses.field(default_factory=dict)
    figures: dict[str, float] = dataclasses.field(default_factory=dict)
    measured: int = 0  # number of measurements
    game: dict[str, Any] | None = None
    scores: dict[str, dict[str, Any]] = dataclasses.field(default_factory=dict)  # by level


class Audience(Protocol):
    """The viewers of a session, as the loop sees them."""

    @property
    def has_viewers(self) -> bool:
        """Whether there are any; without one the session is paused."""

    @property
    def wants_picture(self) -> bool:
        """Whether a viewer is ready for the next picture."""

    @property
    def has_new_viewer(self) -> bool:
        """Whether a viewer has not seen any yet."""

    @property
    def size(self) -> tuple[int, int] | None:
        """Width and height of the picture on the screen [px]; None where unknown."""

    @property
    def detail(self) -> str:
        """Resolution of pictures: see `Painter.detail`."""

    def show(self, image: np.ndarray, regions: list[dict[str, Any]]) -> None:
        """Show a picture, uint8 [height, width, 3], with the regions of the game in it."""

    def send_report(self, report: Report, notes: list[str]) -> None:
        """Show the status, and messages."""

    def send_progress(self, kernel: int) -> None:
        """Show that a kernel is being compiled, number `kernel` since the start."""


class Loop:
    """Runs a session, makes its pictures and reports its status, until `stop`."""

    def __init__(self, session: Session, audience: Audience, figures_every: float = FIGURES_EVERY) -> None:
        session.smooth = session.starts_on_touch = True
        session.wait_for_touch()
        self.session, self.audience, self.figures_every = session, audience, figures_every
        self.painter, self.hud = Painter(session), Hud(session)
        self._calls: queue.SimpleQueue[tuple[Callable[[], Any], concurrent.futures.Future[Any]]] = queue.SimpleQueue()
        self._asked: dict[Hashable, tuple[Callable[[], Any], concurrent.futures.Future[Any]]] = {}
        self._lock = threading.Lock()  # of `_asked`
        self._next_answer = self._next_size = 0.0  # s of `perf_counter`
        self._stopped = threading.Event()
        self._painted, self._painted_at, self._sharp = -1, 0.0, False
        self._next_status = self._next_figures = self._next_progress = 0.0
        self._figures: dict[str, float] = {}
        self._measured, self._measured_at = 0, (-1, 0)  # how often; frame and particles of the last one

    def call(self, function: Callable[[], Any]) -> concurrent.futures.Future[Any]:
        """Have `function` called between two frames, from any thread; the future has its result or exception."""
        future: concurrent.futures.Future[Any] = concurrent.futures.Future()
        self._calls.put((function, future))
        self.session.wake()
        return future

    def ask(self, key: Hashable, function: Callable[[], Any]) -> concurrent.futures.Future[Any]:
        """Do what `call` does for a viewer: spaced, so that all answers take `ASKED_SHARE` of the time.

        A later question takes the place of one with the same `key` that still waits, whose future is cancelled. Raises
        `WavetankError` where too many wait.
        """
        future: concurrent.futures.Future[Any] = concurrent.futures.Future()
        with self._lock:
            replaced = self._asked.get(key)
            if replaced is None and len(self._asked) >= MOST_ASKED:
                raise WavetankError("Too many questions at once: one was dropped.")
            self._asked[key] = (function, future)
        if replaced is not None:
            replaced[1].cancel()
        self.session.wake()
        return future

    def _answer_calls(self) -> None:
        for _ in range(self._calls.qsize()):
            _answer(*self._calls.get())
        while time.perf_counter() >= self._next_answer:
            with self._lock:
                if not self._asked:
                    return
                question = self._asked.pop(next(iter(self._asked)))
            began = time.perf_counter()
            _answer(*question)
            end = time.perf_counter()
            self._next_answer = end + (end - began) * (1.0 / ASKED_SHARE - 1.0)

    def run(self) -> None:
        """Run until `stop`."""
        with on_compile(self.report_kernel):
            while not self._stopped.is_set():
                self.turn_or_pause()
                self.session.rest(REST, asleep=not self.audience.has_viewers)
        self.session.drain()  # commands of the last frame belong to the recording

    def turn_or_pause(self) -> None:
        """Turn; an unexpected error pauses the session and becomes a note."""
        try:
            self.turn()
        except Exception as error:
            if os.environ.get("WAVETANK_STRICT_INPUT"):
                raise
            self.session.paused, self.session.steps_left = True, 0
            self.session.note(f"The water is paused: {type(error).__name__}, {one_line(error)}; restart the scene.")
            self._stopped.wait(REST)

    def report_kernel(self, number: int, name: str) -> None:
        """Tell viewers of a kernel that is compiled, number `number`, at most every `STATUS_EVERY`."""
        now = time.perf_counter()
        if now >= self._next_progress:
            self._next_progress = now + STATUS_EVERY
            self.audience.send_progress(number)

    def stop(self) -> None:
        """End `run`, from any thread."""
        self._stopped.set()
        self.session.wake()

    def turn(self) -> None:
        """Do what is due: calls, commands, a frame, a picture, a report."""
        self._answer_calls()
        self.painter.detail = self.audience.detail
        size, now = self.audience.size, time.perf_counter()
        if size is not None and size != self.painter.asked and now >= self._next_size:
            self._next_size = now + SIZE_EVERY
            self.painter.want(*size)
        if self.audience.has_new_viewer or self._painted < 0:  # before the first frame, whose kernels take longest
            self._paint(time.perf_counter())
        if self.audience.has_viewers and not (self._painted >= 0 and self.session.compile_ahead()):
            self.session.turn()
        else:  # so that the first viewer sees the start
            self.session.drain()
            self.session.pace.stop()
        now = time.perf_counter()
        self._paint(now)
        if now >= self._next_status and self.audience.has_viewers:
            self._next_status = now + STATUS_EVERY
            self._measure(now)
            report = self.report()  # first, as it may add a note
            notes, self.session.notes = self.session.notes, []
            self.audience.send_report(report, notes)

    def report(self) -> Report:
        """Return the status of the session."""
        game = self.hud.status()
        return Report(
            status(self.session, self.painter),
            world(self.session),
            self._figures,
            self._measured,
            game,
            self.hud.scores,
        )

    def _paint(self, now: float) -> None:
        """Show a picture where something has changed, or a sharp one is due, and a viewer is ready."""
        if not self.audience.wants_picture:
            return
        changed = self.session.changes != self._painted
        calm = not changed and not self._sharp and self.painter.is_reduced and now - self._painted_at > CALM
        if not ((self.audience.has_new_viewer or changed or calm) and self.painter.is_due(now)):
            return
        self._painted, self._painted_at, self._sharp = self.session.changes, now, calm
        image = self.painter.paint(sharp=calm)
        self.audience.show(image, self.hud.regions(self.painter.wanted))

    def _measure(self, now: float) -> None:
        """Measure the water where it has moved, within `FIGURES_SHARE` of the time."""
        instant = (self.session.ticks, self.session.sim.count)
        if now < self._next_figures or instant == self._measured_at:
            return
        began = time.perf_counter()
        self._figures, self._measured, self._measured_at = figures(self.session), self._measured + 1, instant
        took = time.perf_counter() - began
        self._next_figures = now + min(FIGURES_EVERY, max(self.figures_every, took / FIGURES_SHARE))


def _answer(function: Callable[[], Any], future: concurrent.futures.Future[Any]) -> None:
    if future.set_running_or_notify_cancel():
        try:
            future.set_result(function())
        except Exception as error:
            future.set_exception(error)

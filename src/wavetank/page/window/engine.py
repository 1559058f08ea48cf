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
from wavetank.page.loop import Loop, Report
from wavetank.session.commands import Command
from wavetank.session.pace import share_interpreter
from wavetank.session.session import Session

FIGURES_EVERY = 0.2  # s between two measurements, at least
SLOW_START = 1.5  # s without a picture after which compiling is mentioned


@dataclasses.dataclass(frozen=True)
class Shown(Report):
    """What a front draws: it never reads the session itself, which another thread is changing."""

    image: np.ndarray | None = None  # uint8 [height, width, 3]
    number: int = 0  # of the picture
    regions: list[dict[str, Any]] = dataclasses.field(default_factory=list)  # of the game, in the picture


class Engine:
    """Turns a session and paints it until `stop`. `submit` and `do` may be called from any thread."""

    has_viewers = wants_picture = True  # see `loop.Audience`
    has_new_viewer = False

    def __init__(self, session: Session) -> None:
        self.session, self.loop = session, Loop(session, self, FIGURES_EVERY)
        self.painter, self.call = self.loop.painter, self.loop.call
        self.shown = Shown(**vars(self.loop.report()))
        self.notes: queue.SimpleQueue[str] = queue.SimpleQueue()
        self.failure: BaseException | None = None
        self._started, self._said = time.perf_counter(), False
        self.size = self.painter.asked  # px of the place for the picture; the front sets it
        self.detail = "auto"
        self._thread = threading.Thread(target=self._run, name="wavetank water", daemon=True)

    def start(self) -> None:
        """Let the water move."""
        share_interpreter()
        self._thread.start()

    def stop(self) -> None:
        """End the thread and wait for it, as long as a first frame may take to compile: the world is then ours."""
        self.loop.stop()
        if self._thread.is_alive():
            self._thread.join()

    def do(self, kind: type[Command], **fields: Any) -> None:
        """Submit a command; one that is not allowed becomes a note."""
        try:
            self.session.submit(kind.parse(fields))
        except WavetankError as error:
            self.notes.put(str(error))

    def show(self, image: np.ndarray, regions: list[dict[str, Any]]) -> None:
        """Publish a picture."""
        self.shown = dataclasses.replace(self.shown, image=image, number=self.shown.number + 1, regions=regions)

    def send_report(self, report: Report, notes: list[str]) -> None:
        """Publish how things stand."""
        for sentence in notes:
            self.notes.put(sentence)
        self.shown = dataclasses.replace(self.shown, **vars(report))

    def send_progress(self, kernel: int) -> None:
        """Say once that kernels are being compiled, where that takes long."""
        if self.shown.image is None and time.perf_counter() - self._started > SLOW_START and not self._said:
            self._said = True
            self.notes.put("Compiling, once: the next start takes seconds.")

    def _run(self) -> None:
        try:
            self.loop.run()
        except BaseException as error:  # the front's thread raises it again
            self.failure = error

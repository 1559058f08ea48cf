"""Saves the recording of a session every few seconds while it is played, so that a killed one loses little."""

import concurrent.futures
import contextlib
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from wavetank.foundation.atomic_write import partial_path
from wavetank.foundation.errors import WavetankError
from wavetank.scene.scene import Scene
from wavetank.session.commands import Command
from wavetank.session.recording import Recording
from wavetank.session.session import Session

EVERY = 5.0  # s between two saves, or
SHARE = 20.0  # times the duration of one, where that is longer

Call = Callable[[Callable[[], Any]], "concurrent.futures.Future[Any]"]


class Recorder:
    """Saves recordings from a thread of its own; each file is complete and replays to its own digest."""

    def __init__(self, path: Path, session: Session, start: Scene, call: Call) -> None:
        self.path, self.session, self.start = path, session, start
        self._call, self._ended, self._ticks = call, threading.Event(), 0
        self._thread = threading.Thread(target=self._save_repeatedly, daemon=True)
        self._thread.start()

    def _save_repeatedly(self) -> None:
        pause = EVERY
        while not self._ended.wait(pause):
            began = time.monotonic()
            with contextlib.suppress(WavetankError, OSError, TimeoutError, concurrent.futures.TimeoutError):
                self._write()
            pause = max(EVERY, SHARE * (time.monotonic() - began))

    def _write(self) -> None:
        """Copy the log between two frames, and write it in this thread."""
        now = self._call(lambda: _moment(self.session))
        while not now.done() and not self._ended.is_set():
            concurrent.futures.wait([now], timeout=0.2)
        if not now.done() or self._ended.is_set():
            return
        ticks, digest, log = now.result()
        if ticks != self._ticks:
            Recording.of(self.session, self.start, ticks, digest, log).save(self.path)
            self._ticks = ticks

    def finish(self) -> None:
        """End the thread and save the whole recording; raises `WavetankError` where it cannot be replayed."""
        self._ended.set()
        self._thread.join(60.0)
        Recording.of(self.session, self.start).save(self.path)
        print(f"session written to {self.path}", flush=True)


def _moment(session: Session) -> tuple[int, str, list[tuple[int, Command]]]:
    return session.ticks, session.sim.digest(), [*session.log]


@contextlib.contextmanager
def recorded(path: Path | None, session: Session, start: Scene, call: Call) -> Iterator[None]:
    """Record a session within the context; without a path, do nothing."""
    recorder = Recorder(path, session, start, call) if path is not None else None
    try:
        yield
    finally:
        if recorder is not None:
            recorder.finish()


def check_folder(path: Path | None) -> None:
    """Raise `WavetankError` where a recording could not be written."""
    if path is None:
        return
    if not path.resolve().parent.is_dir():
        raise WavetankError(f"--record {path}: the folder {path.resolve().parent} does not exist; create it first.")
    if path.is_dir():
        raise WavetankError(f"--record {path}: this is a folder; name a file in it.")
    partial = partial_path(path)
    try:
        partial.touch()
        partial.unlink()
    except OSError as error:
        raise WavetankError(f"--record {path}: the file cannot be written: {error.strerror or error}.") from None

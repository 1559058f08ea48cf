"""Somebody honest at the page, who shows every picture and asks for the next: for tests, and for an hour's soak."""

import json
import re
import threading
import time
from contextlib import ExitStack
from pathlib import Path

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect


class Watcher:
    """Such a person, whose eyes are a thread."""

    def __init__(self, url: str) -> None:
        self.pictures, self.notes = 0, []
        self._ended = False
        self._stack = ExitStack()
        self.socket = self._stack.enter_context(connect(url, max_size=None))
        self.thread = threading.Thread(target=self._look, daemon=True)
        self.thread.start()

    def _look(self) -> None:
        while not self._ended:
            try:
                message = self.socket.recv(timeout=1.0)
                if isinstance(message, bytes):
                    self.pictures += 1
                    self.socket.send('{"do": "ack"}')
                else:
                    table = json.loads(message)
                    self.notes += table.get("notes", []) + ([table["text"]] if table["type"] == "note" else [])
            except TimeoutError:
                continue
            except ConnectionClosed:
                return

    def send(self, table: dict) -> None:
        """Send a command."""
        self.socket.send(json.dumps(table))

    def wait_for_pictures(self, count: int = 5, seconds: float = 120.0) -> None:
        """Wait until so many were shown."""
        end = time.monotonic() + seconds
        while self.pictures < count and time.monotonic() < end:
            time.sleep(0.05)

    def wait_for_note(self, text: str, seconds: float = 60.0) -> bool:
        """Wait for a note that holds `text`; say whether it came."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if any(text in note for note in self.notes):
                return True
            time.sleep(0.05)
        return False

    def close(self) -> None:
        """Leave."""
        self._ended = True
        self._stack.close()


def resident() -> float:
    """Memory of this process [MB]."""
    return int(re.search(r"VmRSS:\s+(\d+)", Path("/proc/self/status").read_text())[1]) / 1024

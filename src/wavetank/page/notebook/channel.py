"""The widget in a notebook's cell, and its messages over the kernel's channel.

There is no server: messages and pictures use the connection that the notebook has to its kernel, local or remote.
"""

import functools
import importlib.resources
import time
from collections.abc import Callable
from typing import Any

from typing_extensions import override

from wavetank.foundation.errors import WavetankError
from wavetank.foundation.input_limits import explain_errors
from wavetank.foundation.json_text import plain
from wavetank.page.theme import COLORS
from wavetank.page.viewers import Ray, Submit, Viewer, Viewers

TIMEOUT = 15.0  # s without an acknowledged picture after which there is no viewer any more
Table = dict[str, Any]


@functools.cache
def widget_class() -> type[Any]:
    """Return the class of the widget; raises `WavetankError` where its package is missing."""
    try:
        import anywidget
    except ModuleNotFoundError as error:
        raise WavetankError(
            f"wt.show needs the package {error.name} (pip install 'wavetank[notebook]'); then restart the kernel."
        ) from None
    static = importlib.resources.files("wavetank.page.notebook") / "static"
    colors = " ".join(f"--{name}: {value};" for name, value in COLORS.items())
    style = f".wavetank-live {{ {colors} }}\n{(static / 'live.css').read_text('utf-8')}"
    members = {"_esm": (static / "live.js").read_text("utf-8"), "_css": style}
    kind: type[Any] = type("WavetankLive", (anywidget.AnyWidget,), members)
    return kind


class Seat(Viewer):
    """All views of the widget as one viewer: they show the same, and any of them may acknowledge."""

    def __init__(self, widget: Any) -> None:
        super().__init__(None)
        self.widget = widget

    @override
    def post(self, message: Table | bytes) -> None:
        if isinstance(message, bytes):
            self.widget.send({"type": "picture"}, [message])
        else:
            self.widget.send(plain(message))


class Channel:
    """Exchanges messages with the views of one widget, in the kernel's own thread."""

    def __init__(self, submit: Submit, ray: Ray, hello: Callable[[], Table]) -> None:
        self.widget = widget_class()()
        self.viewers = Viewers(submit, ray, hello)
        self.seat = self.viewers.driver = Seat(self.widget)
        self.viewers.all.append(self.seat)
        self.views: set[str] = set()  # that are open
        self.hidden = False  # whether the browser shows another tab
        self.on_message: Callable[[], None] = lambda: None
        self._sent_at = 0.0  # s, on the clock of the process
        self.widget.on_msg(self._hear)

    @property
    def has_viewers(self) -> bool:
        """Whether a view is open, visible and responds."""
        answers = not self.seat.is_busy or time.monotonic() - self._sent_at < TIMEOUT
        return bool(self.views) and not self.hidden and answers

    def send(self, message: Table) -> None:
        """Send a message to all views."""
        if self.views:
            self.seat.post(message)

    def show(self, picture: bytes) -> None:
        """Send a picture once the previous one was shown."""
        if not self.seat.is_busy:
            self._sent_at = time.monotonic()
        self.seat.show(picture)

    def close(self) -> None:
        """Close the widget and its views."""
        self.send({"type": "end"})
        self.widget.close()

    def _hear(self, widget: Any, content: Any, buffers: Any) -> None:
        try:
            with explain_errors("a message", "command"):
                self._act(content if isinstance(content, dict) else {})
        except WavetankError as error:
            self.send({"type": "note", "text": str(error)[:400]})
        self.on_message()

    def _act(self, table: Table) -> None:
        do, view = table.get("do"), str(table.get("view", ""))[:80]
        if do == "open":
            self.views.add(view)
            self.seat.is_busy, self.seat.next_picture, self.seat.is_new, self.hidden = False, None, True, False
            self.send(self.viewers.hello())
        elif do == "leave":
            self.views.discard(view)
            self.viewers.end_tools()
        elif do == "hidden":
            self.hidden = table.get("on") is True
        else:
            self._sent_at = time.monotonic()  # any message shows that it responds
            self.viewers.hear(self.seat, table)

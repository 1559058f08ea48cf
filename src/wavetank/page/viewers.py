"""Connected viewers: one controls the session, the others watch. Runs in the server's event loop."""

import asyncio
import json
import math
import time
from collections.abc import Callable
from typing import Any

from wavetank.foundation.errors import WavetankError
from wavetank.foundation.input_limits import explain_errors, one_line, parse_json
from wavetank.session.commands import COMMANDS, Command, ToolBegin, ToolEnd, ToolMove, command_of

RATE, BURST = 500.0, 1000.0  # messages a second, and at once: more than a pointer makes
FIRST = 200.0  # at once from one who has just connected, so that connecting again gains nothing
BYTES = 4096  # of a message that cost as much as a short message
SLOW = 25.0  # messages that one costs which makes others wait
COSTS = {
    **{kind.model_fields["do"].default: SLOW for kind in COMMANDS if kind.is_slow},
    **dict.fromkeys(("drive", "fit", "detail", "mesh"), SLOW),
    **dict.fromkeys(("size", "point-begin", "tool-begin"), 5.0),
}
DROPPED = 50  # messages beyond the rate that are dropped, unread, between two pauses of `REST`
REST = 0.02  # s
LARGEST_DEBT = 20_000.0  # messages beyond the rate after which a viewer is disconnected
MOST_NOTES = 20  # that wait to be sent
MOST_VIEWERS = 16
LONGEST_SIDE = 8192  # px
REPEAT_AFTER = 1.0  # s after which the same note is sent again
LONGEST_MESSAGE = 2_500_000  # bytes: a dropped scene file

Ray = Callable[[float, float, str], dict[str, Any]]
Tell = Callable[[str], None] | None
Submit = Callable[[Command, Tell], bool]  # takes a command, and what reports a failure in another thread


class RateLimit:
    """Limits what messages cost to `RATE` a second (a token bucket of size `BURST`); who sends on gets into debt."""

    def __init__(self) -> None:
        self.left, self.last = FIRST, time.monotonic()

    def take(self, cost: float = 1.0) -> bool:
        """Charge a message; return whether it may pass."""
        now = time.monotonic()
        self.left, self.last = min(BURST, self.left + RATE * (now - self.last)), now
        self.left -= cost
        return self.left >= 0.0


class Viewer:
    """One socket; at most one picture is in flight, and the next one may wait."""

    def __init__(self, socket: Any) -> None:
        self.socket, self.rate_limit = socket, RateLimit()
        self.is_busy = False  # whether a picture is in flight
        self.next_picture: bytes | None = None
        self.is_new = True  # whether it has not seen any picture yet
        self.size = (960, 540)
        self.last_note = "", -math.inf  # and its time [s]
        self.outbox: dict[str, dict[str, Any] | bytes] = {}  # what waits to be sent: the last message of each kind
        self.filled, self.noted = asyncio.Event(), 0  # whether there are any; notes so far

    def post(self, message: dict[str, Any] | bytes) -> None:
        """Queue a message in place of one of its kind that still waits; the last notes wait together."""
        kind = "picture" if isinstance(message, bytes) else str(message["type"])
        earlier = self.outbox.get(kind)
        if kind == "note":
            kind, self.noted = f"note {self.noted % MOST_NOTES}", self.noted + 1
        elif kind == "status" and isinstance(message, dict) and isinstance(earlier, dict):
            message = {**earlier, **message, "notes": [*earlier["notes"], *message["notes"]][-MOST_NOTES:]}
        self.outbox[kind] = message
        self.filled.set()

    def note(self, text: str) -> None:
        """Queue a sentence, unless it repeats the last one."""
        now = time.monotonic()
        if text != self.last_note[0] or now - self.last_note[1] > REPEAT_AFTER:
            self.last_note = text, now
            self.post({"type": "note", "text": text})

    def show(self, picture: bytes) -> None:
        """Send a picture once the previous one was shown; until then a later one replaces it."""
        if self.is_busy:
            self.next_picture = picture
        else:
            self.is_busy = True
            self.post(picture)

    def acknowledge(self) -> None:
        """Send the waiting picture, as the page has shown the previous one."""
        picture, self.next_picture, self.is_busy = self.next_picture, None, False
        if picture is not None:
            self.show(picture)

    async def send_all(self) -> None:
        """Send queued messages indefinitely."""
        while True:
            await self.filled.wait()
            self.filled.clear()
            while self.outbox:
                message = self.outbox.pop(next(iter(self.outbox)))
                if isinstance(message, bytes):
                    await self.socket.send_bytes(message)
                else:
                    await self.socket.send_text(json.dumps(message, allow_nan=False))


class Viewers:
    """All viewers, in the order in which they connected."""

    def __init__(self, submit: Submit, ray: Ray, hello: Callable[[], dict[str, Any]]) -> None:
        self.submit, self.ray, self.hello = submit, ray, hello
        self.all: list[Viewer] = []
        self.driver: Viewer | None = None
        self.detail = "auto"
        self.wake: Callable[[], None] = lambda: None
        self.in_server: Callable[[Callable[[], None]], None] = lambda job: job()  # in the server's event loop
        self.fit: Callable[[Viewer], None] = lambda viewer: None
        self.aim: Callable[[Viewer, str, float, float, float], None] = lambda *given: None
        self.drop_mesh: Callable[[Viewer, str, str], None] = lambda *given: None
        self.tool = ""  # that the driver used last
        self.down: set[int] = set()  # pointers of the driver that are down

    @property
    def anyone_ready(self) -> bool:
        """Whether a viewer has no picture waiting: the next one is made while one is in flight."""
        return any(viewer.next_picture is None for viewer in self.all)

    async def serve(self, socket: Any) -> None:
        """Serve one page until it disconnects."""
        await socket.accept()
        if len(self.all) >= MOST_VIEWERS:
            await socket.close(1013, "too many viewers")
            return
        viewer = Viewer(socket)
        self.all.append(viewer)
        self.driver = self.driver or viewer
        viewer.post(self.hello())
        self._tell_roles()
        sender = asyncio.create_task(viewer.send_all())
        try:
            await self._listen(viewer)
        finally:
            sender.cancel()
            self._disconnect(viewer)

    async def _listen(self, viewer: Viewer) -> None:
        dropped = 0
        while True:
            message = await viewer.socket.receive()
            if message["type"] == "websocket.disconnect":
                return
            if not viewer.rate_limit.take(1.0 + len(message.get("text") or message.get("bytes") or "") / BYTES):
                # Reading slowly makes the sender wait, and does not affect the simulation.
                dropped += 1
                if viewer.rate_limit.left < -LARGEST_DEBT:
                    await viewer.socket.close(1008, "too many messages")
                    return
                if dropped % DROPPED == 0:
                    await asyncio.sleep(REST)
                continue
            try:
                with explain_errors("a message", "command"):
                    table = _table(message)
                    viewer.rate_limit.take(COSTS.get(str(table.get("do")), 0.0))
                    self.hear(viewer, table)
            except WavetankError as error:
                viewer.note(str(error)[:400])

    def hear(self, viewer: Viewer, table: dict[str, Any]) -> None:
        """Act on one message; raises `WavetankError` where it is not allowed."""
        do = str(table.get("do"))
        if do in FROM_ANYONE:
            FROM_ANYONE[do](self, viewer, table)
        elif viewer is not self.driver:
            self._refuse_watcher(viewer, do)
        elif do == "detail" and table.get("detail") in ("auto", "full", "half"):
            self.detail = table["detail"]
            self.wake()
        elif do in FROM_DRIVER:
            FROM_DRIVER[do](self, viewer, table)
        elif not self.submit(command_of(table), self._reporter(viewer)):
            raise WavetankError("Too many commands at once: one was dropped.")

    def _acknowledge(self, viewer: Viewer, _: dict[str, Any]) -> None:
        viewer.acknowledge()
        self.wake()

    def _resize(self, viewer: Viewer, table: dict[str, Any]) -> None:
        """Set the size of a viewer's pictures [px]."""
        viewer.size = (_whole_number(table, "width", LONGEST_SIDE), _whole_number(table, "height", LONGEST_SIDE))
        self.wake()

    def _take_control(self, viewer: Viewer, _: dict[str, Any]) -> None:
        self.end_tools()
        self.driver = viewer
        self._tell_roles()

    def _refuse_watcher(self, viewer: Viewer, do: str) -> None:
        """Refuse what only the driver may do; a pointer that hovers is answered, with nothing to mark."""
        if do != "hover":
            raise WavetankError("You are watching; take control to use tools.")
        viewer.post({"type": "aim"})

    def _hover(self, viewer: Viewer, table: dict[str, Any]) -> None:
        self.aim(viewer, *_hovered(table))

    def _drop_mesh(self, viewer: Viewer, table: dict[str, Any]) -> None:
        self.drop_mesh(viewer, str(table.get("text", "")), str(table.get("file", "the mesh"))[:200])

    def _reporter(self, viewer: Viewer) -> Tell:
        """Return a function that sends notes to one viewer, from any thread."""
        return lambda text: self.in_server(lambda: viewer.note(text))

    def _point(self, viewer: Viewer, table: dict[str, Any]) -> None:
        """Begin, move or end a tool at a point of the picture: it acts along the ray into the world there."""
        tell = self._reporter(viewer)
        pointer = _whole_number(table, "pointer", 9, least=0)
        if table["do"] == "point-end":
            self.down.discard(pointer)
            self.submit(ToolEnd(pointer=pointer), tell)
            return
        if table["do"] == "point-begin":
            self.tool = str(table.get("tool"))[:80]
        ray = {"pointer": pointer, **self.ray(*_picture_point(table), self.tool)}
        if table["do"] == "point-begin":
            self.down.add(pointer)
            self.submit(
                ToolBegin.parse({**ray, "tool": table.get("tool"), "options": table.get("options") or {}}), tell
            )
        else:
            self.submit(ToolMove.parse(ray), tell)

    def broadcast(self, message: dict[str, Any]) -> None:
        """Queue a message to all viewers."""
        for viewer in self.all:
            viewer.post(message)

    def show(self, picture: bytes) -> None:
        """Send a picture to all viewers, to each at its pace."""
        for viewer in self.all:
            viewer.show(picture)

    def _disconnect(self, viewer: Viewer) -> None:
        self.all.remove(viewer)
        if viewer is self.driver:
            self.end_tools()
            self.driver = self.all[0] if self.all else None
        self._tell_roles()

    def end_tools(self) -> None:
        """End the tools that the driver uses."""
        for pointer in self.down:
            self.submit(ToolEnd(pointer=pointer), None)
        self.down.clear()

    def _tell_roles(self) -> None:
        for viewer in self.all:
            viewer.post({"type": "role", "driving": viewer is self.driver, "viewers": len(self.all)})


Hear = Callable[[Viewers, Viewer, dict[str, Any]], None]
#: What messages of any viewer do, by their names; then those that the driver alone may send.
FROM_ANYONE: dict[str, Hear] = {
    "ack": Viewers._acknowledge,
    "size": Viewers._resize,
    "drive": Viewers._take_control,
    "fit": lambda viewers, viewer, _: viewers.fit(viewer),
}
FROM_DRIVER: dict[str, Hear] = {
    "hover": Viewers._hover,
    "mesh": Viewers._drop_mesh,
    **dict.fromkeys(("point-begin", "point-move", "point-end"), Viewers._point),
}


def _table(message: dict[str, Any]) -> dict[str, Any]:
    text = message.get("text")
    if text is None:
        raise WavetankError("a message must be text: JSON with the key 'do'.")
    table = parse_json(text, "a message, which must be JSON with the key 'do',", LONGEST_MESSAGE)
    if not isinstance(table, dict):
        raise WavetankError("a message must be a JSON object with the key 'do'.")
    return table


def _picture_point(table: dict[str, Any]) -> tuple[float, float]:
    """Return a point of the picture, as shares of its width and height."""
    u, v = table.get("x"), table.get("y")
    for share in (u, v):
        if isinstance(share, bool) or not isinstance(share, int | float) or not -2.0 <= share <= 3.0:
            raise WavetankError("a pointer's x and y must be shares of the picture, numbers around 0 to 1.")
    return float(u or 0.0), float(v or 0.0)


def _hovered(table: dict[str, Any]) -> tuple[str, float, float, float]:
    """Return tool, point and radius of a pointer over the picture; no tool where it has left it."""
    if "x" not in table:
        return "", 0.0, 0.0, 0.0
    reach = table.get("reach", 0.0)
    if isinstance(reach, bool) or not isinstance(reach, int | float) or not 0.0 <= reach <= 2.0:
        raise WavetankError("reach must be a share of the world, a number from 0 to 2.")
    return str(table.get("tool", ""))[:80], *_picture_point(table), float(reach)


def _whole_number(table: dict[str, Any], key: str, most: int, least: int = 1) -> int:
    value = table.get(key, 0)
    if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
        raise WavetankError(f"{key} = {one_line(value, 20)} must be a whole number from {least} to {most}.")
    return value

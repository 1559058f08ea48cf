"""Whatever the one who drives sends: the server lives, and who watches keeps half of the pictures."""

import asyncio
import contextlib
import json
import os
import select
import socket as sockets
import threading
import time
import types
import urllib.error
import urllib.request

import pytest
from watcher import resident
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

import wavetank as wt
from wavetank.page import server
from wavetank.page.dropped import drop_mesh
from wavetank.page.gate import HEADERS
from wavetank.page.loop import Loop
from wavetank.page.viewers import Viewer, Viewers
from wavetank.session.session import Session

POOL = wt.Scene(spacing=0.05, tank=wt.Tank(size=(1.0, 0.6)), fluids=[wt.Block(lower=(0, 0), upper=(0.5, 0.4))])
TEXT = "spacing = 0.05\ntank.size = [1.0, 0.6]\nfluids = [{ lower = [0, 0], upper = [0.5, 0.4] }]\n"
LONG = os.environ.get("WAVETANK_FUZZ") == "long"  # make fuzz
SECONDS, SHARE = (5.0, 0.5) if LONG else (2.0, 0.1)  # beside other tests: whoever watches is not starved
TRIES = 4  # of so many seconds: a neighbour may take the processor for a while


SOLID = {"do": "add-solid", "solid": {"shape": "box", "center": [0.8, 0.1], "size": [0.05, 0.05]}}
FLOODS = {
    "scenes": [{"do": "load", "text": TEXT}],
    "resets": [{"do": "reset", "parameters": {"spacing": 0.04}}, {"do": "reset", "parameters": {}}],
    "solids": [SOLID],
    "bookmarks": [{"do": "bookmark", "name": "a"}, {"do": "bookmark", "name": "a", "action": "go"}],
    "rewinds": [{"do": "rewind", "time": 0.0}],
    "numbers": [{"do": "set", "name": "viscosity", "value": 0.1}],
    "nonsense": [{"do": "x" * 1000}, {"do": "load", "text": "x = ["}],
    "tools": [{"do": "point-begin", "tool": "pour", "x": 0.5, "y": 0.5}, {"do": "point-end"}],
    "large scenes": [{"do": "load", "text": TEXT + "# of 2 MB\n" * 190_000}],
    "meshes": [{"do": "mesh", "file": "a.obj", "text": "v 0 0 0\n" * 90_000}],
    "previews": [{"do": "hover", "tool": "pour", "x": 0.5, "y": 0.5, "reach": 0.1}],
    "undo": [{"do": "undo"}],
    "control": [{"do": "drive"}],
    "sizes": [{"do": "size", "width": 640 + 8 * k, "height": 480} for k in range(50)],
    "choices": [{"do": "fit"}],
    "acknowledgements": [{"do": "ack"}],
}
BY_A_WATCHER = ("choices", "acknowledgements", "nonsense")  # the others are sent by the one who drives


@pytest.mark.parametrize("name", FLOODS if LONG else ["scenes", "solids", "bookmarks", "previews", "choices"])
def test_who_watches_keeps_half_of_the_pictures(playing, watching, name):
    world = playing(POOL)
    with connect(world.socket, max_size=None) as flooder:
        flood_and_watch(world, watching(world.socket), flooder, FLOODS[name], drives=name not in BY_A_WATCHER)


class Pace:
    """How many pictures come in a second, and in a second of the server's work.

    What a neighbour takes of the processor is not the flood's doing: it lengthens seconds, and not those of work. What
    the flood and the one who watches take themselves is not the server's.
    """

    def __init__(self, watcher, others: list[threading.Thread]) -> None:
        self.watcher, self.others = watcher, [watcher.thread, *others]

    def measure(self) -> tuple[float, float]:
        shown, began, work = self.watcher.pictures, time.monotonic(), self._work()
        time.sleep(SECONDS)
        came = self.watcher.pictures - shown
        return came / (time.monotonic() - began), came / max(self._work() - work, 1e-3)

    def best_share(self, flooding: threading.Event) -> float:
        """Of some tries, no more than it takes: each beside a calm time after it, as the world may have grown."""
        best = 0.0
        for _ in range(TRIES):
            flooding.set()
            time.sleep(0.5)
            flooded = self.measure()
            flooding.clear()
            time.sleep(0.5)
            calm = self.measure()
            assert calm[0] > 0.0
            best = max(best, *(now / then for now, then in zip(flooded, calm, strict=True)))
            if best >= SHARE:
                break
        return best

    def _work(self) -> float:
        clocks = [time.pthread_getcpuclockid(thread.ident) for thread in self.others if thread.is_alive()]
        return time.process_time() - sum(map(time.clock_gettime, clocks))


def flood_and_watch(world, watcher, flooder, tables: list[dict], drives: bool) -> None:
    if drives:
        flooder.send('{"do": "drive"}')
    watcher.wait_for_pictures()
    for table in tables:  # kernels that this needs
        flooder.send(json.dumps(table))
    time.sleep(1.0)
    watcher.wait_for_pictures(watcher.pictures + 10)
    before, flooding, ended, sent = resident(), threading.Event(), threading.Event(), [0]

    def flood() -> None:
        texts = [json.dumps(table) for table in tables]
        try:
            while flooding.wait() and not ended.is_set():
                for text in texts:
                    flooder.send(text)
                    sent[0] += 1
        except ConnectionClosed:
            ended.wait()

    thread = threading.Thread(target=flood, daemon=True)
    thread.start()
    share = Pace(watcher, [thread]).best_share(flooding)
    grown = resident() - before
    ended.set()
    flooding.set()
    assert sent[0] > 100 or len(json.dumps(tables)) > 500_000
    assert share >= SHARE, f"{share:.2f} of the pictures"
    assert grown < 100, f"{grown:.0f} MB"
    assert world.thread.is_alive()


class Socket:
    """A page's side that sends these texts and leaves."""

    def __init__(self, texts: list[str]) -> None:
        self.texts, self.sent, self.closed = iter(texts), [], False

    async def accept(self) -> None:
        pass

    async def receive(self) -> dict:
        text = next(self.texts, None)
        return {"type": "websocket.disconnect"} if text is None else {"type": "websocket.receive", "text": text}

    async def send_text(self, text: str) -> None:
        self.sent.append(json.loads(text))

    async def send_bytes(self, picture: bytes) -> None:
        self.sent.append(picture)

    async def close(self, code: int, reason: str) -> None:
        self.closed = True


def served(texts: list[str], viewers: Viewers) -> Socket:
    socket = Socket(texts)
    asyncio.run(viewers.serve(socket))
    return socket


def test_a_message_beyond_the_rate_is_not_heard():
    """Slow commands cost more than moves; who sends on and on is disconnected."""
    heard = []
    viewers = Viewers(
        lambda command, tell: heard.append(command) or True, lambda u, v, tool: {}, lambda: {"type": "hello"}
    )
    viewers.fit = heard.append
    for table, most in (({"do": "fit"}, 15), ({"do": "load", "text": TEXT}, 15), ({"do": "pause"}, 500)):
        heard.clear()
        socket = served([json.dumps(table)] * 2000, viewers)
        assert 5 <= len(heard) <= most, (table, len(heard))
        assert not socket.closed and not viewers.all
    assert served(['{"do": "fit"}'] * 100_000, viewers).closed


def test_a_picture_is_not_lost_behind_messages():
    """What waits is the last of each kind, so that no flood of messages displaces a picture, nor grows."""
    viewer = Viewer(Socket([]))
    for number in range(10_000):
        viewer.post({"type": "role", "driving": bool(number % 2)})
        viewer.post({"type": "status", "time": number, "notes": [f"{number}"]})
        viewer.note(f"note {number}")
        if number == 5000:
            viewer.show(b"picture")
    assert b"picture" in viewer.outbox.values() and len(viewer.outbox) < 30
    assert viewer.outbox["status"]["time"] == 9999 and len(viewer.outbox["status"]["notes"]) <= 20

    async def send() -> None:
        sender = asyncio.create_task(viewer.send_all())
        await asyncio.sleep(0.05)
        sender.cancel()

    asyncio.run(send())
    assert b"picture" in viewer.socket.sent and not viewer.outbox
    assert [m["text"] for m in viewer.socket.sent if isinstance(m, dict) and m["type"] == "note"][-1] == "note 9999"


def test_questions_are_spaced_and_the_last_of_a_viewer_counts():
    """However many: answers take a share of the time, and commands that are many wait for the next frame."""
    session = Session(POOL)
    audience = types.SimpleNamespace(
        has_viewers=False, wants_picture=False, has_new_viewer=False, size=None, detail="auto"
    )
    loop, answered = Loop(session, audience), []

    def slow(who: str) -> str:
        time.sleep(0.02)
        answered.append(who)
        return who

    futures = [loop.ask(who, lambda who=who: slow(who)) for who in ("a", "b") * 500]
    began = time.perf_counter()
    while time.perf_counter() - began < 1.0:
        loop.turn()
    assert answered == ["a", "b"]
    assert sum(future.cancelled() for future in futures) == 998
    for number in range(100):
        with contextlib.suppress(wt.WavetankError):
            loop.ask(number, lambda: slow("c"))
    began = time.perf_counter()
    while time.perf_counter() - began < 1.0:
        loop.turn()
    assert 0.02 * (len(answered) - 2) < 0.3
    with pytest.raises(wt.WavetankError, match="Too many questions"):
        for number in range(100, 200):
            loop.ask(number, lambda: None)


def test_a_mesh_that_is_refused_is_not_said_to_be_there():
    tank = wt.Scene(spacing=0.1, tank=wt.Tank(size=(1, 1, 1)), fluids=[wt.Block(lower=(0, 0, 0), upper=(1, 0.2, 1))])
    session = Session(tank)
    corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
    closed = "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
    assert "was added" in drop_mesh(session, corners + closed, "a.obj")
    assert "not closed" in drop_mesh(session, corners + closed[:16], "b.obj")
    assert len(session.sim.scene.solids) == 1


def test_idle_connections_take_no_files(playing, monkeypatch):
    """More sockets than allowed are closed at once, those that ask nothing soon; the page still answers."""
    monkeypatch.setattr(server, "MOST_CONNECTIONS", 20)
    monkeypatch.setattr(server, "IDLE", 4.0)
    world = playing(POOL)
    lines = [sockets.create_connection(("127.0.0.1", world.front.port), timeout=20) for _ in range(60)]
    assert all(line.recv(100) == b"" for line in lines[20:]), "closed at once"
    assert not select.select(lines[:20], [], [], 0)[0], "those that are allowed are still open"
    assert all(line.recv(100) == b"" for line in lines[:20]), "closed as they asked nothing"
    token = world.front.gate.token
    assert urllib.request.urlopen(f"{world.base}/?token={token}", timeout=20).status == 200


def test_connections_are_fewer_where_files_are_few(monkeypatch):
    resource = pytest.importorskip("resource")
    monkeypatch.setattr(resource, "getrlimit", lambda which: (1024, 4096))
    assert server.connections_allowed() < 1024 - 64


def answer(port: int, request: bytes) -> bytes:
    with sockets.create_connection(("127.0.0.1", port), timeout=20) as line:
        line.sendall(request)
        parts = []
        while part := line.recv(65536):
            parts.append(part)
            if len(b"".join(parts)) > 200_000:
                break
    return b"".join(parts)


def test_headers_are_on_every_answer(playing):
    """Good pages, refusals, what is not there, a malformed request, a socket that is refused."""
    world = playing(POOL)
    port, token = world.front.port, world.front.gate.token
    host = f"Host: 127.0.0.1:{port}\r\nConnection: close\r\n"
    ask = "GET {} HTTP/1.1\r\n" + host + "{}\r\n"
    upgrade = "Upgrade: websocket\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n"
    requests = {
        200: [
            ask.format(f"/?token={token}", ""),
            ask.format("/page/main.js", ""),
            ask.format(f"/scene.toml?token={token}", ""),
        ],
        403: [
            ask.format("/", ""),
            ask.format("/", "Origin: http://[\r\n"),
            ask.format("/", "Origin: http://[::1\r\n"),
            ask.format("/socket", upgrade).replace("Connection: close", "Connection: Upgrade"),
        ],
        404: [ask.format("/page/none.js", ""), ask.format(f"/none?token={token}", "")],
        405: [ask.format(f"/?token={token}", "").replace("GET", "POST")],
        400: ["nonsense\r\n\r\n", "GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n"],
    }
    for status, texts in requests.items():
        for text in texts:
            head = answer(port, text.encode()).partition(b"\r\n\r\n")[0].decode("latin-1").lower()
            assert head.startswith(f"http/1.1 {status}"), (text, head)
            for name, value in HEADERS.items():
                assert f"\r\n{name}: {value}".lower() in head, (text, name, head)
            assert "\r\nserver:" not in head


def test_downloads_do_not_stop_the_water(playing, watching):
    world = playing(POOL)
    watcher = watching(world.socket)
    watcher.wait_for_pictures()
    flooding, ended, codes = threading.Event(), threading.Event(), set()

    def ask() -> None:
        url = f"{world.base}/scene.toml?token={world.front.gate.token}"
        while flooding.wait() and not ended.is_set():
            try:
                codes.add(urllib.request.urlopen(url, timeout=60).status)
            except urllib.error.HTTPError as error:
                codes.add(error.code)
            except OSError:
                ended.wait()

    threads = [threading.Thread(target=ask, daemon=True) for _ in range(6)]
    for thread in threads:
        thread.start()
    share = Pace(watcher, threads).best_share(flooding)
    ended.set()
    flooding.set()
    assert codes <= {200, 429} and 200 in codes
    assert share >= SHARE, f"{share:.2f} of the pictures"


def test_what_nobody_thought_of_pauses_and_is_told(playing, watching, monkeypatch):
    monkeypatch.delenv("WAVETANK_STRICT_INPUT", raising=False)
    world = playing(POOL)
    watcher = watching(world.socket)
    watcher.wait_for_pictures()

    def fail(*arguments):
        raise RuntimeError("a pipe\nhas burst")

    from wavetank.session.commands import SetView

    monkeypatch.setattr(SetView, "apply", fail)
    watcher.socket.send('{"do": "view", "view": "particles"}')
    monkeypatch.setattr(type(world.session), "_fit_frame", fail)
    assert watcher.wait_for_note("The water is paused")
    assert any("The command 'view' failed" in note and "a pipe has burst" in note for note in watcher.notes)
    assert any("The water is paused: RuntimeError, a pipe has burst" in note for note in watcher.notes)
    assert world.thread.is_alive() and world.session.paused


def test_only_who_failed_is_told(playing, watching):
    """What a driver's command fails for goes to the driver; who watches sees the water."""
    world = playing(POOL)
    driver, watcher = watching(world.socket), watching(world.socket)
    watcher.wait_for_pictures()
    failing = [{"do": "remove-solid", "name": "no-such-solid"}, {"do": "load", "text": "spacing = -1"}]
    for table in failing:
        driver.send(table)
    assert driver.wait_for_note("no-such-solid") and driver.wait_for_note("spacing")
    watcher.send({"do": "remove-solid", "name": "of the watcher"})
    assert watcher.wait_for_note("You are watching")
    for _ in range(20):  # the same over and over is said once a second
        driver.send(failing[0])
    watcher.wait_for_pictures(watcher.pictures + 3, 10.0)
    assert not any("no-such-solid" in note or "spacing" in note for note in watcher.notes), watcher.notes
    assert not any("watching" in note for note in driver.notes)
    assert sum("no-such-solid" in note for note in driver.notes) <= 4

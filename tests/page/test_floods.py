"""Whatever the one who drives sends: the server lives, and who watches keeps half of the pictures."""

import json
import os
import socket as sockets
import threading
import time
import urllib.error
import urllib.request

import pytest
from watcher import resident
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

import wavetank as wt
from wavetank.page.gate import HEADERS

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
}


@pytest.mark.parametrize("name", FLOODS if LONG else ["scenes", "solids", "bookmarks"])
def test_who_watches_keeps_half_of_the_pictures(playing, watching, name):
    world = playing(POOL)
    with connect(world.socket, max_size=None) as flooder:
        flood_and_watch(world, watching(world.socket), flooder, FLOODS[name])


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


def flood_and_watch(world, watcher, flooder, tables: list[dict]) -> None:
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
    assert sent[0] > 100
    assert share >= SHARE, f"{share:.2f} of the pictures"
    assert grown < 100, f"{grown:.0f} MB"
    assert world.thread.is_alive()


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

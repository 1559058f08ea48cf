"""Bad visitors and bad messages are refused or dropped; the simulation goes on."""

import json
import time
import urllib.error
import urllib.request

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

import wavetank as wt

POOL = wt.Scene(spacing=0.05, tank=wt.Tank(size=(1.0, 0.6)), fluids=[wt.Block(lower=(0, 0), upper=(0.5, 0.4))])


def status_of(url: str, **headers: str) -> int:
    request = urllib.request.Request(url, headers=headers)
    try:
        return urllib.request.urlopen(request, timeout=120).status
    except urllib.error.HTTPError as error:
        return error.code


def goes_on(world) -> None:
    """The simulation computes frames and a new viewer is served."""
    before = world.session.ticks
    with connect(world.socket, max_size=None) as socket:
        hello = json.loads(socket.recv(timeout=120))
        assert hello["type"] == "hello"
        assert {"parameters", "tools", "scenes"} <= set(hello)
        end = time.monotonic() + 120
        while world.session.ticks <= before and time.monotonic() < end:
            time.sleep(0.02)
    assert world.session.ticks > before


def test_only_the_right_token_host_and_origin_come_in(playing):
    world = playing(POOL)
    port, token = world.front.port, world.front.gate.token
    good = f"{world.base}/?token={token}"
    assert status_of(good) == 200
    assert status_of(f"{world.base}/page/main.js") == 200
    assert status_of(f"{world.base}/page/../web.py") in (403, 404)
    assert status_of(f"{world.base}/page/%2e%2e%2fweb.py") in (403, 404)
    for url in (world.base, f"{world.base}/?token=", f"{world.base}/?token={token}x", f"{world.base}/recording.toml"):
        assert status_of(url) == 403
    assert status_of(good, Host="evil.example") == 403
    assert status_of(good, Host=f"evil.example:{port}") == 403
    assert status_of(good, Origin="http://evil.example") == 403
    assert status_of(good, Origin="null") == 403
    assert status_of(good, Origin=world.base) == 200
    assert status_of(world.base, Cookie=f"wavetank_{port}={token}") == 200
    assert status_of(world.base, Cookie=f"wavetank_{port}=guess") == 403
    reply = urllib.request.urlopen(good)
    assert "default-src 'self'" in reply.headers["content-security-policy"]
    assert "SameSite=Strict" in reply.headers["set-cookie"]
    assert "HttpOnly" in reply.headers["set-cookie"]
    text = urllib.request.urlopen(f"{world.base}/recording.toml?token={token}").read().decode()
    assert "[scene]" in text
    text = urllib.request.urlopen(f"{world.base}/scene.toml?token={token}").read().decode()
    assert len(wt.Scene.from_text(text).particles()[0]) == world.session.sim.count
    for url, options in (
        (f"ws://127.0.0.1:{port}/socket", {}),
        (f"ws://127.0.0.1:{port}/socket?token=guess", {}),
        (world.socket, {"origin": "http://evil.example"}),
        (world.socket, {"origin": f"http://evil.example:{port}"}),
        (world.socket, {"additional_headers": {"Host": "evil.example"}}),
    ):
        with pytest.raises((InvalidStatus, ConnectionClosed, ValueError)), connect(url, **options) as socket:
            socket.recv(timeout=5)
    goes_on(world)


def test_every_message_is_json_that_a_browser_reads(playing):
    """Before the first frame of a scene its time is no number; a browser would drop the whole message."""
    world = playing(POOL)
    with connect(world.socket, max_size=None) as socket:
        socket.send('{"do": "pause", "on": true}')
        socket.send('{"do": "reset"}')
        seen, end = False, time.monotonic() + 120
        while not seen and time.monotonic() < end:
            message = socket.recv(timeout=120)
            if isinstance(message, str):
                assert "NaN" not in message
                assert "Infinity" not in message
                status = json.loads(message)
                seen = status.get("paused", False) and status.get("frame_ms", 0.0) is None
        assert seen


def test_time_stands_still_while_nobody_watches(playing):
    world = playing(POOL)
    time.sleep(0.5)
    assert world.session.ticks == 0
    goes_on(world)
    time.sleep(0.3)
    ticks = world.session.ticks
    time.sleep(0.3)
    assert world.session.ticks == ticks


def test_bad_messages_do_no_harm(playing):
    world = playing(POOL)
    with connect(world.socket, max_size=None) as socket:
        for text in (
            "",
            "x",
            "[]",
            "1",
            '"set"',
            "{}",
            '{"do": "fly"}',
            '{"do": ["set"]}',
            '{"do": NaN}',
            '{"do": "set", "name": "viscosity", "value": NaN}',
            '{"do": "set", "name": "viscosity", "value": -1}',
            '{"do": "set", "name": "spacing", "value": 1e-9}',
            '{"do": "set", "name": "viscosity"}',
            '{"do": "set", "name": "gravity", "value": [1e300, 0]}',
            '{"do": "set", "name": "gravity", "value": [1, 2, 3]}',
            '{"do": "reset", "parameters": {"spacing": 1e-6}}',
            '{"do": "load", "name": "../../etc/passwd"}',
            '{"do": "load", "text": "spacing ="}',
            '{"do": "load"}',
            '{"do": "size", "width": -1, "height": 1e9}',
            '{"do": "point-begin", "x": "left"}',
            '{"do": "point-begin", "x": 0.5, "y": 0.5, "tool": "hammer"}',
            '{"do": "point-begin", "x": 0.5, "y": 0.5, "tool": "push", "options": {"radius": 1e9}}',
            '{"do": "tool-begin", "tool": "push", "origin": [0, 0, 0], "direction": [0, 0, 0]}',
            '{"do": "orbit", "azimuth": Infinity}',
            '{"do": "step", "frames": 1e9}',
            '{"do": "detail", "detail": 3}',
            "[" * 100_000,
            '{"do": ' * 50_000,
            '{"do": "set", "value": ' + "9" * 5000 + "}",
        ):
            socket.send(text)
        socket.send(b"\x00\xff" * 100)
        notes = 0
        end = time.monotonic() + 120
        while notes < 20 and time.monotonic() < end:
            message = socket.recv(timeout=120)
            if isinstance(message, str):
                table = json.loads(message)
                notes += (table["type"] == "note") + len(table.get("notes", []))
                assert "Traceback" not in message
        assert notes >= 20
    goes_on(world)
    assert world.session.scene.spacing == 0.05
    assert world.session.sim.scene.gravity == (0.0, -9.81)


def test_giants_broken_text_and_floods_do_no_harm(playing):
    world = playing(POOL)
    with connect(world.socket, max_size=None) as socket, pytest.raises((ConnectionClosed, OSError)):
        socket.send("x" * 100_000_000)
        while True:
            socket.recv(timeout=120)
    with connect(world.socket, max_size=None) as socket, pytest.raises((ConnectionClosed, OSError)):
        socket.send(b"\xff\xfe{", text=True)
        while True:
            socket.recv(timeout=120)
    goes_on(world)
    before, began = world.session.ticks, time.monotonic()
    with connect(world.socket, max_size=None) as socket:
        message = '{"do": "set", "name": "viscosity", "value": 0.123}'
        try:
            while time.monotonic() - began < 3.0:
                for _ in range(1000):
                    socket.send(message, text=True)
        except ConnectionClosed:
            pass
    assert world.session.ticks > before + 5
    assert len(world.session.log) < 2000
    goes_on(world)


def test_one_drives_the_others_watch(playing):
    world = playing(POOL)

    def role(socket) -> bool:
        while True:
            message = socket.recv(timeout=120)
            if isinstance(message, str) and json.loads(message)["type"] == "role":
                return json.loads(message)["driving"]

    def wait_until(true) -> None:
        end = time.monotonic() + 120
        while not true() and time.monotonic() < end:
            time.sleep(0.02)
        assert true()

    with connect(world.socket, max_size=None) as first, connect(world.socket, max_size=None) as second:
        assert role(first) is True
        assert role(second) is False
        second.send('{"do": "set", "name": "viscosity", "value": 0.9}')
        second.send('{"do": "drive"}')
        assert role(second) is True
        second.send('{"do": "set", "name": "viscosity", "value": 0.4}')
        wait_until(lambda: world.session.sim.viscosity == 0.4)
        second.send('{"do": "point-begin", "x": 0.5, "y": 0.5, "tool": "push"}')
        wait_until(lambda: world.session.hands)
        second.close()
        # Who leaves lifts the hand, and another takes control.
        wait_until(lambda: not world.session.hands)
        first.send('{"do": "set", "name": "viscosity", "value": 0.2}')
        wait_until(lambda: world.session.sim.viscosity == 0.2)


def test_one_picture_is_on_its_way_at_a_time(playing):
    world = playing(POOL)
    with connect(world.socket, max_size=None) as socket:
        pictures = 0
        end = time.monotonic() + 2.0
        while time.monotonic() < end:
            message = socket.recv(timeout=120)
            pictures += isinstance(message, bytes)
            if isinstance(message, bytes):
                assert message[:2] == b"\xff\xd8"
        assert pictures == 1
        socket.send('{"do": "ack"}')
        while not isinstance(socket.recv(timeout=120), bytes):
            pass

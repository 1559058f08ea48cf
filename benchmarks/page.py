"""How lively the page is: pictures a second and the time from a click to its picture, measured at the socket.

    python benchmarks/page.py obstacle-tank --size 960x540

prints one JSON object. The client sits on the same machine and decodes nothing.
"""

import argparse
import json
import statistics
import threading
import time
from typing import Any

from websockets.sync.client import connect

import wavetank as wt
from wavetank.front.page.server import WebFront


def next_picture(socket: Any) -> bytes:
    while not isinstance(message := socket.recv(timeout=60), bytes):
        pass
    socket.send('{"do": "ack"}')
    return message


def pictures_a_second(socket: Any, seconds: float, each: str = "") -> float:
    """Count pictures; `each` is a command that is sent for every one, so that there is something new to see."""
    for _ in range(10):
        socket.send(each or '{"do": "home"}')
        next_picture(socket)
    began, count = time.perf_counter(), 0
    while time.perf_counter() < began + seconds:
        if each:
            socket.send(each)
        next_picture(socket)
        count += 1
    return count / (time.perf_counter() - began)


def click_to_picture(socket: Any) -> float:
    """Return the median time [s] from a click with dye, while time stands still, to the picture that shows it."""
    times = []
    for k in range(20):
        quiet = time.perf_counter() + 0.5
        while time.perf_counter() < quiet:  # statuses, and pictures still on their way
            if isinstance(socket.recv(timeout=60), bytes):
                socket.send('{"do": "ack"}')
        began = time.perf_counter()
        x = 0.3 + 0.01 * k
        socket.send(json.dumps({"do": "point-begin", "x": x, "y": 0.6, "tool": "dye"}))
        next_picture(socket)
        times.append(time.perf_counter() - began)
        socket.send('{"do": "point-end"}')
    return statistics.median(times)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene", nargs="?", default="obstacle-tank")
    parser.add_argument("--size", default="960x540")
    parser.add_argument("--arch", default="cpu")
    parser.add_argument("--detail", default="auto", choices=("auto", "full", "half"))
    parser.add_argument("--seconds", type=float, default=8.0)
    options = parser.parse_args()
    width, height = (int(side) for side in options.size.split("x"))
    session = wt.Session(wt.Scene.load(options.scene), options.arch)
    front = WebFront(session, port=0)
    front.start()
    threading.Thread(target=front.run, daemon=True).start()
    url = f"ws://127.0.0.1:{front.port}/socket?token={front.gate.token}"
    with connect(url, max_size=None) as socket:
        socket.send(json.dumps({"do": "size", "width": width, "height": height}))
        socket.send(json.dumps({"do": "detail", "detail": options.detail}))
        for _ in range(10):
            next_picture(socket)
        water, wall = session.sim.time, time.perf_counter()
        moving = pictures_a_second(socket, options.seconds)
        pace = (session.sim.time - water) / (time.perf_counter() - wall)
        moving_size = front.painter.last_size
        socket.send('{"do": "pause", "on": true}')
        paused = pictures_a_second(socket, options.seconds, '{"do": "orbit", "azimuth": 0.01}')
        figures = {
            "scene": options.scene, "particles": session.sim.count, "size": options.size, "arch": session.sim.arch,
            "pictures_a_second_moving": round(moving, 1), "picture_while_moving": "x".join(map(str, moving_size)),
            "seconds_of_water_a_second": round(pace, 3), "pictures_a_second_paused": round(paused, 1),
            "click_to_picture_ms": round(1e3 * click_to_picture(socket), 1),
        }  # fmt: skip
    front.stop()
    print(json.dumps(figures))


if __name__ == "__main__":
    main()

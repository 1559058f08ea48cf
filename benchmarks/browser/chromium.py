"""A headless Chromium and a person at its page, by the DevTools Protocol: for measuring and testing the page."""

import base64
import contextlib
import itertools
import json
import shutil
import subprocess
import time
import urllib.request
from collections.abc import Callable
from pathlib import Path
from typing import Any

from wavetank.foundation.errors import WavetankError

NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")


def executable() -> str | None:
    """Return the path of a Chromium, None without one."""
    return next((path for name in NAMES if (path := shutil.which(name))), None)


class Browser:
    """A headless Chromium with one page; `folder` is for its profile. Raises `WavetankError` without a Chromium."""

    def __init__(self, folder: Path, width: int = 1280, height: int = 800) -> None:
        from websockets.sync.client import connect

        program = executable()
        if program is None:
            raise WavetankError(
                "there is no Chromium here; install one (on Debian and Ubuntu: apt-get install chromium)."
            )
        self.process = subprocess.Popen(
            [
                program,
                "--headless=new",
                "--no-sandbox",
                "--disable-gpu",
                "--disable-dev-shm-usage",
                "--remote-debugging-port=0",
                f"--user-data-dir={folder}",
                f"--window-size={width},{height}",
                "--no-first-run",
                "--disable-background-networking",
                "about:blank",
            ],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        told = folder / "DevToolsActivePort"
        self._until(lambda: told.exists() and len(told.read_text().splitlines()) > 1, 60, "Chromium starts")
        port = told.read_text().splitlines()[0]
        pages = json.loads(urllib.request.urlopen(f"http://127.0.0.1:{port}/json").read())
        page = next(entry for entry in pages if entry["type"] == "page")
        self._open = contextlib.ExitStack()
        self.socket = self._open.enter_context(connect(page["webSocketDebuggerUrl"], max_size=None, open_timeout=60))
        self.events: list[dict[str, Any]] = []
        self._numbers = itertools.count(1)
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Call a method of the protocol and return its result."""
        number = next(self._numbers)
        self.socket.send(json.dumps({"id": number, "method": method, "params": parameters}))
        while True:
            message: dict[str, Any] = json.loads(self.socket.recv(timeout=300))
            if message.get("id") == number:
                if "error" in message:
                    raise WavetankError(f"Chromium refused {method}: {message['error']}.")
                result: dict[str, Any] = message["result"]
                return result
            self.events.append(message)

    def open(self, url: str) -> None:
        """Go to a page."""
        self.call("Page.navigate", url=url)

    def size(self, width: int, height: int, *, touch: bool = False) -> None:
        """Set the size of the page [px], and whether fingers touch it."""
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=touch)
        self.call("Emulation.setTouchEmulationEnabled", enabled=touch)

    def run(self, code: str) -> Any:
        """Return what an expression of the page's language comes to."""
        result = self.call("Runtime.evaluate", expression=code, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in result:
            raise WavetankError(f"the page failed at {code}: {result['exceptionDetails']}.")
        return result["result"].get("value")

    def wait_for(self, code: str, seconds: float = 240.0) -> Any:
        """Wait until an expression is true, and return it."""
        return self._until(lambda: self.run(code), seconds, code)

    def center(self, selector: str, x: float = 0.5, y: float = 0.5) -> tuple[float, float]:
        """Return the place [px] at the shares `x` and `y` of an element's box."""
        box = self.run(
            f"(() => {{ const b = document.querySelector({selector!r}).getBoundingClientRect();"
            "return [b.left, b.top, b.width, b.height] })()"
        )
        return box[0] + x * box[2], box[1] + y * box[3]

    def mouse(self, kind: str, x: float, y: float, button: str = "left") -> None:
        """Press, move or release the mouse."""
        self.call(
            "Input.dispatchMouseEvent",
            type=kind,
            x=x,
            y=y,
            button=button,
            buttons=0 if kind == "mouseReleased" else {"left": 1, "right": 2}.get(button, 0),
            clickCount=1,
        )

    def click(self, selector: str) -> None:
        """Click on the middle of an element, once it rests: what has just appeared may still move."""
        place: list[tuple[float, float]] = []

        def rests() -> bool:
            place.append(self.center(selector))
            return len(place) > 1 and place[-1] == place[-2]

        self._until(rests, 30.0, f"{selector} rests")
        self.mouse("mousePressed", *place[-1])
        self.mouse("mouseReleased", *place[-1])

    def drag(self, start: tuple[float, float], end: tuple[float, float], steps: int = 12, pause: float = 0.03) -> None:
        """Drag with the left button, `pause` [s] between two places."""
        self.mouse("mousePressed", *start)
        for k in range(1, steps + 1):
            share = k / steps
            self.mouse("mouseMoved", start[0] + share * (end[0] - start[0]), start[1] + share * (end[1] - start[1]))
            time.sleep(pause)
        self.mouse("mouseReleased", *end)

    def key(self, key: str) -> None:
        """Press and release a key."""
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=key, text=key if kind == "keyDown" else "")

    def picture(self, path: Path) -> None:
        """Write a PNG of the page, or a JPEG where the path says so."""
        kind = {"quality": 88, "format": "jpeg"} if path.suffix == ".jpg" else {"format": "png"}
        path.write_bytes(base64.b64decode(self.call("Page.captureScreenshot", **kind)["data"]))

    def complaints(self) -> list[str]:
        """Return what the page's console and the security policy had to say."""
        self.run("1")
        bad = []
        for event in self.events:
            if event["method"] == "Runtime.exceptionThrown":
                bad.append(json.dumps(event["params"]["exceptionDetails"])[:400])
            elif event["method"] == "Log.entryAdded" and event["params"]["entry"]["level"] == "error":
                bad.append(event["params"]["entry"]["text"])
        return bad

    def hosts(self) -> set[str]:
        """Return the hosts that the page asked for anything."""
        self.run("1")
        urls = [e["params"]["request"]["url"] for e in self.events if e["method"] == "Network.requestWillBeSent"]
        return {url.split("/")[2] for url in urls if url.startswith(("http", "ws"))}

    def close(self) -> None:
        """End the browser."""
        self._open.close()
        self.process.terminate()
        self.process.wait(20)

    def _until(self, ask: Callable[[], Any], seconds: float, what: str) -> Any:
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if value := ask():
                return value
            time.sleep(0.05)
        raise WavetankError(f"this did not come true within {seconds:g} s: {what}.")

"""What a viewer of the page gets, measured in a real browser.

A server as `wavetank play --web` starts it, a headless Chromium on the same processor, a mouse. Pictures are
counted by the page when they are drawn; a delay is from the browser's own time of the press to the first picture drawn
after it, which nothing but that press can have caused because time stands still and the sharp picture is long there.
"""

import contextlib
import math
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from rich.table import Table

from benchmarks.browser.chromium import Browser
from wavetank.foundation.errors import WavetankError
from wavetank.lab.bench.machine import machine

STAGE = (960, 540)  # px, of the picture's place on the page
SCENE, SIZE = "obstacle-tank", 20_000
SECONDS, CLICKS = 8.0, 15
DYED = 0.06  # of the world: radius of the brush
SETTLED = 1.2  # s after which a page at rest has its sharp picture

WATCH = """(async () => {
  const { seen } = await import('/page/stage.js'), { on } = await import('/page/link.js');
  const canvas = document.querySelector('#picture');
  window.watch = { seen, status: {}, pixels: [], delays: [] };
  on('status', (status) => Object.assign(watch.status, status));
  let pressed = null;
  canvas.addEventListener('pointerdown', (event) => { if (event.button === 0) pressed = event.timeStamp; }, true);
  const draw = CanvasRenderingContext2D.prototype.drawImage;
  CanvasRenderingContext2D.prototype.drawImage = function (...given) {
    draw.apply(this, given);
    if (this.canvas !== canvas) return;
    watch.pixels.push(canvas.width * canvas.height);
    if (pressed !== null) watch.delays.push(performance.now() - pressed);
    pressed = null;
  };
})()"""


def measure(
    scene: str = SCENE, size: int = SIZE, *, seconds: float = SECONDS, arch: str = "cpu", say: Callable[[str], None]
) -> dict[str, Any]:
    """Return pictures a second of resting and of moving water, and milliseconds from click to picture."""
    with _served(scene, size, arch) as url, _browsing() as browser:
        browser.open(url)
        browser.wait_for("document.querySelector('#veil.gone') !== null")
        width, height = _sides(browser)
        browser.size(1280 + STAGE[0] - width, 800 + STAGE[1] - height)
        browser.run(WATCH)
        say("kernels are compiled, once")
        browser.wait_for("watch.status.time > 0.1 && watch.seen.pictures > 3")
        browser.key(" ")
        browser.wait_for("watch.status.paused")
        _orbit(browser, 2.0)
        say("time stands still, the eye goes round")
        paused = _counted(browser, lambda: _orbit(browser, seconds))
        say("click to picture")
        delays = _clicks(browser)
        say("the water moves")
        browser.key(" ")
        browser.wait_for("!watch.status.paused")
        time.sleep(2.0)
        began = browser.run("watch.status.time")
        moving = _counted(browser, lambda: time.sleep(seconds))
        moving["water_per_second"] = (browser.run("watch.status.time") - began) / moving["seconds"]
        return {
            "scene": scene,
            "particles": browser.run("watch.status.count"),
            "stage": list(_sides(browser)),
            "arch": arch,
            "paused": paused,
            "moving": moving,
            "click_ms": _quartiles(delays),
            "clicks": len(delays),
            "machine": machine(arch),
        }


@contextlib.contextmanager
def _served(scene: str, size: int, arch: str) -> Iterator[str]:
    """Serve a page in a process of its own and yield its address."""
    command = [
        sys.executable,
        "-m",
        "wavetank",
        "play",
        scene,
        "--particles",
        str(size),
        "--web",
        "--no-browser",
        "--port",
        "0",
        "--arch",
        arch,
    ]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, text=True, env={**os.environ, "PYTHONUNBUFFERED": "1"}
    ) as server:
        try:
            assert server.stdout is not None
            line = next((line for line in server.stdout if "http://" in line), "")
            if not line:
                raise WavetankError(f"`{' '.join(command[1:])}` served no page; see above why.")
            yield next(word for word in line.split() if word.startswith("http://")).rstrip(";")
        finally:
            server.terminate()


@contextlib.contextmanager
def _browsing() -> Iterator[Browser]:
    # A browser that ends may still be writing into its profile.
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        browser = Browser(Path(folder))
        try:
            browser.size(1280, 800)
            yield browser
        finally:
            browser.close()


def _sides(browser: Browser) -> tuple[int, int]:
    width, height = browser.run(
        "[document.querySelector('#stage').clientWidth, document.querySelector('#stage').clientHeight]"
    )
    return width, height


def _orbit(browser: Browser, seconds: float) -> None:
    """Turn the view to and fro with the right button, sixty places a second."""
    x, y = browser.center("#picture")
    browser.mouse("mousePressed", x, y, "right")
    began = time.perf_counter()
    while (passed := time.perf_counter() - began) < seconds:
        browser.mouse("mouseMoved", x + 150 * math.sin(passed), y + 20 * math.sin(0.7 * passed), "right")
        time.sleep(1 / 60)
    browser.mouse("mouseReleased", x, y, "right")


def _counted(browser: Browser, act: Callable[[], None]) -> dict[str, Any]:
    browser.run("watch.pixels.length = 0")
    before, began = browser.run("[watch.seen.pictures, watch.seen.bytes]"), time.perf_counter()
    act()
    seconds = time.perf_counter() - began
    pictures, size = (
        b - a for a, b in zip(before, browser.run("[watch.seen.pictures, watch.seen.bytes]"), strict=True)
    )
    share = np.sqrt(np.median(browser.run("watch.pixels") or [0]) / (STAGE[0] * STAGE[1]))
    return {
        "seconds": seconds,
        "pictures_per_second": pictures / seconds,
        "sharpness": float(share),
        "kilobytes_per_second": size / seconds / 1000,
    }


def _clicks(browser: Browser) -> list[float]:
    """Put dye into resting water again and again; return the delays [ms] until it was seen."""
    browser.run("document.querySelector('[data-tool=dye]').click()")
    # Dyed water takes longer to paint: of the same amount as in results of before, whatever the default is.
    browser.run(f"(async () => {{ (await import('/page/tools.js')).hand.options.radius = {DYED} }})()")
    for number in range(CLICKS):
        time.sleep(SETTLED)
        place = browser.center("#picture", 0.3 + 0.4 * number / CLICKS, 0.6)
        browser.mouse("mousePressed", *place)
        browser.wait_for(f"watch.delays.length > {number}", 10.0)
        browser.mouse("mouseReleased", *place)
    delays: list[float] = browser.run("watch.delays")
    return delays


def _quartiles(values: list[float]) -> dict[str, float]:
    low, median, high = np.percentile(values, (25, 50, 75))
    return {"median": float(median), "low": float(low), "high": float(high)}


def page_table(result: dict[str, Any]) -> Table:
    """Return the figures as a table."""
    sides, click = result["stage"], result["click_ms"]
    table = Table(
        f"{result['scene']}, {result['particles']:,} particles, {sides[0]} x {sides[1]}",
        "pictures a second",
        "share of width and height",
        "kB a second",
        "water a second",
    )
    for title, one in (("paused, the eye goes round", result["paused"]), ("the water moves", result["moving"])):
        water = f"{one['water_per_second']:.3f} s" if "water_per_second" in one else ""
        table.add_row(
            title,
            f"{one['pictures_per_second']:.1f}",
            f"{one['sharpness']:.2f}",
            f"{one['kilobytes_per_second']:.0f}",
            water,
        )
    table.add_row("paused, click to picture", f"{click['median']:.0f} ms [{click['low']:.0f}, {click['high']:.0f}]")
    return table

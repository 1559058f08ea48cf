"""Pictures of window and page: `xvfb-run -s "-screen 0 1400x900x24" env PYTHONPATH=. python docs/screens.py [name ...]`, minutes.

A headless Chromium looks at the page; the window opens on whatever display there is.
"""

import contextlib
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from PIL import Image

import wavetank as wt
from benchmarks.browser.chromium import Browser
from wavetank.page.server import PageServer
from wavetank.session import commands as do
from wavetank.session.session import Session

DOCS = Path(__file__).parent
SHARP = 12.0  # s after which a picture of what stands still is sharp, on a busy machine
PATIENCE = 300.0  # s


@contextlib.contextmanager
def page(scene: wt.Scene, size: tuple[int, int]) -> Iterator[tuple[Browser, Session]]:
    """Open the page on a scene that waits."""
    session = Session(scene)
    session.submit(do.Pause(on=True))
    front = PageServer(session, port=0)
    front.start()
    thread = threading.Thread(target=front.run)
    thread.start()
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        browser = Browser(Path(folder), *size)
        try:
            browser.size(*size)
            browser.open(front.url)
            browser.wait_for("document.querySelector('#veil.gone') !== null")
            yield browser, session
        finally:
            browser.close()
            front.stop()
            thread.join()


def until(true: Callable[[], bool], look: Callable[[], object] = lambda: None) -> None:
    """Wait until something is true."""
    end = time.monotonic() + PATIENCE
    while not true():
        look()
        time.sleep(0.05)
        if time.monotonic() > end:
            raise SystemExit("what was waited for did not come")


def play(session: Session, moment: float, look: Callable[[], object] = lambda: None) -> None:
    """Let the water move up to a time [s], and stop it there."""
    session.submit(do.Pause(on=False))
    until(lambda: session.sim.time >= moment, look)
    session.submit(do.Pause(on=True))
    until(lambda: session.paused, look)


def use(browser: Browser, tool: str) -> None:
    """Take a tool in hand."""
    browser.run(f"document.querySelector('[data-tool={tool}]').click()")


def take(browser: Browser, name: str) -> None:
    """Write a picture of the page once the water is sharp."""
    for _ in range(int(SHARP)):
        time.sleep(1.0)
        browser.run("1")
    browser.run("document.querySelector('#busy')?.remove()")  # a busy machine says so
    browser.picture(DOCS / f"{name}.jpg")


def playing() -> None:
    """README: dyed water breaks over a pillar."""
    with page(wt.Scene.load("obstacle-tank"), (1280, 800)) as (browser, session):
        use(browser, "dye")
        start, end = browser.center("#picture", 0.1, 0.62), browser.center("#picture", 0.5, 0.78)
        browser.drag(start, end, steps=24, pause=0.25)
        play(session, 0.5, lambda: browser.run("1"))
        browser.mouse("mouseMoved", *browser.center("#picture", 0.42, 0.74), button="none")
        take(browser, "playing")


def level() -> None:
    """A level in progress: the tray is tilted, and tilted back."""
    with page(wt.Scene.load("the-tray"), (1120, 700)) as (browser, session):
        use(browser, "tilt")
        session.submit(do.Pause(on=False))
        middle = browser.center("#picture", 0.5, 0.6)
        browser.mouse("mousePressed", *middle)
        browser.mouse("mouseMoved", *browser.center("#picture", 0.3, 0.72))
        until(lambda: session.sim.time >= 1.0, lambda: browser.run("1"))
        browser.key(" ")
        until(lambda: session.paused)
        browser.mouse("mouseReleased", *browser.center("#picture", 0.3, 0.72))
        take(browser, "level")


def forces() -> None:
    """What the water does to a boat, and its motors."""
    with page(wt.Scene.load("paddle-boat"), (1200, 700)) as (browser, session):
        browser.key("n")
        use(browser, "look")
        browser.run("document.querySelector('#panel-toggle').click()")
        play(session, 3.0, lambda: browser.run("1"))
        take(browser, "forces")


def window() -> None:
    """The window with its curves."""
    from wavetank.page.window.window import Window

    opened = Window(Session(wt.Scene.load("obstacle-tank")), (1360, 860))
    opened.open()
    try:
        desk, session = opened.desk, opened.engine.session
        play(session, 0.6, opened.draw)
        look_for(SHARP, opened.draw)
        turn_to("Curves", desk.places, opened.draw)
        look_for(SHARP, opened.draw)
        Image.fromarray(opened.screenshot()).save(DOCS / "window.jpg", quality=88, optimize=True)
    finally:
        opened.close()


def look_for(seconds: float, draw: Callable[[], object]) -> None:
    """Draw for a while."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        draw()
        time.sleep(0.01)


def turn_to(name: str, places: dict[str, tuple[float, float, float, float]], draw: Callable[[], object]) -> None:
    """Click on a tab of the window's panel."""
    from imgui_bundle import imgui

    left, top, right, bottom = places[f"page.{name}"]
    to = imgui.get_io()
    to.add_mouse_pos_event(0.5 * (left + right), 0.5 * (top + bottom))
    for down in (True, False):
        look_for(0.2, draw)
        to.add_mouse_button_event(0, down)


if __name__ == "__main__":
    for name in sys.argv[1:] or ("playing", "level", "forces", "window"):
        {"playing": playing, "level": level, "forces": forces, "window": window}[name]()
        print(name, flush=True)

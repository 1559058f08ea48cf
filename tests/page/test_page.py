"""The page in a real browser: it shows moving water, and what a person does reaches the simulation."""

import asyncio
import os
import subprocess
import sys
import time

import pytest

import wavetank as wt
from benchmarks.browser.chromium import Browser, executable
from wavetank.session import commands as do

BASIN = wt.Scene(
    title="Basin",
    spacing=0.05,
    tank=wt.Tank(size=(1.2, 0.6, 0.4)),
    fluids=[wt.Block(lower=(0, 0, 0), upper=(0.6, 0.4, 0.4))],
    solids=[wt.Box(name="pillar", center=(0.9, 0.1, 0.2), size=(0.12, 0.2, 0.12))],
)
PICTURE = "(() => { const c = document.querySelector('#picture'); return c.toDataURL() })()"


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    if executable() is None:
        if os.environ.get("CI") == "true":
            pytest.fail("no Chromium here; .ci/run installs it with apt-get")
        pytest.skip("no Chromium here: apt-get install chromium")
    page = Browser(tmp_path_factory.mktemp("profile"))
    page.size(1000, 700)
    yield page
    page.close()


@pytest.fixture
def open_page(playing, browser):
    def open_(scene: wt.Scene = BASIN):
        world = playing(scene)
        browser.events.clear()
        browser.open(world.front.url)
        browser.wait_for("document.querySelector('#veil.gone') !== null")
        return world

    yield open_
    browser.open("about:blank")


def until(true, seconds: float = 120.0) -> None:
    end = time.monotonic() + seconds
    while not true() and time.monotonic() < end:
        time.sleep(0.02)
    assert true()


def test_a_person_plays(open_page, browser):
    """Loads, moves, and a key, a slider, tools, the camera, the timeline and a scene do what they say."""
    world = open_page()
    session = world.session
    first = browser.run(PICTURE)
    until(lambda: session.sim.time > 0.2)
    browser.wait_for(f"{PICTURE} !== {first!r}")
    assert browser.run("location.search") == "", "the token stays out of the address bar"
    assert "Basin" in browser.run("document.querySelector('#title').textContent")
    assert browser.run("document.querySelectorAll('#tools button').length") == 20

    # A key.
    browser.key(" ")
    until(lambda: session.paused)
    ticks = session.ticks
    browser.key(".")
    until(lambda: session.ticks == ticks + 1)

    # One that is held pauses once.
    browser.call("Input.dispatchKeyEvent", type="keyDown", key=" ", text=" ", autoRepeat=True)
    time.sleep(0.5)
    assert session.paused

    # A slider.
    before = session.sim.viscosity
    x, y = browser.center("[aria-label=Viscosity][type=range]", 0.8)
    browser.mouse("mousePressed", x, y)
    browser.mouse("mouseReleased", x, y)
    until(lambda: session.sim.viscosity > before + 0.3)

    # A drag of a tool that acts while time stands still: dye.
    browser.run("document.querySelector('[data-tool=dye]').click()")
    water = browser.center("#picture", 0.35, 0.6)
    browser.drag(water, browser.center("#picture", 0.42, 0.6))
    until(lambda: world.front.call(lambda: (session.sim.frame().dyes != 0).any()).result(60))

    # One that needs time: the hand pushes the water.
    browser.key(" ")
    until(lambda: not session.paused)
    browser.run("document.querySelector('[data-tool=cut]').click()")
    count = session.sim.count
    browser.drag(water, browser.center("#picture", 0.3, 0.5))
    until(lambda: session.sim.count < count)
    until(lambda: not session.hands)

    # The camera: right button and wheel.
    eye, distance = session.camera.eye, session.camera.distance
    browser.mouse("mousePressed", *water, button="right")
    browser.mouse("mouseMoved", water[0] + 60, water[1], button="right")
    browser.mouse("mouseReleased", water[0] + 60, water[1], button="right")
    until(lambda: session.camera.eye != eye)
    browser.call("Input.dispatchMouseEvent", type="mouseWheel", x=water[0], y=water[1], deltaX=0, deltaY=300)
    until(lambda: session.camera.distance > 1.1 * distance)

    # The light: an environment, and a sun that is turned by a slider and by a key.
    browser.click("[data-tab=look]")
    browser.run("[...document.querySelectorAll('#look button')].find((b) => b.textContent === 'Evening').click()")
    until(lambda: session.light == {"environment": "evening"})
    browser.wait_for("document.querySelector(\"[aria-label='Sun azimuth'][type=range]\")?.value > 0.6")  # 235 of 360
    browser.run(
        "(() => { const s = document.querySelector(\"[aria-label='Sun azimuth'][type=range]\");"
        "s.value = 0.25; s.oninput() })()"
    )
    until(lambda: session.light.get("sun") == "90,9")
    browser.run("document.activeElement.blur()")
    browser.key(">")
    until(lambda: session.light.get("sun") == "100,9")
    browser.click("[data-tab=water]")

    # The timeline.
    until(lambda: session.sim.time > 0.6)
    browser.click("#bookmark")
    until(lambda: session.history.bookmarks)
    browser.run("(() => { const s = document.querySelector('#scrub'); s.value = 0.2; s.oninput() })()")
    until(lambda: session.paused and session.sim.time <= 0.21)
    browser.wait_for("document.querySelector('#bookmarks button') !== null")
    browser.wait_for("Number(document.querySelector('#clock b').textContent) <= 0.21")  # nothing moves any more
    browser.click("#bookmarks button")
    until(lambda: session.sim.time > 0.5)

    # A scene, and one dropped as a file.
    browser.click("[data-tab=scenes]")
    browser.run("document.querySelector('[data-scene=drop-2d]').click()")
    until(lambda: session.sim.scene.dim == 2)
    browser.wait_for("document.querySelector('[data-scene=drop-2d].now') !== null")
    browser.run(
        "(() => { const data = new DataTransfer();"
        "data.items.add(new File(['spacing = 0.1\\ntitle = \"Mine\"\\n[tank]\\nsize = [1, 1]'], 'mine.toml'));"
        "window.dispatchEvent(new DragEvent('drop', { dataTransfer: data })) })()"
    )
    until(lambda: session.sim.scene.title == "Mine")
    assert browser.complaints() == []
    assert browser.hosts() == {f"127.0.0.1:{world.front.port}"}


def test_a_phone(open_page, browser):
    """Fingers pour; two of them turn the view; the page fits."""
    browser.size(390, 780, touch=True)
    try:
        world = open_page()
        assert browser.run("document.documentElement.scrollWidth") <= 390
        browser.run("document.querySelector('[data-tool=pour]').click()")
        x, y = browser.center("#picture", 0.6, 0.4)
        count = world.session.sim.count
        browser.call("Input.dispatchTouchEvent", type="touchStart", touchPoints=[{"x": x, "y": y, "id": 1}])
        until(lambda: world.session.sim.count > count)
        eye = world.session.camera.eye
        two = [{"x": x, "y": y, "id": 1}, {"x": x - 80, "y": y + 20, "id": 2}]
        browser.call("Input.dispatchTouchEvent", type="touchStart", touchPoints=two)
        for k in range(1, 6):
            moved = [{**p, "x": p["x"] + 12 * k} for p in two]
            browser.call("Input.dispatchTouchEvent", type="touchMove", touchPoints=moved)
        until(lambda: world.session.camera.eye != eye)
        assert not world.session.hands
        browser.call("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
    finally:
        browser.size(1000, 700)


def test_it_comes_back(open_page, browser):
    """A socket that breaks is opened again; the page goes on."""
    world = open_page()
    viewer = world.front.viewers.all[0]
    asyncio.run_coroutine_threadsafe(viewer.socket.close(), world.front._events).result(10)
    until(lambda: world.front.viewers.all and world.front.viewers.all[0] is not viewer)
    browser.wait_for("document.title === 'wavetank' && document.querySelector('#veil.gone') !== null")
    first = browser.run(PICTURE)
    browser.wait_for(f"{PICTURE} !== {first!r}")
    assert world.front.viewers.driver is world.front.viewers.all[0]


LEVEL = wt.Scene(
    title="Small level",
    spacing=0.05,
    tank=wt.Tank(size=(1.2, 0.7)),
    fluids=[wt.Block(lower=(0, 0), upper=(0.6, 0.3))],
    solids=[wt.Box(center=(0.65, 0.175), size=(0.1, 0.35))],
    goal={
        "text": "Bring the water over.",
        "seconds": 60,
        "tools": {"tilt": {"most": 60.0}, "push": {}},
        "aims": [{"kind": "deliver", "name": "here", "lower": (0.7, 0), "upper": (1.2, 0.7), "share": 0.2}],
    },
)


def test_a_level_is_played_and_won(open_page, browser, tmp_path, monkeypatch):
    """Goal, region, allowed tools and progress are shown; a drag wins, the score is kept, retry begins anew."""
    monkeypatch.setenv("WAVETANK_DATA", str(tmp_path))
    world = open_page(LEVEL)
    session = world.session
    browser.wait_for("document.querySelector('#hud p')?.textContent === 'Bring the water over.'")
    browser.wait_for("document.querySelectorAll('#tools button:not([hidden])').length === 3")
    assert browser.run("[...document.querySelectorAll('#tool-card input[type=range]')].length") == 0, (
        "tilt, the first, is in hand, and its only slider is fixed"
    )
    browser.wait_for("document.querySelectorAll('#regions line').length === 4")
    # The outline lies where the region is in the picture, once that has the size of the window.
    box = (
        "(() => { const b = document.querySelector('#regions polygon').getBoundingClientRect();"
        "const p = document.querySelector('#picture').getBoundingClientRect();"
        "return [(b.left - p.left) / p.width, (b.right - p.left) / p.width] })()"
    )

    def columns() -> list[float]:
        width, height = world.front.painter.wanted
        places = session.camera.project([[0.7, 0.0, 0.0], [1.2, 0.0, 0.0]], width, height)
        return (places[:, 0] / width).tolist()

    until(lambda: browser.run(box) == pytest.approx(columns(), abs=0.01))
    browser.click("[data-tool=push]")
    assert browser.run("[...document.querySelectorAll('#tool-card input[type=range]')].length") == 2
    browser.click("[data-tool=tilt]")
    start, end = browser.center("#picture", 0.4, 0.4), browser.center("#picture", 0.95, 0.4)
    browser.mouse("mousePressed", *start)
    for _ in range(3):
        browser.mouse("mouseMoved", *end)
        time.sleep(0.05)
    until(lambda: session.game.outcome == "won", 60)
    browser.mouse("mouseReleased", *end)
    browser.wait_for(
        "!document.querySelector('#banner').hidden && document.querySelector('#banner .stars i.on') !== null"
    )
    assert "Won" in browser.run("document.querySelector('#banner').textContent")
    until(lambda: (tmp_path / "scores.json").exists())
    attempt = session.game
    browser.click("#retry")
    until(lambda: session.game is not attempt)
    browser.wait_for("document.querySelector('#banner').hidden")
    session.submit(do.LoadScene(name="drop-2d"))
    browser.wait_for(
        "document.querySelector('#hud').hidden && document.querySelectorAll('#tools button:not([hidden])').length > 9"
    )
    assert browser.complaints() == []


def test_a_first_start_says_that_it_compiles_and_then_shows_water(browser, tmp_path):
    command = [sys.executable, "-m", "wavetank", "play", "drop-2d", "--web", "--no-browser", "--port", "0"]
    env = os.environ | {"QD_OFFLINE_CACHE_FILE_PATH": str(tmp_path), "PYTHONUNBUFFERED": "1"}
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=env) as server:
        try:
            line = next(line for line in server.stdout if "http://" in line)
            browser.open(next(word for word in line.split() if word.startswith("http://")).rstrip(";"))
            browser.wait_for("document.querySelector('#veil-text')?.textContent.startsWith('Compiling, once')", 120)
            assert browser.run("document.querySelector('#veil.gone') === null"), "it is read over an empty picture"
            browser.wait_for("document.querySelector('#veil.gone') !== null", 240)
        finally:
            server.terminate()
            browser.open("about:blank")


def test_forces_on_bodies_are_shown_by_a_key(open_page, browser):
    """Two arrows for a body, each with its newtons; the same key, and the switch under Look, take them away."""
    pytest.importorskip("rapier3d")
    crate = wt.Box(name="crate", center=(0.3, 0.4, 0.2), size=(0.2, 0.2, 0.2), density=500)
    open_page(BASIN.changed(solids=[crate]))
    assert browser.run("document.querySelectorAll('#region-names .force').length") == 0
    browser.key("n")
    browser.wait_for("document.querySelectorAll('#region-names .force').length === 2")
    assert browser.run("document.querySelector('#region-names .buoyancy').textContent").endswith(" N")
    browser.wait_for("document.querySelectorAll('#regions line.force.buoyancy').length === 1")
    pressed = "[...document.querySelectorAll('#look button')].find((b) => b.textContent === 'Shown')"
    browser.wait_for(f"{pressed}?.getAttribute('aria-pressed') === 'true'")
    browser.key("n")
    browser.wait_for("document.querySelectorAll('#region-names .force').length === 0")
    assert browser.complaints() == []


def test_numbers_of_forces_lie_beside_each_other(open_page, browser):
    """Two crates in the same place in the picture: four numbers, none over another."""
    pytest.importorskip("rapier3d")
    crates = [wt.Box(name=f"crate{z}", center=(0.3, 0.4, z), size=(0.12, 0.12, 0.12), density=500) for z in (0.1, 0.3)]
    open_page(BASIN.changed(solids=crates))
    browser.key("n")
    browser.wait_for("document.querySelectorAll('#region-names .force').length === 4")
    boxes = browser.run(
        "[...document.querySelectorAll('#region-names .force')].map((one) => one.getBoundingClientRect())"
        ".map((b) => [b.left, b.top, b.right, b.bottom])"
    )
    for k, a in enumerate(boxes):
        for b in boxes[k + 1 :]:
            assert a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1]

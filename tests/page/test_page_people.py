"""The page as people use it: by keys alone, by fingers alone, with a reader, on another run of the server."""

import os
import time
from pathlib import Path

import pytest
from test_page import BASIN, LEVEL, browser, open_page, until  # noqa: F401

import wavetank as wt
from wavetank.session.recording import Recording, replay

AXE = os.environ.get("WAVETANK_AXE", "")  # axe.min.js of axe-core, which is not ours to carry
CODES = {"Enter": 13, "Tab": 9, "Escape": 27, "ArrowLeft": 37, "ArrowUp": 38, "ArrowRight": 39, "ArrowDown": 40}
FOCUS = (
    "(() => { const e = document.activeElement; return e.id || e.dataset.tool || e.dataset.scene || e.className })()"
)


def press(page, key: str, hold: float = 0.0, shift: bool = False) -> None:
    """Press a key as a keyboard does, and hold it down for so many seconds."""
    about = {"key": key, "code": key, "windowsVirtualKeyCode": CODES.get(key, ord(key[0].upper()))}
    text = {"Enter": "\r", "Tab": ""}.get(key, key if len(key) == 1 else "")
    modifiers = 8 * shift
    page.call("Input.dispatchKeyEvent", type="keyDown", text=text, modifiers=modifiers, **about)
    time.sleep(hold)
    page.call("Input.dispatchKeyEvent", type="keyUp", modifiers=modifiers, **about)


def tab_to(page, wanted: str, most: int = 90) -> None:
    """Press Tab until an element has the focus."""
    for _ in range(most):
        press(page, "Tab")
        if page.run(FOCUS) == wanted:
            return
    raise AssertionError(f"Tab does not reach {wanted}")


def test_keys_alone(open_page, browser, tmp_path, monkeypatch):  # noqa: F811
    """Tab goes through all there is; a level waits, is won with arrows and Enter, and its recording repeats it."""
    monkeypatch.setenv("WAVETANK_DATA", str(tmp_path))
    world = open_page(LEVEL)
    session = world.session
    browser.wait_for("!document.querySelector('#hud').hidden")
    time.sleep(0.5)
    assert session.awaits_touch
    assert session.sim.time == 0.0, "nothing moves before the first touch"
    tab_to(browser, "tab-water")
    press(browser, "ArrowRight")
    browser.wait_for("document.querySelector('#tab-scenes').ariaSelected === 'true'")
    press(browser, "c")  # the panel goes, and comes back
    browser.wait_for("document.body.classList.contains('no-panel')")
    press(browser, "c")
    tab_to(browser, "tilt")
    press(browser, " ")  # belongs to the button that Tab went to
    assert session.sim.time == 0.0
    browser.run("document.activeElement.blur()")
    press(browser, "Enter")
    browser.wait_for("!document.querySelector('#cross').hidden")
    press(browser, "Enter")
    until(lambda: session.hands and not session.awaits_touch)
    press(browser, "ArrowRight", hold=1.2)
    until(lambda: session.game.outcome == "won", 90)
    press(browser, "Enter")
    press(browser, "Escape")
    until(lambda: not session.hands)
    browser.wait_for("!document.querySelector('#banner').hidden")
    assert browser.run(FOCUS) == "retry"
    tab_to(browser, "tab-scenes")  # the one that is chosen; arrows go to the others
    press(browser, "ArrowRight")
    assert browser.run(FOCUS) == "tab-look"
    text = browser.run(
        "(async () => (await fetch([...document.querySelectorAll('#look a')]"
        ".find(a => a.download === 'session.toml').href)).text())()"
    )
    path = tmp_path / "session.toml"
    path.write_text(text)
    recording = Recording.load(path)
    # In the simulation's thread, the only one that may compute.
    assert world.front.call(lambda: list(replay(recording))[-1].sim.digest()).result(240) == recording.digest
    assert browser.complaints() == []


def test_keys_alone_from_the_start_to_a_saved_recording(open_page, browser, tmp_path, monkeypatch):  # noqa: F811
    """Tab to the scenes, to a level, Enter; aim, tilt, win; Tab to the session, Enter; the file repeats it."""
    monkeypatch.setenv("WAVETANK_DATA", str(tmp_path))
    browser.call("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(tmp_path))
    world = open_page(wt.Scene.load("drop-2d"))
    session = world.session
    tab_to(browser, "tab-water")
    press(browser, "ArrowRight")
    browser.wait_for("document.querySelector('#tab-scenes').ariaSelected === 'true'")
    tab_to(browser, "spill")
    press(browser, "Enter")
    until(lambda: session.game is not None and session.awaits_touch)
    browser.wait_for("!document.querySelector('#hud').hidden && document.activeElement.id === 'picture'")
    browser.wait_for("document.querySelector('[data-tool=tilt]').getAttribute('aria-pressed') === 'true'")
    press(browser, "Enter")
    browser.wait_for("!document.querySelector('#cross').hidden")
    press(browser, "Enter")
    until(lambda: session.hands and not session.awaits_touch)
    press(browser, "ArrowRight", hold=1.0)
    until(lambda: session.game.outcome, 150)
    assert session.game.outcome == "won"
    press(browser, "Escape")
    until(lambda: not session.hands)
    browser.wait_for("!document.querySelector('#banner').hidden")
    until(lambda: browser.run(FOCUS) in ("next-level", "retry"))
    tab_to(browser, "tab-scenes")
    press(browser, "ArrowRight")
    for _ in range(40):
        press(browser, "Tab")
        if browser.run("document.activeElement.download") == "session.toml":
            break
    press(browser, "Enter")
    path = tmp_path / "session.toml"
    until(path.is_file, 60)
    until(lambda: path.stat().st_size > 0, 10)
    recording = Recording.load(path)
    assert world.front.call(lambda: list(replay(recording))[-1].sim.digest()).result(240) == recording.digest
    assert browser.complaints() == []


def test_a_reader_is_told_values_with_units(open_page, browser):  # noqa: F811
    """The dial is filled at once, says where down is and turns by arrows; sliders and tools say their units."""
    world = open_page()
    dial = "document.querySelector('.dial svg')"
    assert browser.run(f"{dial}.getAttribute('aria-valuetext')") == "9.81 m/s², straight down"
    tab_to(browser, "")  # the first that has no name of its own: nothing may trap the focus
    browser.run(f"{dial}.focus()")
    for _ in range(6):
        press(browser, "ArrowRight")
    until(lambda: world.session.sim.gravity[0] == pytest.approx(4.905, abs=0.01))
    # The world has turned before the page is told so.
    until(lambda: browser.run(f"{dial}.getAttribute('aria-valuetext')") == "9.81 m/s², 30° to the right of down")
    # 0.13 L in a world of 1.2 m, and 10 g.
    assert browser.run("document.querySelector('#tool-card input[type=range]').ariaValueText") == "0.156 m"
    browser.run("document.querySelector('[data-tool=attract]').click()")
    values = browser.run("[...document.querySelectorAll('#tool-card .number')].map(e => e.value)")
    assert values == ["0.3 m", "10 g"]
    # What is typed shows what holds: at most 20 g.
    browser.run(
        "(() => { const e = document.querySelectorAll('#tool-card .number')[1]; e.focus(); e.value = '1,000';"
        "e.onchange(); e.blur() })()"
    )
    assert browser.run("document.querySelectorAll('#tool-card .number')[1].value") == "20 g"
    small = browser.run(
        "[...document.querySelectorAll('body *')].filter(e => e.childNodes.length && [...e.childNodes].some(n =>"
        "n.nodeType === 3 && n.textContent.trim()) && parseFloat(getComputedStyle(e).fontSize) < 11)"
        ".map(e => e.outerHTML.slice(0, 80))"
    )
    assert small == []


@pytest.mark.skipif(not Path(AXE).is_file(), reason="no axe-core: npm pack axe-core, WAVETANK_AXE=.../axe.min.js")
def test_no_serious_barrier_in_any_state(open_page, browser, tmp_path, monkeypatch):  # noqa: F811
    monkeypatch.setenv("WAVETANK_DATA", str(tmp_path))
    world = open_page()
    states = {
        "water": "document.querySelector('#tab-water').click()",
        "parameters": "document.querySelector('#more').open = true",
        "scenes": "document.querySelector('#tab-scenes').click()",
        "look": "document.querySelector('#tab-look').click()",
        "colours": "[...document.querySelectorAll('#look .pills button')].find(b => b.textContent === 'Speed').click()",
        "help": "document.querySelector('#help-toggle').click()",
        "level": "document.querySelector('#help').close(); document.querySelector('#tab-water').click();"
        "document.querySelector('[data-scene=over-the-wall]').click()",
    }
    bad = []
    for name, act in states.items():
        browser.run(act)
        time.sleep(1.0)
        browser.run(Path(AXE).read_text() + ";1")
        found = browser.run(
            "axe.run().then(r => r.violations.filter(v => ['serious', 'critical'].includes(v.impact))"
            ".map(v => v.id + ': ' + v.nodes[0].html.slice(0, 120)))"
        )
        bad += [f"{name}: {one}" for one in found]
    assert bad == []
    assert world.session.game is not None


def look(page, name: str) -> None:
    """Keep what the page shows, where someone wants to look at it."""
    if folder := os.environ.get("WAVETANK_PICTURES"):
        page.picture(Path(folder) / f"{name}.png")


class Finger:
    """One finger on a phone."""

    def __init__(self, page) -> None:
        self.page = page

    def put(self, kind: str, *places) -> None:
        points = [{"x": x, "y": y, "id": k} for k, (x, y) in enumerate(places)]
        self.page.call("Input.dispatchTouchEvent", type=kind, touchPoints=points)

    def tap(self, selector: str) -> None:
        """Tap the middle of an element, which must be on the screen and covered by nothing."""
        self.page.run(f"document.querySelector({selector!r}).scrollIntoView({{block: 'nearest', inline: 'nearest'}})")
        time.sleep(0.3)
        x, y = self.page.center(selector)
        hit = self.page.run(f"document.elementFromPoint({x}, {y})?.closest({selector!r}) !== null")
        assert hit, f"{selector} is not where a finger gets it"
        self.put("touchStart", (x, y))
        self.put("touchEnd")


@pytest.mark.parametrize("sides", [(390, 844), (844, 390)])
def test_a_phone_by_touch_alone(open_page, browser, tmp_path, monkeypatch, sides):  # noqa: F811
    """A tool, a level that is won, another scene and back again, upright and on its side."""
    monkeypatch.setenv("WAVETANK_DATA", str(tmp_path))
    browser.size(*sides, touch=True)
    try:
        world = open_page(LEVEL)
        session, finger = world.session, Finger(browser)
        browser.wait_for("!document.querySelector('#hud').hidden")
        assert browser.run("[document.documentElement.scrollWidth, document.documentElement.scrollHeight]") <= [*sides]
        finger.tap("[data-tool=tilt]")
        start, end = browser.center("#picture", 0.3, 0.6), browser.center("#picture", 0.95, 0.6)
        look(browser, f"level-{sides[0]}")
        finger.put("touchStart", start)
        for k in range(1, 9):
            share = k / 8
            finger.put("touchMove", (start[0] + share * (end[0] - start[0]), start[1]))
            time.sleep(0.05)
        look(browser, f"tool-{sides[0]}")
        until(lambda: session.game.outcome == "won", 90)
        finger.put("touchEnd")
        browser.wait_for("!document.querySelector('#banner').hidden")
        time.sleep(0.4)
        look(browser, f"won-{sides[0]}")
        finger.tap("#retry")
        until(lambda: session.awaits_touch)
        finger.tap("#panel-toggle")
        finger.tap("#tab-scenes")
        browser.wait_for("document.querySelectorAll('#scenes button[data-scene]').length > 20")
        look(browser, f"scenes-{sides[0]}")
        finger.tap("[data-scene=drop-2d]")
        until(lambda: session.sim.scene.title != "Small level")
        assert browser.run("document.body.classList.contains('no-panel')"), "the panel gives way to the picture"
        finger.tap("#home")
        browser.wait_for("!document.querySelector('#undo').hidden")
        look(browser, f"scene-{sides[0]}")
        covered = browser.run(
            "[...document.querySelectorAll('#notes div')].flatMap(n => ['#home', '#undo'].filter(id => {"
            "const a = n.getBoundingClientRect(), b = document.querySelector(id).getBoundingClientRect();"
            "return a.right > b.left && a.bottom > b.top && a.top < b.bottom }))"
        )
        assert covered == [], "a note hides no button"
        finger.tap("#undo")
        until(lambda: session.sim.scene.title == "Small level")
        # A part of one more tool is seen at one of the ends, so that one knows of the others.
        session.submit(wt.commands.LoadScene(name="drop-2d"))
        browser.wait_for("document.querySelectorAll('#tools button:not([hidden])').length > 15")
        if sides[0] < sides[1]:
            cut = (
                "[...document.querySelectorAll('#tools button')].map(b => b.getBoundingClientRect()).some(b => "
                "b.left < innerWidth - 24 && b.right > innerWidth + 8 || b.left < -8 && b.right > 24)"
            )
            browser.wait_for(cut)
        assert browser.complaints() == []
    finally:
        browser.size(1000, 700)


def test_what_was_left_comes_back(open_page, browser):  # noqa: F811
    """A scene is loaded as fine as the machine can; undo brings back the world that was left, to the last bit."""
    world = open_page(BASIN)
    session = world.session
    until(lambda: session.sim.time > 0.6)
    browser.click("#tab-scenes")
    browser.wait_for("document.querySelector('[data-scene=obstacle-tank] small').textContent.includes(' of ')")
    browser.key(" ")
    until(lambda: session.paused)
    digest = world.front.call(session.sim.digest).result(60)
    browser.run("document.querySelector('[data-scene=obstacle-tank]').click()")
    until(lambda: session.sim.scene.title != "Basin")
    assert 200 <= session.sim.count < 20_000, "of 21,952"
    until(lambda: not session.paused)
    browser.key("z")
    until(lambda: session.sim.scene.title == "Basin")
    assert world.front.call(session.sim.digest).result(60) == digest
    # The dial is filled in the other scene, and in this one again.
    assert "straight down" in browser.run("document.querySelector('.dial svg').getAttribute('aria-valuetext')")


def test_the_aim_lies_on_the_water_and_lights_what_would_be_taken(open_page, browser):  # noqa: F811
    world = open_page(BASIN)
    session = world.session
    width, height = world.front.painter.wanted
    until(lambda: session.sim.time > 0.1)
    browser.run("document.querySelector('[data-tool=stir]').click(); document.querySelector('.fold').click()")
    middle = session.tilted_camera.project([[0.3, 0.3, 0.2]], width, height)[0]
    browser.mouse("mouseMoved", *browser.center("#picture", middle[0] / width, middle[1] / height))
    browser.wait_for("document.querySelectorAll('#aim polyline[points*=\" \"]').length === 4")
    ring = browser.run(
        "(() => { const b = document.querySelectorAll('#aim polyline')[3].getBBox();return [b.width, b.height] })()"
    )
    assert ring[0] * width > 1.5 * ring[1] * height, "a circle that lies is seen flat"
    browser.run("document.querySelector('[data-tool=grab]').click()")
    top = session.tilted_camera.project([[0.9, 0.199, 0.2]], width, height)[0]
    browser.mouse("mouseMoved", *browser.center("#picture", top[0] / width, top[1] / height))
    until(lambda: session.highlighted == "pillar")
    browser.mouse("mouseMoved", *browser.center("#title"))
    until(lambda: session.highlighted == "")


CUBE = """v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1
f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n"""


def drop(page, name: str, text: str) -> None:
    page.run(
        f"(() => {{ const data = new DataTransfer(); data.items.add(new File([{text!r}], {name!r}));"
        "window.dispatchEvent(new DragEvent('drop', { dataTransfer: data })) })()"
    )


def test_a_dropped_mesh_becomes_a_solid_and_messages_name_the_file(open_page, browser):  # noqa: F811
    world = open_page(BASIN)
    session = world.session
    drop(browser, "Cube.obj", CUBE)
    until(lambda: "Cube" in session.sim.solids.names)
    said = "[...document.querySelectorAll('#notes div')].map(e => e.textContent).join(' | ')"
    drop(browser, "bad.obj", "v 1 2 x\n")
    browser.wait_for(f"{said}.includes('bad.obj, line 1')")
    drop(browser, "mine.toml", "spacing = -1\n[tank]\nsize = [1, 1]")
    browser.wait_for(f"{said}.includes('mine.toml')")
    told = browser.run(said)
    assert "load: load:" not in told
    assert session.sim.scene.title == "Basin"


def test_the_picture_is_sharp_and_a_png_while_the_water_moves(open_page, browser):  # noqa: F811
    world = open_page(BASIN)
    size = browser.run(
        "(async () => { const a = [...document.querySelectorAll('#look a')].find(a => a.download.endsWith('.png'));"
        "const b = await createImageBitmap(await (await fetch(a.href)).blob()); return [b.width, b.height] })()"
    )
    wanted = world.front.painter.wanted
    assert not world.session.paused
    assert [side // 8 for side in size] == [side // 8 for side in wanted]


def test_a_colour_switches_the_view_and_has_a_legend_and_a_slice_moves(open_page, browser):  # noqa: F811
    world = open_page(BASIN)
    session = world.session
    browser.click("#tab-look")
    pill = "[...document.querySelectorAll('#look .pills button')].find(b => b.textContent === '{}').click()"
    assert browser.run("document.querySelector('#legend').hidden")
    browser.run(pill.format("Speed"))
    until(lambda: session.view == "particles")
    browser.wait_for("document.querySelector('#legend').textContent.includes('Speed [m/s]')")
    browser.run(pill.format("Slice"))
    place = "document.querySelector('#look input[type=range][aria-label=\\'Position\\']')"
    browser.wait_for(f"{place} !== null")
    first = browser.run("document.querySelector('#picture').toDataURL()")
    browser.run(f"(() => {{ const e = {place}; e.value = 0.9; e.oninput() }})()")
    until(lambda: session.cut == ("z", 0.9))
    browser.wait_for(f"document.querySelector('#picture').toDataURL() !== {first!r}")


def test_a_page_of_another_run_says_so_and_stops_asking(open_page, browser):  # noqa: F811
    """Another server on the same port: with another token the page says what to do; with the same one it goes on."""
    from wavetank.page.server import PageServer
    from wavetank.session.session import Session

    world = open_page(BASIN)
    port = world.front.port
    world.front.stop()
    world.thread.join(30)
    other = PageServer(Session(BASIN), port=port)  # at once: the port of a run that has ended is free
    other.start()
    try:
        browser.wait_for("document.querySelector('#veil-text').textContent.includes('restarted')", 30)
        time.sleep(1.0)
        sockets = sum(event["method"] == "Network.webSocketCreated" for event in browser.events)
        time.sleep(3.0)
        browser.run("1")
        assert sum(event["method"] == "Network.webSocketCreated" for event in browser.events) == sockets
    finally:
        other.stop()

"""A real window on a virtual display: what a person does there reaches the simulation, and pictures come back."""

import os
import subprocess
import sys
import time

import numpy as np
import pytest
from xdnd import Drag
from xvfb import Display, missing

import wavetank as wt
from wavetank.page import play
from wavetank.session.recording import Recording
from wavetank.session.session import Session

BASIN = wt.Scene(
    title="Basin",
    spacing=0.05,
    tank=wt.Tank(size=(1.2, 0.6, 0.4)),
    fluids=[wt.Block(lower=(0, 0, 0), upper=(0.6, 0.4, 0.4))],
    solids=[wt.Box(name="pillar", center=(0.9, 0.1, 0.2), size=(0.12, 0.2, 0.12))],
)
LONGEST = 120.0  # s, on a busy machine that compiles its kernels on the way
NEEDED = "apt-get install xvfb xdotool libgl1 libgl1-mesa-dri libglx-mesa0 libegl1"


@pytest.fixture(scope="module")
def display():
    if missing():
        if os.environ.get("CI") == "true":
            pytest.fail(f"{' and '.join(missing())} not here; .ci/run installs them with apt-get")
        pytest.skip(f"{' and '.join(missing())} not here: {NEEDED}")
    server = Display()
    yield server
    server.close()


class Person:
    """Someone in front of the window."""

    def __init__(self, display, window) -> None:
        import glfw
        from imgui_bundle import glfw_utils, imgui

        self.imgui = imgui
        self.display, self.window, self.session = display, window, window.engine.session
        self.desk = window.desk
        handle = glfw_utils.glfw_window_hello_imgui()
        self.left, self.top = glfw.get_window_pos(handle)
        glfw.focus_window(handle)

    def look(self, seconds: float = 0.15) -> None:
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.window.draw()
            time.sleep(0.005)

    def until(self, true, seconds: float = LONGEST) -> None:
        end = time.monotonic() + seconds
        while not true() and time.monotonic() < end:
            self.look(0.03)
        assert true()

    def move(self, x: float, y: float) -> None:
        """Move the pointer, and wait until the window has seen it there: a busy machine may take a while."""
        self.display.do("mousemove", round(self.left + x), round(self.top + y))
        self.until(lambda: max(abs(self.pointer.x - x), abs(self.pointer.y - y)) <= 1.0)
        self.look()

    @property
    def pointer(self):
        return self.imgui.get_mouse_pos()

    def press(self, button: int = 1) -> None:
        self._hold(button, True)

    def lift(self, button: int = 1) -> None:
        self._hold(button, False)

    def _hold(self, button: int, down: bool) -> None:
        self.display.do("mousedown" if down else "mouseup", button)
        self.until(lambda: self.imgui.is_mouse_down({1: 0, 2: 2, 3: 1}[button]) == down)
        self.look()

    def click(self, place: str, share: float = 0.5) -> None:
        def moved() -> bool:  # what has just appeared may still move, on a busy machine after the pointer is there
            before = self.desk.places[place]
            left, top, right, bottom = before
            self.move(left + share * (right - left), 0.5 * (top + bottom))
            return self.desk.places.get(place) != before

        self.until(lambda: place in self.desk.places)
        self.until(lambda: place in self.desk.places and not moved())
        self.press()
        self.lift()

    def scroll_to(self, place: str) -> None:
        """Turn the wheel over the panel until all of a control is in sight."""
        self.until(lambda: place in self.desk.places)
        left, top, right, bottom = self.desk.places["panel"]
        self.move(0.5 * (left + right), bottom - 40.0)

        def is_seen() -> bool:
            _, high, _, low = self.desk.places[place]
            if high < top or low > bottom:
                self.display.do("click", 4 if high < top else 5)
                self.look(0.1)
            return high >= top and low <= bottom

        self.until(is_seen)

    def key(self, name: str) -> None:
        self.display.do("key", name)
        self.look()

    def water(self, u: float, v: float) -> tuple[float, float]:
        x, y, width, height = self.window.stage.box
        return x + u * width, y + v * height


@pytest.fixture(scope="module")
def person(display):
    before = os.environ.get("DISPLAY")
    os.environ["DISPLAY"] = display.name
    assert play.why_no_window() is None
    from wavetank.page.window.window import Window

    window = Window(Session(BASIN), (1240, 820))
    window.open()
    someone = Person(display, window)
    someone.until(lambda: window.engine.shown.number > 2)
    yield someone
    window.close()
    os.environ.pop("DISPLAY") if before is None else os.environ.update(DISPLAY=before)


def test_the_water_is_seen(person):
    """The texture is on the screen, where it belongs, and it changes."""
    person.key("h")
    x, y, width, height = (round(side) for side in person.window.stage.box)
    person.window.draw()
    screen = person.window.screenshot()
    painted = person.window.engine.shown.image
    inside = screen[y + height // 2 : y + height - 8, x + 8 : x + width - 8]  # below the card of the tool
    assert np.abs(inside.mean((0, 1)) - painted[len(painted) // 2 :].mean((0, 1))).max() < 4.0
    assert inside.std() > 15.0
    first = person.window.engine.shown.number
    person.until(lambda: person.window.engine.shown.number > first)


def test_a_key_pauses_and_another_computes_one_frame(person):
    person.key("space")
    person.until(lambda: person.session.paused)
    ticks = person.session.ticks
    person.key("period")
    person.until(lambda: person.session.ticks == ticks + 1)
    person.key("space")
    person.until(lambda: not person.session.paused)
    person.key("3")
    assert person.desk.tool == "attract"
    person.key("question")
    assert person.desk.help
    person.key("Escape")
    assert not person.desk.help


def test_a_key_that_is_held_turns_on_and_off_once(person):
    """Signs come again and again while a key is down: the list of keys blinked, and time stood still by chance."""
    assert not person.desk.help
    person.display.do("keydown", "question")
    person.until(lambda: person.desk.help)
    for _ in range(5):  # as the system sends them, if it does
        person.imgui.get_io().add_input_character(ord("?"))
        person.look()
        assert person.desk.help
    person.display.do("keyup", "question")
    person.key("question")
    assert not person.desk.help


def test_a_slider_acts_at_once_and_another_waits_for_a_reset(person):
    person.click("viscosity", 0.8)
    person.until(lambda: person.session.sim.viscosity > 0.6)
    spacing = person.session.sim.scene.spacing
    person.click("spacing", 0.9)
    assert "spacing" in person.desk.pending and person.session.sim.scene.spacing == spacing
    person.look()
    person.click("again")
    person.until(lambda: person.session.sim.scene.spacing > 1.3 * spacing)
    assert person.session.sim.viscosity > 0.6, "what was set stays"
    assert not person.desk.pending


def test_a_tool_pushes_the_water_and_ends(person):
    person.click("tool.push")
    assert person.desk.tool == "push"
    person.move(*person.water(0.35, 0.6))
    person.press()
    person.until(lambda: [tool.name for tool, _ in person.session.hands.values()] == ["push"])
    person.move(*person.water(0.5, 0.6))
    point = person.session.hands[0][1].point
    person.move(*person.water(0.6, 0.6))
    person.until(lambda: np.linalg.norm(person.session.hands[0][1].point - point) > 0.02)
    person.lift()
    person.until(lambda: not person.session.hands)
    done = [type(command).__name__ for _, command in person.session.log]
    assert done.count("ToolBegin") == done.count("ToolEnd") == 1 and "ToolMove" in done


def test_the_aim_lies_on_the_water_and_lights_what_would_be_taken(person):
    """Before a click: a ring that lies, a line from its middle to the floor; what Grab would carry shines."""
    session, stage = person.session, person.window.stage
    width, height = stage.box[2:]
    person.desk.tool = "stir"
    middle = session.tilted_camera.project([[0.3, 0.35, 0.2]], width, height)[0]
    person.move(*person.water(middle[0] / width, middle[1] / height))
    person.until(lambda: stage._aim.get("drop"))
    ring, drop = np.array(stage._aim["ring"]) * (width, height), np.array(stage._aim["drop"]) * (width, height)
    assert np.ptp(ring[:, 0]) > 1.3 * np.ptp(ring[:, 1]), "a circle that lies is seen flat"
    assert drop[0] == pytest.approx(0.5 * (ring.min(0) + ring.max(0)), abs=0.05 * width)
    assert drop[1][1] > drop[0][1] + 20, "down, to the floor"
    assert not session.hands
    person.look(0.2)
    x, y = (round(side) for side in stage.box[:2])
    screen = person.window.screenshot().astype(int)
    ring = np.array(stage._aim["ring"]) * (width, height)  # it lies on water, which has moved on meanwhile
    u, v = (round(float(side)) for side in ring[len(ring) // 4])
    around = screen[y + v - 3 : y + v + 4, x + u - 3 : x + u + 4]
    assert np.ptp(around.max(axis=2)) > 60, "a bright line with a dark rim"
    person.desk.tool = "grab"
    top = session.tilted_camera.project([[0.9, 0.199, 0.2]], width, height)[0]
    person.move(*person.water(top[0] / width, top[1] / height))
    person.until(lambda: session.highlighted == "pillar")
    person.desk.tool = "push"
    person.move(stage.box[0] + 0.5 * width, 12.0)
    person.until(lambda: session.highlighted == "")


def test_buttons_wheel_and_keys_move_the_camera(person):
    person.key("h")
    person.until(lambda: person.session.chosen_camera is None)
    before = person.session.camera
    person.move(*person.water(0.5, 0.6))
    person.press(3)
    person.move(*person.water(0.6, 0.65))
    person.until(lambda: person.session.camera.eye != before.eye)
    turned = person.session.camera
    assert turned.distance == pytest.approx(before.distance) and turned.target == before.target
    person.display.do("keydown", "w")
    person.until(lambda: person.session.camera.target != turned.target)
    person.display.do("keyup", "w")
    person.lift(3)
    way = np.subtract(person.session.camera.target, turned.target)
    ahead = np.subtract(turned.target, turned.eye)
    assert way @ ahead > 0.9 * np.linalg.norm(way) * np.linalg.norm(ahead)
    assert not person.session.hands, "the right button is no tool"
    person.look()
    distance = person.session.camera.distance
    person.display.do("click", 4)
    person.until(lambda: person.session.camera.distance < 0.95 * distance)


def test_a_key_shows_what_the_water_does_to_bodies(person):
    pytest.importorskip("rapier3d")
    crate = wt.Box(name="crate", center=(0.3, 0.4, 0.2), size=(0.2, 0.2, 0.2), density=500)
    person.window.engine.call(lambda: person.session.sim.add_solid(crate)).result(LONGEST)
    assert "force.buoyancy" not in person.desk.places
    person.key("n")
    person.until(lambda: "force.buoyancy" in person.desk.places and "force.drag" in person.desk.places)
    left, top, right, bottom = person.desk.places["force.buoyancy"]
    assert right > left + 10 and bottom > top + 5, "a number in a box"
    person.key("n")
    person.until(lambda: not person.session.shows_forces)
    person.window.engine.call(lambda: person.session.sim.remove_solid("crate")).result(LONGEST)


def test_the_sun_is_turned_by_a_slider_and_by_keys(person):
    person.click("page.Look")
    person.until(lambda: "sun.azimuth" in person.desk.places)
    person.click("sun.azimuth", 0.25)
    person.until(lambda: "sun" in person.session.light)
    azimuth, elevation = map(float, person.session.light["sun"].split(","))
    assert abs(azimuth - 90.0) < 12.0 and abs(elevation - 54.1) < 0.1, "its height stays"
    person.key("greater")
    person.until(lambda: float(person.session.light["sun"].split(",")[0]) > azimuth + 9.0)
    person.click("page.Water")


def test_pages_curves_scenes_and_files(person, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    person.until(lambda: len(person.desk.curves.get("density_error_mean", ())) > 1)
    for page in ("Look", "Curves", "Keep"):
        person.click(f"page.{page}")
    person.click("keep.session.toml")
    person.until(lambda: (tmp_path / "session.toml").exists())
    saved = Recording.load(tmp_path / "session.toml")
    assert 0 < saved.frames <= person.session.ticks and len(saved.commands) <= len(person.session.log)
    person.click("page.Scenes")
    person.scroll_to("scene.double-dam-2d")  # below the levels
    person.click("scene.double-dam-2d")
    person.until(lambda: person.session.sim.scene.dim == 2)


def drop(person, file) -> None:
    """Drag a file over the window and let go, as another program would."""
    import glfw
    from imgui_bundle import glfw_utils

    x, y = person.water(0.5, 0.5)
    target = glfw.get_x11_window(glfw_utils.glfw_window_hello_imgui())
    drag = Drag(person.display.name, target, [file], round(person.left + x), round(person.top + y))

    def is_done() -> bool:
        drag.pump()
        return drag.finished

    person.until(is_done)
    drag.close()


def test_a_file_that_is_dropped_is_opened_and_a_wrong_one_says_why(person, tmp_path):
    BASIN.changed(title="Dropped").save(tmp_path / "mine.toml")
    drop(person, tmp_path / "mine.toml")
    person.until(lambda: person.session.sim.scene.title == "Dropped")
    (tmp_path / "wrong.toml").write_text("spacing = 'wide'\n")
    drop(person, tmp_path / "wrong.toml")
    person.until(lambda: any("spacing" in note for note, _ in person.desk.notes))
    assert person.session.sim.scene.title == "Dropped"


LEVEL = wt.Scene(
    title="Small level",
    spacing=0.05,
    tank=wt.Tank(size=(1.2, 0.7)),
    fluids=[wt.Block(lower=(0, 0), upper=(0.6, 0.3))],
    solids=[wt.Box(center=(0.65, 0.175), size=(0.1, 0.35))],
    goal={
        "text": "Bring the water over.",
        "hint": "Tilt more.",
        "seconds": 60,
        "tools": {"tilt": {"most": 60.0}, "push": {}},
        "aims": [{"kind": "deliver", "name": "here", "lower": (0.7, 0), "upper": (1.2, 0.7), "share": 0.2}],
    },
)


def time_is_over(person) -> None:
    def wait() -> None:
        assert person.session.awaits_touch, "for the first touch"
        person.session.paused = person.session.awaits_touch = False
        person.session.game.elapsed = person.session.game.goal.seconds

    person.window.engine.call(wait).result()
    person.until(lambda: person.desk.game["outcome"] == "lost" and "retry" in person.desk.places)


def test_a_level_is_won_and_lost(person, tmp_path, monkeypatch):
    """Region and allowed tools are shown; a drag wins and the score is kept; retry and the next level are a click."""
    monkeypatch.setenv("WAVETANK_DATA", str(tmp_path / "scores"))
    session, desk = person.session, person.desk
    LEVEL.save(tmp_path / "level.toml")
    drop(person, tmp_path / "level.toml")
    person.until(lambda: desk.game is not None and "region.0" in desk.places)
    assert [tool["name"] for tool in desk.rail] == ["look", "push", "tilt"]
    assert desk.tool == "tilt"
    assert [about["name"] for about in desk.hand["options"]] == ["stay"], "the angle is fixed"
    person.key("9")
    assert desk.tool == "tilt", "there is no dye in this level"
    assert (desk.game["heading"], desk.game["aims"][0]["label"]) == ("Level", "here 0 % of 20 %")

    def columns() -> list[float]:
        x, _, width, height = person.window.stage.box
        return (x + session.camera.project([[0.7, 0.0, 0.0], [1.2, 0.0, 0.0]], width, height)[:, 0]).tolist()

    person.until(lambda: desk.places["region.0"][0::2] == pytest.approx(columns(), abs=2.0))
    person.move(*person.water(0.4, 0.5))
    person.press()
    person.move(*person.water(0.95, 0.5))
    person.until(lambda: session.game.outcome == "won")
    person.lift()
    person.until(lambda: "retry" in desk.places)
    assert "next" not in desk.places
    assert desk.game["headline"] == "Won" and "A new best." in desk.game["verdict"]
    assert [entry["stars"] for entry in desk.engine.shown.scores.values()] == [desk.game["stars"]]
    assert (tmp_path / "scores" / "scores.json").exists()
    attempt = session.game
    person.click("retry")
    person.until(lambda: session.game is not attempt and not desk.game["outcome"])
    person.look()
    assert "retry" not in desk.places
    time_is_over(person)
    assert (desk.game["headline"], desk.game["verdict"]) == ("Time is over", "Tilt more.")
    person.click("page.Scenes")
    person.scroll_to("scene.over-the-wall")
    person.click("scene.over-the-wall")
    person.until(lambda: desk.game["heading"] == "Level 1 of 11")
    time_is_over(person)
    person.click("next")
    person.until(lambda: desk.game["heading"] == "Level 2 of 11")
    assert session.scene.title == wt.Scene.load("spill").title


def play_out(arguments, environment, until: str, seconds: float = LONGEST) -> str:
    """Start `wavetank play`, wait for a word of its, end it as a person does; return all that it said."""
    process = subprocess.Popen(
        [sys.executable, "-m", "wavetank", "play", "drop-2d", "--particles", "200", *arguments],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    said = ""
    end = time.monotonic() + seconds
    while process.poll() is None and until not in said and time.monotonic() < end:
        said += process.stdout.readline()
    if process.poll() is None:
        process.terminate()
    said += process.communicate(timeout=LONGEST)[0]
    return said


def without_display() -> dict[str, str]:
    quiet = {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "WAYLAND_DISPLAY")}
    return {**quiet, "BROWSER": "true"}


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="elsewhere there is always a display")
def test_without_a_display_play_serves_the_page_and_says_why():
    said = play_out([], without_display(), "plays at")
    assert "no window: there is no display (neither DISPLAY nor WAYLAND_DISPLAY is set); serving the page" in said
    assert "token=" in said and "Traceback" not in said
    said = play_out(["--window"], without_display(), "no such word")
    assert said.count("\n") == 1 and said.startswith("wavetank: --window: there is no display")


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="elsewhere there is always a display")
def test_reasons_are_told_apart(monkeypatch):
    """A missing package, a missing library, a display that is not there."""
    monkeypatch.setenv("DISPLAY", ":9")
    monkeypatch.setitem(sys.modules, "moderngl", None)
    assert play.why_no_window() == "the package moderngl is missing (pip install 'wavetank[window]')"
    said = play_out(["--window"], {**os.environ, "DISPLAY": ":4999"}, "no such word")
    assert "--window: the display cannot be opened (X11: Failed to open display :4999)." in said


def test_play_opens_a_window_and_records(display, tmp_path):
    """The command itself, from the window to the file of the session, on a display without another window."""
    display = Display()
    process = subprocess.Popen(
        [sys.executable, "-m", "wavetank", "play", "drop-2d", "--particles", "200", "--record", tmp_path / "s.toml"],
        env=display.environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    try:
        found = subprocess.run(
            ["xdotool", "search", "--sync", "--onlyvisible", "--name", "^wavetank$"],
            env=display.environment,
            capture_output=True,
            text=True,
            timeout=LONGEST,
        ).stdout.split()
        display.do("windowfocus", "--sync", found[0])
        for _ in range(6):  # the first picture is slow where kernels are compiled
            display.do("key", "space")
            time.sleep(2.0)
    finally:
        process.terminate()
        said = process.communicate(timeout=LONGEST)[0]
        display.close()
    assert process.returncode == 0 and "session written to" in said, said
    assert "pause" in [command["do"] for command in Recording.load(tmp_path / "s.toml").commands]


def test_numbers_of_forces_make_way_for_each_other():
    from wavetank.page.window.hud import parted

    boxes = [(0.0, 10.0, 40.0, 24.0), (10.0, 15.0, 50.0, 29.0), (60.0, 15.0, 90.0, 29.0), (20.0, 20.0, 70.0, 34.0)]
    placed = parted(boxes)
    assert placed[0] == boxes[0] and placed[2] == boxes[2], "those that are in nobody's way stay"
    for k, a in enumerate(placed):
        for b in placed[k + 1 :]:
            assert a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1]

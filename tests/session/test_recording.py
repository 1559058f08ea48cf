"""What was played can be played again, to the last bit; time goes back, and every command has one meaning."""

import dataclasses
import json
import os
import re
import signal
import subprocess
import sys
import time
import tomllib

import numpy as np
import pytest
from test_session import Monkey, down, pool

import wavetank as wt
from wavetank.scene.forces import Force
from wavetank.session import commands as c
from wavetank.session.commands import COMMANDS, command_of, table_of
from wavetank.session.history import History
from wavetank.session.recording import Recording, replay
from wavetank.session.session import Session
from wavetank.simulation.state import PackedState

RAY = {"origin": (0.3, 0.2, 5.0), "direction": (0.0, 0.0, -1.0)}
EXAMPLES = [
    c.SetParameter(name="viscosity", value=0.2),
    c.SetParameter(name="gravity", value=(1.0, -2.0)),
    c.Reset(parameters={"spacing": 0.06}),
    c.LoadScene(name="drop-2d"),
    c.LoadScene(text="spacing = 0.1"),
    c.LoadScene(name="drop", particles=4000),
    c.Undo(),
    c.SetView(axis="x", place=0.25),
    c.Zoom(factor=0.8, x=0.2),
    c.ToolBegin(tool="pour", options={"aim": "ahead", "width": 0.2, "keep": True}, **RAY),
    c.ToolMove(**RAY, pointer=3),
    c.ToolEnd(pointer=3),
    c.ToolStop(tool="pour"),
    c.MoveSolid(name="ball", position=(0.5, 0.3), rotation=0.5),
    c.AddSolid(solid=wt.Box(center=(0.1, 0.2), size=(0.1, 0.1))),
    c.RemoveSolid(name="ball"),
    c.Pause(on=False),
    c.Step(frames=3),
    c.Speed(factor=0.25),
    c.FrameLength(parts=2, filled=True),
    c.Rewind(time=0.3),
    c.Bookmark(name="here", action="go"),
    c.SetCamera(eye=(1, 2, 3), target=(0, 0, 0)),
    c.Orbit(azimuth=0.1),
    c.Pan(right=0.2),
    c.Zoom(factor=0.9),
    c.Home(),
    c.SetView(color_by="density"),
    c.SetLight(environment="evening"),
    c.SetLight(azimuth=40.0, elevation=12.0),
    c.SetLight(turn=-10.0),
]


OTHER = """
spacing = 0.06
tank.size = [0.8, 0.5]
fluids = [{ lower = [0, 0], upper = [0.4, 0.4] }]
solids = [{ name = "ball", center = [0.6, 0.2], size = [0.1, 0.1] }]
forces = [{ kind = "wind", velocity = [1, 0] }]
"""


def test_commands_survive_the_way_through_json():
    assert {type(command) for command in EXAMPLES} == set(COMMANDS)
    for command in EXAMPLES:
        assert command_of(json.loads(json.dumps(table_of(command)))) == command


@pytest.mark.parametrize(
    ("table", "words"),
    [
        (None, "must be a table"),
        ([], "must be a table"),
        ({}, "do = 'None' is not a command"),
        ({"do": "swim"}, "'swim' is not a command; it must be one of set, reset"),
        ({"do": "speed", "factor": float("nan")}, "factor = nan"),
        ({"do": "speed", "factor": 100}, "at most 4"),
        ({"do": "speed"}, "factor is missing"),
        ({"do": "speed", "factr": 1}, "did you mean 'factor'"),
        ({"do": "tool-move", "origin": [0, 0], "direction": [0, 0, 1]}, "origin"),
        ({"do": "tool-move", "origin": [0, 0, 1e9], "direction": [0, 0, 1]}, "at most 1"),
        ({"do": "tool-move", "origin": [0, 0, 0], "direction": [0, 0, 0]}, "too short"),
        ({"do": "add-solid", "solid": {"shape": "cone"}}, "cone"),
        ({"do": "load"}, "either the name"),
    ],
)
def test_what_is_no_command_is_one_sentence(table, words):
    with pytest.raises(wt.WavetankError, match=re.escape(words)) as report:
        command_of(table)
    assert "\n" not in str(report.value)


def test_the_latest_value_wins_and_nothing_overtakes():
    session = Session(pool())
    for value in (0.1, 0.2, 0.3):
        session.submit(c.SetParameter(name="viscosity", value=value))
        session.submit(c.SetParameter(name="vorticity", value=value))
    session.submit(c.Orbit(azimuth=0.1))
    session.submit(c.Orbit(azimuth=0.2))
    session.submit(c.Zoom(factor=0.5))
    session.submit(c.Zoom(factor=0.5))
    assert session.drain() == 4
    assert session.sim.viscosity == 0.3
    assert [command for _, command in session.log if isinstance(command, c.Zoom)] == [c.Zoom(factor=0.25)]
    assert next(k for _, k in session.log if isinstance(k, c.Orbit)).azimuth == pytest.approx(0.3)
    for x in (0.1, 0.2):
        session.submit(c.ToolBegin(tool="push", **down(x, 0.2)))
        session.submit(c.ToolMove(**down(x + 0.05, 0.2)))
        session.submit(c.ToolEnd())
    assert session.drain() == 6
    for _ in range(10_000):
        session.submit(c.ToolEnd())
    assert session.drain() < 5000


def test_refusals_become_notes_and_leave_no_trace():
    session = Session(pool())
    log = len(session.log)
    for command in (
        c.SetParameter(name="viscosity", value=-1.0),
        c.SetParameter(name="spacing", value=0.1),
        c.RemoveSolid(name="whale"),
        c.RemoveSolid(name="tank x lower"),
        c.LoadScene(text="spacing = 0"),
        c.Reset(parameters={"spacing": 1e-4}),
        c.Bookmark(name="x", action="go"),
        c.SetView(view="x-ray"),
        c.MoveSolid(name="ball", position=(0.1, 0.2, 0.3)),
    ):
        session.submit(command)
    before = session.sim.scene.model_copy(deep=True)
    session.drain()
    assert len(session.notes) >= 8
    assert len(session.log) == log
    assert session.sim.scene == before


def test_pause_step_and_slow_motion():
    session = Session(pool(substeps=4))
    session.apply(c.Pause())
    session.turn()
    assert session.sim.time == 0.0
    session.apply(c.Step(frames=2))
    for _ in range(5):
        session.turn()
    assert session.ticks == 2
    assert session.sim.time == pytest.approx(2 / 60)
    session.apply(c.Speed(factor=0.5))
    session.tick()
    assert session.sim.time == pytest.approx(2.5 / 60)
    session.apply(c.Speed(factor=1 / 64))
    session.tick()
    assert session.sim.time == pytest.approx(2.625 / 60), "no frame is shorter than a good time step"


def test_real_time_is_kept_and_slowness_told(monkeypatch):
    clock = [100.0]
    monkeypatch.setattr("wavetank.session.session.time.perf_counter", lambda: clock[0])
    session = Session(pool())
    for cost, late in ((0.0, False), (0.1, True)):
        monkeypatch.setattr(session, "tick", lambda cost=cost: clock.__setitem__(0, clock[0] + cost) or 1 / 60)
        start, frames = clock[0], 0
        while clock[0] < start + 5.0:
            frames += session.turn()
            clock[0] += 0.001
        assert session.pace.is_late(1.0) is late
        assert frames == pytest.approx(5.0 * min(60.0, 1 / (cost + 0.001)), rel=0.03)


def test_a_slow_machine_gets_shorter_frames(monkeypatch):
    clock = [100.0]
    monkeypatch.setattr("wavetank.session.session.time.perf_counter", lambda: clock[0])
    session = Session(pool())
    session.smooth, session.sim.time_steps = True, 5

    def tick(per_step: float) -> float:
        clock[0] += per_step * session.frame_duration / session.sim.scene.frame_time * 5
        return session.frame_duration

    for per_step, least, most in ((0.05, 0.03, 0.067), (0.001, 0.004, 0.006)):
        monkeypatch.setattr(session, "tick", lambda per_step=per_step: tick(per_step))
        for _ in range(40):
            session.turn()
            clock[0] += 0.02
        took = per_step * 5 * session.frame_duration / session.sim.scene.frame_time
        assert least <= took <= most
    assert any(isinstance(command, c.FrameLength) for _, command in session.log)


def test_a_late_session_fills_its_frames_and_a_replay_does_as_well(monkeypatch):
    scene = wt.Scene.load("dam-break-2d")
    session = Session(scene)
    session.smooth = True
    monkeypatch.setattr(session.pace, "is_late", lambda wanted: session.sim.time > 0.2)
    monkeypatch.setattr(session.pace, "wait", lambda now: 0.0)
    monkeypatch.setattr("wavetank.session.session.SLOW_FRAME", 1e9)  # s: frames are never divided
    while session.sim.time < 0.8:
        session.turn()
    assert [command for _, command in session.log] == [c.FrameLength(parts=1, filled=True)]
    assert session.ticks > 0.8 * 60 + 4, "frames are shorter than a sixtieth"
    recording = Recording.of(session, scene)
    again = [*replay(recording)][-1]
    assert again.sim.time == session.sim.time
    assert again.sim.digest() == recording.digest


def test_rewind_brings_the_same_water_back():
    session = Session(pool())
    for _ in range(24):
        session.tick()
    then, when = session.sim.digest(), session.sim.time
    solids = [*session.sim.solids.names]
    session.apply(c.Bookmark(name="then"))
    session.apply(c.ToolBegin(tool="waves", **down(0.1, 0.2)))
    session.apply(c.ToolEnd())
    session.apply(c.AddSolid(solid=wt.Sphere(center=(0.3, 0.5), radius=0.05)))
    session.apply(c.ToolBegin(tool="cut", **down(0.2, 0.1)))
    for _ in range(30):
        session.tick()
    assert session.sim.count < 96
    session.apply(c.Bookmark(name="then", action="go"))
    assert session.sim.digest() == then
    assert session.sim.time == when
    assert session.sim.solids.names == solids
    assert not session.running
    session.apply(c.Rewind(time=0.21))
    assert session.sim.time == pytest.approx(0.2, abs=0.02)
    first = session.history.times[-1]
    session.tick()
    assert session.history.times[-1] < first, "another future begins here"


def test_the_past_fits_into_its_memory():
    snapshot = Session(pool()).sim.snapshot()
    size = PackedState(snapshot).size
    history = History(memory=5 * size)
    for k in range(20):
        history.record(dataclasses.replace(snapshot, time=0.1 * k))
    assert 4 <= len(history.times) <= 5
    assert history.times[-1] == pytest.approx(1.9)
    unpacked = PackedState(snapshot).unpack()
    for name, array in snapshot.arrays.items():
        np.testing.assert_array_equal(unpacked.arrays[name], array)


@pytest.mark.parametrize(("seed", "periodic"), [(1, []), (2, []), (3, ["x"])])
def test_a_replay_has_the_same_particles_bit_for_bit(seed, periodic, tmp_path):
    """Whatever was done: pouring, cutting, rewinding, bookmarks, other scenes, slow motion."""
    start = pool(tank=wt.Tank(size=(1.0, 0.6), periodic=periodic))
    session, monkey = Session(start, most_particles=400), Monkey(seed)
    for number in range(300):
        if number == 150:
            session.submit(c.LoadScene(text=OTHER))
        try:
            session.submit(command_of(monkey.command()))
        except wt.WavetankError:
            continue
        if number % 2:
            session.drain()
            session.tick()
    session.drain()
    Recording.of(session, start).save(tmp_path / "session.toml")
    recording = Recording.load(tmp_path / "session.toml")
    assert recording.frames == session.ticks > 50
    *_, again = replay(recording)
    assert again.sim.digest() == session.sim.digest() == recording.digest
    assert again.sim.count == session.sim.count


def test_a_recording_that_is_none(tmp_path):
    path = tmp_path / "r.toml"
    good = Recording.of(Session(pool()), pool())
    for text, words in (
        ("frames =", "cannot be read"),
        ("frames = 1", "scene is missing"),
        ("format = 2\n[scene]\n", "format = 2"),
        (good.text() + '[[commands]]\nframe = 3\ndo = "home"\n', "commands[0].frame = 3"),
        (good.text() + '[[commands]]\nframe = 0\ndo = "swim"\n', "commands[0]: do = 'swim'"),
        (good.text() + '[[commands]]\nframe = 0\ndo = "remove-solid"\nname = "whale"\n', "before frame 0 is refused"),
    ):
        path.write_text(text.replace("commands = []\n", ""))
        with pytest.raises(wt.WavetankError, match=re.escape(words)) as report:
            list(replay(Recording.load(path), origin=str(path)))
        assert str(report.value).startswith(str(path))


OFTEN = "import wavetank.page.recorder as r; r.EVERY = 0.2; from wavetank.cli import main; main()"


def test_a_killed_session_keeps_its_recording(tmp_path):
    """Killed in the middle of play, with a hand in the water: the file is whole, and replays to its digest."""
    from websockets.sync.client import connect

    path = tmp_path / "session.toml"
    process = subprocess.Popen(
        [sys.executable, "-c", OFTEN, "play", "drop-2d", "--web", "--no-browser", "--port", "0", "--record", str(path)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    port, token = re.search(r"http://127\.0\.0\.1:(\d+)/\?token=(\S+)", process.stdout.readline()).groups()
    with connect(f"ws://127.0.0.1:{port}/socket?token={token}", max_size=None) as socket:
        socket.send('{"do": "point-begin", "x": 0.5, "y": 0.7, "tool": "stir"}')
        socket.send('{"do": "set", "name": "viscosity", "value": 0.2}')
        end, frames = time.monotonic() + 600, 0
        while time.monotonic() < end and frames < 10:
            socket.send('{"do": "point-move", "x": 0.4, "y": 0.6}')
            message = socket.recv(timeout=240)
            if not isinstance(message, str):
                socket.send('{"do": "ack"}')
            frames = Recording.load(path).frames if path.exists() else 0
        os.kill(process.pid, signal.SIGKILL)
    process.communicate(timeout=60)
    recording = Recording.load(path)
    assert recording.frames >= 10
    assert {"tool-begin", "tool-move", "set"} <= {command["do"] for command in recording.commands}
    *_, again = replay(recording)
    assert again.sim.digest() == recording.digest


def test_play_records_and_replay_repeats(tmp_path):
    """The commands of the command line, with someone at the page."""
    from websockets.sync.client import connect

    path, film = tmp_path / "session.toml", tmp_path / "film.mp4"
    wavetank = [sys.executable, "-m", "wavetank"]
    process = subprocess.Popen(
        [*wavetank, "play", "drop-2d", "--web", "--no-browser", "--port", "0", "--record", str(path)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    line = process.stdout.readline()
    port, token = re.search(r"http://127\.0\.0\.1:(\d+)/\?token=(\S+)", line).groups()
    with connect(f"ws://127.0.0.1:{port}/socket?token={token}", max_size=None) as socket:
        socket.send('{"do": "point-begin", "x": 0.5, "y": 0.7, "tool": "stir"}')
        socket.send('{"do": "set", "name": "viscosity", "value": 0.2}')
        end, seen = time.monotonic() + 60, 0.0
        while seen < 0.3 and time.monotonic() < end:
            message = socket.recv(timeout=240)
            seen = json.loads(message).get("time", 0.0) if isinstance(message, str) else seen
    os.kill(process.pid, signal.SIGINT)
    stdout, stderr = process.communicate(timeout=300)
    assert process.returncode == 0, stderr
    assert f"session written to {path}" in stdout
    assert [line for line in stderr.splitlines() if "preparing kernels" not in line] == []
    table = tomllib.loads(path.read_text())
    assert {"tool-begin", "set"} <= {command["do"] for command in table["commands"]}
    result = subprocess.run(
        [*wavetank, "replay", str(path), "--video", str(film), "--size", "160x96", "--json"],
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert result.returncode == 0, result.stderr
    figures = json.loads(result.stdout.splitlines()[-1])
    assert figures["same"] is True
    assert figures["frames"] == table["frames"] > 0
    assert film.stat().st_size > 1000
    result = subprocess.run([*wavetank, "replay", str(tmp_path / "no.toml")], capture_output=True, text=True)
    assert result.returncode == 1
    assert result.stderr.count("\n") == 1


class Lift(Force):
    """A force of one's own, as in examples/04."""

    def apply(self, particles, count, dt, time):
        pass


def test_forces_of_a_script_cannot_be_recorded_and_that_is_said():
    """Those of the scene and of tools can; others would be missing in the replay."""
    session = Session(pool())
    session.apply(c.ToolBegin(tool="explosion", **RAY))
    session.apply(c.ToolEnd())
    session.apply(c.ToolBegin(tool="push", **RAY))
    for _ in range(3):
        session.tick()
    assert Recording.of(session, pool()).frames == 3
    for add in (lambda sim: sim.forces.append(Lift()), lambda sim: sim.push(Lift())):
        session = Session(pool())
        add(session.sim)
        session.tick()
        with pytest.raises(
            wt.WavetankError, match=r"a script changed its forces \(Lift\); a recording holds the scene"
        ) as e:
            Recording.of(session, pool())
        assert "\n" not in str(e.value)
    session = Session(wt.Scene.from_text(OTHER, "scene"))
    session.sim.forces.clear()
    session.tick()
    with pytest.raises(wt.WavetankError, match="Wind"):
        Recording.of(session, session.scene)

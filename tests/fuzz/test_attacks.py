"""Everything that fell once, in its smallest form: refused in one sentence, soon, and nothing is hurt."""

import os
import re
import threading
from pathlib import Path

import numpy as np
import pytest
from attacks import (
    ARRAYS,
    HEADERS,
    MESSAGES,
    POOL,
    SCENES,
    bomb,
    refused,
    state_parts,
    taken_or_refused,
    with_about,
    write_state,
    zeros,
)

import wavetank as wt
from wavetank.page.viewers import Viewer, Viewers, _table
from wavetank.session.recording import Recording, replay
from wavetank.session.session import Session
from wavetank.simulation.state_file import sealed


def started(text: str) -> wt.Simulation:
    sim = wt.Simulation(wt.Scene.from_text(text, "scene.toml"))
    for _ in range(3):
        sim.step()
    assert np.isfinite(sim.positions).all() and np.isfinite(sim.velocities).all()
    return sim


@pytest.mark.parametrize("name", SCENES)
def test_scenes(name):
    text, words = SCENES[name]
    refused(lambda: started(text), words)


@pytest.fixture(scope="module")
def state(tmp_path_factory) -> dict[str, np.ndarray]:
    sim = wt.Simulation(wt.Scene.from_text(POOL + 'solids = [{name = "box", center = [0.8, 0.1], size = [0.1, 0.2]}]'))
    for _ in range(3):
        sim.step()
    path = tmp_path_factory.mktemp("state") / "good.npz"
    sim.save(path)
    return state_parts(path)


def restored(path: Path) -> wt.Simulation:
    sim = wt.Simulation.restore(path)
    sim.step()
    assert np.isfinite(sim.positions).all() and np.isfinite(sim.velocities).all()
    return sim


@pytest.mark.parametrize("name", HEADERS)
def test_headers_of_states(name, state, tmp_path):
    path = write_state(tmp_path / "bad.npz", sealed(with_about(state, HEADERS[name])))
    assert str(path) in refused(lambda: restored(path))


@pytest.mark.parametrize("name", ARRAYS)
def test_arrays_of_states(name, state, tmp_path):
    path = write_state(tmp_path / "bad.npz", sealed(ARRAYS[name](state)))
    assert str(path) in refused(lambda: restored(path))


def test_bombs_cost_nothing(tmp_path):
    path = tmp_path / "bomb.npz"
    for content in (
        bomb(),
        bomb("(2**62, 2**62)"),
        bomb("(-1,)"),
        bomb("(" + "(" * 5000),
        zeros(0.5),
        b"PK",
        b"",
        b"\x93NUMPY",
    ):
        path.write_bytes(content)
        assert str(path) in refused(lambda: restored(path))


def test_messages_do_not_end_the_session():
    session = Session(wt.Scene.from_text(POOL))
    viewers = Viewers(session.submit, lambda u, v, tool: {}, dict)
    viewers.driver = viewer = Viewer(None)

    for name, text in MESSAGES.items():
        taken_or_refused(lambda text=text: viewers.hear(viewer, _table({"text": text})))
        before = len(session.notes)
        session.turn()
        session.tick()
        assert all("\n" not in note and len(note) < 1000 for note in session.notes[before:]), name
        assert np.isfinite(session.sim.positions).all(), name


RECORDING = "format = 1\nframes = 3\n[scene]\nspacing = 0.05\ntank.size = [1.0, 0.6]\nfluids = [{lower=[0,0],upper=[0.5,0.4]}]\n"
RECORDINGS = {
    "deep": "x = " + "[" * 100_000,
    "digits": "frames = " + "9" * 5000,
    "fine reset": RECORDING + '[[commands]]\nframe = 1\ndo = "reset"\nparameters = {spacing = 0.0001}',
    "load of deep text": RECORDING + '[[commands]]\nframe = 1\ndo = "load"\ntext = "x = ' + "[" * 50_000 + '"',
    "deep command": RECORDING + '[[commands]]\nframe = 1\ndo = "pause"\non = ' + "[" * 300 + "]" * 300,
    "frames without end": RECORDING.replace("frames = 3", "frames = 100000000"),
    "a frame that is a list": RECORDING + '[[commands]]\nframe = [1]\ndo = "pause"',
    "commands of numbers": RECORDING.replace("[scene]", "commands = [1, 2]\n[scene]"),
}


@pytest.mark.parametrize("name", RECORDINGS)
def test_recordings(name, tmp_path):
    path = tmp_path / "session.toml"
    path.write_text(RECORDINGS[name])
    assert str(path) in refused(lambda: [*replay(Recording.load(path), origin=str(path))])


@pytest.mark.parametrize("door", [wt.Scene.load, Recording.load, wt.Simulation.restore])
def test_odd_places(door, tmp_path, monkeypatch):
    """Devices, pipes, links in circles, folders, sparse files: one sentence that names the place, at once."""
    pipe, circle, sparse = tmp_path / "pipe.toml", tmp_path / "circle.toml", tmp_path / "sparse.toml"
    os.mkfifo(pipe)
    circle.symlink_to(circle)
    with sparse.open("wb") as file:
        file.truncate(2**40)
    newline = tmp_path / "two\nlines.toml"
    newline.write_bytes(b"x = [")
    binary = tmp_path / "binary.toml"
    binary.write_bytes(b"\xff\xfe\x00")
    for place in (pipe, circle, sparse, newline, binary, tmp_path, Path("/dev/zero"), tmp_path / ("x" * 300), "a\0b"):
        finished = threading.Event()

        def try_it(place=place, finished=finished):
            refused(lambda: door(place))
            finished.set()

        thread = threading.Thread(target=try_it, daemon=True)
        thread.start()
        thread.join(10)
        assert finished.is_set(), place


@pytest.mark.parametrize("call", ["advance(1e9)", "advance(1e300)", "[*sim.frames(1e18)]", "[*sim.frames(1, 1e300)]"])
def test_time_without_end(call):
    sim = wt.Simulation(wt.Scene.from_text(POOL))
    refused(lambda: eval(call if "sim" in call else f"sim.{call}", {"sim": sim}), "s" if re.search("adv", call) else "")


def test_a_million_particles_in_one_place():
    scene = wt.Scene(
        spacing=0.01, tank=wt.Tank(size=(1, 1)), fluids=[wt.Points(positions=np.full((1_000_000, 2), 0.5))]
    )
    refused(lambda: wt.Simulation(scene), "place")


def test_points_that_are_none_hold_no_water():
    text = 'spacing = 0.05\ntank.size = [1, 1]\nfluids = [{ shape = "points", positions = [] }]'
    assert wt.Simulation(wt.Scene.from_text(text)).count == 0


@pytest.mark.parametrize(
    "call", ["sim.add(np.zeros((100_000_000, 2), np.float32))", "wt.render(sim, width=8192, height=8192)"]
)
def test_memory_is_asked_for_first(call, monkeypatch):
    """Before anything of that size is made: of new particles, of pictures."""
    from wavetank.foundation import memory
    from wavetank.simulation import cost

    sim = wt.Simulation(wt.Scene.from_text(POOL))
    for module in (memory, cost):
        monkeypatch.setattr(module, "free_memory", lambda: 2_000_000_000)
    refused(lambda: eval(call, {"sim": sim, "wt": wt, "np": np}), "of memory")
    sim.step()

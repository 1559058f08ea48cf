"""A run that ends early goes on from its last checkpoint to the same bits, whatever ended it."""

import dataclasses
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import av
import numpy as np
import pytest

import wavetank as wt
from wavetank.foundation.json_text import json_text
from wavetank.run.checkpoints import load_run
from wavetank.run.folder import RunFolder
from wavetank.run.options import RunOptions
from wavetank.run.record import record, resume_run
from wavetank.run.signals import stop_on_signal

SCENE = """
spacing = 0.05
tank.size = [1.2, 0.8]
fluids = [{ lower = [0, 0], upper = [0.5, 0.6] }]
solids = [{ name = "wheel", center = [0.9, 0.2], size = [0.3, 0.04], motion = { rotation = "2*t" } }]
emitters = [{ shape = "line", position = [0.6, 0.7], direction = [0, -1], width = 0.1, speed = 1.0 }]
[[forces]]
kind = "sway"
acceleration = [2.0, 0.0]
frequency = 1.0
"""


def order(out: Path, **more) -> RunOptions:
    return RunOptions(out, 1.0, 20.0, (64, 48), exports=("npz",), checkpoint_every=0.1, **more)


def started() -> wt.Simulation:
    return wt.Simulation(wt.Scene.from_text(SCENE))


def films(path: Path) -> int:
    with av.open(str(path)) as film:
        return len([*film.decode(video=0)])


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> Path:
    """A run that nothing interrupted."""
    out = tmp_path_factory.mktemp("whole")
    record(started(), order(out, video=True))
    assert len([*out.glob("states/*")]) == 2, "a complete run keeps its last instant alone"
    return out


class Crash(Exception):
    pass


def crash_at(monkeypatch, frame: int, error: type[BaseException] = Crash) -> None:
    """Let the run end after so many frames, as if the power had gone."""
    from wavetank.simulation.simulation import Simulation

    count, step = [0], Simulation._advance_frame

    def advance(self, duration):
        count[0] += 1
        if count[0] == 3 * frame:
            raise error
        step(self, duration)

    monkeypatch.setattr(Simulation, "_advance_frame", advance)


def strict(path: Path) -> dict:
    """What is in a file of JSON that has no NaN."""

    def refuse(name: str) -> None:
        raise AssertionError(f"{path} holds {name}")

    return json.loads(path.read_text(), parse_constant=refuse)


def same(out: Path, whole: Path) -> None:
    """The files of two runs hold the same."""
    ours, theirs = (strict(path / "stats.json") for path in (out, whole))
    for figures in (ours, theirs):
        del figures["last"]["milliseconds_per_frame"], figures["mean"]["milliseconds_per_frame"]  # of the machine
    assert ours["last"] == theirs["last"] and ours["mean"] == theirs["mean"]
    assert ours["digest"] == theirs["digest"]
    for name in ("worst", "energy_start", "seconds_of_water"):
        assert ours[name] == theirs[name]
    files = sorted(path.name for path in whole.glob("*.npz"))
    assert files == sorted(path.name for path in out.glob("*.npz")) and len(files) == 21
    for name in files:
        with np.load(out / name) as a, np.load(whole / name) as b:
            for key in b.files:
                np.testing.assert_array_equal(a[key], b[key])
    assert sorted(path.name for path in out.glob("states/*")) == ["00020.npz", "run.json"] and not [*out.glob(".*")]


@pytest.mark.parametrize("frame", [4, 9, 18])
def test_a_run_goes_on_to_the_same_bits(whole, tmp_path, monkeypatch, frame):
    with monkeypatch.context() as patch, pytest.raises(Crash):
        crash_at(patch, frame)
        record(started(), order(tmp_path, video=True))
    states = sorted(path.name for path in (tmp_path / "states").glob("*.npz"))
    assert len(states) == min(2, (frame - 1) // 2)
    resume_run(tmp_path)
    same(tmp_path, whole)
    assert films(tmp_path / "run.mp4") == films(whole / "run.mp4") == 21


@pytest.mark.parametrize("place", ["write_png", "Checkpoints.finish"])
def test_a_run_that_is_killed_after_its_last_frame_goes_on(place, whole, tmp_path, monkeypatch):
    """Before its summary, and between that and the end: no frame is left to compute, and none counts twice."""
    from wavetank.run import record as module

    def crash(*arguments: object) -> None:
        raise Crash

    with monkeypatch.context() as patch, pytest.raises(Crash):
        if place == "write_png":
            patch.setattr(module, place, crash)
        else:
            patch.setattr(module.Checkpoints, "finish", crash)
        record(started(), order(tmp_path, video=True))
    resume_run(tmp_path)
    same(tmp_path, whole)


def test_figures_of_a_run_without_time_are_json(tmp_path):
    figures = record(started(), dataclasses.replace(order(tmp_path), seconds=0.0))
    assert strict(tmp_path / "stats.json")["last"]["milliseconds_per_frame"] is None
    assert json_text(figures)


def test_a_damaged_checkpoint_gives_way_to_the_one_before(whole, tmp_path, monkeypatch):
    with monkeypatch.context() as patch, pytest.raises(Crash):
        crash_at(patch, 12)
        record(started(), order(tmp_path))
    last = max((tmp_path / "states").glob("*.npz"))
    content = bytearray(last.read_bytes())
    content[len(content) // 2] ^= 1
    last.write_bytes(content)
    run = load_run(tmp_path)
    assert run.checkpoint.state != last.name and "SHA-256" in run.note
    resume_run(tmp_path)
    same(tmp_path, whole)
    assert resume_run(tmp_path)["complete"]


def test_a_run_goes_on_where_another_one_has_been(whole, tmp_path, monkeypatch):
    """What a later run left in the folder is no part of the one that goes on."""
    with monkeypatch.context() as patch, pytest.raises(Crash):
        crash_at(patch, 12)
        record(started(), order(tmp_path, video=True))
    record(wt.Simulation(wt.Scene.load("drop-2d")), RunOptions(tmp_path, 0.1, 30.0, (64, 48), name="other"))
    figures = resume_run(tmp_path)
    assert figures["digest"] == json.loads((whole / "stats.json").read_text())["digest"]
    folder = RunFolder.open(tmp_path)
    assert folder.run.name == "run" and folder.run.fps == 20.0 and folder.scene.tank.size == (1.2, 0.8)
    assert films(tmp_path / "run.mp4") == 21


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda table: table | {"format": 7}, "has the format 7; this version of wavetank reads 1"),
        (lambda table: [], "has the format None"),
        (lambda table: table | {"checkpoints": []}, "checkpoints"),
        (lambda table: table | {"order": {}}, "cannot be read"),
        (lambda table: table | {"order": table["order"] | {"seconds": 1e9}}, "0 to 86400"),
        (lambda table: table | {"checkpoints": [table["checkpoints"][0] | {"state": "../x.npz"}]}, "state"),
        (lambda table: table | {"checkpoints": [table["checkpoints"][0] | {"sha256": "0" * 64}]}, "damaged"),
    ],
)
def test_what_is_no_checkpoint_is_one_sentence(change, words, tmp_path, monkeypatch):
    with monkeypatch.context() as patch, pytest.raises(Crash):
        crash_at(patch, 6)
        record(started(), order(tmp_path))
    place = tmp_path / "states" / "run.json"
    place.write_text(json.dumps(change(json.loads(place.read_text()))))
    monkeypatch.delenv("WAVETANK_STRICT_INPUT", raising=False)
    with pytest.raises(wt.WavetankError, match=words) as report:
        resume_run(tmp_path)
    assert "\n" not in str(report.value)


def heed_signals() -> None:
    """Undo what the shell of these tests may hand on: background jobs ignore Ctrl-C, `nohup` a closed terminal."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


def process(*arguments: str) -> subprocess.Popen:
    return subprocess.Popen(
        [sys.executable, "-m", "wavetank", *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=heed_signals,
    )


RUN = ("drop-2d", "--fps", "30", "--size", "160x96", "--video")


@pytest.mark.parametrize(
    ("signals", "codes"),
    [
        ([signal.SIGINT], {130}),
        ([signal.SIGTERM], {143}),
        ([signal.SIGHUP], {129}),
        ([signal.SIGINT] * 2, {130}),
        # Two that come within one kernel are one signal to Python, and the second may find the run ended.
        ([signal.SIGTERM, signal.SIGTERM], {130, 143}),
    ],
)
def test_being_asked_to_end_leaves_a_video_that_plays(signals, codes, tmp_path):
    run = process("run", *RUN, "--seconds", "200", "--out", str(tmp_path), "--name", "a")
    end = time.monotonic() + 120
    rows = tmp_path / "stats.jsonl"  # a line for each frame whose picture was written: before the first is no video
    while time.monotonic() < end and not (rows.exists() and rows.read_text().count("\n") > 2):
        time.sleep(0.02)
    for number in signals:
        os.kill(run.pid, number)
        time.sleep(0.01)
    _, said = run.communicate(timeout=120)
    assert run.returncode in codes, said
    assert "Traceback" not in said
    assert films(tmp_path / "a.mp4") >= 1
    assert not [*tmp_path.glob(".*")]


@pytest.mark.parametrize("delay", [0.05, 0.6])
def test_a_killed_run_goes_on_and_leaves_nothing_behind(delay, tmp_path):
    arguments = ("run", *RUN, "--seconds", "20", "--export", "npz", "--checkpoint-every", "0.1", "--name", "a")
    run = process(*arguments, "--out", str(tmp_path / "killed"))
    end = time.monotonic() + 120
    while time.monotonic() < end and not (tmp_path / "killed" / "states" / "run.json").exists():
        time.sleep(0.01)
    time.sleep(delay)
    os.kill(run.pid, signal.SIGKILL)
    run.communicate()
    goes_on = process("resume", str(tmp_path / "killed"), "--json")
    told, said = goes_on.communicate(timeout=300)
    assert goes_on.returncode == 0, said
    figures = json.loads(told.splitlines()[-1])
    again = wt.Simulation(wt.Scene.load("drop-2d"))
    for _, _ in again.numbered_frames(20.0, 30.0, 0.0):
        pass
    assert figures["digest"] == again.digest()
    assert films(tmp_path / "killed" / "a.mp4") == 601
    assert len([*(tmp_path / "killed").glob("a-*.npz")]) == 601
    assert not [*(tmp_path / "killed").rglob(".*")]
    shutil.rmtree(tmp_path / "killed")


def test_leftovers_of_the_dead_are_swept_and_those_of_the_living_stay(tmp_path, monkeypatch):
    from wavetank.foundation import atomic_write

    dead = subprocess.Popen([sys.executable, "-c", "pass"])
    dead.wait()
    here = atomic_write._here()
    names = {
        f".a.mp4.{here}-{dead.pid}.partial": False,
        f".a.mp4.{here}-{dead.pid}-12.partial": False,
        f".a.usdc.{here}-{dead.pid}.partial.usdc": False,
        f".a.mp4.{here}-{os.getpid()}-0.partial": True,
        f".a.mp4.abcdef-{dead.pid}.partial": True,  # of another machine
        f"a.mp4.{here}-{dead.pid}.partial": True,
        ".a.partial": True,
    }
    for name in names:
        (tmp_path / name).write_text("half")
    with atomic_write.atomic_write(tmp_path / "b.txt") as partial:
        partial.write_text("whole")
    for name, stays in names.items():
        assert (tmp_path / name).exists() is stays, name


def test_a_second_signal_in_a_finalizer_comes_again_after_it():
    """What is raised in `__del__` is printed and forgotten: the interrupt waits until it is over."""

    class Slow:
        def __del__(self) -> None:
            os.kill(os.getpid(), signal.SIGTERM)
            self.has_ended = sum(range(1000))
            ended.append(True)

    ended: list[bool] = []
    with pytest.raises(KeyboardInterrupt), stop_on_signal() as stop:
        os.kill(os.getpid(), signal.SIGTERM)
        assert stop.code == 143
        slow = Slow()
        del slow
        assert ended == [True], "the finalizer ends"
        time.sleep(5.0)

"""A run's folder, and what is made of it, of a state and of a recording."""

import json
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import wavetank as wt
from wavetank.cli import main
from wavetank.formats import hdf5
from wavetank.run.folder import RunFolder


def run(monkeypatch, *arguments, code=0):
    monkeypatch.setattr("sys.argv", ["wavetank", *map(str, arguments)])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == code


DROP = ("--set", "spacing=0.05", "--seconds", "0.2", "--size", "64x36")


def test_a_run_folder_has_all_that_a_run_was(tmp_path, monkeypatch):
    run(monkeypatch, "run", "drop", *DROP, "--out", tmp_path, "--export", "h5,npz", "--every", "2", "--name", "a[1]")
    folder = RunFolder.open(tmp_path)
    assert (folder.run.name, folder.run.seconds, folder.run.every, folder.run.exports) == (
        "a[1]",
        0.2,
        2,
        ["h5", "npz"],
    )
    assert folder.scene.spacing == 0.05
    rows = folder.stats()
    assert [round(30 * row["time"]) for row in rows] == [*range(7)]
    assert folder.has_instants()
    assert [round(30 * instant.time) for instant in folder.instants()] == [0, 2, 4, 6]
    sim = wt.Simulation(folder.scene)
    for instant, _ in zip(folder.instants(), sim.frames(0.2, 15), strict=True):
        assert (instant.positions == sim.positions).all()
    text = (tmp_path / "run.toml").read_text()
    (tmp_path / "run.toml").write_text(text.replace("format = 1", "format = 2"))
    with pytest.raises(wt.WavetankError, match="format = 2 is not known"):
        RunFolder.open(tmp_path)


def test_a_run_without_frames_is_computed_again(tmp_path, monkeypatch, capsys):
    run(monkeypatch, "run", "drop", *DROP, "--out", tmp_path)
    run(monkeypatch, "export", tmp_path, "--to", "h5", "--json")
    printed = capsys.readouterr()
    assert "computed again" in " ".join(printed.err.split())
    assert json.loads(printed.out.splitlines()[-1])["frames"] == 7
    sim = wt.Simulation(wt.Scene.load("drop").changed(spacing=0.05))
    sim.advance(0.2)
    *_, last = hdf5.read(tmp_path / "drop.h5")
    assert last.count == sim.count


def test_a_state_and_a_recording_are_exported(tmp_path, monkeypatch, capsys):
    sim = wt.Simulation(wt.Scene.load("drop").changed(spacing=0.05))
    sim.advance(0.1)
    sim.save(tmp_path / "state.npz")
    run(monkeypatch, "export", tmp_path / "state.npz", "--to", "h5")
    (instant,) = hdf5.read(tmp_path / "state.h5")
    assert (instant.positions == sim.positions).all()
    assert instant.time == sim.time
    from wavetank.session.recording import Recording
    from wavetank.session.session import Session

    scene = wt.Scene.load("drop-2d").changed(spacing=0.05)
    session = Session(scene, "cpu")
    for _ in range(5):
        session.tick()
    Recording.of(session, scene).save(tmp_path / "session.toml")
    run(monkeypatch, "export", tmp_path / "session.toml", "--to", "h5")
    *_, last = hdf5.read(tmp_path / "session.h5")
    assert (last.positions == session.sim.positions).all()


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("nothing", "there is no file or folder"),
        (".", "the run cannot be read"),
        ("a.xyz", "this is none"),
        ("frame.npz", "without their scene"),
        ("a.h5", "cannot be read"),
    ],
)
def test_what_is_no_run_is_one_sentence(tmp_path, monkeypatch, capsys, name, words):
    (tmp_path / "a.xyz").write_text("x")
    (tmp_path / "a.h5").write_text("x")
    np.savez(tmp_path / "frame.npz", positions=np.zeros((1, 3)))
    run(monkeypatch, "export", tmp_path / name, "--to", "vtp", code=1)
    told = capsys.readouterr().err
    assert words in told
    assert told.count("\n") == 1


def files_of(folder):
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and "stats" not in path.name and path.parent.name != "states"
    }


def test_a_killed_run_goes_on_to_the_same_bytes(tmp_path):
    """SIGKILL at some frame after the first checkpoint, then `wavetank resume`: all files as without."""
    order = [
        "drop",
        "--set",
        "spacing=0.04",
        "--seconds",
        "0.5",
        "--size",
        "64x36",
        "--checkpoint-every",
        "0.1",
        "--export",
        "usd,vtkhdf,h5,vtp,npz",
    ]
    command = [sys.executable, "-m", "wavetank"]
    subprocess.run([*command, "run", *order, "--out", str(tmp_path / "whole")], check=True, capture_output=True)
    process = subprocess.Popen(
        [*command, "run", *order, "--out", str(tmp_path / "killed")],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    began = time.monotonic()
    while not (tmp_path / "killed" / "states" / "run.json").exists() and time.monotonic() - began < 60:
        time.sleep(0.01)
    time.sleep(0.15)
    process.send_signal(signal.SIGKILL)
    process.wait()
    assert not (tmp_path / "killed" / "stats.json").exists(), "it was to be killed on its way"
    subprocess.run([*command, "resume", str(tmp_path / "killed")], check=True, capture_output=True)
    whole, resumed = files_of(tmp_path / "whole"), files_of(tmp_path / "killed")
    assert whole.keys() == resumed.keys()
    assert [name for name in whole if whole[name] != resumed[name]] == []
    assert len(RunFolder.open(tmp_path / "killed").stats()) == 16

"""Runs that go on: longer, from a state, and from a kept instant with other parameters; files by their content."""

import io
import json
import os
import shutil
import subprocess
import sys

import numpy as np
import pytest

import wavetank as wt
from wavetank.run.starting import kind_of, scene_at, start_world

RUN = ["--set", "spacing=0.06", "--fps", "20", "--export", "npz", "--name", "w", "--size", "64x48"]


def arrays(path):
    with np.load(path) as file:
        return {name: file[name].tobytes() for name in file.files}


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """A run of 0.2 s, and one of 0.4 s."""
    from typer.testing import CliRunner

    from wavetank.cli.options import app

    place, runner = tmp_path_factory.mktemp("runs"), CliRunner()
    for name, seconds in (("short", "0.2"), ("long", "0.4")):
        done = runner.invoke(app, ["run", "drop-2d", *RUN, "--seconds", seconds, "--video", "--out", str(place / name)])
        assert done.exit_code == 0, done.output
    return place


def test_a_complete_run_becomes_a_longer_one(folders, tmp_path, wavetank):
    out = tmp_path / "run"
    shutil.copytree(folders / "short", out)
    said = wavetank("resume", str(out))
    assert said.returncode == 0 and "this run is complete; --seconds 0.4 extends it" in said.stderr.replace("\n", " ")
    assert wavetank("resume", str(out), "--seconds", "0.4").returncode == 0
    names = {path.name for path in (folders / "long").iterdir()}
    assert names == {path.name for path in out.iterdir()}
    for path in (folders / "long").glob("w-*.npz"):
        assert arrays(path) == arrays(out / path.name)
    for name in ("run.toml", "scene.toml"):
        assert (out / name).read_text() == (folders / "long" / name).read_text()
    ends = [json.loads((place / "stats.json").read_text())["digest"] for place in (out, folders / "long")]
    assert ends[0] == ends[1] and len((out / "stats.jsonl").read_text().splitlines()) == 9
    assert (out / "w.mp4").stat().st_size > (folders / "short" / "w.mp4").stat().st_size
    said = wavetank("resume", str(out), "--seconds", "0.1")
    assert said.returncode == 1 and "is less than the 0.4 s" in said.stderr


def test_a_shorter_run_into_a_folder_leaves_no_frames_of_the_longer_one(folders, tmp_path, wavetank):
    out = tmp_path / "run"
    shutil.copytree(folders / "long", out)
    assert wavetank("run", "drop-2d", *RUN, "--seconds", "0.1", "--out", str(out)).returncode == 0
    assert len(list(out.glob("w-*.npz"))) == 3


def test_a_state_goes_on_as_a_run(folders, tmp_path, wavetank):
    sim = wt.Simulation(wt.Scene.load("drop-2d").changed(spacing=0.06))
    for _ in sim.frames(0.2, 20):
        pass
    state = tmp_path / "saved"  # told by its content
    sim.save(state)
    for source in (state, folders / "short"):
        out = tmp_path / f"from {source.name}"
        done = wavetank("run", str(source), "--seconds", "0.2", "--fps", "20", "--size", "64x48", "--out", str(out))
        assert done.returncode == 0, done.stderr
        ends = [json.loads((place / "stats.json").read_text())["digest"] for place in (out, folders / "long")]
        assert ends[0] == ends[1]


def test_live_parameters_change_a_state_exactly(folders):
    sim = start_world(str(folders / "short"), {"viscosity": 0.5}, None, "cpu")
    assert sim.viscosity == 0.5 and sim.frame_number > 0


def test_a_run_starts_from_a_kept_instant_with_other_keys(folders):
    """From the frames in between, and with keys that are no live parameters."""
    sim = start_world(str(folders / "long"), {"viscosity": 0.5}, 0.1, "cpu")
    with np.load(folders / "long" / "w-00002.npz") as file:
        assert len(file["positions"]) == sim.count
        assert np.abs(np.sort(sim.positions, axis=0) - np.sort(file["positions"], axis=0)).max() < 0.01
    assert sim.scene.start_time == pytest.approx(0.1)
    changed = start_world(str(folders / "short"), {"rest_density": 900.0, "tank.open": ["top"]}, None, "cpu")
    assert changed.scene.rest_density == 900.0 and changed.scene.tank.open == ["top"] and changed.count == sim.count
    changed.advance(0.1)


def test_bodies_and_solids_start_where_they_were():
    scene = wt.Scene(
        spacing=0.05,
        foam=0,
        tank=wt.Tank(size=(1, 1)),
        fluids=[wt.Block(lower=(0, 0), upper=(1, 0.3))],
        solids=[
            wt.Box(name="crate", center=(0.4, 0.6), size=(0.2, 0.2), rotation=0.4, density=500),
            wt.Capsule(name="log", start=(0.6, 0.8), end=(0.8, 0.9), radius=0.05, density=500),
            wt.Sphere(center=(0.1, 0.8), radius=0.05),
        ],
    )
    sim = wt.Simulation(scene)
    sim.advance(0.3)
    again = wt.Simulation(scene_at(sim.frame().state(), {"viscosity": 0.2}))
    for name, body in sim.bodies.items():
        twin = again.bodies[name]
        np.testing.assert_allclose(twin.position, body.position, atol=1e-6)
        np.testing.assert_allclose(twin.velocity, body.velocity, atol=1e-5)
    turns = [np.abs(world.bodies["crate"].rotation) for world in (sim, again)]
    np.testing.assert_allclose(*turns, atol=1e-5)
    assert again.count >= 0.98 * sim.count


def test_what_a_file_is_follows_from_its_content(folders, tmp_path):
    assert kind_of("drop-2d") == "scene" and kind_of(folders / "long") == "run"
    for name, kind in (("w-00001.npz", "frame"), ("states/00004.npz", "state"), ("scene.toml", "scene")):
        copy = tmp_path / "file.txt"
        shutil.copy(folders / "short" / name, copy)
        assert kind_of(copy) == kind


def test_two_runs_at_once_into_one_folder_are_refused(tmp_path, wavetank):
    """The mark of a run is a partial file: those of the dead are swept."""
    from wavetank.foundation.atomic_write import partial_path

    mark = partial_path(tmp_path / "run")
    other = mark.with_name(mark.name.replace(f"-{os.getpid()}-", f"-{os.getppid()}-"))
    other.touch()
    said = wavetank("run", "drop-2d", *RUN, "--seconds", "0", "--out", str(tmp_path))
    assert said.returncode == 1 and f"another run, process {os.getppid()}, writes to this folder" in said.stderr
    assert [path.name for path in tmp_path.iterdir()] == [other.name]


def test_runs_of_two_scenes_do_not_mix(tmp_path, wavetank, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for scene in ("drop-2d", "dam-break-2d"):
        assert wavetank("run", scene, "--set", "spacing=0.06", "--size", "32x32", "--seconds", "0").returncode == 0
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"drop-2d", "dam-break-2d"}


def test_short_help_and_a_level_of_ones_own(tmp_path, wavetank):
    assert "--seconds" in wavetank("run", "-h").stdout and "Commands" in wavetank("-h").stdout
    said = wavetank("play", "--level", str(tmp_path / "none.toml"))
    assert said.returncode == 1 and "or a scene's file" in said.stderr


def test_the_bar_and_the_doctor_fit_a_screen(wavetank, monkeypatch):
    from rich.console import Console

    from wavetank.run.record import progress_bar

    console = Console(file=io.StringIO(), force_terminal=True, width=80)
    with progress_bar(console) as bar:
        bar.add_task("compiling kernel 107", total=4.0, time=123.45, fps=123.4, count=12_345_678, error=0.0123)
        lines = console.render_lines(bar.get_renderable())
    assert len(lines) == 1
    monkeypatch.setenv("COLUMNS", "100")
    assert len(wavetank("doctor").stdout.splitlines()) <= 40


@pytest.mark.skipif(os.name == "nt", reason="names of files are text there")
def test_names_of_files_need_not_be_utf8(tmp_path):
    """As in a folder of a disk from another system."""
    scene = tmp_path / os.fsdecode(b"caf\xe9.toml")
    scene.write_text("spacing=0.1\n[tank]\nsize=[1,1]\n[[fluids]]\nlower=[0,0]\nupper=[0.4,0.4]\n")
    for command in (["run", scene, "--seconds", "0", "--export", "npz"], ["run", scene, "--seconds", "0", "--json"]):
        out = tmp_path / os.fsdecode(b"o\xe9")
        arguments = [sys.executable, "-m", "wavetank", *map(str, command), "--size", "32x32", "--out", str(out)]
        done = subprocess.run(arguments, capture_output=True, timeout=200, env={**os.environ, "PYTHONUTF8": "1"})
        assert done.returncode == 0, done.stderr[-600:]
        assert (out / "stats.json").is_file()

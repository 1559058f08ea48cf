"""The comparison with another solver: equal scenes, fair settings, ratios; without that solver at hand."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from benchmarks.peers import compare, environment, runs, scenes, splishsplash
from benchmarks.peers.runs import Dam, ours, pace, rate
from wavetank import WavetankError

ROOT = Path(__file__).parents[2]

#: Stands in for the peer: answers like its script, and says what it was told.
FAKE = """
import json, os, sys
order = json.loads(sys.argv[2])
dt = 0.004 * order.get("cfl_factor", 1.0)
steps = round(order["seconds"] / dt)
print("banner")
print(json.dumps({"particles": 1000, "steps": steps, "seconds_of_water": order["seconds"], "wall": 0.02 * steps,
    "iterations": 2.0, "iterations_in_all": 2.0 * steps, "density_error_mean": 0.004 * (dt / 0.004) ** 2,
    "density_error_p99": 0.1, "order": order, "threads": os.environ["OMP_NUM_THREADS"]}))
"""


@pytest.fixture
def fake(tmp_path, monkeypatch):
    script = tmp_path / "fake.py"
    script.write_text(FAKE)
    monkeypatch.setattr(runs, "SCRIPT", script)
    monkeypatch.setenv(environment.VARIABLE, sys.executable)
    return tmp_path


def test_both_start_from_the_same_water():
    dam = Dam.of(60_000)
    x = dam.scene().particles()[0]
    assert len(x) == np.prod(dam.cells) == pytest.approx(60_000, rel=0.03)
    order = {"method": "dfsph", "spacing": dam.spacing, "cells": dam.cells, "tank": dam.tank, "dt": 0.001}
    theirs = splishsplash.scene(order)
    block, wall = theirs["FluidBlocks"][0], theirs["RigidBodies"][0]
    # Its sampler puts the first particle one spacing behind the corner and the last one before the other.
    layers = (np.array(block["end"]) - np.array(block["start"])) / dam.spacing - 1.0
    assert layers == pytest.approx(dam.cells)
    # Walls as far from the lattice as from ours, and one spacing more.
    first = np.array(block["start"]) + dam.spacing
    assert first == pytest.approx([1.5 * dam.spacing] * 3)
    assert np.array(wall["scale"]) == pytest.approx(np.array(dam.tank) + 2.0 * dam.spacing)
    assert theirs["Configuration"]["particleRadius"] == pytest.approx(0.5 * dam.spacing)


def test_the_box_is_closed_and_looks_outwards():
    lines = splishsplash.box().splitlines()
    points = np.array([[float(n) for n in line.split()[1:]] for line in lines if line[0] == "v"])
    faces = np.array([[int(n) - 1 for n in line.split()[1:]] for line in lines if line[0] == "f"])
    assert len(faces) == 12
    a, b, c = (points[faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    assert (np.einsum("ij,ij->i", normals, a + b + c) > 0.0).all()
    # The divergence theorem gives the volume of a closed surface.
    assert np.einsum("ij,ij->", a, normals) / 6.0 == pytest.approx(1.0)


def test_our_run_says_what_it_did():
    run = ours(Dam.of(300).scene(substeps=2, iterations=3), 0.05)
    assert run["seconds_of_water"] == pytest.approx(0.05)
    assert run["iterations_in_all"] == 3 * run["steps"]
    assert rate(run) == pytest.approx(run["particles"] * 3 * run["steps"] / run["wall"])
    assert 0.0 <= run["density_error_mean"] < 0.05


def test_ratios_are_ours_over_theirs_at_equal_error(fake, monkeypatch):
    def mine(scene, seconds, measure=True):
        steps = 1 + round(seconds / (0.01 * scene.wave_courant))
        error = 0.02 * (scene.wave_courant / scene.iterations) ** 2
        return {
            "particles": 1000,
            "steps": steps,
            "seconds_of_water": seconds,
            "iterations": scene.iterations,
            "wall": 0.001 * steps * (1 + scene.iterations),
            "iterations_in_all": steps * scene.iterations,
            "density_error_mean": error,
            "density_error_p99": error,
        }

    monkeypatch.setattr(compare, "ours", mine)
    result = compare.compare_peers(1000, 2000, seconds=1.0, repeats=2)
    assert result["settings"]["particles"] == [1000, 2000]
    pbf, dfsph = result["peers"]["splishsplash_pbf"], result["peers"]["splishsplash_dfsph"]
    assert pbf["ratio"] == pytest.approx(rate(pbf["ours"]) / rate(pbf["theirs"]))
    assert pbf["theirs"]["order"]["iterations"] == compare.ITERATIONS
    for label, target in compare.TARGETS.items():
        at = dfsph[f"at_{label}"]
        assert dfsph[f"ratio_at_{label}"] == pytest.approx(pace(at["ours"]) / pace(at["theirs"]))
        for side in ("ours", "theirs"):
            assert 0.5 * target < at[side]["density_error_mean"] <= target
    json.dumps(result)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("dam", "10"), "from 1,000"),
        (("dam", "--repeats", "1"), "--repeats = 1"),
        (("scenes", "--seconds", "99"), "--seconds = 99"),
    ],
)
def test_mistakes_are_one_sentence(words, told):
    done = subprocess.run([sys.executable, "-m", "benchmarks.peers", *words], capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 1
    assert told in done.stderr.strip() and done.stderr.count("\n") == 1


def test_a_setting_that_meets_the_error_is_found():
    tried = []

    def run(setting):
        tried.append(setting["step"])
        error = 0.1 * setting["step"] ** 2
        return {"density_error_mean": error, "steps": len(tried), "seconds_of_water": setting["step"], "wall": 1.0}

    found: list = []
    step = compare._meet(0.001, 1.0, (0.01, 2.0), lambda s: {"step": s}, run, found, lambda text: None)
    assert 0.85 * 0.001 <= 0.1 * step**2 <= 0.001
    assert found[-1][1] == {"step": step}
    with pytest.raises(WavetankError, match="no setting of ours"):
        compare._fastest([], 0.001, "ours")


def test_a_run_slower_than_the_fastest_is_given_up_and_not_chosen():
    orders = []

    def their(**order):
        orders.append(order)
        steps = round(order["seconds"] / (0.004 * order["cfl_factor"]))
        wall = 0.02 * steps * (1.0 if order["max_error"] == 1.0 else 5.0)  # the others take five times as long
        share = min(1.0, order.get("patience", np.inf) / wall)
        return {
            "steps": steps,
            "wall": share * wall,
            "seconds_of_water": share * order["seconds"],
            "given_up": share < 1.0,
            "density_error_mean": 0.0099,
        }

    chosen = compare.fastest_of_theirs(their, 0.01, 1.0, lambda text: None)
    assert chosen["max_error"] == 1.0 and "patience" not in chosen
    assert [order["max_error"] for order in orders] == pytest.approx([1.0, 0.3, 3.0])  # each once
    best = 0.02 * round(1.0 / (0.004 * chosen["cfl_factor"]))
    assert "patience" not in orders[0]
    assert [order["patience"] for order in orders[1:]] == pytest.approx([compare.PATIENCE * best] * 2)


def test_a_peer_that_stops_is_one_sentence(fake):
    runs.SCRIPT.write_text("import sys; sys.exit('no graphics')")
    with pytest.raises(WavetankError, match="exit code 1: no graphics"):
        runs.theirs(environment.splishsplash_python(print), fake, Dam.of(1000), 1, seconds=1.0)


def test_an_environment_that_cannot_be_made_is_one_sentence(tmp_path, monkeypatch):
    monkeypatch.delenv(environment.VARIABLE, raising=False)
    monkeypatch.setattr(environment, "cache_folder", lambda: tmp_path)
    monkeypatch.setattr(environment.venv, "create", lambda *a, **k: None)

    def fail(*arguments, **options):
        raise subprocess.CalledProcessError(1, "pip", stderr="looking\nERROR: no wheel for this system")

    monkeypatch.setattr(environment.subprocess, "run", fail)
    with pytest.raises(WavetankError, match=r"could not be installed here: ERROR: no wheel for this system; set WAVE"):
        environment.splishsplash_python(lambda text: None)
    monkeypatch.setenv(environment.VARIABLE, str(tmp_path / "none"))
    with pytest.raises(WavetankError, match="is not a file"):
        environment.splishsplash_python(lambda text: None)


def test_the_script_needs_nothing_of_ours():
    """Another environment's Python runs it: only the standard library at the top."""
    path = Path(splishsplash.__file__)
    code = "import runpy, sys; sys.modules['wavetank'] = None; sys.modules['numpy'] = None; runpy.run_path(sys.argv[1])"
    subprocess.run([sys.executable, "-c", code, str(path)], check=True)


#: Answers for a scene of its own: the same block, which falls freely beside a ball that turns about y.
FAKE_SCENE = """
import json, pathlib, sys
import numpy as np
order, folder = json.loads(sys.argv[2]), pathlib.Path(sys.argv[1])
file = pathlib.Path(__file__).with_name(order["scene"] + ".json")
if not file.is_file():
    raise SystemExit("there is no scene " + order["scene"])
if "seconds" in order:
    times = np.arange(0.0, order["seconds"] + 1e-9, order["every"])
    grid = np.stack(np.meshgrid(*[np.arange(0.05, 0.4, 0.1)] * 3, indexing="ij"), -1).reshape(-1, 3) + [0, 1.5, 0]
    fall = np.array([0, -4.905, 0]) * times[:, None, None] ** 2
    half = 0.5 * np.pi * times / times[-1]  # half a turn in all
    poses = [[[0, 0, 0, 0, 0, 0, 1], [1, 0.3, 1, 0, np.sin(a), 0, np.cos(a)]] for a in half]
    np.savez(folder / "watched.npz", times=times, counts=np.full((len(times), 1), len(grid)), bodies=poses,
             names=["Fluid"], positions=(grid + fall).reshape(-1, 3), velocities=np.zeros((len(times) * len(grid), 3)))
print(json.dumps({"file": str(file), "wall": 1.0}))
"""


@pytest.fixture
def their_scene(tmp_path, monkeypatch):
    script = tmp_path / "fake.py"
    script.write_text(FAKE_SCENE)
    monkeypatch.setattr(runs, "SCRIPT", script)
    monkeypatch.setenv(environment.VARIABLE, sys.executable)
    (tmp_path / "box.obj").write_text(splishsplash.box())
    wall = {"geometryFile": "box.obj", "translation": [1, 2, 1], "scale": [4, 4, 4], "isWall": True, "mapInvert": True}
    block = {"geometryFile": "box.obj", "translation": [1, 0.3, 1], "scale": [0.4, 0.2, 0.2], "isDynamic": False}
    water = {"start": [-0.05, 1.45, -0.05], "end": [0.45, 1.95, 0.45]}
    scene = {"Configuration": {"particleRadius": 0.05}, "RigidBodies": [wall, block], "FluidBlocks": [water]}
    (tmp_path / "Falls.json").write_text(json.dumps(scene))
    return tmp_path


def test_a_scene_of_theirs_is_run_by_both_and_shown(their_scene):
    """Both fall freely, so their heights are the same, y0 - g t^2 / 2; pictures show both."""
    from PIL import Image

    result = scenes.compare_scenes(["Falls"], their_scene / "pictures", seconds=0.3, threads=1)
    (found,) = result["scenes"]
    for side in ("ours", "theirs"):
        times, means = (np.array(found[side][what]) for what in ("times", "mean"))
        assert means == pytest.approx(means[0] - 0.5 * 9.81 * times**2, abs=0.03)  # g t dt / 2 of Euler's steps
    assert found["apart_largest"] < 0.05
    assert Image.open(their_scene / "pictures" / "Falls.png").width > 1000
    assert "Falls" in str(scenes.scenes_table(result).columns[0]._cells)


def test_their_bodies_turn_ours(their_scene):
    """A box of 0.4 x 0.2 m that turned by 90 degrees about y is 0.4 m long along z (their quaternions: x, y, z, w)."""
    from wavetank.formats.splishsplash import load_splishsplash
    from wavetank.foundation.rotations import turned

    scene = load_splishsplash(their_scene / "Falls.json").scene
    standing = scenes.watch(scene, 0.05).instants[0].placed[0]
    start, end = np.array([1, 0.3, 1, 0, 0, 0, 1.0]), np.array([1, 0.8, 1, 0, 0.5**0.5, 0, 0.5**0.5])
    moved = scenes._moved(standing, start, end)
    assert moved.position - standing.position == pytest.approx([0, 0.5, 0])
    assert np.abs(turned(moved.rotation, np.array([1.0, 0, 0]))) == pytest.approx([0, 0, 1])
    assert scenes._numbers(their_scene / "Falls.json") == {"body 1": 0, "body 2": 1}
    assert standing.name == "body 2"


def test_what_is_no_scene_of_theirs_is_said(their_scene):
    with pytest.raises(WavetankError, match="there is no scene Nothing"):
        scenes.compare_scenes(["Nothing"], their_scene, seconds=0.1)
    with pytest.raises(WavetankError, match="--seconds"):
        scenes.compare_scenes(["Falls"], their_scene, seconds=1e9)

"""The comparison with another solver: equal scenes, fair settings, ratios; without that solver at hand."""

import json
import subprocess
import sys

import numpy as np
import pytest

from wavetank import WavetankError
from wavetank.lab.bench.peers import compare, environment, runs, splishsplash
from wavetank.lab.bench.peers.runs import Dam, ours, pace, rate

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
        return {"particles": 1000, "steps": steps, "seconds_of_water": seconds, "iterations": scene.iterations,
                "wall": 0.001 * steps * (1 + scene.iterations), "iterations_in_all": steps * scene.iterations,
                "density_error_mean": error, "density_error_p99": error}  # fmt: skip

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
        return {"steps": steps, "wall": share * wall, "seconds_of_water": share * order["seconds"],
                "given_up": share < 1.0, "density_error_mean": 0.0099}  # fmt: skip

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
    with pytest.raises(WavetankError, match="is no file"):
        environment.splishsplash_python(lambda text: None)


def test_the_script_needs_nothing_of_ours():
    """Another environment's Python runs it: only the standard library at the top."""
    path = runs.Path(splishsplash.__file__)
    code = "import runpy, sys; sys.modules['wavetank'] = None; sys.modules['numpy'] = None; runpy.run_path(sys.argv[1])"
    subprocess.run([sys.executable, "-c", code, str(path)], check=True)

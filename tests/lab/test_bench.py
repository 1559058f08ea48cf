"""`wavetank bench`: what it measures adds up, keeps and compares; no figure of speed is judged here."""

import importlib
import io
import json
import math
import pkgutil
import platform
import re
import time
from pathlib import Path

import pytest
from rich.console import Console

from wavetank import Scene, WavetankError, cli, physics
from wavetank.device import compiler
from wavetank.lab.bench import machine, roofline, stages, startup
from wavetank.lab.bench import run as bench_run
from wavetank.lab.bench import scenes as room
from wavetank.lab.bench import tables as bench_tables
from wavetank.lab.bench.stages import STAGE_NAMES, Clock, stage_of
from wavetank.simulation.simulation import Simulation


@pytest.fixture(scope="module")
def result() -> dict:
    return room.bench(["dam-break"], [400], seconds=0.05, repeats=2)


def text(table) -> str:
    written = io.StringIO()
    Console(width=200, file=written).print(table)
    return written.getvalue()


@pytest.mark.parametrize(("name", "count"), [("dam-break", 3000), ("drop", 20000), ("obstacle-tank-2d", 5000)])
def test_a_size_is_about_that_many_particles(name, count):
    scene = room.sized(Scene.load(name), count)
    assert len(scene.particles()[0]) == pytest.approx(count, rel=0.15)


def test_a_run_has_every_figure(result):
    run = result["runs"][0]
    sim = Simulation(room.sized(Scene.load("dam-break"), 400))
    sim.step()
    assert run["particles"] == sim.count
    assert run["frames"] == 3
    assert run["substeps_per_frame"] >= sim.scene.substeps
    assert 10 < run["pairs_per_particle"] < run["tests_per_particle"] < 27 * 27
    assert 0.0 <= run["density_error_mean"] < run["density_error_p99"] < 0.1
    # Particles twice with ten and a half numbers of three or one components, lists, cells.
    assert 200 < run["bytes_per_particle"] < 1000
    frame = run["milliseconds_per_frame"]
    assert 0.0 < frame["low"] <= frame["median"] <= frame["high"]
    # The four rates are one measurement seen from four sides.
    work = run["particles"] * run["iterations"] * run["substeps_per_frame"]
    assert run["particle_iterations_per_second"]["high"] == pytest.approx(1e3 * work / frame["low"])
    assert run["water_per_second"]["low"] == pytest.approx(1e3 / 60 / frame["high"])
    assert set(run["stages"]) == {*STAGE_NAMES, "render"}
    # No solids, no contact: the tank itself is part of other kernels.
    assert run["stages"]["contact"]["median"] == 0.0
    for name in ("neighbours", "constraint", "velocities", "foam", "time step", "host", "render"):
        assert run["stages"][name]["median"] > 0.0, name
    assert run["kernels"]["constraint: solve_multipliers"]["launches"] == 4 * run["substeps_per_frame"]
    assert math.isfinite(json.loads(json.dumps(result))["runs"][0]["pairs_per_second"]["median"])


def test_the_clock_accounts_for_all_of_the_time():
    sim, clock = Simulation(room.sized(Scene.load("dam-break-2d"), 300)), Clock()
    sim.step()
    began = time.perf_counter()
    with clock.running():
        sim.step()
    elapsed = time.perf_counter() - began
    assert sum(clock.stages().values()) == pytest.approx(elapsed, rel=0.05, abs=1e-3)
    seen = sum(clock.launches.values())
    sim.step()
    assert sum(clock.launches.values()) == seen  # it stopped


def modules_with_kernels() -> list[str]:
    source = Path(stages.__file__).parents[3]
    files = [path for path in source.rglob("*.py") if "\n@qd.kernel" in path.read_text()]
    return [".".join(path.relative_to(source).with_suffix("").parts) for path in files]


def test_every_kernel_has_a_stage():
    assert stage_of("wavetank.physics.neighbors") == stage_of("wavetank.physics.sorting") == "neighbours"
    assert stage_of("wavetank.physics.foam.pool") == "foam"
    assert stage_of("wavetank.view.passes.shade") == "render"
    assert stage_of("quadrants._kernels") == "other"
    homes = modules_with_kernels()
    assert len(homes) > 40
    for module in homes:
        assert stage_of(module) in (*STAGE_NAMES, "render"), module
    for declared in (home for several in stages.STAGES.values() for home in several if home != "quadrants"):
        assert any(f"{module}.".startswith(f"{declared}.") for module in homes), f"{declared} has no kernel"


@pytest.mark.parametrize("module", ["wavetank.physics.a_new_term", "wavetank.physics.foamy", "__main__", "wavetank"])
def test_a_kernel_without_a_stage_is_an_error(module):
    """A kernel that has moved must not count as something else unnoticed."""
    with pytest.raises(
        LookupError, match=rf"kernels of {re.escape(module)} belong to no stage; .* STAGES of .*stages.py"
    ):
        stage_of(module)


def test_watching_ends_with_its_context_even_after_an_error():
    from quadrants.lang.kernel import Kernel

    call = Kernel.__call__
    with pytest.raises(ZeroDivisionError), compiler.watched(lambda module, name, launch: launch()):
        raise ZeroDivisionError
    assert Kernel.__call__ is call


def test_a_result_is_kept_and_compared(result, tmp_path):
    path = tmp_path / "a" / "old.json"
    bench_tables.save_result(result, path)
    old = bench_tables.load_result(path)
    assert old == result
    new = json.loads(json.dumps(result))
    new["runs"][0]["milliseconds_per_frame"]["median"] *= 2.0
    shown = text(bench_tables.comparison_table(old, new))
    assert "2.000 *" in shown
    assert shown.count("*") == 1
    new["runs"][0]["size"] += 1
    other = text(bench_tables.comparison_table(old, {**new, "runs": new["runs"][:1]}))
    assert "no run in common" in other
    assert f"{old['runs'][0]['scene']} {old['runs'][0]['size']:,} on cpu" in other
    with pytest.raises(WavetankError, match="No such file"):
        bench_tables.load_result(tmp_path / "none.json")
    (tmp_path / "other.json").write_text("{}")
    with pytest.raises(WavetankError, match=r"--compare .*other.json: this is not a result"):
        bench_tables.load_result(tmp_path / "other.json")


def test_the_machine_is_described_without_its_name():
    found = machine.machine()
    assert found["processor"]
    assert found["cores"] >= 1
    assert platform.node() not in json.dumps(found)


def test_roofline_shares_follow_from_the_ceilings(monkeypatch):
    monkeypatch.setattr(roofline, "LARGE", 1 << 16)
    monkeypatch.setattr(roofline, "SPINS", 1 << 10)
    result = roofline.roofline("dam-break", 400, seconds=0.05, repeats=2)
    assert all(value > 0.0 for value in result["ceilings"].values())
    assert {"solve_multipliers", "correct_positions", "list_neighbors", "reorder"} <= set(result["kernels"])
    shown = "".join(text(table) for table in roofline.roofline_table(result))
    assert "solve_multipliers" in shown
    run = {"particles": 1000, "pairs_per_particle": 30.0, "tests_per_particle": 100.0}
    ceilings = {"copy": 1e9, "arithmetic": 1e9, "walk": 1e9}
    cost = roofline.Cost(vectors=1, words=1, pair_words=1, operations=10, pair_operations=20)
    # 16 bytes and 30 words of 4 bytes for each of 1,000 particles, twice; 10 + 30 x 20 operations.
    found = roofline.share(cost, run, 2.0, 0.01, ceilings)
    assert found["bytes_per_second"] == pytest.approx(2 * 1000 * (16 + 120) / 0.01)
    assert found["operations_per_second"] == pytest.approx(2 * 1000 * 610 / 0.01)
    assert found["bound"] == "arithmetic"
    assert found["share"] == pytest.approx(2 * 1000 * 610 / 1e9 / 0.01)


def test_every_cost_belongs_to_a_kernel():
    """A kernel that was renamed or dropped does not stay in the model."""
    modules = pkgutil.walk_packages(physics.__path__, "wavetank.physics.")
    names = {name for module in modules for name in dir(importlib.import_module(module.name))}
    assert set(roofline.COSTS) <= names


def test_start_up_runs_in_fresh_processes(monkeypatch):
    answers = iter([9.0, 1.0, 3.0, 2.0])

    def run(arch, cache):
        first = next(answers)
        return {"import": 0.1, "frame": first, "picture": first + 1, "switch": 0.2, "process": first + 2}

    monkeypatch.setattr(startup, "_run", run)
    times = startup.start_up("cpu")
    assert times["first_frame_cold"] == 9.0
    assert times["first_frame_warm"] == 2.0


def test_a_fresh_process_takes_a_frame(tmp_path, monkeypatch):
    monkeypatch.setattr(startup, "_SCRIPT", "import json; print(json.dumps({'import': 1.0}))")
    assert startup._run("cpu", str(tmp_path))["import"] == 1.0
    monkeypatch.setattr(startup, "_SCRIPT", "raise SystemExit('no luck')")
    with pytest.raises(WavetankError, match=r"start-up: .*no luck"):
        startup._run("cpu", str(tmp_path))


def test_numbers_among_the_scenes_are_sizes():
    assert bench_run.split(["dam-break", "2000"], "1000,3000") == (["dam-break"], [1000, 3000, 2000])
    assert bench_run.split([], "") == ([], [])


def command(*arguments: str, monkeypatch) -> None:
    monkeypatch.setattr("sys.argv", ["wavetank", "bench", *arguments])
    cli.main()


def test_the_command_prints_json_last(tmp_path, monkeypatch, capsys):
    out = tmp_path / "new.json"
    with pytest.raises(SystemExit) as end:
        command(
            "dam-break-2d",
            "--sizes",
            "200",
            "300",
            "--seconds",
            "0.03",
            "--repeats",
            "2",
            "--no-start-up",
            "--out",
            str(out),
            "--json",
            monkeypatch=monkeypatch,
        )
    assert end.value.code in (0, None)
    last = json.loads(capsys.readouterr().out.strip().splitlines()[-1])
    assert [run["size"] for run in last["runs"]] == [200, 300]
    assert json.loads(out.read_text()) == last


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("no-such-scene",), "bundled are"),
        (("--sizes", "many"), "--sizes = 'many'"),
        (("--sizes", "0"), "--sizes = 0"),
        (("--seconds", "0"), "--seconds = 0.0"),
        (("--seconds", "nan"), "--seconds = nan"),
        (("--repeats", "1"), "--repeats = 1"),
        (("--compare", "nothing.json"), "--compare nothing.json"),
        (("--search", "--roofline"), "give one of them"),
        (("--roofline", "drop-2d", "300"), "2-D world"),
    ],
)
def test_mistakes_are_one_sentence(arguments, words, monkeypatch, capsys):
    with pytest.raises(SystemExit) as end:
        command(*arguments, monkeypatch=monkeypatch)
    assert end.value.code == 1
    told = [line for line in capsys.readouterr().err.splitlines() if line]
    assert words in told[-1]
    assert told[-1].startswith("wavetank: ")

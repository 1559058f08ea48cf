"""The experiments of `wavetank validate`: what they measure with, and the quick ones against their bounds."""

import datetime
import json
import math
import sys

import numpy as np
import pytest

from wavetank import Scene, WavetankError, cli
from wavetank.cli import experiments
from wavetank.lab import validate as room
from wavetank.lab.cases import CASES, coiling
from wavetank.lab.cases.case import Case, Figure, Outcome, measured, surface
from wavetank.lab.cases.cup import holds, within
from wavetank.lab.cases.cup import scene as cups
from wavetank.lab.cases.elliptical_drop import hull_area
from wavetank.lab.cases.known import KNOWN, Known
from wavetank.lab.cases.martin_moyce import A, front
from wavetank.lab.cases.packing import settled
from wavetank.lab.cases.seeds import world
from wavetank.lab.cases.standing_wave import AMPLITUDE, DEPTH, LENGTH, PERIOD, K, displaced
from wavetank.scene.fluids import Points
from wavetank.scene.tank import Tank
from wavetank.simulation.simulation import Simulation

QUICK = [
    "still-tank",
    "column",
    "martin-moyce",
    "lobovsky",
    "standing-wave",
    "elliptical-drop",
    "drop",
    "energy",
    "momentum",
    "rest",
    "solids-at-rest",
    "creep",
    "seeds",
    "layers",
    "lock-exchange",
    "shear-wave",
    "gravity-current",
    "buckling",
    "tension-drop",
    "calm-vorticity",
    "emitter",
    "buoyancy",
    "heave",
    "water-entry",
    "u-tube",
    "frame-rate",
    "scale",
    "resonance",
    "vortex",
    "gate",
    "hull",
    "torricelli",
    "submerged-inlet",
]


def test_the_help_names_all_cases():
    assert experiments.CASE_NAMES.split(", ") == sorted(case.name for case in CASES)


@pytest.mark.parametrize("name", QUICK)
def test_quick_case_is_within_its_bounds(name):
    result = room.validate([name], quick=True)
    assert [figure for figure in room.out_of_bounds(result) if "(known: " not in figure] == []
    for figure in result["cases"][name]["figures"]:
        entry = KNOWN.get(f"{name}: {figure['name']}")
        assert entry is None or entry.low <= figure["value"] <= entry.high, figure["name"]


def test_names_and_titles_are_unique():
    assert len({case.name for case in CASES}) == len({case.title for case in CASES}) == len(CASES)


def test_a_figure_passes_between_its_bounds_only():
    assert Figure("x", 1.0, "", 0.0, 1.0).passed is True
    assert Figure("x", np.float64(1.1), "", 0.0, 1.0).passed is False
    assert Figure("x", -5.0, "", None, 1.0).passed is True
    assert Figure("x", math.nan, "", None, 1.0).passed is False
    assert Figure("x", math.inf, "", 0.0).passed is False
    assert Figure("x", math.nan, "").passed is None
    assert Figure("x", math.nan, "").as_dict()["value"] is None


def test_tables_of_measurements():
    table = measured("martin_moyce_n2_2_a225in_front_table2.csv")
    assert table["T"][0] == 0.41
    assert table["Z"][-1] == 4.11
    for height in (300, 600):
        assert np.all(np.diff(measured(f"lobovsky_h{height}_front_fig12.csv")["X"]) > 0)
    levels = measured("lobovsky_h300_levels_fig16.csv")
    assert levels["H1"][0] == 1.0
    first = [levels["T"][np.argmax(levels[name] > 0)] for name in ("H2", "H3", "H4")]
    assert first == sorted(first)
    assert measured("elliptical_drop_exact.csv")["b"][10] == 2.275516
    assert np.all(np.diff(measured("martin_moyce_n2_2_a225in_height_table6.csv")["H"]) < 0)


@pytest.mark.parametrize("dim", [2, 3])
def test_level_of_a_full_lattice(dim):
    size = (1.0, 1.0, 0.4)[:dim]
    d = 0.1
    axes = [(np.arange(round(edge / d)) + 0.5) * d for edge in (size[0], 0.5, *size[2:])]
    x = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, dim)
    assert surface(x, d, size) == pytest.approx(np.full(5 ** (dim - 1) if dim == 2 else 10, 0.5))
    empty = x[x[:, 0] > 0.2]
    assert np.count_nonzero(surface(empty, d, size) == 0.0) == (1 if dim == 2 else 2)


def test_front_of_connected_water():
    d = A / 20
    x = np.stack(np.meshgrid((np.arange(20) + 0.5) * d, (np.arange(40) + 0.5) * d), -1).reshape(-1, 2)
    assert front(x, d, 1.0) == pytest.approx(A)
    assert front(np.append(x, [[1.5 * A, 0.0]], axis=0), d, 1.0) == pytest.approx(A)
    assert front(np.append(x, [[20.5 * d, 0.0]], axis=0), d, 1.0) == pytest.approx(A + d)


def test_two_experiments_of_one_shape_differ_as_much_as_martin_and_moyce_and_we():
    """What martin_moyce.py and docs/method.md say of square columns: 13.9 % of Z as they are, 5.3 % at best."""
    slow, fast = measured("martin_moyce_n2_1_a225in_front.csv"), measured("lobovsky_h600_front_fig12.csv")
    both = slow["Z"] < 1.0 + fast["X"].max()

    def differ(shift):
        z = np.interp(slow["T"][both] - shift, [0.0, *fast["T"]], [1.0, *(1.0 + fast["X"])])
        return 100.0 * math.sqrt(np.mean((z / slow["Z"][both] - 1.0) ** 2))

    assert differ(0.0) == pytest.approx(13.9, abs=0.4)
    assert min(differ(shift) for shift in np.linspace(0.0, 0.5, 101)) == pytest.approx(5.3, abs=0.3)


def test_start_of_the_wave_keeps_its_area_and_has_the_amplitude():
    d = 0.01
    x = displaced(d)
    assert x[:, 0].min() > 0
    assert x[:, 0].max() < LENGTH
    assert x[:, 1].min() > 0
    amplitude = 2 / LENGTH * d * d * np.cos(K * x[:, 0]).sum()
    assert amplitude == pytest.approx(AMPLITUDE, rel=0.01)
    top = x.reshape(round(LENGTH / d), round(DEPTH / d), 2)[:, -1]
    y = np.concatenate([top[:1, 1], top[:, 1], top[-1:, 1]])
    height = np.trapezoid(y, np.concatenate([[0.0], top[:, 0], [LENGTH]])) / LENGTH
    assert height + d / 2 == pytest.approx(DEPTH, abs=2e-4)
    assert pytest.approx(1.6713, abs=1e-4) == PERIOD


def test_area_of_a_hull():
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0.5, 0.5], [0.5, 0]], float)
    assert hull_area(square, 0.0) == pytest.approx(1.0)
    assert hull_area(square, 0.1) == pytest.approx(1.0 + 0.4 + math.pi * 0.01)


def test_a_layer_of_the_jet_is_round():
    disc = coiling.layer(2)
    assert len(disc) == 19
    gaps = np.linalg.norm(disc[:, None] - disc[None], axis=-1) + 10 * np.eye(19)
    assert gaps.min() == pytest.approx(1.0)
    spread = disc.T @ disc / 19  # alike in all directions: it bends alike
    assert spread[0, 0] == pytest.approx(spread[2, 2])
    assert spread[0, 2] == pytest.approx(0.0, abs=1e-12)


def test_settled_water_has_no_perfect_rows_and_fills_its_box():
    d, size = 0.05, (1.0, 0.5)
    x = settled(d, size)
    assert x.shape == (200, 2)
    assert np.all((x > 0) & (x < size))
    sim = Simulation(Scene(spacing=d, gravity=(0, 0), tank=Tank(size=size), fluids=[Points(positions=x)]))
    assert sim.densities.mean() == pytest.approx(1000, rel=0.005)
    assert sim.densities.std() < 5
    off = np.std((x / d) % 1.0)
    assert 0.03 < off < 0.15, "rms distance from the places of a lattice, in spacings"


def test_cups_hold_all_their_water_at_the_start():
    x = cups().particles()[0].astype(float)
    assert holds(x, 0.0).sum(0).min() > 500
    assert np.all(holds(x, 0.0).sum(1) == 1)
    assert not within(x, 0.0).any()
    assert within(np.array([[0.25 + 0.065, 0.1, 0.15], [0.25, 0.045, 0.15], [0.65, 0.1, 0.15 - 0.065]]), 0.0).all()
    assert not within(np.array([[0.25 + 0.1, 0.1, 0.15], [0.25, 0.035, 0.15], [0.25, 0.1, 0.15]]), 0.0).any()


def test_random_worlds_reach_what_they_promise():
    worlds = [world(seed) for seed in range(100)]
    assert min(min(w.tank.size) / w.spacing for w in worlds) < 3.5
    assert max(np.linalg.norm(w.gravity) for w in worlds) > 90
    assert all(0 < len(w.particles()[0]) < 5000 for w in worlds)
    assert all(isinstance(w, Scene) for w in worlds)


def test_unknown_case_is_one_sentence():
    with pytest.raises(WavetankError, match=r"no case named 'soup'; cases are: still-tank, column, .*\."):
        room.validate(["soup"])


def invented(value: float) -> Case:
    outcome = Outcome(
        [Figure("depth", value, "m", None, 1.0, "0", "nobody"), Figure("colour", 2.0, "")],
        {"time": [0.0, 1.0], "level": [3.0]},
        lambda plot: plot.subplots().plot([0, 1]),
    )
    return Case("invented", "Invented", lambda quick, arch: outcome)


@pytest.mark.parametrize(("value", "code"), [(0.5, 0), (1.5, 1), (math.nan, 1)])
def test_command(value, code, monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(room, "CASES", (invented(value),))
    monkeypatch.setattr(sys, "argv", ["wavetank", "validate", "invented", "--json", "--out", str(tmp_path)])
    with pytest.raises(SystemExit) as leave:
        cli.main()
    assert (leave.value.code or 0) == code
    printed = capsys.readouterr()
    result = json.loads(printed.out.strip().splitlines()[-1])
    assert (result["passed"], result["failed"]) == (1 - code, code)
    assert [f["pass"] for f in result["cases"]["invented"]["figures"]] == [not code, None]
    lines = [line for line in printed.err.splitlines() if line.strip()]
    assert len(lines) == code
    if code:
        assert "1 of 1 figures are out of their bounds: invented: depth." in lines[0]
    assert (tmp_path / "invented" / "invented.csv").read_text().split() == ["time,level", "0.0,3.0", "1.0,"]
    assert (tmp_path / "invented" / "invented.png").read_bytes().startswith(b"\x89PNG")


def test_known_failures_have_a_date_and_a_reason():
    for name, entry in KNOWN.items():
        assert datetime.date.fromisoformat(entry.since) and len(entry.why) > 20, name


@pytest.mark.parametrize(
    ("value", "quick", "said"),
    [
        (1.5, True, "bounds, all of them known: invented: depth (known: the floor is young, since 2026-11-24)"),
        (3.0, True, "bounds: invented: depth."),  # worse than what is known
        (1.5, False, "bounds: invented: depth."),
    ],
)
def test_quick_runs_say_which_failures_are_known(value, quick, said, monkeypatch, capsys):
    monkeypatch.setattr(room, "CASES", (invented(value),))
    monkeypatch.setitem(KNOWN, "invented: depth", Known(0.0, 2.0, "2026-11-24", "the floor is young"))
    monkeypatch.setattr(sys, "argv", ["wavetank", "validate", *(["--quick"] if quick else [])])
    with pytest.raises(SystemExit) as leave:
        cli.main()
    printed = capsys.readouterr()
    assert leave.value.code == 1 and said in printed.err
    assert ("known" in printed.out) == ("known" in said)


def test_without_a_folder_nothing_is_written(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(room, "CASES", (invented(0.5),))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["wavetank", "validate"])
    with pytest.raises(SystemExit):
        cli.main()
    assert "depth" in capsys.readouterr().out
    assert not list(tmp_path.iterdir())

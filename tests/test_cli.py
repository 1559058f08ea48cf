import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import av
import pytest

from wavetank.scene.summary import bundled_counts

ROOT = Path(__file__).parent.parent


def process(*arguments: str) -> subprocess.CompletedProcess:
    return subprocess.run([sys.executable, "-m", "wavetank", *arguments], capture_output=True, text=True, timeout=300)


def pictures(path: Path) -> list:
    with av.open(str(path)) as container:
        return [frame.to_ndarray(format="rgb24").shape for frame in container.decode(video=0)]


def test_run_writes_what_was_asked_for(tmp_path):
    result = process(
        "run",
        "drop-2d",
        "--seconds",
        "0.2",
        "--fps",
        "20",
        "--size",
        "160x90",
        "--out",
        str(tmp_path / "a" / "b"),
        "--video",
        "--gif",
        "--frames",
        "--export",
        "npz",
        "--export",
        "ply",
        "--set",
        "viscosity=0.2",
        "--json",
    )
    assert result.returncode == 0, result.stderr
    figures = json.loads(result.stdout.strip().splitlines()[-1])
    assert figures["last"]["count"] == 512
    assert figures["seconds_of_water"] == pytest.approx(0.2)
    assert figures["interrupted"] is False
    out = tmp_path / "a" / "b"
    assert pictures(out / "drop-2d.mp4") == [(90, 160, 3)] * 5
    assert (out / "drop-2d.gif").read_bytes()[:3] == b"GIF"
    for suffix in ("png", "npz", "ply"):
        assert len(list(out.glob(f"drop-2d-0*.{suffix}"))) == 5
    assert json.loads((out / "stats.json").read_text()) == figures
    assert not list(out.glob("*partial*"))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("run", "no-such-scene"), ["no-such-scene", "obstacle-tank"]),
        (("run", "drop-2d", "--out", f"{__file__}/x"), ["test_cli.py/x", "cannot be made"]),
        (("run", "obstacle-tnk"), ["did you mean 'obstacle-tank'?"]),
        (("run", "drop-2d", "--set", "spacing=5"), ["no particle", "spacing = 5 m"]),
        (("run", "drop", "--set", "viscos=1"), ["'viscos'", "did you mean 'viscosity'"]),
        (("run", "drop", "--set", "viscosity=nan"), ["viscosity = nan"]),
        (("run", "drop", "--set", "viscosity=thick"), ["viscosity = 'thick'"]),
        (("run", "drop", "--set", "viscosity"), ["NAME=VALUE"]),
        (("run", "drop", "--set", "spacing=-1"), ["spacing = -1", "greater than 0"]),
        (("run", "drop", "--set", "spacing=1e-5"), ["spacing = 1e-05", "100,000,000"]),
        (("run", "drop", "--set", "tank.size=3"), ["tank.size = 3"]),
        (("run", "drop", "--seconds", "-1"), ["--seconds = -1.0", "0 to 86400"]),
        (("run", "drop", "--seconds", "nan"), ["--seconds = nan"]),
        (("run", "drop", "--fps", "0"), ["--fps = 0.0"]),
        (("run", "drop", "--size", "big"), ["--size = 'big'", "1280x720"]),
        (("run", "drop", "--size", "10000x100"), ["--size = '10000x100'", "8192x8192"]),
        (("run", "drop", "--name", "a/b"), ["--name = 'a/b'", "--out"]),
        (("run", "drop", "--set", "viscosity=abc"), ["viscosity = 'abc'", "must be a number."]),
        (("run", "drop", "--set", "gravity=0,-9.81,0"), ["gravity", "as [0, -9.81, 0]"]),
        (("run", "drop", "--export", "xyz"), ["'xyz'", "npz, csv, ply"]),
        (("run", "drop", "--color-by", "taste"), ["'taste'", "speed"]),
        (("run", "drop", "--arch", "opengl"), ["'opengl'", "cpu"]),
        (("run", "drop", "--arch", "metal"), ["'metal'", "available"]),
        (("run", "drop", "--view", "glass"), ["'glass'", "water, particles, slice, foam"]),
        (("run", "drop", "--gif", "--fps", "60"), ["--gif", "50"]),
        (("render", "no-such-scene"), ["no-such-scene", "obstacle-tank"]),
        (("render", "no-such.npz"), ["no-such.npz"]),
        (("render", "drop", "--view", "glass"), ["'glass'", "water, particles, slice, foam"]),
        (("render", "drop", "--quality", "best"), ["'best'", "draft, standard, high, film"]),
        (("render", "drop", "--at", "-1"), ["--at = -1.0"]),
        (("render", "drop", "--at", "nan"), ["--at = nan"]),
        (("render", "drop-2d", "--at", "0", "--eye", "1,2"), ["--eye = '1,2'", "2,1,3"]),
        (("render", "drop-2d", "--at", "0", "--width", "0"), ["width = 0", "8192"]),
        (("render", "drop", "--out", "none/x.png"), ["no folder"]),
        (("render", "drop", "--out", "x.bmp"), [".png"]),
        (("converge", "drop-2d", "--iterations", "0"), ["--iterations = 0"]),
        (("play", "no-such-scene"), ["no-such-scene", "obstacle-tank"]),
        (("play", "drop-2d", "--record", "no-folder/x.toml"), ["--record", "folder"]),
        (("play", "drop-2d", "--record", "."), ["--record .", "name a file"]),
        (("play", "drop-2d", "--host", "256.1.1.1", "--no-browser"), ["--host 256.1.1.1"]),
        (("play", "drop-2d", "--most", "10", "--no-browser"), ["at most 10"]),
        (("replay", "no-such-file.toml"), ["no-such-file.toml", "cannot be read"]),
    ],
)
def test_a_mistake_is_one_line_and_leaves_nothing(wavetank, arguments, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = wavetank(*arguments)
    assert result.returncode == 1
    lines = [line for line in result.stderr.splitlines() if line]
    assert len(lines) == 1, result.stderr
    assert lines[0].startswith("wavetank: ")
    for word in words:
        assert word in lines[0]
    assert list(tmp_path.iterdir()) == []


def test_render_draws_scenes_and_states(wavetank, tmp_path):
    from PIL import Image

    from wavetank import Scene, Simulation

    small = ("--width", "96", "--height", "54", "--quality", "draft")
    result = wavetank("render", "drop-2d", "--at", "0.1", *small, "--out", str(tmp_path / "a.png"), "--timings")
    assert result.returncode == 0, result.stderr
    assert "flatten" in result.stdout
    with Image.open(tmp_path / "a.png") as picture:
        assert picture.size == (96, 54)
        assert picture.text["scene"] == "A drop falls into a pool"
        assert picture.text["time"] == "0.1000 s"
        assert picture.text["view"] == "water"
    sim = Simulation(Scene.load("drop-2d"))
    sim.advance(0.1)
    sim.save(tmp_path / "state.npz")
    state = str(tmp_path / "state.npz")
    result = wavetank("render", state, *small, "--view", "slice", "--out", str(tmp_path / "b.png"), "--json")
    figures = json.loads(result.stdout)
    assert (figures["time"], figures["view"], figures["particles"]) == (pytest.approx(0.1), "slice", 512)
    assert wavetank("render", state, *small, "--out", str(tmp_path / "c.png")).returncode == 0
    with Image.open(tmp_path / "a.png") as first, Image.open(tmp_path / "c.png") as again:
        assert first.tobytes() == again.tobytes()
    assert "0.1 s" in wavetank("render", state, "--at", "0.05", "--out", str(tmp_path / "d.png")).stderr
    assert not (tmp_path / "d.png").exists()


def test_pictures_are_named_after_what_is_on_them(wavetank, tmp_path, monkeypatch):
    """The commands under the pictures of README.md leave a file each; sizes are said in one way."""
    from PIL import Image

    monkeypatch.chdir(tmp_path)
    for more in ((), ("--view", "particles"), ("--view", "slice"), ("--at", "0.1"), ("--color-by", "#ff0000")):
        result = wavetank("render", "drop-2d", "--set", "spacing=0.05", "--size", "96x54", "--quality", "draft", *more)
        assert result.returncode == 0, result.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "drop-2d-0.1s.png",
        "drop-2d-ff0000.png",
        "drop-2d-particles.png",
        "drop-2d-slice.png",
        "drop-2d.png",
    ]
    assert Image.open("drop-2d-slice.png").size == (96, 54)
    assert "--size = '96' is not allowed" in wavetank("render", "drop-2d", "--size", "96").stderr
    lines = re.findall(r"`wavetank render ([^`]*)`", (ROOT / "README.md").read_text())
    names = {(line.split()[0], *re.findall(r"--(?:view|at) (\S+)", line)) for line in lines if "--out" not in line}
    assert len(names) >= len({line for line in lines if "--out" not in line}) - 1  # one is shown twice, finer


def test_several_formats_in_one_word_and_a_small_gif(wavetank, tmp_path):
    from PIL import Image

    run = ("run", "drop-2d", "--seconds", "0.05", "--set", "spacing=0.05", "--fps", "20", "--out", str(tmp_path))
    result = wavetank(*run, "--export", "npz,ply", "--export", "csv", "--gif")
    assert result.returncode == 0, result.stderr
    assert {path.suffix for path in tmp_path.iterdir()} >= {".npz", ".ply", ".csv", ".gif"}
    with Image.open(tmp_path / "drop-2d.gif") as picture:
        assert picture.size == (640, 360)
    assert wavetank(*run, "--gif", "--size", "800x450").returncode == 0
    with Image.open(tmp_path / "drop-2d.gif") as picture:
        assert picture.size == (800, 450)  # what is asked for


@pytest.mark.parametrize(
    "command",
    [
        "scenes",
        "run",
        "render",
        "play",
        "replay",
        "resume",
        "export",
        "import",
        "converge",
        "validate",
        "bench",
        "doctor",
    ],
)
def test_help_is_for_people(wavetank, command):
    text = wavetank(command, "--help").stdout
    assert "list[" not in text and "--width" not in text


def test_a_broken_scene_file_is_one_line(wavetank, tmp_path):
    path = tmp_path / "mine.toml"
    for text, words in (
        ("spacing = 0.1\nspacing = 0.2", "this is not TOML"),
        ("spacing = 0.1\n[tank]\nsize = [1, nan]", "tank.size[1] = nan"),
        ("spacing = 0.1\n[[fluids]]\nlower = [0, 0]", "fluids[0].upper is missing"),
        ("spacing = 0.1\n[tank]\nsize = [1, 1]\n[[fluids]]\nlower = [0, 0]\nupper = [2, 1]", "outside the tank"),
        ('spacing = "0.1 m"', "spacing = '0.1 m'"),
    ):
        path.write_text(text)
        result = wavetank("run", str(path), "--out", str(tmp_path / "out"))
        assert result.returncode == 1
        assert result.stderr.count("\n") == 1
        assert "mine.toml: " in result.stderr
        assert words in result.stderr
        assert not (tmp_path / "out").exists()


def test_wrong_usage_exits_with_2(wavetank):
    assert wavetank("run").returncode == 2
    assert wavetank("run", "drop", "--no-such-option").returncode == 2
    assert process("swim").returncode == 2


def test_a_process_ends_with_one_line_too():
    result = process("run", "no-such-scene")
    assert (result.returncode, result.stderr.count("\n"), result.stdout) == (1, 1, "")
    assert result.stderr.startswith("wavetank: ")


def test_ctrl_c_finishes_the_files(tmp_path):
    process = subprocess.Popen(
        [
            sys.executable,
            "-m",
            "wavetank",
            "run",
            "drop-2d",
            "--seconds",
            "1000",
            "--size",
            "96x64",
            "--video",
            "--out",
            str(tmp_path),
            "--json",
        ],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        # A test run in the background of a shell ignores interrupts, and children inherit that.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    deadline = time.time() + 120
    while time.time() < deadline and not any(p.stat().st_size for p in tmp_path.glob("*partial*")):
        time.sleep(0.1)
    time.sleep(2.0)
    os.kill(process.pid, signal.SIGINT)
    stdout, stderr = process.communicate(timeout=120)
    assert (process.returncode, stderr.splitlines()[-1]) == (130, "wavetank: stopped."), stderr
    figures = json.loads(stdout.strip().splitlines()[-1])
    assert figures["interrupted"] is True
    assert len(pictures(tmp_path / "drop-2d.mp4")) > 0
    assert (tmp_path / "stats.json").exists()
    assert not list(tmp_path.glob("*partial*"))
    assert "Traceback" not in stderr


def test_scenes_and_schema(wavetank, tmp_path):
    listed = json.loads(wavetank("scenes", "--json").stdout)
    assert {"obstacle-tank", "dam-break", "double-dam", "still-tank", "drop", "drop-2d"} <= set(listed)
    assert listed["levels"]["over-the-wall"]["goal"]
    schema = json.loads(wavetank("scenes", "--schema").stdout)
    assert schema["properties"]["viscosity"]["maximum"] == 1.0
    assert "obstacle-tank" in wavetank("scenes").stdout


def test_a_scene_that_needs_a_missing_package_spoils_nothing():
    """Without trimesh the list, the cards of the page and all other scenes are there."""
    code = """
import sys
sys.modules["trimesh"] = None
from wavetank import cli
from wavetank.page.about import scenes
cards = {card["name"]: card for card in scenes()}
print(len(cards), bool(cards["dam-break"]["shapes"]))
sys.argv = ["wavetank", "scenes"]
cli.main()
"""
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=100)
    assert said.returncode == 0, said.stderr
    assert said.stdout.startswith(f"{len(bundled_counts())} True")
    assert "dam-break" in said.stdout and ": first pip install trimesh" in said.stdout


def test_doctor_says_what_works(wavetank):
    findings = json.loads(wavetank("doctor", "--json").stdout)
    rows = {row["name"]: row["found"] for row in findings["checks"]}
    assert findings["ok"] is True
    assert rows["back end cpu"] == "works"
    assert rows["back end metal"] in ("not here", "available")
    assert wavetank("doctor").returncode == 0
    assert rows["display"] in ("window", "page only")
    assert {"pysplashsurf", "rapier3d", "usd-core", "h5py", "anywidget"} <= set(rows)
    notes = {row["name"]: row["note"] for row in findings["checks"]}
    for cache in ("cache of kernels", "cache of meshes"):
        assert Path(notes[cache].removesuffix(" (may be deleted)")).is_absolute()
        assert rows[cache] == "empty" or rows[cache].endswith(("bytes", "kB", "MB", "GB"))
    said = wavetank("doctor").stdout
    assert all(
        f"wavetank[{extra}]" in note
        for name, extra in (("anywidget", "notebook"), ("h5py", "hdf5"))
        if rows[name] == "missing"
        for note in [notes[name]]
    )
    assert "patches of the compiler" in said and "patch: " not in said  # one line, not one each


def test_converge_draws_the_reports_figures(wavetank, tmp_path):
    result = wavetank("converge", "obstacle-tank-2d", "--seconds", "0.1", "--iterations", "4", "--out", str(tmp_path))
    assert result.returncode == 0, result.stderr
    assert {path.name for path in tmp_path.iterdir()} == {"converge.csv", "converge-steps.csv", "converge.png"}
    rows = [line.split(",") for line in (tmp_path / "converge.csv").read_text().splitlines()]
    assert rows[0][:4] == ["preset", "iteration", "density_max", "density_mean"]
    assert [row[0] for row in rows[1:]] == ["paper"] * 4 + ["standard"] * 4
    assert all(2.0 < float(row[3]) < 6.0 for row in rows[1:])

"""A damaged or foreign cache costs time, never a wrong or a dead run."""

import os
import random
import subprocess
import sys

import pytest

from wavetank.device.compiler import cache_folder
from wavetank.device.kernel_cache import ENTRY, HEAD, NAME, is_whole

RUN = """
import sys
import wavetank as wt
scene = wt.Scene(spacing=0.08, tank=wt.Tank(size=(1, 1, 1)), fluids=[wt.Block(lower=(0, 0, 0), upper=(0.4, 1, 1))],
                 solids=[wt.Mesh(path="wavetank/knot.obj", center=(0.7, 0.3, 0.5), size=0.4)])
sim = wt.Simulation(scene)
sim.step()
print(sim.digest())
"""


def test_damaged_caches_change_nothing(tmp_path):
    """Kernels and grids of meshes; files are cut, flipped, emptied, or something else."""
    places = {"XDG_CACHE_HOME": str(tmp_path), "WAVETANK_CACHE": str(tmp_path / "own"), "HOME": str(tmp_path)}

    def run() -> str:
        done = subprocess.run(
            [sys.executable, "-c", RUN], capture_output=True, text=True, env=os.environ | places, timeout=600
        )
        assert done.returncode == 0, done.stderr[-2000:]
        assert [line for line in done.stderr.splitlines() if "preparing kernels" not in line] == []
        return done.stdout

    first, chance = run(), random.Random(3)
    files = [path for path in tmp_path.rglob("*") if path.is_file()]
    assert any(path.suffix == ".npz" for path in files) and len(files) > 5
    for number, path in enumerate(sorted(files)):
        content = bytearray(path.read_bytes())
        if number % 4 == 0 and content:
            for _ in range(8):
                content[chance.randrange(len(content))] ^= 255
        elif number % 4 == 1:
            content = content[: len(content) // 2]
        else:
            content = bytearray(b"" if number % 4 == 2 else b"something else")
        path.write_bytes(bytes(content))
    assert run() == first


def test_a_damaged_list_of_kernels_is_told_from_a_whole_one():
    """The compiler's own list; every length and key in it, cut or flipped."""
    content = (cache_folder() / NAME).read_bytes()
    assert is_whole(content)
    assert not is_whole(content[: len(content) // 2]) and not is_whole(b"") and not is_whole(content + b"x")
    places = [0, 3, 22, 29, HEAD, HEAD + 7, HEAD + 40, HEAD + 73, HEAD + 80, HEAD + 100]
    for place in [*places, *(place + ENTRY.itemsize for place in places[4:])]:
        damaged = bytearray(content)
        damaged[place] ^= 255
        assert not is_whole(bytes(damaged)), place


@pytest.mark.parametrize("mode", ["absent", "read-only"])
def test_caches_that_cannot_be_written_change_nothing(mode, tmp_path):
    """A folder that cannot be made; one whose kernels can be read and not written is used as it is."""
    (tmp_path / "file").write_bytes(b"")
    (tmp_path / "temporary").mkdir()
    places = {name: str(tmp_path / "file" / "cache") for name in ("XDG_CACHE_HOME", "WAVETANK_CACHE", "HOME")}
    places |= {"TMPDIR": str(tmp_path / "temporary")}
    code = RUN
    if mode == "read-only":  # whoever runs the tests may be allowed to write anywhere
        places = {"TMPDIR": places["TMPDIR"], "WAVETANK_CACHE": places["WAVETANK_CACHE"]}
        code = (
            """
import tempfile

def refused(*args, dir=None, **more):
    raise PermissionError(13, "Permission denied")
tempfile.TemporaryFile = refused
"""
            + RUN
        )
    runs = [
        subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, env=os.environ | more, timeout=600)
        for text, more in ((RUN, {}), (code, places))
    ]
    told = [line for line in runs[1].stderr.splitlines() if "preparing kernels" not in line]  # where that takes long
    assert runs[1].returncode == 0 and not told, runs[1].stderr[-2000:]
    assert runs[0].stdout == runs[1].stdout
    assert not [*(tmp_path / "temporary").glob("wavetank-kernels-*")]


def test_the_environment_names_the_folder_of_kernels(monkeypatch, tmp_path):
    """A start with an empty folder is a cold one: `wavetank bench` and a first start of the page rely on it."""
    usual = cache_folder()
    monkeypatch.setenv("QD_OFFLINE_CACHE_FILE_PATH", str(tmp_path))
    assert cache_folder() == tmp_path != usual

"""Without a card: whether kernels compile for CUDA, and what a frame asks of the driver."""

import os
import re
import shutil
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest

#: of the third frame of each scene of `worlds.compile_kernels`; the driver's launches are the loops of ours
FRAMES = {
    "obstacle-tank": {"steps": 1, "launch": 116, "wait": 4},
    "obstacle-tank-2d": {"steps": 1, "launch": 118, "wait": 4},
    "honey": {"steps": 2, "launch": 215, "wait": 10},
    "oil-and-water": {"steps": 1, "launch": 112, "wait": 4},
    "crates": {"steps": 1, "launch": 173, "wait": 15},
}


@pytest.fixture(scope="module")
def driver(tmp_path_factory) -> Path:
    """The folder of a driver that computes nothing, after worlds have used it; `book` and `modules` are in it."""
    compiler = shutil.which("gcc") or shutil.which("cc")
    if not sys.platform.startswith("linux") or compiler is None:
        if os.environ.get("CI") == "true":
            pytest.fail("no C compiler here; .ci/run installs gcc with apt-get")
        pytest.skip("the driver needs Linux and a C compiler: apt-get install gcc libc6-dev")
    folder, here = tmp_path_factory.mktemp("driver"), Path(__file__).parent
    (folder / "modules").mkdir()
    subprocess.run([compiler, "-shared", "-fPIC", "-o", folder / "libcuda.so", here / "driver.c"], check=True)
    found = os.environ | {
        "LD_LIBRARY_PATH": str(folder),
        "CUDA_DRIVER_LOG": str(folder / "book"),
        "CUDA_DRIVER_MODULES": str(folder / "modules"),
        "XDG_CACHE_HOME": str(folder / "cache"),
    }
    done = subprocess.run([sys.executable, here / "worlds.py", "compile_kernels"], env=found, capture_output=True)
    assert done.returncode == 0, done.stderr.decode()[-2000:]
    return folder


def test_a_frame_is_as_many_launches_and_waits_as_it_was(driver):
    """A change that costs less fails too: put the new number in its place."""
    frames, lines = {}, (driver / "book").read_text().splitlines()
    for begin in (n for n, line in enumerate(lines) if line.startswith("frame ")):
        _, name, steps = lines[begin].split()
        asked = Counter(line.split()[0] for line in lines[begin + 1 : lines.index("end", begin)])
        frames[name] = {"steps": int(steps), "launch": asked["launch"], "wait": asked["wait"]}
    assert frames == FRAMES
    assert not any(line.startswith("unknown") for line in lines)


def test_kernels_compute_in_single_precision(driver):
    """A card that is not for computing takes 64 times as long for a double."""
    modules = [path.read_text() for path in sorted((driver / "modules").iterdir())]
    ours = [text for text in modules if re.search(r"\.entry \w+_c\d+_\d+_kernel", text)]
    assert len(ours) > 60
    doubles = {re.search(r"\.entry (\w+)_c\d+", text)[1] for text in ours if re.search(r"\.f64\s", text)}
    assert not doubles


def test_no_crowd_waits_for_one_number(driver):
    """What a loop brings together in one place is a loop of its own, of 16,384 threads at most.

    A loop over all particles has a million threads on a card, of which every 32 exchange that number in turn.
    """
    book = (driver / "book").read_text()
    crowded = set()
    for path in (driver / "modules").iterdir():
        for body in path.read_text().split(".entry ")[1:]:
            kernel = body[: body.index("(")]
            launches = re.findall(rf"launch {kernel} (\d+) x (\d+)", book)
            if "atom.acquire.sys.cas" in body and any(int(a) * int(b) > 16384 for a, b in launches):
                crowded.add(kernel)
    assert not crowded

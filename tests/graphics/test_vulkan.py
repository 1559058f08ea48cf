"""Water on a graphics processor, of which Chromium brings one in software."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from wavetank.lab import backends

DRIVER = Path("/usr/lib/chromium/vk_swiftshader_icd.json")  # of Debian's package


@pytest.fixture
def vulkan(monkeypatch):
    if not DRIVER.is_file():
        if os.environ.get("CI") == "true":
            pytest.fail(f"no {DRIVER}; .ci/run installs chromium with apt-get")
        pytest.skip("no Vulkan in software here: apt-get install chromium")
    monkeypatch.setenv("LD_LIBRARY_PATH", str(DRIVER.parent))
    monkeypatch.setenv("VK_ICD_FILENAMES", str(DRIVER))


def moved(block_nodes: int) -> str:
    worlds = Path(__file__).parent / "worlds.py"
    done = subprocess.run(
        [sys.executable, worlds, "move", str(block_nodes)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout.splitlines()[-1]


def test_water_and_pictures_are_those_of_the_processor(vulkan):
    result = backends.compare("vulkan", ("water", "particles"), 0.15)
    for name, tolerance in (("kinetic_energy", 1e-3), ("speed_rms", 1e-3), ("neighbors_mean", 1e-2)):
        ours, theirs = result["figures"][name]
        assert ours == pytest.approx(theirs, rel=tolerance), name
    assert all(view["close"] > 0.999 for view in result["views"].values())


def test_a_block_solves_a_level_as_many_launches_do(vulkan):
    """A level has two colours, and no node of one asks another of the same: the order within a colour is free."""
    assert moved(8192) == moved(0)

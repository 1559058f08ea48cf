"""What cannot be afforded is refused in little time and memory: a process each, whose limits would end it otherwise."""

import json
import os
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

SECONDS, MEGABYTES = 2.0, 200.0
ROOM = 600_000_000  # bytes of address space beyond what is mapped already: a refusal that allocates ends here

#: refuses one scene in a process that has done one before; prints seconds, growth of the peak [MB] and what was said
CHILD = """
import json, re, resource, sys, time
from pathlib import Path
import wavetank as wt


GOOD = "spacing = 0.1\\ntank.size = [1, 1]\\nfluids = [{ lower = [0, 0], upper = [0.5, 0.5] }]\\n"

def memory(name):
    return int(re.search(name + r":\\s+(\\d+)", Path("/proc/self/status").read_text())[1]) / 1024

wt.Simulation(wt.Scene.from_text(GOOD))  # what every process needs
import trimesh  # and what meshes need
path = sys.argv[1]
mapped = int(2**20 * memory("VmSize"))
resource.setrlimit(resource.RLIMIT_AS, (mapped + ROOM, mapped + ROOM))
Path("/proc/self/clear_refs").write_text("5")  # the peak begins anew
before, began, said = memory("VmRSS"), time.process_time(), ""
try:
    wt.Simulation(wt.Scene.load(path))
except wt.WavetankError as error:
    said = str(error)
print(json.dumps([time.process_time() - began, memory("VmHWM") - before, said]))
"""


def bomb(path: Path, triangles: int, instances: int) -> None:
    """Write a GLB of a few bytes that stands for `triangles` in so many instances."""
    each = triangles // instances
    points = np.random.default_rng(1).random((each + 2, 3)).astype(np.float32)
    faces = np.stack([np.arange(each), np.arange(each) + 1, np.arange(each) + 2], axis=1).astype(np.uint32)
    data = points.tobytes() + faces.tobytes()
    about = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [*range(instances)]}],
        "nodes": [{"mesh": 0, "translation": [k, 0, 0]} for k in range(instances)],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {
                "bufferView": 0,
                "componentType": 5126,
                "count": len(points),
                "type": "VEC3",
                "min": points.min(axis=0).tolist(),
                "max": points.max(axis=0).tolist(),
            },
            {"bufferView": 1, "componentType": 5125, "count": faces.size, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": points.nbytes},
            {"buffer": 0, "byteOffset": points.nbytes, "byteLength": faces.nbytes},
        ],
        "buffers": [{"byteLength": len(data)}],
    }
    text = json.dumps(about).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)


TANK = "fluids = [{ lower = [0, 0, 0], upper = [0.5, 0.5, 0.5] }]\n"
MESH = (
    "spacing = 0.05\ntank.size = [1, 1, 1]\n"
    + TANK
    + 'solids = [{ shape = "mesh", path = "FILE", center = [0.7, 0.5, 0.5], size = 0.2 }]'
)
CASES = {
    "10^12 particles in 2-D": (
        "spacing = 1e-4\ntank.size = [100, 100]\nfluids = [{ lower = [0, 0], upper = [100, 100] }]",
        "particles",
    ),
    "10^12 particles": (
        "spacing = 1e-3\ntank.size = [10, 10, 10]\nfluids = [{ lower = [0, 0, 0], upper = [10, 10, 10] }]",
        "particles",
    ),
    "10^24 cells": (
        "spacing = 1e-6\ntank.size = [100, 100, 100]\nfluids = [{lower=[0,0,0],upper=[1e-5,1e-5,1e-5]}]",
        "",
    ),
    "1000 km at 1 m": ("spacing = 1\ntank.size = [1e6, 1e6, 1e6]\nfluids = [{lower=[0,0,0],upper=[1,1,1]}]", "cells"),
    "64 M triangles in 50,000 places": (MESH.replace("FILE", "places.glb"), "50,000 meshes"),
    "64 M triangles": (MESH.replace("FILE", "triangles.glb"), "64,000,000 triangles"),
}


@pytest.mark.skipif(not Path("/proc/self/clear_refs").exists(), reason="peaks of memory are read off Linux's /proc")
@pytest.mark.parametrize("name", CASES)
def test_a_refusal_costs_little(name, tmp_path):
    text, words = CASES[name]
    bomb(tmp_path / "places.glb", 64_000_000, 50_000)
    bomb(tmp_path / "triangles.glb", 64_000_000, 2_000)
    (tmp_path / "scene.toml").write_text(text, encoding="utf-8")
    run = subprocess.run(
        [sys.executable, "-c", f"ROOM = {ROOM}\n{CHILD}", str(tmp_path / "scene.toml")],
        capture_output=True,
        text=True,
        timeout=120,
        env={**os.environ, "WAVETANK_STRICT_INPUT": "1"},
    )
    assert run.returncode == 0, run.stderr[-600:]
    seconds, megabytes, said = json.loads(run.stdout.splitlines()[-1])
    print(f"{name}: {seconds:.2f} s, {megabytes:.0f} MB: {said}")
    assert said and words in said and "\n" not in said
    assert megabytes < MEGABYTES, f"{megabytes:.0f} MB"
    assert seconds < SECONDS, f"{seconds:.2f} s"

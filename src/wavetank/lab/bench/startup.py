"""How long it takes from nothing to the first frame and picture: with an empty kernel cache, and again with it."""

import json
import os
import statistics
import subprocess
import sys
import tempfile
import time

from wavetank.foundation.errors import WavetankError

SCENE = "obstacle-tank"  # that of `make demo`

#: Runs in a process of its own; times count from the first line of Python.
_SCRIPT = """
import json, sys, time
began = time.perf_counter()
import wavetank
imported = time.perf_counter()
sim = wavetank.Simulation(wavetank.Scene.load(sys.argv[1]), arch=sys.argv[2])
sim.step()
first = time.perf_counter()
wavetank.render(sim, 640, 360)
drawn = time.perf_counter()
sim = wavetank.Simulation(wavetank.Scene.load("double-dam"), arch=sys.argv[2])
sim.step()
switched = time.perf_counter()
print(json.dumps({"import": imported - began, "frame": first - began, "picture": drawn - began,
                  "switch": switched - drawn}))
"""


def start_up(arch: str = "cpu", repeats: int = 3) -> dict[str, float]:
    """Measure the seconds from the start of a fresh process; `repeats` warm ones after the cold one, medians.

    Raises `WavetankError` where such a process fails.
    """
    with tempfile.TemporaryDirectory(prefix="wavetank-bench-") as cache:
        cold = _run(arch, cache)
        warm = [_run(arch, cache) for _ in range(repeats)]
    middle = {key: statistics.median(run[key] for run in warm) for key in cold}
    return {
        "import": middle["import"],
        "first_frame_cold": cold["frame"],
        "first_picture_cold": cold["picture"],
        "first_frame_warm": middle["frame"],
        "first_picture_warm": middle["picture"],
        "switch_scene_warm": middle["switch"],
        "process_warm": middle["process"],
    }


def _run(arch: str, cache: str) -> dict[str, float]:
    began = time.perf_counter()
    result = subprocess.run(
        [sys.executable, "-c", _SCRIPT, SCENE, arch],
        capture_output=True,
        text=True,
        env={**os.environ, "QD_OFFLINE_CACHE_FILE_PATH": cache},
    )
    elapsed = time.perf_counter() - began
    if result.returncode:
        last = (result.stderr.strip().splitlines() or ["no message"])[-1]
        raise WavetankError(f"start-up: a fresh process could not take the first frame of {SCENE}: {last}")
    return {**json.loads(result.stdout.strip().splitlines()[-1]), "process": elapsed}

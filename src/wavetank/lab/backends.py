"""The same water on the CPU and on another back end: figures of the motion, and pictures of one state by both.

A process has one back end, so each side is a process of its own (`python -m wavetank.lab.backends`). Motion is
compared by figures, because the last digit of a sum decides where a splash goes; pictures, of the very state that the
CPU reached, pixel by pixel.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

import wavetank
from wavetank.foundation.errors import WavetankError
from wavetank.scene.scene import Scene
from wavetank.simulation.simulation import Simulation

SCENE, SPACING, SECONDS, SIZE = "obstacle-tank", 0.04, 0.5, (480, 270)
VIEWS = ("water", "particles", "slice")
CLOSE = 2  # of 255
FIGURES = ("density_error_mean", "density_error_p99", "kinetic_energy", "speed_rms", "neighbors_mean")


def compare(arch: str, views: tuple[str, ...] = VIEWS, seconds: float = SECONDS) -> dict[str, Any]:
    """Run `seconds` of water on the CPU and on `arch`, and return what differs.

    The result has `figures`, {name: [cpu, arch]}, `height`, the mean height of the water [m] of both, and `views`:
    for each, the share of pixels that differ by at most `CLOSE` / 255, and the largest difference. Raises
    `WavetankError` where a side fails.
    """
    with tempfile.TemporaryDirectory() as folder:
        sides = [_side(name, Path(folder), views, seconds) for name in ("cpu", arch)]
        pictures = [np.load(Path(folder) / f"{name}.npz") for name in ("cpu", arch)]
        seen = {view: _difference(*(side[view] for side in pictures)) for view in views}
    return {
        "arch": arch,
        "scene": SCENE,
        "particles": sides[0]["particles"],
        "seconds": seconds,
        "figures": {name: [side["stats"][name] for side in sides] for name in FIGURES},
        "height": [side["height"] for side in sides],
        "views": seen,
    }


def _side(arch: str, folder: Path, views: tuple[str, ...], seconds: float) -> dict[str, Any]:
    command = [sys.executable, "-m", "wavetank.lab.backends", arch, str(folder), str(seconds), *views]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        reason = (done.stderr.strip() or f"exit code {done.returncode}").splitlines()[-1]
        raise WavetankError(f"doctor --compare: the side of {arch} failed: {reason}")
    return json.loads(done.stdout.splitlines()[-1])


def _difference(a: np.ndarray, b: np.ndarray) -> dict[str, float]:
    away = np.abs(a.astype(int) - b.astype(int)).max(axis=-1)
    return {"close": float(np.mean(away <= CLOSE)), "largest": int(away.max())}


def _run(arch: str, folder: Path, seconds: float, views: list[str]) -> dict[str, Any]:
    sim = Simulation(Scene.load(SCENE).changed(spacing=SPACING), arch)
    sim.advance(seconds)
    told = {"particles": sim.count, "stats": sim.stats(), "height": float(sim.positions[:, 1].mean())}
    state = folder / "state.npz"
    if arch == "cpu":
        sim.save(state)
    same = Simulation.restore(state, arch=arch)
    pictures: dict[str, Any] = {view: wavetank.render(same, *SIZE, view=view) for view in views}
    np.savez(folder / f"{arch}.npz", **pictures)
    return told


if __name__ == "__main__":
    try:
        print(json.dumps(_run(sys.argv[1], Path(sys.argv[2]), float(sys.argv[3]), sys.argv[4:])))
    except WavetankError as error:
        sys.exit(str(error))

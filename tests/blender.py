"""Blender opens a run: its own package (bpy) in an environment of its own, as it needs another NumPy than wavetank.

python tests/blender.py            # makes a run, lets Blender open it, and compares; exit code 77 without Blender
PYTHON_OF_BLENDER tests/blender.py --inside FOLDER
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGE = "bpy>=4.4,<4.6"
VARIABLE = "WAVETANK_BLENDER_PYTHON"  # a Python that has bpy already
SKIPPED = 77
SCENE = """
spacing = 0.06
foam = 1.0
tank.size = [1.0, 0.7, 0.5]
fluids = [{ lower = [0, 0, 0], upper = [0.4, 0.6, 0.5] }]
solids = [{ name = "paddle", center = [0.8, 0.2, 0.25], size = [0.05, 0.3, 0.3], motion = { rotation = "2*t" } }]
"""
FRAMES, SIZE = 4, (160, 90)


def python_of_blender() -> str:
    """Return a Python that has bpy, made in .venv-blender the first time; exits with a reason without one."""
    if os.environ.get(VARIABLE):
        return os.environ[VARIABLE]
    folder = ROOT / ".venv-blender"
    python = folder / "bin" / "python"
    if not (folder / "ready").exists():
        for command in (
            [sys.executable, "-m", "venv", str(folder)],
            [str(python), "-m", "pip", "install", "-q", "--only-binary", ":all:", PACKAGE],
        ):
            done = subprocess.run(command, capture_output=True, text=True)
            if done.returncode:
                said = (done.stderr.strip().splitlines() or ["no message"])[-1]
                print(f"skipped: there is no {PACKAGE} for this Python and this system: {said}")
                raise SystemExit(SKIPPED)
        (folder / "ready").touch()
    return str(python)


def make_run(out: Path) -> None:
    """Write a run with USD, and what Blender has to find in it."""
    import wavetank as wt
    from wavetank.run.options import RunOptions
    from wavetank.run.record import record

    sim = wt.Simulation(wt.Scene.from_text(SCENE))
    sim.advance(0.5)
    record(sim, RunOptions(out, (FRAMES - 1) / 10.0, 10.0, SIZE, exports=("usd", "npz")))
    import numpy as np

    expected = []
    for number in range(FRAMES):
        with np.load(out / f"run-{number:05d}.npz") as file:
            x, ids, foam = file["positions"], file["ids"], file["foam_kinds"]
            pose = file["solid_poses"][0][:7].tolist()
            expected.append(
                {
                    "count": len(x),
                    "middle": x.mean(axis=0).tolist(),
                    "ids": int(ids.astype(np.int64).sum()),
                    "foam": [int((foam == kind).sum()) for kind in (1, 2, 3)],
                    "pose": pose,
                }
            )
    (out / "expected.json").write_text(json.dumps(expected))


def inside(out: Path) -> None:
    """Open the run, compare each frame, and draw one; runs in Blender's Python."""
    import importlib.util

    import bpy
    import numpy as np

    bpy.ops.wm.read_factory_settings(use_empty=True)
    spec = importlib.util.spec_from_file_location("wavetank_blender", ROOT / "examples" / "blender" / "__init__.py")
    addon = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(addon)
    addon.register()
    assert bpy.ops.import_scene.wavetank_run(filepath=str(out / "run.usda")) == {"FINISHED"}
    scene, expected = bpy.context.scene, json.loads((out / "expected.json").read_text())
    assert (scene.frame_start, scene.frame_end, scene.render.fps) == (0, FRAMES - 1, 10)
    assert scene.camera is not None and scene.render.engine == "CYCLES"
    clouds = {one.name: one for one in bpy.data.objects if one.type == "POINTCLOUD"}
    assert "particles" in clouds, [*clouds]
    assert clouds["particles"].data.materials[0].name == "wavetank particles"
    paddle = next(one for one in bpy.data.objects if one.type == "MESH" and "paddle" in one.name)
    turns = []
    for number, frame in enumerate(expected):
        scene.frame_set(number)
        graph = bpy.context.evaluated_depsgraph_get()
        points, places = points_of(clouds["particles"].evaluated_get(graph), np)
        assert len(points.points) == frame["count"], f"frame {number}: {len(points.points)} points"
        x, y, z = frame["middle"]  # y is up with us, z with them
        np.testing.assert_allclose(places.mean(axis=0), (x, -z, y), atol=1e-5, err_msg=f"frame {number}")
        ids = np.zeros(len(points.points), np.int32)
        points.attributes["id"].data.foreach_get("value", ids)
        assert int(ids.astype(np.int64).sum()) == frame["ids"], f"ids of frame {number}"
        found = [
            len(points_of(clouds[name].evaluated_get(graph), np)[0].points) if name in clouds else 0
            for name in ("spray", "foam", "bubbles")
        ]
        assert found == frame["foam"], f"frame {number}: {found} of {frame['foam']}"
        place = paddle.evaluated_get(graph).matrix_world.translation
        x, y, z = frame["pose"][:3]
        np.testing.assert_allclose(place, (x, -z, y), atol=1e-5)
        turns.append(tuple(round(number, 4) for row in paddle.evaluated_get(graph).matrix_world for number in row))
    assert len({*turns}) == FRAMES, "the paddle turns"
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    scene.cycles.samples, scene.cycles.device = 8, "CPU"
    scene.render.filepath = str(out / "blender.png")
    bpy.ops.render.render(write_still=True)
    picture = bpy.data.images.load(str(out / "blender.png"))
    pixels = np.array(picture.pixels[:]).reshape(-1, 4)[:, :3]
    blue = (pixels[:, 2] > 1.5 * pixels[:, 0]) & (pixels[:, 2] > 0.15)
    assert pixels.std() > 0.05 and blue.mean() > 0.02, f"{blue.mean():.3f} of the picture is water"
    print(
        f"Blender {bpy.app.version_string}: {FRAMES} frames with {expected[-1]['count']} particles, "
        f"{sum(expected[-1]['foam'])} of foam; {100 * blue.mean():.0f} % of the picture is water"
    )


def points_of(cloud, np):
    """Return the points of a cloud, and where they are in the world [n, 3]."""
    places = np.zeros(3 * len(cloud.data.points), np.float32)
    cloud.data.points.foreach_get("co", places)
    turn = np.array(cloud.matrix_world)
    return cloud.data, places.reshape(-1, 3) @ turn[:3, :3].T + turn[:3, 3]


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("--inside", type=Path)
    parser.add_argument("--keep", type=Path, help="folder for the run and Blender's picture")
    given = parser.parse_args()
    if given.inside:
        inside(given.inside)
        sys.stdout.flush()
        os._exit(0)  # what bpy says when it is taken down is of no use
    python = python_of_blender()
    with tempfile.TemporaryDirectory() as folder:
        out = given.keep or Path(folder)
        make_run(out)
        return subprocess.run([python, __file__, "--inside", str(out)]).returncode


if __name__ == "__main__":
    sys.exit(main())

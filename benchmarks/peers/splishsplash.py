"""One run of SPlisHSPlasH, on a dam break or on a scene of its own; its Python is one that has pysplishsplash.

    python splishsplash.py FOLDER '{"method": "dfsph", ...}'
    python splishsplash.py FOLDER '{"scene": "DamBreakModel", "seconds": 2.0, "every": 0.05}'

It needs nothing of wavetank. The last line that it prints is a JSON object with what the run took and reached. Keys of
the order: method (pbf, dfsph), spacing [m], cells (three numbers of particles), tank [m], seconds, and the solver's
own iterations, dt, cfl_factor, largest_dt, max_error and max_error_v [%]. A run that has taken `patience` [s] is given
up: what it prints is then of the water until there. Of a scene of its own, which is run as it is, particles and rigid
bodies are kept `every` so long [s] in FOLDER/watched.npz.
"""

import contextlib
import ctypes
import json
import math
import sys
import time
from pathlib import Path
from typing import Any

METHODS = {"pbf": 2, "dfsph": 4}
#: Its module needs these loaded for everyone on a machine without a desktop.
LIBRARIES = ("libOpenGL.so.0", "libGLX.so.0", "libGL.so.1", "libGLU.so.1")
#: How far from its walls its water starts [d]: nearer, its volume maps press the first layer.
GAP = 1.5
CORNERS = [(x, y, z) for z in (-0.5, 0.5) for y in (-0.5, 0.5) for x in (-0.5, 0.5)]
FACES = ((1, 3, 4, 2), (5, 6, 8, 7), (1, 2, 6, 5), (3, 7, 8, 4), (1, 5, 7, 3), (2, 4, 8, 6))


class Done(Exception):  # noqa: N818
    """Ends a run from within."""


def scene(order: dict[str, Any]) -> dict[str, Any]:
    """Return the scene file's content: a block of water in the corner of a tank."""
    d, tank = order["spacing"], [edge + (2.0 * GAP - 1.0) * order["spacing"] for edge in order["tank"]]
    configuration = {
        "particleRadius": 0.5 * d,
        "density0": 1000,
        "gravitation": [0, -9.81, 0],
        "simulationMethod": METHODS[order["method"]],
        "boundaryHandlingMethod": 2,  # its default: volume maps
        "timeStepSize": order["dt"],
        "cflMethod": 0 if order["method"] == "pbf" else 1,
        "cflFactor": order.get("cfl_factor", 1.0),
        "cflMaxTimeStepSize": order.get("largest_dt", 0.005),
        "cflMinTimeStepSize": 1e-5,
    }
    # A block starts one spacing behind its corner and ends one before the other.
    lower = [(GAP - 1.0) * d] * 3
    upper = [low + (n + 1) * d for low, n in zip(lower, order["cells"], strict=True)]
    wall = {
        "geometryFile": "box.obj",
        "translation": [0.5 * edge for edge in tank],
        "scale": tank,
        "isDynamic": False,
        "rotationAxis": [1, 0, 0],
        "rotationAngle": 0,
        "isWall": True,
        "mapInvert": True,
        "mapThickness": 0.0,
        "mapResolution": [max(10, round(edge / (2.5 * d))) for edge in tank],
    }
    return {
        "Configuration": configuration,
        "Materials": [{"id": "Fluid", "viscosityMethod": 0, "vorticityMethod": 0}],
        "RigidBodies": [wall],
        "FluidBlocks": [{"denseMode": 0, "start": lower, "end": upper}],
    }


def box() -> str:
    """Return a cube of edge 1 as triangles that look outwards, in the OBJ format."""
    lines = [f"v {x} {y} {z}" for x, y, z in CORNERS]
    lines += [f"f {a} {b} {c}\nf {a} {c} {d}" for a, b, c, d in FACES]
    return "\n".join(lines) + "\n"


def configure(solver: Any, order: dict[str, Any]) -> None:
    """Set when the pressure solver stops: after `iterations`, or below its own errors [%]."""
    if order["method"] == "pbf":
        solver.setValueFloat(solver.MAX_ERROR, 1e-10)
        solver.setValueUInt(solver.MAX_ITERATIONS, order["iterations"])
        solver.setValueUInt(solver.MIN_ITERATIONS, order["iterations"])
        return
    solver.setValueFloat(solver.MAX_ERROR, order["max_error"])
    solver.setValueFloat(solver.MAX_ERROR_V, order["max_error_v"])


def load() -> Any:
    """Return its module."""
    for name in LIBRARIES if sys.platform == "linux" else ():
        try:
            ctypes.CDLL(name, mode=ctypes.RTLD_GLOBAL)
        except OSError:
            continue
    import pysplishsplash

    return pysplishsplash


def begin(sph: Any, file: Path, folder: Path, seconds: float) -> Any:
    """Return its simulator with a scene file in it."""
    solver = sph.Exec.SimulatorBase()
    solver.init(
        sceneFile=str(file),
        outputDir=str(folder / "out"),
        useGui=False,
        initialPause=False,
        useCache=True,
        stopAt=seconds,
    )
    solver.initSimulation()
    return solver


def run(folder: Path, order: dict[str, Any]) -> dict[str, Any]:
    """Simulate and return steps, seconds, iterations and density error; reading the densities is not timed."""
    sph = load()
    import numpy as np

    (folder / "box.obj").write_text(box())
    file = folder / "scene.json"
    file.write_text(json.dumps(scene(order)))
    solver = begin(sph, file, folder, order["seconds"])
    water, clock = sph.Simulation.getCurrent(), sph.TimeManager.getCurrent()
    configure(water.getTimeStep(), order)
    steps: list[tuple[float, float, int, float, float]] = []
    left = [time.perf_counter()]

    def after_step() -> None:
        elapsed = time.perf_counter() - left[0]
        fluid = water.getFluidModel(0)
        rho = np.array(fluid.getFieldBuffer("density"))[: fluid.numActiveParticles()]
        error = np.maximum(rho.astype(np.float64) / 1000.0 - 1.0, 0.0)
        iterations = water.getTimeStep().getNumIterations()
        steps.append((clock.getTime(), elapsed, iterations, float(error.mean()), float(np.percentile(error, 99))))
        # It does not always stop where it was told to.
        if clock.getTime() >= order["seconds"] or sum(step[1] for step in steps[1:]) > order.get("patience", math.inf):
            raise Done
        left[0] = time.perf_counter()

    solver.setTimeStepCB(after_step)
    solver.setValueFloat(solver.STOP_AT, order["seconds"])
    with contextlib.suppress(Done):
        solver.runSimulation()
    # The first step pays for the maps of the walls.
    times, elapsed, iterations, means, tails = np.array(steps).T
    water_time = times[-1] - times[0]
    weights = np.diff(times, prepend=0.0)
    return {
        "particles": water.getFluidModel(0).numActiveParticles(),
        "steps": len(steps) - 1,
        "seconds_of_water": float(water_time),
        "given_up": bool(times[-1] < 0.99 * order["seconds"]),
        "wall": float(elapsed[1:].sum()),
        "iterations": float(iterations[1:].mean()),
        "iterations_in_all": float(iterations[1:].sum()),
        "density_error_mean": float(np.average(means, weights=weights)),
        "density_error_p99": float(np.average(tails, weights=weights)),
    }


def scenes() -> Path:
    """Return the folder of the scenes that its package has."""
    for place in (Path(sys.prefix) / "bin" / "data" / "Scenes", Path(sys.prefix) / "data" / "Scenes"):
        if place.is_dir():
            return place
    raise SystemExit("this pysplishsplash has no folder of scenes")


def watch(folder: Path, order: dict[str, Any]) -> dict[str, Any]:
    """Run a scene of its own and keep what moves; return how long it took and where the scene file is.

    FOLDER/watched.npz has, for n instants: times [s], counts [n, fluids], positions [m] and velocities [m/s] one
    instant after the other, [sum, 3], names of fluids, and bodies [n, bodies, 7]: place [m], quaternion (x, y, z, w).
    """
    file = scenes() / f"{order['scene']}.json"
    if not file.is_file():
        raise SystemExit(f"there is no scene {order['scene']!r} in pysplishsplash")
    if not order.get("seconds"):
        return {"file": str(file)}
    sph = load()
    import numpy as np

    solver = begin(sph, file, folder, order["seconds"])
    water, clock = sph.Simulation.getCurrent(), sph.TimeManager.getCurrent()
    kept: dict[str, list[Any]] = {key: [] for key in ("times", "counts", "positions", "velocities", "bodies")}
    left, wall, steps = [time.perf_counter()], [0.0], [0]

    def keep() -> None:
        fluids = [water.getFluidModel(k) for k in range(water.numberOfFluidModels())]
        solids = [water.getBoundaryModel(k).getRigidBodyObject() for k in range(water.numberOfBoundaryModels())]
        kept["times"].append(clock.getTime())
        kept["counts"].append([fluid.numActiveParticles() for fluid in fluids])
        for name, column in (("position", "positions"), ("velocity", "velocities")):
            rows = [np.array(fluid.getFieldBuffer(name))[: fluid.numActiveParticles()] for fluid in fluids]
            kept[column].append(np.concatenate(rows).astype(np.float32))
        poses = [[*np.ravel(solid.getPosition()), *np.ravel(solid.getRotation())] for solid in solids]
        kept["bodies"].append(np.array(poses, np.float64).reshape(len(solids), 7))

    def after_step() -> None:
        if steps[0]:  # the first one pays for the maps of the walls
            wall[0] += time.perf_counter() - left[0]
        steps[0] += 1
        if clock.getTime() >= len(kept["times"]) * order["every"] - 1e-9:
            keep()
        if clock.getTime() >= order["seconds"]:
            raise Done
        left[0] = time.perf_counter()

    solver.setTimeStepCB(after_step)
    solver.setValueFloat(solver.STOP_AT, order["seconds"])
    with contextlib.suppress(Done):
        solver.runSimulation()
    names = [water.getFluidModel(k).getId() for k in range(water.numberOfFluidModels())]
    np.savez(
        folder / "watched.npz",
        times=kept["times"],
        counts=kept["counts"],
        bodies=kept["bodies"],
        names=names,
        positions=np.concatenate(kept["positions"]),
        velocities=np.concatenate(kept["velocities"]),
    )
    return {"file": str(file), "wall": wall[0], "steps": steps[0], "seconds_of_water": clock.getTime()}


if __name__ == "__main__":
    ordered = json.loads(sys.argv[2])
    done = (watch if "scene" in ordered else run)(Path(sys.argv[1]).resolve(), ordered)
    print(json.dumps(done), flush=True)

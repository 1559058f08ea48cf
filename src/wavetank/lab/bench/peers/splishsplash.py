"""One run of SPlisHSPlasH on a dam break; executed by the Python of an environment that has pysplishsplash.

    python splishsplash.py FOLDER '{"method": "dfsph", ...}'

It needs nothing of wavetank. The last line that it prints is a JSON object with what the run took and reached. Keys of
the order: method (pbf, dfsph), spacing [m], cells (three numbers of particles), tank [m], seconds, and the solver's
own iterations, dt, cfl_factor, largest_dt, max_error and max_error_v [%]. A run that has taken `patience` [s] is given
up: what it prints is then of the water until there.
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
        "geometryFile": "box.obj", "translation": [0.5 * edge for edge in tank], "scale": tank, "isDynamic": False,
        "rotationAxis": [1, 0, 0], "rotationAngle": 0, "isWall": True, "mapInvert": True, "mapThickness": 0.0,
        "mapResolution": [max(10, round(edge / (2.5 * d))) for edge in tank],
    }  # fmt: skip
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
    """Set how far the pressure solver goes: so many iterations, or until its own errors [%] are met."""
    if order["method"] == "pbf":
        solver.setValueFloat(solver.MAX_ERROR, 1e-10)
        solver.setValueUInt(solver.MAX_ITERATIONS, order["iterations"])
        solver.setValueUInt(solver.MIN_ITERATIONS, order["iterations"])
        return
    solver.setValueFloat(solver.MAX_ERROR, order["max_error"])
    solver.setValueFloat(solver.MAX_ERROR_V, order["max_error_v"])


def run(folder: Path, order: dict[str, Any]) -> dict[str, Any]:
    """Simulate and return steps, seconds, iterations and density error; reading the densities is not timed."""
    for name in LIBRARIES if sys.platform == "linux" else ():
        try:
            ctypes.CDLL(name, mode=ctypes.RTLD_GLOBAL)
        except OSError:
            continue
    import numpy as np
    import pysplishsplash as sph

    (folder / "box.obj").write_text(box())
    file = folder / "scene.json"
    file.write_text(json.dumps(scene(order)))
    solver = sph.Exec.SimulatorBase()
    solver.init(
        sceneFile=str(file), outputDir=str(folder / "out"), useGui=False, initialPause=False, useCache=True,
        stopAt=order["seconds"],
    )  # fmt: skip
    solver.initSimulation()
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


if __name__ == "__main__":
    print(json.dumps(run(Path(sys.argv[1]).resolve(), json.loads(sys.argv[2]))), flush=True)

"""How fast the water is: scenes x sizes, milliseconds per stage, rates, and the density error bought with them.

A first pass over a run compiles, measures and is not timed; runs repeat bit for bit, so the timed passes need not
look. In these every other frame is watched by a clock around each kernel (`stages.py`), and the others are timed as
a whole; the passes of all runs take turns, because machines are noisy, and what is reported is the median over
passes, with the lowest and the highest.
"""

import math
import statistics
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

import wavetank
from wavetank.device import compiler
from wavetank.foundation.errors import WavetankError
from wavetank.lab.bench.counts import device_bytes, distance_tests, frame_launches, pairs, water_bytes
from wavetank.lab.bench.machine import load, machine
from wavetank.lab.bench.stages import STAGE_NAMES, Clock
from wavetank.scene.scene import MAX_PARTICLES, Scene
from wavetank.simulation.simulation import Simulation

SCENES = ("dam-break", "obstacle-tank")
SIZES = (10_000, 100_000)
PICTURE = (640, 360)
PASSES_PER_ITERATION = 2  # of the pairs: multipliers, then corrections

Figures = dict[str, Any]


def bench(
    scenes: Sequence[str] = SCENES,
    sizes: Sequence[int] = SIZES,
    *,
    arch: str = "cpu",
    seconds: float = 0.5,
    repeats: int = 3,
    threads: int | None = None,
    say: Callable[[str], None] = lambda text: None,
) -> Figures:
    """Run every scene at every size for `seconds` of water and return the figures as plain data.

    Raises `WavetankError` for numbers out of range and for a scene that cannot have that size.
    """
    check(seconds, repeats)
    started = compiler.start(arch, threads=threads)
    jobs = [(name, size, sized(Scene.load(name), size)) for name in scenes for size in sizes]
    runs, busy = [], load()
    for name, size, scene in jobs:
        say(f"{name}, {size:,} particles: measuring")
        runs.append({"scene": name, "size": size, **measured(scene, arch, seconds)})
    passes: list[list[Figures]] = [[] for _ in jobs]
    for turn in range(repeats):
        for number, (name, size, scene) in enumerate(jobs):
            say(f"{name}, {size:,} particles: pass {turn + 1} of {repeats}")
            passes[number].append(timed(scene, arch, runs[number]["frames"], turn))
    for run, taken in zip(runs, passes, strict=True):
        run.update(_rates(run, taken))
    return {
        "machine": machine(started, threads),
        "settings": {"seconds": seconds, "repeats": repeats, "load_before": busy},
        "runs": runs,
    }


def check(seconds: float, repeats: int) -> None:
    """Raise `WavetankError` where there would be nothing to measure, or no end of it."""
    if not (math.isfinite(seconds) and 0.0 < seconds <= 60.0):
        raise WavetankError(f"--seconds = {seconds} is not allowed; it must be a number above 0, at most 60.")
    if not 2 <= repeats <= 100:
        raise WavetankError(f"--repeats = {repeats} is not allowed; it must be a whole number from 2 to 100.")


def sized(scene: Scene, count: int) -> Scene:
    """Return the scene with the spacing at which about `count` particles come out."""
    if not 1 <= count <= MAX_PARTICLES:
        raise WavetankError(f"--sizes = {count} is not allowed; it must be a whole number from 1 to {MAX_PARTICLES:,}.")
    spacing, tried = scene.spacing, []
    for _ in range(4):  # lattices come in whole layers: take the best of a few
        found = len(scene.changed(spacing=spacing).particles()[0])
        tried.append((abs(math.log(max(found, 0.5) / count)), spacing))
        spacing *= (max(found, 1) / count) ** (1.0 / scene.dim)
    return scene.changed(spacing=min(tried)[1])


def measured(scene: Scene, arch: str, seconds: float) -> Figures:
    """Run once without a clock: density error, substeps and pairs of each frame, and what the device holds.

    The first frame does not count, as in `timed`.
    """
    sim = Simulation(scene, arch)
    sim.step()
    frames = max(2, math.ceil(seconds / scene.frame_time - 1e-6))
    launches, parts, lists, means, tails = [], [], [], [], []
    for _ in range(frames):
        launches.append(sum(frame_launches(sim).values()))
        parts.append(sim.time_steps)
        lists.append(pairs(sim))
        error = np.maximum(sim.densities.astype(np.float64) / scene.rest_density - 1.0, 0.0)
        means.append(float(error.mean()))
        tails.append(float(np.percentile(error, 99)))
    wavetank.render(sim, *PICTURE)
    pool = sim.world.pool
    return {
        "particles": sim.count,
        "spacing": scene.spacing,
        "dim": scene.dim,
        "frames": frames,
        "frame_time": scene.frame_time,
        "iterations": scene.iterations,
        "substeps_per_frame": float(np.mean(parts)),
        "launches_per_frame": float(np.mean(launches)),
        "pairs_per_particle": float(np.mean(lists)) / max(sim.count, 1),
        "tests_per_particle": distance_tests(sim) / max(sim.count, 1),
        "density_error_mean": float(np.mean(means)),
        "density_error_p99": float(np.mean(tails)),
        "bytes_per_particle": water_bytes(sim) / max(sim.count, 1),
        "foam_bytes": sum(device_bytes(part) for part in (pool.now, pool.spare, pool.births)) if pool else 0,
        "pair_frames": float(np.dot(lists, parts)) / frames,
    }


def timed(scene: Scene, arch: str, frames: int, turn: int) -> Figures:
    """Run once more: every other frame as a whole, the others kernel by kernel; then a few pictures. Seconds.

    The first frame does not count: what is new to the compiler then is start-up, which has its own figures.
    """
    sim = Simulation(scene, arch)
    sim.step()
    clock, whole, watched = Clock(), [], 0
    for frame in range(frames):
        if (frame + turn) % 2:
            with clock.running():
                sim.step()
            watched += 1
        else:
            began = time.perf_counter()
            sim.step()
            whole.append(time.perf_counter() - began)
    now, pictures = sim.frame(), []
    compiler.synchronize()
    for _ in range(3):
        began = time.perf_counter()
        wavetank.render(now, *PICTURE)
        pictures.append(time.perf_counter() - began)
    return {
        "frame": statistics.fmean(whole),
        "stages": {name: seconds / watched for name, seconds in clock.stages().items()},
        "kernels": {
            f"{stage}: {name}": (seconds / watched, clock.launches[stage, name] / watched)
            for (stage, name), seconds in clock.seconds.items()
            if name
        },
        "render": statistics.median(pictures),
    }


def _rates(run: Figures, passes: list[Figures]) -> Figures:
    """Turn the seconds of all passes into the figures of a run: medians, lowest and highest."""
    work = run["particles"] * run["iterations"] * run["substeps_per_frame"]
    visits = PASSES_PER_ITERATION * run["iterations"] * run["pair_frames"]
    kernels = {
        name: {
            "ms": 1e3 * statistics.median(taken["kernels"].get(name, (0.0, 0.0))[0] for taken in passes),
            "launches": statistics.fmean(taken["kernels"].get(name, (0.0, 0.0))[1] for taken in passes),
        }
        for name in sorted({name for taken in passes for name in taken["kernels"]})
    }
    return {
        "milliseconds_per_frame": spread([1e3 * taken["frame"] for taken in passes]),
        "stages": {
            **{name: spread([1e3 * taken["stages"].get(name, 0.0) for taken in passes]) for name in STAGE_NAMES},
            "render": spread([1e3 * taken["render"] for taken in passes]),
        },
        "kernels": kernels,
        "particle_iterations_per_second": spread([work / taken["frame"] for taken in passes]),
        "pairs_per_second": spread([visits / max(taken["stages"]["constraint"], 1e-12) for taken in passes]),
        "water_per_second": spread([run["frame_time"] / taken["frame"] for taken in passes]),
    }


def spread(values: Sequence[float]) -> dict[str, float]:
    """Return median, lowest and highest."""
    return {"median": statistics.median(values), "low": min(values), "high": max(values)}

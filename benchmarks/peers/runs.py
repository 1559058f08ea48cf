"""One dam break, run by us and run by them; each returns the same figures."""

import dataclasses
import json
import math
import os
import subprocess
import time
from pathlib import Path
from typing import Any

import numpy as np

from wavetank.foundation.errors import WavetankError
from wavetank.physics.measure import density_error
from wavetank.scene.fluids import Block
from wavetank.scene.scene import Scene
from wavetank.scene.tank import Tank
from wavetank.simulation.simulation import Simulation

WATER, TANK = (0.5, 0.6, 0.5), (1.6, 0.8, 0.5)  # m, those of the scene dam-break
SCRIPT = Path(__file__).with_name("splishsplash.py")

Run = dict[str, Any]


@dataclasses.dataclass(frozen=True)
class Dam:
    """A block of whole layers of particles in the corner of a tank that is as deep as the block."""

    spacing: float  # m
    cells: tuple[int, int, int]

    @classmethod
    def of(cls, count: int) -> "Dam":
        """Return the dam of about `count` particles."""
        d = (math.prod(WATER) / count) ** (1.0 / 3.0)
        x, y, z = (max(1, round(edge / d)) for edge in WATER)
        return cls(d, (x, y, z))

    @property
    def tank(self) -> tuple[float, float, float]:
        """Inner size [m]."""
        return TANK[0], TANK[1], self.cells[2] * self.spacing

    def scene(self, **parameters: Any) -> Scene:
        """Return it as a scene of ours; without foam, which they do not compute."""
        upper = tuple(n * self.spacing for n in self.cells)
        return Scene(
            spacing=self.spacing,
            tank=Tank(size=self.tank),
            fluids=[Block(lower=(0.0, 0.0, 0.0), upper=upper)],
            **{"foam": 0.0, **parameters},
        )


def ours(scene: Scene, seconds: float, *, measure: bool = True) -> Run:
    """Run our solver for `seconds` of water on the back end that has been started; measuring is not timed."""
    sim = Simulation(scene, arch="cpu")
    sim.step()  # compiles where the cache is empty
    sim.reset()
    wall, steps, means, tails = 0.0, 0, [], []
    while sim.time < seconds - 1e-9:
        began = time.perf_counter()
        sim.step()
        wall += time.perf_counter() - began
        steps += sim.time_steps
        if measure:
            error = density_error(sim.densities, scene.rest_density)
            means.append(float(error.mean()))
            tails.append(float(np.percentile(error, 99)))
    return {
        "particles": sim.count,
        "steps": steps,
        "seconds_of_water": sim.time,
        "wall": wall,
        "iterations": float(scene.iterations),
        "iterations_in_all": float(scene.iterations * steps),
        "density_error_mean": float(np.mean(means)) if means else math.nan,
        "density_error_p99": float(np.mean(tails)) if tails else math.nan,
    }


def theirs(python: Path, folder: Path, dam: Dam, threads: int, **order: Any) -> Run:
    """Run SPlisHSPlasH on the dam with this order (see `splishsplash.py`); raise `WavetankError` where it fails."""
    return ask(python, folder, {"spacing": dam.spacing, "cells": dam.cells, "tank": dam.tank, **order}, threads)


def ask(python: Path, folder: Path, order: dict[str, Any], threads: int) -> Run:
    """Let SPlisHSPlasH carry out an order; raise `WavetankError` where it fails."""
    result = subprocess.run(
        [str(python), str(SCRIPT), str(folder), json.dumps(order)],
        capture_output=True,
        text=True,
        env={**os.environ, "OMP_NUM_THREADS": str(threads)},
    )
    lines = result.stdout.strip().splitlines()
    if result.returncode or not lines or not lines[-1].startswith("{"):
        said = (result.stderr.strip().splitlines() or lines or ["no message"])[-1]
        raise WavetankError(f"SPlisHSPlasH stopped with exit code {result.returncode}: {said}")
    run: Run = json.loads(lines[-1])
    return run


def rate(run: Run) -> float:
    """Return the particle-iterations per second of the whole step."""
    return float(run["particles"] * run["iterations_in_all"] / run["wall"])


def pace(run: Run) -> float:
    """Return the seconds of water per second."""
    return float(run["seconds_of_water"] / run["wall"])

"""What bodies cost: a pool at rest, and the same pool with fifty bodies that rain into it.

The worlds take turns frame by frame, and what is compared is the time that the processor worked for each: a machine
that does something else meanwhile slows all of them.
"""

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from rich.table import Table

from wavetank.device import compiler
from wavetank.foundation.errors import WavetankError
from wavetank.lab.bench.machine import load, machine
from wavetank.scene.fluids import Block
from wavetank.scene.scene import Scene
from wavetank.scene.tank import Tank
from wavetank.simulation.simulation import Simulation
from wavetank.solids.shapes import Box, Capsule, Sphere
from wavetank.solids.solid import Solid

PARTICLES = 20_000
COUNT = 50
SIZES = {"small": 0.09, "large": 0.14}  # m, about two and three and a half particles across
SECONDS = 4.0
TANK, DEPTH = (3.2, 1.4, 1.2), 0.36  # m
DENSITIES = (300.0, 500.0, 700.0, 900.0, 1500.0)  # kg/m^3


def rain(count: int, edge: float, particles: int = PARTICLES) -> Scene:
    """Return a pool of about `particles`, with `count` bodies of that `edge` [m] above it, in two layers."""
    rng, bodies, (columns, rows) = np.random.default_rng(2), [], (9, 3)
    for number in range(count):
        column, row, layer = number % columns, number // columns % rows, number // (columns * rows)
        shaken = 0.03 * rng.uniform(-0.5, 0.5, 3)
        center = np.array(
            [TANK[0] * (column + 0.5) / columns, DEPTH + 0.25 + 0.3 * layer, TANK[2] * (row + 0.5) / rows]
        )
        bodies.append(_body(number, center + shaken, edge, rng))
    spacing = (TANK[0] * DEPTH * TANK[2] / particles) ** (1.0 / 3.0)
    pool = Block(lower=(0.0, 0.0, 0.0), upper=(TANK[0], DEPTH, TANK[2]))
    return Scene(spacing=round(spacing, 4), tank=Tank(size=TANK), fluids=[pool], solids=bodies)


def _body(number: int, center: np.ndarray, edge: float, rng: np.random.Generator) -> Solid:
    about: dict[str, Any] = {"name": f"body {number + 1}", "density": float(rng.choice(DENSITIES))}
    turn, aside = tuple(rng.normal(size=4)), 0.3 * edge * np.array([1.0, 0.0, 0.2])
    if number % 3 == 0:
        return Box(center=tuple(center), size=(edge, 0.8 * edge, 1.1 * edge), rotation=turn, **about)
    if number % 3 == 1:
        return Sphere(center=tuple(center), radius=0.55 * edge, **about)
    return Capsule(start=tuple(center - aside), end=tuple(center + aside), radius=0.4 * edge, **about)


def bodies(
    particles: int = PARTICLES,
    *,
    seconds: float = SECONDS,
    arch: str = "cpu",
    threads: int | None = None,
    say: Callable[[str], None] = lambda text: None,
) -> dict[str, Any]:
    """Measure the frames of all pools for `seconds` of water, in four parts, and return the figures.

    Raises `WavetankError` for a pool of fewer than 1,000 or more than a million particles, or a time out of range.
    """
    if not 1000 <= particles <= 1_000_000:
        raise WavetankError(f"--sizes = {particles} is not allowed with --bodies; it must be from 1,000 to 1,000,000.")
    if not 0.1 <= seconds <= 60.0:
        raise WavetankError(f"--seconds = {seconds} is not allowed with --bodies; it must be from 0.1 to 60.")
    started = compiler.start(arch, threads=threads)
    scenes = {"none": rain(0, 1.0, particles)} | {name: rain(COUNT, edge, particles) for name, edge in SIZES.items()}
    for name, scene in scenes.items():  # compiling does not count
        say(f"{name}: a first splash")
        Simulation(scene, arch).advance(min(0.7, seconds))
    worlds = {name: Simulation(scene, arch) for name, scene in scenes.items()}
    frames = max(4, round(seconds / scenes["none"].frame_time))
    spent = {name: np.zeros((frames, 2)) for name in worlds}
    for frame in range(frames):
        if frame % 60 == 0:
            say(f"frame {frame} of {frames}")
        for name, sim in worlds.items():
            began = time.perf_counter(), time.process_time()
            sim.step()
            spent[name][frame] = time.perf_counter() - began[0], time.process_time() - began[1]
    rows = []
    for name, times in spent.items():
        for part, (own, alone) in enumerate(
            zip(np.array_split(times, 4), np.array_split(spent["none"], 4), strict=True)
        ):
            rows.append(
                {
                    "bodies": name,
                    "from": part * seconds / 4,
                    "to": (part + 1) * seconds / 4,
                    "milliseconds": 1e3 * float(own[:, 0].mean()),
                    "processor_milliseconds": 1e3 * float(own[:, 1].mean()),
                    "ratio": float(own[:, 1].mean() / alone[:, 1].mean()),
                }
            )
    return {"machine": machine(started, threads), "load": load(), "particles": worlds["none"].count, "bodies": rows}


def bodies_table(result: dict[str, Any]) -> Table:
    """Return one row for each pool and part of the time."""
    table = Table("fifty bodies", "seconds", "ms a frame", "of the processor", "over the pool alone")
    for row in result["bodies"]:
        table.add_row(
            row["bodies"],
            f"{row['from']:g} to {row['to']:g}",
            f"{row['milliseconds']:.1f}",
            f"{row['processor_milliseconds']:.1f}",
            f"{row['ratio']:.2f}",
        )
    table.caption = f"A pool of {result['particles']:,} particles."
    return table

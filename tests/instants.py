"""Ten frames of a world that has everything a frame can hold; counts change from one to the next."""

import dataclasses
import functools

import numpy as np

import wavetank as wt
from wavetank.foundation.materials import Material
from wavetank.simulation.state import State

FRAMES = 10
FPS = 25.0


@functools.cache
def world() -> wt.Scene:
    return wt.Scene(
        title='a "world"',
        spacing=0.05,
        tank=wt.Tank(size=(1.2, 0.8, 0.6)),
        materials=[Material(name="water"), Material(name="light oil", density=800.0, color="#e0a526")],
        fluids=[
            wt.Block(lower=(0, 0, 0), upper=(0.4, 0.5, 0.6), material="water"),
            wt.Block(lower=(0.4, 0, 0), upper=(0.8, 0.25, 0.6), material="light oil"),
        ],
        solids=[
            wt.Box(name="crate 1", center=(0.95, 0.3, 0.3), size=(0.12, 0.12, 0.12), density=400.0, rotation=0.3),
            wt.Sphere(center=(0.6, "0.5 + 0.1*sin(6*t)", 0.3), radius=0.08),
        ],
        emitters=[
            wt.Emitter(position=(0.2, 0.7, 0.3), direction=(1, -0.5, 0), radius=0.08, speed=2.0, material="water")
        ],
        foam=1.0,
    )


@functools.cache
def instants() -> tuple[State, ...]:
    """The frames; the foam is made up, as is a dye."""
    sim, random, found = wt.Simulation(world()), np.random.default_rng(1), []
    for number in range(FRAMES):
        frame = sim.frame().state()
        count = 3 * number
        foam = {
            "foam_ids": np.arange(count, dtype=np.int32) + 7,
            "foam_positions": random.uniform(0.1, 0.5, (count, 3)).astype(np.float32),
            "foam_velocities": random.normal(size=(count, 3)).astype(np.float32),
            "foam_kinds": (np.arange(count) % 3 + 1).astype(np.int32),
            "foam_ages": random.uniform(0, 1, count).astype(np.float32),
            "foam_lives": random.uniform(1, 2, count).astype(np.float32),
        }
        dyes = frame.dyes.copy()
        dyes[:5] = 127 << 24 | 0xFF0000
        found.append(dataclasses.replace(frame, arrays=frame.arrays | foam | {"dye": dyes}))
        sim.advance(1.0 / FPS)
    return tuple(found)

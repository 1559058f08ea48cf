"""What the tests of graphics processors do in processes of their own: a process has one back end."""

import hashlib
import os
import sys
from pathlib import Path

import numpy as np

import wavetank as wt
from wavetank.lab.bench.scenes import sized
from wavetank.physics.pressure import multigrid


def compile_kernels() -> None:
    """Some frames, the last of each scene with a line before it in the driver's book, and pictures."""
    sizes = {"obstacle-tank": 8000, "obstacle-tank-2d": 1500, "honey": 1500, "oil-and-water": 3000, "crates": 3000}
    for name, size in sizes.items():
        sim = wt.Simulation(sized(wt.Scene.load(name), size), arch="cuda")
        sim.step()
        sim.step()
        note(f"frame {name} {sim.time_steps}")
        sim.step()
        note("end")
    for view in ("water", "particles", "slice", "foam"):
        wt.render(wt.Simulation(wt.Scene.load("obstacle-tank"), arch="cuda"), 64, 36, view=view)


def note(line: str) -> None:
    with Path(os.environ["CUDA_DRIVER_LOG"]).open("a") as book:
        book.write(line + "\n")


def move(block_nodes: str) -> None:
    """Print what becomes of a dam when levels of so many nodes are one block's."""
    multigrid.BLOCK_NODES = int(block_nodes)
    sim = wt.Simulation(sized(wt.Scene.load("dam-break"), 4000), arch="vulkan")
    for _ in range(6):
        sim.step()
    print(hashlib.sha256(np.sort(sim.positions, axis=0).tobytes()).hexdigest())


if __name__ == "__main__":
    globals()[sys.argv[1]](*sys.argv[2:])

"""What a run costs in whole numbers: pairs, distance tests, launches, substeps, bytes. They repeat exactly.

A clock tells a slower machine from a slower program only on a quiet day; these numbers always do.
`tests/lab/test_counts.py` compares them with kept ones.
"""

import collections
import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np

from wavetank.device import compiler
from wavetank.device.compiler import download, qd
from wavetank.device.state import Coefficients, Grid, Particles, integers
from wavetank.physics.coefficients import coefficients
from wavetank.physics.neighbors import for_each_row_around
from wavetank.physics.pairs import count_neighbors
from wavetank.simulation.simulation import Simulation


@qd.func
def add_length(sums: qd.template(), point, begin, end, particles: Particles, grid: Grid, h):
    """Count the particles of a row."""
    sums[0] += end - begin


@qd.kernel(fastcache=True)
def count_tests(tests: qd.types.ndarray(), particles: Particles, grid: Grid, c: Coefficients, count: qd.i32):
    """Count the particles in the cells around each particle."""
    for i in range(count):
        sums = qd.Vector([0])
        for_each_row_around(sums, add_length, particles.x[i], particles, grid, c.h)
        tests[i] = sums[0]


def pairs(sim: Simulation) -> int:
    """Return the number of ordered pairs (i, j) within h of each other in the neighbour lists."""
    world = sim.world
    c = coefficients(sim.scene, sim.scene.frame_time)
    return int(count_neighbors(world.particles, world.grid, c, sim.count).sum(dtype=np.int64))


def distance_tests(sim: Simulation) -> int:
    """Return the number of distance tests that lists take for the water as it stands, each particle for itself.

    Lists of eight test each candidate against all eight, in as many cells around as these stand in: somewhat more.
    """
    sim.frame()
    world, count = sim.world, sim.count
    tests = integers(count)
    count_tests(tests, world.particles, world.grid, coefficients(sim.scene, sim.scene.frame_time), count)
    return int(download(tests)[:count].sum(dtype=np.int64))


def frame_launches(sim: Simulation) -> dict[str, int]:
    """Take one frame and return how often each kernel was launched in it."""
    launches: collections.Counter[str] = collections.Counter()

    def around(module: str, name: str, launch: Callable[[], Any]) -> Any:
        launches[f"{module.removeprefix('wavetank.')}.{name}"] += 1
        return launch()

    with compiler.watched(around):
        sim.step()
    return dict(launches)


def device_bytes(value: Any) -> int:
    """Return the bytes that the device arrays of a dataclass take, those of dataclasses in it included.

    An array that has two names counts once.
    """
    if dataclasses.is_dataclass(value):
        parts = {id(part): part for field in dataclasses.fields(value) for part in [getattr(value, field.name)]}
        return sum(map(device_bytes, parts.values()))
    if not hasattr(value, "to_numpy"):
        return 0
    elements = int(np.prod([*value.shape, *getattr(value, "element_shape", ())]))
    return 4 * elements


def water_bytes(sim: Simulation) -> int:
    """Return the bytes on the device of all that water needs: particles twice, temporaries, cells, lists, pressure."""
    world = sim.world
    pressure = (*world.pressure.levels, world.pressure.workspace) if world.pressure else ()
    return sum(map(device_bytes, (world.particles, world.spare, world.temporaries, world.grid, *pressure)))

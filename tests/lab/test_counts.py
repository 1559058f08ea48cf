"""Work in whole numbers against kept ones: a change that costs more, on any machine, fails here.

A change that costs less fails too: put the new number in its place. The tests of the lists are those of fixed places,
so that they do not depend on how the last digit of a sum came out.
"""

import numpy as np
import pytest

from wavetank.lab.bench import counts
from wavetank.lab.bench.scenes import sized
from wavetank.scene.fluids import Points
from wavetank.scene.scene import Scene
from wavetank.scene.tank import Tank
from wavetank.simulation.simulation import Simulation

SPACING = 1 / 16
#: ordered pairs, distance tests of the list build, bytes of all that the water needs
CLOUD = {"pairs": 70148, "tests": 396636, "bytes": 1029008}
#: of the first frames of a dam break with five iterations, after two that fill tables
SUBSTEPS = [1, 2, 2, 2, 3, 3, 3]
LAUNCHES_PER_STEP = 29
#: kernel launches besides: the water is asked for foam in every other frame, and has some after four
LAUNCHES_PER_FRAME = [3, 1, 3, 1, 4, 2, 4]


@pytest.fixture(scope="module")
def cloud() -> Simulation:
    """16 x 12 x 16 shaken particles in a tank.

    Places are whole multiples of d / 64, and a quarter: no pair is as far as h and no cell's edge is hit, so that
    nothing here is a matter of rounding.
    """
    lattice = np.stack(np.meshgrid(*(64 * np.arange(n) + 32 for n in (16, 12, 16)), indexing="ij"), -1).reshape(-1, 3)
    shaken = lattice + np.random.Generator(np.random.PCG64(7)).integers(-12, 13, lattice.shape)
    places = ((shaken + 0.25) * SPACING / 64).astype(np.float32)
    tank = Tank(size=(2.0, 1.0, 1.0))
    return Simulation(Scene(spacing=SPACING, tank=tank, fluids=[Points(positions=places)]))


def test_the_lists_cost_what_they_did(cloud):
    tests = counts.distance_tests(cloud)
    found = {"pairs": counts.pairs(cloud), "tests": tests, "bytes": counts.water_bytes(cloud)}
    assert found == CLOUD


def test_distance_tests_are_those_of_the_cells_around(cloud):
    """Counted again on the host: all particles in the 27 cells around, itself included."""
    cells = np.floor(cloud.positions.astype(float) / (1.9 * SPACING)).astype(int)
    _, which, number = np.unique(cells, axis=0, return_inverse=True, return_counts=True)
    held = {tuple(cell): n for cell, n in zip(cells, number[which.ravel()], strict=True)}
    steps = [np.array(s) - 1 for s in np.ndindex(3, 3, 3)]
    total = sum(held.get(tuple(cell + s), 0) for cell in cells for s in steps)
    assert counts.distance_tests(cloud) == total


def test_a_frame_is_as_many_launches_and_substeps_as_it_was():
    sim = Simulation(sized(Scene.load("dam-break-2d"), 1500))
    sim.step()
    sim.step()
    launches, substeps = [], []
    for _ in SUBSTEPS:
        launches.append(sum(counts.frame_launches(sim).values()))
        substeps.append(sim.time_steps)
    assert substeps == SUBSTEPS
    assert launches == [more + LAUNCHES_PER_STEP * n for more, n in zip(LAUNCHES_PER_FRAME, substeps, strict=True)]


def test_two_runs_count_the_same():
    totals = []
    for _ in range(2):
        sim = Simulation(sized(Scene.load("dam-break-2d"), 1500))
        listed = 0
        for _ in range(5):
            sim.step()
            listed += counts.pairs(sim)
        totals.append((listed, counts.distance_tests(sim)))
    assert totals[0] == totals[1]

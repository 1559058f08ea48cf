"""What lies in one place: particles part, and of fluids that overlap the first one wins, points among them."""

import numpy as np
import pytest

import wavetank as wt
from wavetank.scene.lattice import covered

D = 0.05


def closest(x: np.ndarray) -> float:
    return float((np.linalg.norm(x[:, None] - x[None], axis=2) + 9.0 * np.eye(len(x))).min())


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("way", ["points", "add", "set"])
def test_particles_in_exactly_one_place_part(dim, way):
    heap = np.full((6, dim), 0.5)
    points = heap if way == "points" else heap + 2.0 * D * np.arange(6)[:, None] * np.eye(dim)[0]
    fluids = [wt.Points(positions=points if way != "add" else heap[:1])]
    scene = wt.Scene(spacing=D, foam=0, tank=wt.Tank(size=(1.2,) * dim), fluids=fluids, gravity=(0.0,) * dim)
    sim = wt.Simulation(scene)
    if way == "add":
        sim.add(heap[:5])
    elif way == "set":
        sim.positions = heap
    assert sim.count == 6 and np.abs(sim.positions - 0.5).max() <= 0.011 * D
    sim.advance(0.5)
    assert closest(sim.positions) > 0.5 * D


def test_positions_that_are_apart_stay_where_they_were_put():
    rows = np.random.default_rng(2).uniform(0.1, 0.9, (500, 2)).astype(np.float32)
    scene = wt.Scene(spacing=0.02, tank=wt.Tank(size=(1, 1)), fluids=[wt.Points(positions=rows)], foam=0)
    np.testing.assert_array_equal(wt.Simulation(scene).positions, rows)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("first", ["block", "points"])
def test_points_laid_over_a_block_thin_out_as_two_blocks_do(dim, first):
    block = wt.Block(lower=(0.0,) * dim, upper=(0.6,) * dim)
    other = wt.Block(lower=(0.4,) * dim, upper=(0.9,) * dim)
    lattice = wt.Scene(spacing=D, tank=wt.Tank(size=(1.0,) * dim), fluids=[other]).particles()[0]
    points = wt.Points(positions=lattice)
    counts = {}
    for name, second in (("blocks", other), ("points", points)):
        fluids = [block, second] if first == "block" else [second, block]
        x = wt.Scene(spacing=D, tank=wt.Tank(size=(1.0,) * dim), fluids=fluids).particles()[0]
        counts[name] = len(x)
        assert closest(x) > 0.9 * D
    assert counts["points"] == counts["blocks"]


def test_points_over_points_are_as_they_were_given():
    x = np.random.default_rng(3).uniform(0.1, 0.9, (300, 2))
    fluids = [wt.Points(positions=x), wt.Points(positions=x + 0.001)]
    assert len(wt.Scene(spacing=D, tank=wt.Tank(size=(1, 1)), fluids=fluids).particles()[0]) == 600


@pytest.mark.parametrize("dim", [2, 3])
def test_covered_is_what_all_pairs_say(dim):
    rng = np.random.default_rng(4)
    x, places = rng.uniform(-1, 1, (200, dim)), rng.uniform(-1, 1, (300, dim))
    wanted = (np.abs(x[:, None] - places[None]).max(axis=2) < 0.1).any(axis=1)
    np.testing.assert_array_equal(covered(x, places, 0.2), wanted)
    assert not covered(x, places[:0], 0.2).any() and len(covered(x[:0], places, 0.2)) == 0


def test_a_number_of_numpy_is_a_time_without_a_warning(recwarn):
    scene = wt.Scene(spacing=D, tank=wt.Tank(size=(1, 1)), fluids=[wt.Block(lower=(0, 0), upper=(0.3, 0.3))], foam=0)
    sim = wt.Simulation(scene)
    for seconds in (np.float64(0.02), np.float32(0.02), np.int64(0)):
        sim.advance(seconds)
    assert not recwarn.list

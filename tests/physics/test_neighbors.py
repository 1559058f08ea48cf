import itertools

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

import wavetank as wt
from wavetank.device.compiler import upload
from wavetank.physics import neighbors
from wavetank.physics.coefficients import coefficients
from wavetank.physics.integrate import reset_predictions
from wavetank.physics.neighbors import new_grid
from wavetank.physics.pairs import count_neighbors
from wavetank.physics.sorting import reorder
from wavetank.simulation import particles as particle_arrays
from wavetank.simulation.simulation import Simulation


def apart(difference: np.ndarray, tank: wt.Tank | None) -> np.ndarray:
    """Difference of nearest images."""
    for axis in tank.periodic_axes if tank else ():
        length = np.float32(tank.size[axis])
        difference[..., axis] -= length * np.round(difference[..., axis] / length)
    return difference


def neighbor_sets(sim: Simulation) -> list[set[int]]:
    """Ids of the neighbours of each particle, by id, out of the lists; and check the lists themselves."""
    sim.frame()
    world, count = sim.world, sim.count
    p = np.stack([getattr(world.particles, f"p{axis}").to_numpy()[:count] for axis in "xyz"[: sim.scene.dim]], 1)
    ids = world.particles.id.to_numpy()[:count]
    number, room = world.grid.number.to_numpy(), world.grid.room
    lists = world.grid.list.to_numpy()[: -(-count // 8) * room].reshape(-1, room)
    h = np.float32(sim.scene.support * sim.scene.spacing)
    sets: list[set[int]] = [set() for _ in range(count)]
    for group in range(-(-count // 8)):
        members = np.arange(8 * group, min(8 * group + 8, count))
        listed = lists[group, : number[group]]
        assert len(set(listed.tolist())) == len(listed), "a neighbour is listed twice"
        assert set(members.tolist()) <= set(listed.tolist()), "a particle is not in its own list"
        way = np.linalg.norm(apart(p[members, None] - p[None, listed], sim.scene.tank), axis=2)
        near, edge = way < h, way < h * (1 + 1e-6)
        assert edge.any(axis=0).all(), "somebody is listed who is near nobody"
        for row, i in enumerate(members):
            sets[ids[i]] = set(ids[listed[near[row]]].tolist()) - {int(ids[i])}
    numbers = count_neighbors(world.particles, world.grid, coefficients(sim.scene, 0.0), count)
    assert [len(sets[ids[i]]) for i in range(count)] == pytest.approx(numbers.tolist(), abs=1)
    return sets


def check(x: np.ndarray, spacing: float, tank=None) -> None:
    sim = Simulation(wt.Scene(spacing=spacing, tank=tank, fluids=[wt.Points(positions=x)], gravity=(0.0,) * x.shape[1]))
    h = sim.scene.support * spacing
    rings = tank.periodic_axes if tank else []
    lower = tank.box()[0] if tank else np.zeros(x.shape[1])
    x = x - lower if rings else x
    boxsize = [tank.size[axis] if axis in rings else 0.0 for axis in range(x.shape[1])] if rings else None
    tree = cKDTree(x.astype(np.float64), boxsize=boxsize)
    inside, outside = tree.query_ball_point(x, h * (1 - 1e-6)), tree.query_ball_point(x, h * (1 + 1e-6))
    for i, found in enumerate(neighbor_sets(sim)):
        # Pairs at the very edge of the support may fall on either side by rounding; their kernel is zero.
        assert set(inside[i]) - {i} <= found <= set(outside[i]) - {i}


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("offset", [0.0, -7.3, 1000.0])
def test_same_as_a_tree_in_the_open(dim, offset):
    """Cells repeat in space; far and negative places must not matter. Against scipy's cKDTree."""
    rng = np.random.default_rng(dim)
    x = np.concatenate([rng.uniform(-3, 3, (700, dim)), rng.normal(0, 0.2, (300, dim))]) + offset
    check(x.astype(np.float32), 0.125)


@pytest.mark.parametrize("dim", [2, 3])
def test_same_as_a_tree_in_a_tank(dim):
    rng = np.random.default_rng(dim)
    size = (1.3, 0.4, 0.9)[:dim]
    check((rng.uniform(0, 1, (2000, dim)) * size).astype(np.float32), 0.05, wt.Tank(size=size))


@pytest.mark.parametrize("size", [(1.3, 0.4), (1.0, 0.92, 0.5)])
@pytest.mark.parametrize("periodic", ["x", "y", "xy", "xz", "yz", "xyz"])
def test_same_as_a_tree_across_the_seams(size, periodic):
    """Rows of cells are rings there, also such of four cells, and tanks need not begin at the origin."""
    axes = [axis for axis in periodic if "xyz".index(axis) < len(size)]
    lower = (-0.3, 0.2, 0.7)[: len(size)]
    x = np.random.default_rng(len(axes)).uniform(0, 0.99999, (1500, len(size))) * size + lower
    check(x.astype(np.float32), 0.05, wt.Tank(size=size, lower=lower, periodic=axes))


@pytest.mark.parametrize("length", [0.38, 0.42, 3.0])
def test_same_as_a_tree_across_the_seam_of_few_cells_and_of_many(length):
    """Four supports are the least; a few particles in a long tank have fewer and longer cells than supports."""
    x = np.random.default_rng(1).uniform(0, 0.99999, (400, 3)) * (length, 0.6, 0.6)
    check(x.astype(np.float32), 0.05, wt.Tank(size=(length, 0.6, 0.6), periodic=["x"]))


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.integers(0, 2**32 - 1), st.integers(0, 300), st.sampled_from([2, 3]), st.floats(0.01, 10))
def test_same_as_a_tree_for_any_cloud(seed, count, dim, extent):
    x = np.random.default_rng(seed).uniform(-extent, extent, (count, dim)).astype(np.float32)
    check(x, 0.1)


def test_a_crowd_larger_than_its_list_is_listed_completely(monkeypatch):
    """600 particles in one place: every one has 599 neighbours, far beyond the room of a list at the start."""
    monkeypatch.setattr(particle_arrays, "CROWD", 600)
    x = np.random.default_rng(0).normal(0, 1e-3, (600, 3)).astype(np.float32)
    sim = Simulation(wt.Scene(spacing=0.1, fluids=[wt.Points(positions=x)]))
    assert all(len(found) == 599 for found in neighbor_sets(sim))


@pytest.mark.parametrize("shared", [0, 1])
def test_order_does_not_depend_on_the_order_given(shared):
    """Inside a cell particles stand by x and id: sorting twice from any permutation gives one order, on any threads."""
    x = np.random.default_rng(1).uniform(0, 1, (500, 3)).astype(np.float32)
    sim = Simulation(wt.Scene(spacing=0.1, fluids=[wt.Points(positions=x)]))
    world, c = sim.world, coefficients(sim.scene, 1 / 240)
    orders = []
    for seed in (0, 1):
        shuffle = np.random.default_rng(seed).permutation(500)
        upload(world.particles.x, x[shuffle])
        upload(world.particles.id, shuffle)
        reset_predictions(world.particles, world.grid, c, 500)
        reorder(world.spare, world.particles, world.grid, 500, shared)
        orders.append(world.spare.id.to_numpy()[:500])
    np.testing.assert_array_equal(*orders)
    np.testing.assert_array_equal(np.sort(orders[0]), np.arange(500))
    starts, cells = world.grid.start.to_numpy(), world.grid.cell.to_numpy()[np.argsort(shuffle)]
    for first, end in itertools.pairwise(starts):
        inside = orders[0][first:end]
        assert (np.diff(x[inside, 0]) >= 0).all()
        assert len(set(cells[inside])) <= 1


def test_cells_follow_the_particles_not_the_box():
    """A box of a cubic kilometre around a thousand particles must not cost its volume in cells."""
    grid = new_grid(3, 1000, (1000.0, 1000.0, 1000.0), 0.1, 32)
    assert grid.cells <= 4096
    assert min(grid.nx, grid.ny, grid.nz) >= 3


def test_more_lists_than_an_array_can_hold_are_refused():
    with pytest.raises(wt.WavetankError, match="enough for 119,304,640 particles; use a larger spacing"):
        new_grid(3, 2**27, None, 0.1, 144)


def test_a_list_that_would_grow_too_long_is_refused_and_kept(monkeypatch):
    monkeypatch.setattr(particle_arrays, "CROWD", 400)
    sim = Simulation(wt.Scene(spacing=0.1, fluids=[wt.Points(positions=np.zeros((400, 2)))], gravity=(0.0, 0.0)))
    room = sim.world.grid.room
    monkeypatch.setattr(neighbors, "MAX_ENTRIES", 50 * room)
    with pytest.raises(
        wt.WavetankError, match="400 particles with room for [0-9]+ neighbours of every eight are too many"
    ):
        sim.step()
    assert sim.world.grid.room == room

"""Blocks are filled evenly between what holds them, at any spacing."""

import numpy as np
import pytest

import wavetank as wt


def scene(spacing, size=(1.0, 1.0), fluids=None, **changes):
    fluids = fluids or [wt.Block(lower=(0.0,) * len(size), upper=(size[0], 0.5, *size[2:]))]
    return wt.Scene(spacing=spacing, tank=wt.Tank(size=size, **changes), fluids=fluids)


def rows(x, axis):
    """Where the rows of a lattice lie along an axis [m]."""
    return np.unique(np.round(x[:, axis].astype(float), 5))


@pytest.mark.parametrize("spacing", [0.022, 0.024, 0.026, 0.03])
def test_still_water_is_still_from_the_first_second(spacing):
    """With up to a spacing free at one wall water began at 0.3 to 0.5 m/s. Hydrostatics: nothing moves."""
    sim = wt.Simulation(wt.Scene.load("still-tank-2d").changed(spacing=spacing))
    fastest = 0.0
    for _ in range(60):
        sim.step()
        fastest = max(fastest, np.linalg.norm(sim.velocities, axis=1).max())
    assert fastest < 0.03


@pytest.mark.parametrize("size", [(1.0, 1.0), (1.0, 1.0, 0.31)])
@pytest.mark.parametrize("spacing", [0.024, 0.026])
def test_rows_reach_from_wall_to_wall_and_keep_the_volume(size, spacing):
    x = scene(spacing, size).particles()[0]
    for axis in (0, 2)[: len(size) - 1]:
        at = rows(x, axis)
        assert np.ptp(np.diff(at)) < 3e-5
        assert at[0] - 0.0 == pytest.approx(size[axis] - at[-1], abs=2e-5)
    bottom = rows(x, 1)
    layer = len(x) / len(bottom) * spacing ** len(size) / np.prod([size[axis] for axis in (0, 2)[: len(size) - 1]])
    assert np.diff(bottom).mean() == pytest.approx(layer, rel=1e-3)  # a particle has its volume
    assert len(x) * spacing ** len(size) == pytest.approx(0.5 * np.prod(size) / size[1], rel=0.5 * spacing / 0.5 + 0.01)


def test_what_fits_is_what_it_was():
    x = scene(0.025).particles()[0]
    assert len(x) == 800
    np.testing.assert_allclose(rows(x, 0), 0.0125 + 0.025 * np.arange(40), atol=1e-5)


def test_a_dam_with_a_free_side_keeps_its_rows():
    """Only what is held on both sides is spread: here across the tank."""
    dam = [wt.Block(lower=(0.0, 0.0, 0.0), upper=(0.3, 0.5, 0.31))]
    x = scene(0.02, (1.0, 1.0, 0.31), dam).particles()[0]
    assert len(rows(x, 2)) == 16
    assert rows(x, 2)[0] == pytest.approx(0.31 - rows(x, 2)[-1], abs=2e-5)
    assert rows(x, 0)[0] == pytest.approx(0.01, rel=0.02)
    assert rows(x, 0)[-1] < 0.3


def test_two_blocks_hold_each_other():
    pair = [wt.Block(lower=(0.0, 0.0), upper=(0.49, 0.5)), wt.Block(lower=(0.49, 0.0), upper=(1.0, 0.5))]
    x = scene(0.024, (1.0, 1.0), pair).particles()[0]
    gaps = np.diff(rows(x, 0))
    assert gaps.max() < 1.05 * 0.024
    assert gaps.min() > 0.95 * 0.024


def test_a_block_apart_is_not_touched_by_another():
    pair = [wt.Block(lower=(0.0, 0.0), upper=(0.49, 0.2)), wt.Block(lower=(0.49, 0.3), upper=(1.0, 0.5))]
    x = scene(0.024, (1.0, 1.0), pair).particles()[0]
    np.testing.assert_allclose(np.diff(rows(x[x[:, 0] < 0.49], 0)), 0.024, atol=2e-5)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_rows_are_even_over_a_seam(axis):
    size = [1.0, 1.0, 1.0]
    size[axis] = 0.515
    full = [wt.Block(lower=(0.0, 0.0, 0.0), upper=tuple(size))]
    world = wt.Scene(
        spacing=0.05, tank=wt.Tank(size=tuple(size), periodic=["xyz"[axis]]), fluids=full, gravity=(0.0, 0.0, 0.0)
    )
    at = rows(world.particles()[0], axis)
    assert at[0] + size[axis] - at[-1] == pytest.approx(np.diff(at).mean(), abs=3e-5)


def test_an_open_side_holds_nothing():
    x = scene(0.024, open=["+x"]).particles()[0]
    np.testing.assert_allclose(np.diff(rows(x, 0)), 0.024, atol=2e-5)


def test_a_world_without_walls_is_never_too_full():
    ring = wt.Tank(size=(1.015, 0.515), periodic=["x", "y"])
    full = [wt.Block(lower=(0.0, 0.0), upper=(1.015, 0.515))]
    x = wt.Scene(spacing=0.05, tank=ring, fluids=full, gravity=(0.0, 0.0)).particles()[0]
    assert len(x) == 20 * 10
    for axis, length in enumerate(ring.size):
        np.testing.assert_allclose(np.diff(rows(x, axis)), length / len(rows(x, axis)), atol=2e-5)


@pytest.mark.parametrize("shape", ["block", "ball"])
def test_many_fluids_in_one_place_are_not_all_asked(shape, monkeypatch):
    """As many as a scene may have: work that grows with the square of their number would be two million questions."""
    rng = np.random.default_rng(1)
    block = "{lower = [0.4, 0.4, 0.4], upper = [0.6, 0.6, 0.6]}"
    balls = [
        f'{{shape = "ball", center = {place.tolist()}, radius = 0.3}}' for place in rng.uniform(0.4, 0.6, (2000, 3))
    ]
    each = balls if shape == "ball" else [block] * 2000
    text = f"spacing = 0.1\ntank.size = [1, 1, 1]\nfluids = [{', '.join(each)}]\n"
    asked = []
    for kind in (wt.Block, wt.Ball):
        contains = kind.contains
        monkeypatch.setattr(kind, "contains", lambda self, points, f=contains: (asked.append(self), f(self, points))[1])
    x = wt.Scene.from_text(text).particles()[0]
    assert (len(x) and len(x) == len(np.unique(x, axis=0))) or shape == "ball"
    assert 1999 <= len(asked) < 200 * len(each)

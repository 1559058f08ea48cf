"""Lone particles are drops of their own before the finished picture, not bumps of the water behind them."""

import numpy as np
import pytest
from test_ellipsoids import lattice
from worlds import frame_of

from wavetank import Box, Camera, Scene, Tank
from wavetank.view.renderer import Renderer

D = 0.05
TANK = Tank(size=(1.0, 1.0, 1.0))
ABOVE = Camera(eye=(0.5, 1.9, 0.5), target=(0.5, 0.0, 0.5))
SIZE = (240, 180)


def pool(*drops, velocity=(0.0, 0.0, 0.0)):
    water = lattice((0, 0, 0), (1.0, 0.4, 1.0))
    x = np.concatenate([water, np.reshape(drops, (-1, 3))])
    v = np.zeros_like(x)
    v[len(water) :] = velocity
    return frame_of(Scene(spacing=D, tank=TANK), x, v)


def picture(frame, camera=ABOVE, size=SIZE):
    renderer = Renderer(*size)
    return renderer.render(frame, camera, view="water").astype(int), renderer.buffers.water


def test_a_drop_before_a_pool_shows_the_pool():
    """In its middle a ray goes straight on: what is behind, less what so little water and a mirror of 2 % take."""
    bare, _ = picture(pool())
    wet, water = picture(pool((0.5, 0.9, 0.5)))
    middle = (slice(88, 92), slice(118, 122))
    assert np.abs(wet[middle] - bare[middle]).max() < 30
    assert np.abs(wet - bare)[75:105, 105:135].max() > 20  # and its rim is seen
    depth = water.surface.depth.to_numpy().view(np.float32)
    assert depth[middle].min() > 1.9 - 0.4 - D  # the surface is the pool's


def test_the_water_behind_a_drop_is_as_thick_as_without_it():
    _, bare = picture(pool())
    without = bare.thickness.water.to_numpy().copy()
    _, wet = picture(pool((0.5, 0.9, 0.5)))
    assert (wet.thickness.water.to_numpy() == without).all()


def test_a_drop_turns_the_world_round():
    """A dark wall on the left of what is behind a drop is seen in its right half."""
    wall = Box(center=(0.0, 0.5, -0.2), size=(1.0, 1.4, 0.1), color="#101010")
    camera = Camera(eye=(0.5, 0.5, 1.5), target=(0.5, 0.5, 0.0))
    scene = Scene(spacing=D, tank=TANK, solids=[wall])
    # Beside a pool's worth of water that is out of sight: no picture of nothing but drops.
    frame = frame_of(scene, [(0.5, 0.5, 0.9)])
    image, _ = picture(frame, camera)
    bare, _ = picture(frame_of(scene, np.zeros((0, 3))), camera)
    column, row, _ = camera.project((0.5, 0.5, 0.9), *SIZE)[0]
    row, column = int(row), int(column)
    left, right = (
        (slice(row - 3, row + 3), slice(column - 8, column - 3)),
        (slice(row - 3, row + 3), slice(column + 3, column + 8)),
    )
    assert bare[left].mean() < bare[right].mean() - 40
    assert image[left].mean() > image[right].mean() + 30


def test_a_drop_on_a_pane_is_a_drop():
    """Not a flat disc of more than two spacings that hides the pool behind it."""
    camera = Camera(eye=(0.5, 1.6, 2.4), target=(0.5, 0.3, 0.5))
    column, row, _ = camera.project((0.5, 0.6, 0.98), *SIZE)[0]
    spacing = abs(camera.project((0.5 + D, 0.6, 0.98), *SIZE)[0][0] - column)
    bare, _ = picture(pool(), camera)
    wet, _ = picture(pool((0.5, 0.6, 0.98)), camera)
    assert 3 < np.ptp(np.nonzero((np.abs(wet - bare).max(axis=2) > 10).any(axis=0))[0]) < 1.6 * spacing
    assert np.abs(wet - bare)[int(row) - 1 : int(row) + 2, int(column) - 1 : int(column) + 2].max() < 20


def test_what_is_fast_flies_apart():
    """A slow particle is one drop; a fast one is several, over more of the picture."""
    bare, _ = picture(pool())
    reach = []
    for velocity in ((0.0, 0.0, 0.0), (0.0, -6.0, 0.0)):
        changed = np.abs(picture(pool((0.5, 0.8, 0.5), velocity=velocity))[0] - bare).max(axis=2) > 6
        rows, columns = np.nonzero(changed[60:120, 90:150])
        reach.append(np.ptp(rows) + np.ptp(columns))
    assert reach[1] > 1.3 * reach[0]


@pytest.mark.parametrize("number", [1, 2])
def test_few_neighbours_make_a_drop(number):
    """One or two particles side by side are drops, many are water."""
    _, water = picture(pool(*[(0.5 + k * D, 0.8, 0.5) for k in range(number)]))
    lone = water.ellipsoids.lone.to_numpy()
    assert lone[: len(lone) // 2].sum() == number
    _, water = picture(pool(*(lattice((0.4, 0.7, 0.4), (0.6, 0.85, 0.6)))))
    assert water.ellipsoids.lone.to_numpy().sum() == 0


def test_drops_do_not_depend_on_the_order():
    random = np.random.default_rng(3)
    drops, speeds = random.uniform(0.1, 0.9, (150, 3)) * (1, 0.4, 1) + (0, 0.5, 0), random.normal(0, 2, (150, 3))
    scene = Scene(spacing=D, tank=TANK)
    pictures = []
    for order in (slice(None), slice(None, None, -1)):
        frame = frame_of(scene, drops[order], speeds[order])
        ids = np.zeros(frame.id.shape[0], np.int32)
        ids[:150] = np.arange(150)[order]
        frame.id.from_numpy(ids)
        pictures.append(picture(frame)[0])
    assert (pictures[0] == pictures[1]).all()

"""How long a time step may be."""

import math

import numpy as np
import pytest

import wavetank as wt
from wavetank.physics.time_step import ALONE, filled_share, largest_speed, pool_depth, steps_needed, whole
from wavetank.simulation.simulation import Simulation


def pool(depth: float, d: float, dim: int = 2, **more) -> wt.Scene:
    size = (20 * d, 1.5 * depth, 10 * d)[:dim]
    upper = (20 * d, depth, 10 * d)[:dim]
    return wt.Scene(spacing=d, tank=wt.Tank(size=size), fluids=[wt.Block(lower=(0.0,) * dim, upper=upper)], **more)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("gravity", [(0.0, -9.81, 0.0), (-4.0, -3.0, 0.0)])
def test_depth_is_twice_the_mean_height_against_gravity(dim, gravity):
    world = Simulation(pool(0.5, 0.025, dim, gravity=gravity[:dim]))
    up = -np.array(gravity[:dim]) / math.hypot(*gravity)
    size = np.array(world.scene.tank.size)
    heights = world.positions @ up
    lowest = np.minimum(size * up, 0.0).sum()
    depth = pool_depth(world.world.particles, world.count, gravity[:dim], np.zeros(dim), size)
    assert depth == pytest.approx(2.0 * (heights.mean() - lowest), rel=2e-3)


def test_every_bound_holds():
    """v dt <= courant d, sqrt(g H) dt <= wave_courant d where no grid carries it, dt <= frame_time / substeps."""
    scene = pool(0.5, 0.01)
    for speed, depth in [(0.0, 0.0), (0.0, 2.0), (3.0, 0.1), (5.0, 5.0)]:
        n = whole(steps_needed(scene, scene.frame_time, speed, depth, on_grid=False))
        dt = scene.frame_time / n
        assert speed * dt <= ALONE * scene.courant * scene.spacing
        assert math.sqrt(9.81 * depth) * dt <= scene.wave_courant * scene.spacing * 1.0001
        assert n >= scene.substeps
    for speed in (3.0, 5.0):
        dt = scene.frame_time / whole(steps_needed(scene, scene.frame_time, speed, 0.1, on_grid=True))
        assert 0.6 * scene.courant * scene.spacing <= speed * dt <= scene.courant * scene.spacing
    assert whole(steps_needed(scene, scene.frame_time, 1e6, 0.0, on_grid=True)) == scene.largest_substeps
    assert whole(steps_needed(scene, scene.frame_time, 0.0, 5.0, on_grid=True)) == scene.substeps
    assert whole(steps_needed(scene, scene.frame_time, 0.0, 0.0, on_grid=True, forced=True)) == 2
    assert whole(steps_needed(scene, scene.frame_time, 0.0, 0.0, on_grid=False)) == 2


def test_a_filled_frame_needs_fewer_steps_and_none_longer():
    lengths = set()
    for needed in np.linspace(0.1, 8.0, 500):
        share = filled_share(needed)
        steps = whole(share * needed)
        assert 0.5 <= share <= 1.0
        assert share * needed <= steps + 1e-6, "steps are not longer than allowed"
        assert steps / share <= whole(needed), "nor are there more of them in a second"
        if share < 1.0:
            assert 1.1 * steps / share <= whole(needed), "it has to be worth a frame more"
            lengths.add(round(share / steps, 6))
    assert filled_share(1.4) == pytest.approx(2**-0.5)
    assert filled_share(2.0) == filled_share(1.0) == filled_share(0.0) == 1.0
    assert len(lengths) <= 24, "few lengths, so that launches are known"


def test_frames_that_are_filled_keep_the_courant_number():
    """A dam break in frames that end with a time step: v dt <= courant d as before, in a fifth fewer steps."""
    scene = wt.Scene.load("dam-break-2d")
    steps = {}
    for fills in (False, True):
        world, steps[fills], lengths = Simulation(scene), 0, set()
        while world.time < 1.0:
            duration = world.full_steps_time(scene.frame_time) if fills else scene.frame_time
            fastest = largest_speed(world.world.particles, world.count) + 9.81 * duration
            world.advance(duration)
            steps[fills] += world.time_steps
            lengths.add(duration)
            assert fastest * duration / world.time_steps <= scene.courant * scene.spacing * 1.001
        assert (len(lengths) > 2) is fills
    assert steps[True] < 0.85 * steps[False]


def test_nothing_has_neither_speed_nor_depth():
    world = Simulation(wt.Scene(spacing=0.1, gravity=(0, 0), fluids=[]))
    assert largest_speed(world.world.particles, 0) == 0.0
    assert pool_depth(world.world.particles, 0, (0.0, 0.0), np.zeros(2), np.ones(2)) == 0.0


@pytest.mark.parametrize("on_grid", [0.0, 1.0])
def test_deep_water_of_fine_particles_does_not_boil(on_grid):
    """80 layers in one metre: with five steps a frame they fall into themselves and bounce (notebook/time-steps.md)."""
    world = Simulation(pool(1.0, 0.0125, grid_pressure=on_grid))
    for _ in world.frames(0.8, 20):
        pass
    x, v = world.positions, world.velocities
    assert 2.0 * x[:, 1].mean() == pytest.approx(1.0, abs=0.02)
    assert np.sqrt((v**2).sum(1).mean()) < 0.1

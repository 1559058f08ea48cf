import math

import numpy as np
import pytest
from foam_worlds import with_diffuse

import wavetank as wt
from wavetank.physics.foam.update import BUBBLE_RISE, MOST_FRAMES, SPRAY_DRAG, air


def pool_of_water(dim: int, **keys) -> wt.Scene:
    """Half a metre of water in a tank of a metre."""
    size, upper = (0.5, 1.0, 0.5)[:dim], (0.5, 0.5, 0.5)[:dim]
    return wt.Scene(
        **{"spacing": 0.05, "tank": wt.Tank(size=size), "fluids": [wt.Block(lower=(0.0,) * dim, upper=upper)], **keys}
    )


def size_and_speed(scene: wt.Scene) -> tuple[float, float]:
    """L [m] and U [m/s] of the scene's water."""
    length = scene.spacing * len(scene.particles()[0]) ** (1 / scene.dim)
    return length, math.sqrt(math.hypot(*scene.gravity) * length)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("frame_time", [1 / 60, 1 / 25])
def test_spray_flies_on_the_parabola_with_drag(dim, frame_time):
    """x'' = g - k x' exactly: x = x_0 + v_t t + (v_0 - v_t) (1 - e^(-k t)) / k with v_t = g / k; for any time step."""
    g = (0.7, -9.81, 0.3)[:dim]
    water = wt.Block(lower=(0.0,) * dim, upper=(0.2,) * dim)
    scene = wt.Scene(spacing=0.05, gravity=g, fluids=[water], frame_time=frame_time)
    x0 = np.array([[3.0, 5.0, 2.0][:dim], [-4.0, 8.0, 0.0][:dim]])
    v0 = np.array([[2.0, 3.0, -1.0][:dim], [0.0, 0.0, 0.0][:dim]])
    sim = with_diffuse(scene, x0, v0)
    for _ in range(20):
        sim.step()
    length, speed = size_and_speed(scene)
    k, t = SPRAY_DRAG * speed / length, 20 * frame_time
    final = np.array(g) / k
    np.testing.assert_allclose(
        sim.foam_positions, x0 + final * t + (v0 - final) * (1 - math.exp(-k * t)) / k, atol=1e-5
    )
    np.testing.assert_allclose(sim.frame().foam_velocities, final + (v0 - final) * math.exp(-k * t), atol=1e-5)
    assert (sim.foam_kinds == 1).all()


def test_without_gravity_spray_keeps_its_velocity():
    scene = wt.Scene(spacing=0.1, gravity=(0, 0, 0), fluids=[wt.Points(positions=[(0.0, 0.0, 0.0)])])
    sim = with_diffuse(scene, [(1.0, 2.0, 3.0)], [(1.0, -2.0, 0.5)])
    for _ in range(30):
        sim.step()
    np.testing.assert_allclose(sim.foam_positions, [(1.5, 1.0, 3.25)], atol=1e-5)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_bubble_rises_at_its_terminal_speed_and_becomes_foam(dim):
    """Buoyancy against linear drag: BUBBLE_RISE U above the water's own velocity."""
    scene = pool_of_water(dim)
    start = np.array([[0.25, 0.1, 0.25][:dim]])
    sim = with_diffuse(scene, start)
    _, speed = size_and_speed(scene)
    sim.advance(0.15)  # the start is over after a twentieth of L / U
    low = sim.foam_positions[0]
    sim.advance(0.6)
    assert sim.foam_kinds[0] == 3
    assert (sim.foam_positions[0] - low)[1] / 0.6 == pytest.approx(BUBBLE_RISE * speed, rel=0.07)
    sim.advance(2.0)
    assert sim.foam_kinds[0] == 2
    assert sim.foam_positions[0][1] == pytest.approx(0.5, abs=1.2 * scene.spacing)


def test_each_looks_around_once_in_an_interval():
    """Much water changes little in a frame: particles take turns, and a glass of water is looked at in every frame."""
    for edge, every in ((0.5, 2), (0.1, 1)):
        water = wt.Block(lower=(0, 0, 0), upper=(edge,) * 3, velocity=(3.0, 0.0, 0.0))
        scene = wt.Scene(spacing=edge / 10, gravity=(0, 0, 0), attraction=0.0, fluids=[water])
        falling = scene.changed(gravity=(0.0, -9.81, 0.0))
        assert air(falling, 1000, 1 / 60).every == every
        assert air(falling, 1000, 1 / 240).every == MOST_FRAMES
    sim = with_diffuse(scene.changed(frame_time=1e-4), np.full((4, 3), 0.5 * edge))  # ids 0 to 3, in the middle
    sim.step()
    assert sim.foam_kinds.tolist() == [3, 1, 3, 1]
    sim.step()
    assert sim.foam_kinds.tolist() == [3, 3, 3, 3]


def test_foam_drifts_with_the_water():
    """A block of water moves through free space; what floats at its surface stays there."""
    block = wt.Block(lower=(0, 0, 0), upper=(0.5, 0.5, 0.5), velocity=(2.0, 0.0, 0.0))
    scene = wt.Scene(spacing=0.05, gravity=(0, 0, 0), attraction=0.0, fluids=[block])
    sim = with_diffuse(scene, [(0.25, 0.5, 0.25), (0.5, 0.25, 0.25), (0.0, 0.25, 0.25)], [(2.0, 0.0, 0.0)] * 3)
    sim.advance(MOST_FRAMES / 60)  # until each has looked around
    before = sim.foam_positions
    assert (sim.foam_kinds == 2).all()
    sim.advance(0.5)
    np.testing.assert_allclose(sim.foam_positions - before, np.tile((1.0, 0.0, 0.0), (3, 1)), atol=0.02)


@pytest.mark.parametrize("dim", [2, 3])
def test_what_a_particle_is_follows_from_the_water_around_it(dim):
    """Below, at and above a still surface, in the middle and at a wall, which must not be taken for a surface."""
    scene = pool_of_water(dim)
    d = scene.spacing
    places = [(x, y) for x in (0.25, 0.3 * d) for y in (0.3 * d, 0.25, 0.5, 0.5 + 1.5 * d)]
    expected = [3, 3, 2, 1] * 2
    sim = with_diffuse(scene, [(x, y, 0.25)[:dim] for x, y in places])
    sim.advance(MOST_FRAMES / 60)  # until each has looked around
    assert sim.foam_kinds.tolist() == expected


@pytest.mark.parametrize("speed", [1.0, 30.0])
@pytest.mark.parametrize("dim", [2, 3])
def test_spray_does_not_enter_solids(dim, speed):
    ball = wt.Sphere(center=(0.5, 0.6, 0.5)[:dim], radius=0.12)
    box = wt.Box(center=(0.2, 0.3, 0.5)[:dim], size=(0.02, 0.4, 0.6)[:dim])
    scene = wt.Scene(
        spacing=0.05,
        tank=wt.Tank(size=(1.0,) * dim),
        solids=[ball, box],
        fluids=[wt.Block(lower=(0.6,) + (0.0,) * (dim - 1), upper=(0.8,) + (0.1,) * (dim - 1))],
    )
    rng = np.random.default_rng(0)
    x = rng.uniform(0.02, 0.98, (3000, dim))
    center = np.array((0.5, 0.6, 0.5)[:dim])
    low, high = np.array((0.19, 0.1, 0.2)[:dim]), np.array((0.21, 0.5, 0.8)[:dim])
    x = x[(np.linalg.norm(x - center, axis=1) > 0.15) & ~np.all((x > low - 0.02) & (x < high + 0.02), axis=1)]
    sim = with_diffuse(scene, x, rng.normal(0, speed, x.shape))
    for _ in range(40):
        sim.step()
        at = sim.foam_positions
        assert len(at) == len(x)
        assert np.all((at >= 0) & (at <= 1))
        assert (np.linalg.norm(at - center, axis=1) > 0.12).all()
        assert not np.all((at > low) & (at < high), axis=1).any()


def test_a_moving_solid_pushes_spray_aside():
    paddle = wt.Box(name="paddle", center=(0.1, 0.5, 0.5), size=(0.1, 0.98, 0.98))
    scene = wt.Scene(
        spacing=0.05,
        tank=wt.Tank(size=(1.0, 1.0, 1.0)),
        solids=[paddle],
        gravity=(0, -1e-3, 0),
        fluids=[wt.Block(lower=(0.8, 0, 0), upper=(1.0, 0.1, 1.0))],
    )
    x = np.random.default_rng(0).uniform(0.2, 0.5, (500, 3)) * (1, 1, 1) + (0, 0.3, 0.2)
    sim = with_diffuse(scene, x)
    for k in range(20):
        center = 0.1 + 0.025 * (k + 1)  # 1.5 m/s
        sim.move("paddle", position=(center, 0.5, 0.5))
        sim.step()
        assert sim.foam_positions[:, 0].min() > center + 0.05


@pytest.mark.parametrize("dim", [2, 3])
def test_everything_ends_at_its_age(dim):
    life = np.array([0.1, 0.2, 0.3, 5.0], np.float32)
    scene = pool_of_water(dim, gravity=(0.0, -1e-6, 0.0)[:dim])
    sim = with_diffuse(scene, [(0.25, 0.9, 0.25)[:dim]] * 4, life=life)
    for _ in range(30):
        sim.step()
        assert sim.frame().foam_ids.tolist() == [k for k in range(4) if life[k] > sim.time + 1e-6]
        np.testing.assert_allclose(sim.foam_ages, sim.time, rtol=1e-5)

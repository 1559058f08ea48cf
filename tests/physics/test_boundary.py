import math

import numpy as np
import pytest

import wavetank as wt
from wavetank.simulation.simulation import Simulation


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("kernel", ["spiky", "cubic", "poly6-spiky"])
def test_a_full_tank_reads_rest_density_on_its_faces(dim, kernel):
    """A lattice that fills a tank: inside and on flat walls rho_0 exactly; the product rule keeps edges close."""
    n, d = 8, 0.05
    scene = wt.Scene(
        spacing=d,
        kernel=kernel,
        tank=wt.Tank(size=(n * d,) * dim),
        fluids=[wt.Block(lower=(0,) * dim, upper=(n * d,) * dim)],
    )
    sim = Simulation(scene)
    layers = np.round(sim.positions / d - 0.5).astype(int)
    walls = np.sum((layers < 2) | (layers >= n - 2), axis=1)
    rho = sim.densities / scene.rest_density
    np.testing.assert_allclose(rho[walls <= 1], 1.0, atol=2e-4)
    assert np.abs(rho[walls > 1] - 1.0).max() < 0.04


def test_a_solid_is_a_wall_like_any_other():
    """A box that replaces the lower part of the tank adds the same density as the tank's floor did."""
    d, tank, weightless = 0.05, wt.Tank(size=(0.4, 0.8, 0.4)), (0.0, 0.0, 0.0)  # so that both begin as their rows
    low = wt.Scene(spacing=d, tank=tank, gravity=weightless, fluids=[wt.Block(lower=(0, 0, 0), upper=(0.4, 0.3, 0.4))])
    high = wt.Scene(
        spacing=d,
        tank=tank,
        gravity=weightless,
        fluids=[wt.Block(lower=(0, 0.2, 0), upper=(0.4, 0.5, 0.4))],
        solids=[wt.Box(center=(0.2, 0.05, 0.2), size=(1.0, 0.3, 1.0))],
    )
    np.testing.assert_allclose(Simulation(low).densities, Simulation(high).densities, rtol=1e-4)


@pytest.mark.parametrize("speed", [5.0, 50.0, 500.0])
@pytest.mark.parametrize("dim", [2, 3])
def test_nothing_passes_a_thin_plate(speed, dim):
    """Particles at up to two thousand spacings per second against a plate one spacing thick."""
    d = 0.05
    plate = wt.Box(center=(0.5,) * dim, size=(d, 4.0, 4.0)[:dim], rotation=0.3)
    rng = np.random.default_rng(0)
    x = rng.uniform(0.05, 0.95, (200, dim)) * np.array((0.2, 1, 1)[:dim])
    v = np.tile(np.array((speed, 0.3 * speed, -0.2 * speed)[:dim]), (200, 1))
    scene = wt.Scene(
        spacing=d, tank=wt.Tank(size=(1.0,) * dim), solids=[plate], fluids=[wt.Points(positions=x, velocities=v)]
    )
    sim = Simulation(scene)
    normal = np.array([np.cos(0.3), np.sin(0.3), 0.0][:dim])
    side = np.sign((sim.positions - 0.5) @ normal)
    assert (side < 0).sum() > 0
    for _ in range(30):
        sim.step()
        np.testing.assert_array_equal(np.sign((sim.positions - 0.5) @ normal), side)
        assert np.all((sim.positions >= 0) & (sim.positions <= 1))


def test_a_cup_holds_its_water_while_it_moves():
    """Walls one spacing thick, carried and tipped at 1.5 m/s: no particle inside ever gets out through the wall."""
    d = 0.02
    cup = wt.Difference(
        name="cup",
        center=(0.4, 0.4, 0.4),
        parts=[
            wt.Box(center=(0, 0, 0), size=(0.24, 0.24, 0.24)),
            wt.Box(center=(0, d, 0), size=(0.24 - 2 * d, 0.24, 0.24 - 2 * d)),
        ],
    )
    inside = wt.Block(lower=(0.31, 0.31, 0.31), upper=(0.49, 0.41, 0.49))
    sim = Simulation(wt.Scene(spacing=d, tank=wt.Tank(size=(0.8, 0.8, 0.8)), solids=[cup], fluids=[inside]))
    last = sim.positions - 1e9
    for k in range(90):
        center = np.array([0.4 + 0.08 * np.sin(0.3 * k), 0.4 + 0.02 * np.sin(0.4 * k), 0.4])
        sim.move("cup", position=center)
        sim.step()
        local = sim.positions - center
        if k:
            # Over the rim is allowed, through a wall is not.
            held = (np.abs(last[:, [0, 2]]).max(axis=1) < 0.1) & (last[:, 1] > -0.1) & (last[:, 1] < 0.06)
            out = (np.abs(local[:, [0, 2]]).max(axis=1) > 0.12) | (local[:, 1] < -0.12)
            assert held.sum() > 100
            assert not (held & out).any()
        last = local


def test_friction_slows_the_water_at_a_wall():
    def slide(friction: float) -> float:
        block = wt.Block(lower=(0.1, 0, 0.0), upper=(0.3, 0.1, 0.2), velocity=(1.0, 0, 0))
        scene = wt.Scene(spacing=0.02, tank=wt.Tank(size=(1.2, 0.4, 0.2)), fluids=[block], friction=friction)
        sim = Simulation(scene)
        sim.advance(0.3)
        return float(sim.positions[:, 0].mean())

    assert slide(0.5) < slide(0.0) - 0.01


def test_an_impossible_squeeze_stays_in_the_tank():
    """A piston at the far wall leaves no room: particles may overlap, but none leaves the tank and none is NaN."""
    piston = wt.Box(name="piston", center=(0.1, 0.2, 0.2), size=(0.1, 0.4, 0.4))
    scene = wt.Scene(
        spacing=0.04,
        tank=wt.Tank(size=(0.6, 0.4, 0.4)),
        solids=[piston],
        fluids=[wt.Block(lower=(0.2, 0, 0), upper=(0.6, 0.4, 0.4))],
    )
    sim = Simulation(scene)
    for k in range(40):
        sim.move("piston", position=(0.1 + 0.0125 * k, 0.2, 0.2))
        sim.step()
        assert np.isfinite(sim.positions).all()
        assert np.all((sim.positions >= 0) & (sim.positions <= np.array(scene.tank.size)))


def test_a_solid_that_stands_in_the_water_pushes_none_through_a_wall():
    """The way out of the block leads through the lid, which is farther from the water than it feels."""
    d = 0.02
    block = wt.Box(name="block", center=(0.3, 0.5), size=(0.4, 0.42))
    x = d * np.stack(np.meshgrid(np.arange(10, 20), np.arange(15, 30), indexing="ij"), -1).reshape(-1, 2)
    tank = wt.Tank(size=(0.6, 0.7))
    water = wt.Points(positions=x.tolist())
    sim = Simulation(wt.Scene(spacing=d, gravity=(0.0, 0.0), tank=tank, fluids=[water], solids=[block]))
    for _ in range(3):
        sim.step()
        assert np.all((sim.positions >= 0.0) & (sim.positions <= np.array(tank.size, np.float32)))


@pytest.mark.parametrize(
    "solid",
    [wt.Sphere(center=(0.51, 0.22), radius=0.15), wt.Box(center=(0.5, 0.2), size=(0.4, 0.3), rotation=0.4)],
    ids=["sphere", "box"],
)
def test_water_around_a_solid_begins_at_rest(solid):
    """A block of water that is drawn over a solid leaves it out; pushed out, it would begin at 4 m/s."""
    water = wt.Block(lower=(0, 0), upper=(1.0, 0.5))
    sim = Simulation(wt.Scene(spacing=0.025, tank=wt.Tank(size=(1.0, 1.0)), fluids=[water], solids=[solid]))
    left_out = 1.0 - sim.count / 800
    area = math.pi * 0.15**2 if solid.shape == "sphere" else 0.12
    assert left_out == pytest.approx(area / 0.5, rel=0.15)
    sim.step()
    assert sim.stats()["density_error_max"] < 0.01
    for _ in range(30):
        sim.step()
    assert sim.stats()["speed_max"] < 0.8


def test_places_that_a_scene_gives_are_kept_and_no_water_is_said():
    box = wt.Box(center=(0.3, 0.3), size=(0.2, 0.2))
    tank = wt.Tank(size=(0.6, 0.6))
    given = Simulation(wt.Scene(spacing=0.05, tank=tank, fluids=[wt.Points(positions=[[0.3, 0.3]])], solids=[box]))
    assert given.count == 1
    with pytest.raises(wt.WavetankError, match="inside of its solids"):
        Simulation(
            wt.Scene(spacing=0.05, tank=tank, fluids=[wt.Block(lower=(0.25, 0.25), upper=(0.35, 0.35))], solids=[box])
        )

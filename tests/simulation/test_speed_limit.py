"""The speed limit holds back particles that are thrown, and no flow."""

import numpy as np
import pytest

import wavetank as wt
from wavetank.device.compiler import upload
from wavetank.simulation.simulation import Simulation

SPEED = 0.5  # m/s, of a piston


def pushed_through_a_neck(spacing, frame_time) -> Simulation:
    """Weightless water in a duct 0.4 m high that ends in a neck 0.1 m high; a piston drives it out."""
    solids = [wt.Box(center=(1.0, y), size=(0.4, 0.15)) for y in (0.075, 0.325)]
    motion = wt.Motion(position=(f"-0.1 + {SPEED} * t", 0.2))
    solids.append(wt.Box(name="piston", center=(-0.1, 0.2), size=(0.2, 0.4), motion=motion))
    water = [wt.Block(lower=(0, 0), upper=(0.8, 0.4)), wt.Block(lower=(0.8, 0.15), upper=(1.2, 0.25))]
    tank = wt.Tank(size=(2.4, 0.4))
    return Simulation(
        wt.Scene(spacing=spacing, gravity=(0, 0), frame_time=frame_time, tank=tank, fluids=water, solids=solids, foam=0)
    )


@pytest.mark.parametrize(("spacing", "frame_time"), [(0.02, 1 / 60), (0.02, 1 / 120), (0.0125, 1 / 60)])
def test_water_runs_through_a_neck_as_fast_as_a_piston_drives_it(spacing, frame_time):
    """Continuity: U H. At twice the piston's speed, the limit of old, water was pressed to density errors of 0.07."""
    sim = pushed_through_a_neck(spacing, frame_time)
    sim.advance(0.3)
    flows = []
    for _ in range(20):
        sim.advance(0.02)
        x, v = sim.positions, sim.velocities
        flows.append(v[(x[:, 0] > 0.9) & (x[:, 0] < 1.1), 0].sum() * spacing**2 / 0.2)
    assert np.mean(flows) == pytest.approx(SPEED * 0.4, rel=0.08)
    assert sim.stats()["density_error_mean"] < 0.003


def test_what_flies_apart_is_held_back():
    """As many particles at the limit, but not one way: none is faster than the limit."""
    corner = np.stack(np.meshgrid(np.arange(20), np.arange(20)), -1).reshape(-1, 2)
    water = wt.Points(positions=0.3 + 0.02 * corner)
    sim = Simulation(wt.Scene(spacing=0.02, tank=wt.Tank(size=(1, 1)), gravity=(0, -0.1), fluids=[water], foam=0))
    way = sim.positions - 0.49
    upload(sim.world.particles.v, 3.0 * way / np.linalg.norm(way, axis=1)[:, None])
    sim.particles.outdated = True
    limit = sim._speed_limit(1 / 60)
    for _ in range(5):
        sim.step()
        assert np.linalg.norm(sim.velocities, axis=1).max() < 1.001 * limit
    assert sim.counters.lift == 1.0


def test_a_lifted_limit_is_part_of_a_state(tmp_path):
    sim = pushed_through_a_neck(0.02, 1 / 60)
    assert "lift" not in sim.counters.plain()
    sim.advance(0.2)
    assert sim.counters.lift > 1.0
    sim.save(tmp_path / "state.npz")
    again = Simulation.restore(tmp_path / "state.npz")
    assert again.counters.lift == sim.counters.lift
    sim.advance(0.1)
    again.advance(0.1)
    assert again.digest() == sim.digest()


def test_a_limit_below_one_is_kept():
    sim = pushed_through_a_neck(0.02, 1 / 60)
    sim.speed_limit = 0.9
    sim.advance(0.2)
    assert np.linalg.norm(sim.velocities, axis=1).max() <= 0.9 * 2.0 * SPEED * 1.01

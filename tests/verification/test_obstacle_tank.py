"""The default scene as a user sees it first, until the wave is back from the far wall; coarser for six seconds."""

import numpy as np
import pytest

import wavetank as wt
from wavetank.physics.measure import density_error
from wavetank.simulation.simulation import Simulation


@pytest.fixture(scope="module", params=[(0.025, 21952, 1.5), (0.04, 5184, 6.0)], ids=["as it is", "for long"])
def run(request):
    spacing, count, seconds = request.param
    sim = Simulation(wt.Scene.load("obstacle-tank").changed(spacing=spacing))
    assert sim.count == count
    rows = [(sim.positions, sim.velocities, sim.densities, sim.stats())]
    for _ in range(round(10 * seconds)):
        sim.advance(0.1)
        rows.append((sim.positions, sim.velocities, sim.densities, sim.stats()))
    return sim, rows


def test_no_particle_leaves_the_tank_or_enters_the_obstacle(run):
    sim, rows = run
    pillar = sim.scene.solids[0]
    for x, _, _, _ in rows:
        assert x.shape == (sim.count, 3)
        assert np.isfinite(x).all()
        assert np.all((x >= 0) & (x <= np.array(sim.scene.tank.size, np.float32)))
        assert not np.all(np.abs(x - pillar.center) < np.array(pillar.size) / 2, axis=1).any()


def test_the_water_is_not_compressed(run):
    sim, rows = run
    errors = [density_error(rho, sim.scene.rest_density) for _, _, rho, _ in rows]
    assert np.mean([error.mean() for error in errors]) < 0.005
    assert max(np.percentile(error, 99) for error in errors) < 0.02
    np.testing.assert_array_less([error.mean() for error in errors], 0.006)


def test_nothing_is_faster_than_gravity_can_make_it(run):
    """A free fall through the whole tank: v^2 = 2 g H."""
    sim, rows = run
    limit = np.sqrt(2 * 9.81 * sim.scene.tank.size[1])
    assert max(np.linalg.norm(v, axis=1).max() for _, v, _, _ in rows) <= limit * (1 + 1e-5)


def test_energy_only_falls(run):
    _, rows = run
    energy = np.array([s["kinetic_energy"] + s["potential_energy"] for _, _, _, s in rows])
    assert np.diff(energy).max() < 0.01 * energy[0]
    assert np.max(energy - np.minimum.accumulate(energy)) < 0.01 * energy[0]
    assert energy[-1] < energy[0]

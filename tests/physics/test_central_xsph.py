"""Viscosity in the open: pairs are damped along their line, and the torque of the constraint is made up for."""

import numpy as np
import pytest
from clouds import Cloud

import wavetank as wt
from wavetank.physics.terms.central_xsph import apply_central_xsph
from wavetank.physics.terms.xsph_viscosity import pack_velocities
from wavetank.simulation.simulation import Simulation


def smoothed(cloud: Cloud, multipliers: np.ndarray) -> np.ndarray:
    """Velocities after the pass, float64 [count, dim]."""
    world = cloud.world
    lam = np.zeros(world.temporaries.lam.shape, np.float32)
    lam[: cloud.count] = multipliers
    world.temporaries.lam.from_numpy(lam)
    packed = world.fluids.array("packed")
    pack_velocities(packed, world.particles, world.temporaries.lam, cloud.count)
    apply_central_xsph(world.spare, world.particles, packed, world.grid, cloud.c, cloud.count, cloud.method)
    return world.spare.v.to_numpy()[: cloud.count].astype(np.float64)


def spin(x: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Angular momentum over the mass of a particle [m^2/s]."""
    x, v = (np.pad(a, ((0, 0), (0, 3 - a.shape[1]))) for a in (x, v))
    return np.cross(x, v).sum(axis=0)


@pytest.mark.parametrize("dim", [2, 3])
def test_damping_along_the_line_keeps_both_momenta_and_takes_energy(dim):
    cloud = Cloud(dim, viscosity=0.3, calming=0.0)
    v = smoothed(cloud, np.zeros(cloud.count))
    scale = np.abs(cloud.v).sum()
    assert np.abs((v - cloud.v).sum(axis=0)).max() < 1e-6 * scale
    assert np.abs(spin(cloud.x, v) - spin(cloud.x, cloud.v)).max() < 1e-6 * scale
    assert np.sum(v**2) < 0.95 * np.sum(cloud.v**2)
    n = cloud.r / np.maximum(cloud.distance, 1e-12)[..., None]
    along = np.einsum("ijk,ijk->ij", cloud.v[None] - cloud.v[:, None], n)
    weights = dim * cloud.c.viscosity * cloud.w() * cloud.mass_over_rest_density()
    expected = cloud.v + np.einsum("ij,ijk->ik", weights * along, n)
    np.testing.assert_allclose(v, expected, atol=1e-5 * np.abs(expected).max())


@pytest.mark.parametrize("dim", [2, 3])
def test_the_torque_of_a_push_is_what_is_made_up_for(dim):
    """Displacements sigma r of a pair change its angular momentum by sigma r x v; the pass takes that back."""
    cloud = Cloud(dim, viscosity=0.0, calming=0.0, kernel="cubic")
    rng = np.random.default_rng(1)
    lam = -rng.uniform(0.0, 1e-5, cloud.count)
    change = spin(cloud.x, smoothed(cloud, lam)) - spin(cloud.x, cloud.v)
    pushes = np.einsum("ij,ijk->ik", lam[:, None] + lam[None], cloud.grad_w() * cloud.mass_over_rest_density())
    pushed = spin(pushes, cloud.v)  # the constraint moves particles that go on with the velocities they have
    assert np.abs(pushed).max() > 1e-4
    np.testing.assert_allclose(change, -pushed, atol=2e-3 * np.abs(pushed).max())


@pytest.mark.parametrize("gravity", [0.0, 9.81])
def test_two_drops_keep_their_angular_momentum_in_the_open(gravity):
    """`validate momentum`, coarse, in free space and in free fall: Eq. 11 as it stands loses 1.6 % of it here."""
    balls = [
        wt.Ball(center=(-0.25, -0.06, 0), radius=0.2, velocity=(2, 0, 0)),
        wt.Ball(center=(0.25, 0.06, 0), radius=0.2, velocity=(-1, 0, 0.5)),
    ]
    sim = Simulation(wt.Scene(spacing=0.04, gravity=(0, -gravity, 0), fluids=balls))

    def turning():
        x, v = sim.positions.astype(float), sim.velocities.astype(float)
        return np.cross(x - x.mean(axis=0), v).sum(axis=0)

    start = turning()
    for _ in range(30):
        sim.step()
        assert np.linalg.norm(turning() - start) < 0.005 * np.linalg.norm(start)


def test_a_pool_in_the_open_comes_to_rest():
    """In a basin of solids instead of a tank, where the pass makes up for half of what the pushes damp."""
    walls = [wt.Box(center=(x, 0.2), size=(0.1, 0.5)) for x in (-0.05, 0.45)]
    floor = wt.Box(center=(0.2, -0.05), size=(0.8, 0.1))
    sim = Simulation(
        wt.Scene(
            spacing=0.01, gravity=(0, -9.81), solids=[*walls, floor], fluids=[wt.Block(lower=(0, 0), upper=(0.4, 0.2))]
        )
    )
    sim.advance(4.0)
    assert np.linalg.norm(sim.velocities, axis=1).max() < 0.01
    assert 2.0 * sim.positions[:, 1].mean() == pytest.approx(0.2, rel=0.01)

"""The report's equations, each against a sum over all pairs in double precision."""

import dataclasses

import numpy as np
import pytest
from clouds import Cloud

import wavetank as wt
from wavetank.physics.coefficients import coefficients
from wavetank.physics.density_constraint import correct_positions, schedule, start_multipliers
from wavetank.physics.terms.vorticity import confine_vorticity
from wavetank.physics.terms.xsph_viscosity import apply_xsph

CASES = [(2, "spiky"), (3, "spiky"), (3, "poly6-spiky"), (2, "cubic"), (3, "wendland")]
cases = pytest.mark.parametrize(("dim", "kernel"), CASES)


def solve(cloud: Cloud) -> None:
    world, count = cloud.world, cloud.count
    start_multipliers(
        world.temporaries, world.particles, world.grid, world.solids, world.walls, cloud.c, count, cloud.method, 0
    )
    correct_positions(
        world.spare,
        world.particles,
        world.temporaries,
        world.temporaries.dlam,
        world.grid,
        world.solids,
        world.walls,
        cloud.c,
        count,
        cloud.method,
        int(cloud.scene.tensile_strength > 0),
        0,
    )


def smooth(cloud: Cloud, turning: int) -> None:
    world, grid = cloud.world, cloud.world.grid
    apply_xsph(world.spare, world.particles, world.temporaries, grid, cloud.c, cloud.count, cloud.method, turning)


def multipliers(cloud: Cloud) -> np.ndarray:
    """Eq. 2, 4, 5, bilateral, over all pairs."""
    volume = cloud.mass_over_rest_density()
    constraint = volume * cloud.w().sum(axis=1) - 1.0  # Eq. 1, 2
    grad = volume * cloud.grad_w()
    squares = np.sum(np.sum(grad, axis=1) ** 2, axis=1) + np.sum(grad**2, axis=(1, 2))  # k = i and k = j
    return -constraint / (squares + cloud.c.eps)


@cases
def test_density_eq_1(dim, kernel):
    cloud = Cloud(dim, kernel=kernel)
    expected = cloud.scene.rest_density * cloud.mass_over_rest_density() * cloud.w().sum(axis=1)
    np.testing.assert_allclose(cloud.world.temporaries.rho.to_numpy()[: cloud.count], expected, rtol=2e-5)


@cases
def test_multiplier_eq_5(dim, kernel):
    cloud = Cloud(dim, kernel=kernel, attraction=1.0, force_mixing=0.3)
    solve(cloud)
    expected = multipliers(cloud)
    np.testing.assert_allclose(
        cloud.world.temporaries.lam.to_numpy()[: cloud.count], expected, atol=1e-4 * np.abs(expected).max()
    )


@pytest.mark.parametrize("attraction", [0.0, 0.2])
def test_only_a_share_of_expansion_is_corrected(attraction):
    cloud = Cloud(3, attraction=attraction)
    solve(cloud)
    lam = cloud.world.temporaries.lam.to_numpy()[: cloud.count]
    newton = multipliers(cloud)
    expected = np.where(newton > 0, attraction * newton, newton)
    assert (newton < 0).any()
    assert (newton > 0).any()
    np.testing.assert_allclose(lam, expected, atol=1e-4 * np.abs(expected).max())


@cases
def test_correction_eq_8(dim, kernel):
    """Delta p_i = sum_j (lambda_i + lambda_j + s_corr) grad W m / rho_0, with Eq. 7 for s_corr."""
    cloud = Cloud(dim, kernel=kernel, attraction=1.0, tensile_strength=0.2, iterations=1)
    solve(cloud)
    volume, lam = cloud.mass_over_rest_density(), multipliers(cloud)
    from wavetank.physics.smoothing import NAMES, kernel_shape, rest_lattice

    name = NAMES[kernel][0]
    ratio = kernel_shape(name, cloud.distance / cloud.h)[0] / kernel_shape(name, np.array(0.3))[0]
    s_0 = rest_lattice(kernel, dim, cloud.scene.support).squared_gradients / cloud.h**2
    fall = 9.81 * cloud.c.dt**2 / cloud.scene.spacing  # in a step, in spacings
    s_corr = -0.2 * min(1.0, fall / 0.1089) / s_0 * ratio**4.0
    expected = volume * np.sum((lam[:, None] + lam[None, :] + s_corr)[..., None] * cloud.grad_w(), axis=1)
    moved = cloud.predictions(cloud.world.spare) - cloud.x
    np.testing.assert_allclose(moved, expected, atol=2e-4 * np.abs(expected).max())


@cases
def test_corrections_keep_the_centre_of_mass(dim, kernel):
    """Eq. 8 is antisymmetric in i and j: without walls the corrections sum to zero, to rounding."""
    cloud = Cloud(dim, kernel=kernel, tensile_strength=0.1)
    solve(cloud)
    moved = cloud.predictions(cloud.world.spare) - cloud.x
    assert np.abs(moved.sum(axis=0)).max() < 1e-6 * np.abs(moved).sum()


@cases
def test_vorticity_eq_9(dim, kernel):
    cloud = Cloud(dim, kernel=kernel)
    world = cloud.world
    smooth(cloud, 1)
    v_ij = cloud.v[None, :, :] - cloud.v[:, None, :]
    grad_j = -cloud.grad_w()
    pad = ((0, 0), (0, 0), (0, 3 - dim))
    expected = cloud.mass_over_rest_density() * np.sum(np.cross(np.pad(v_ij, pad), np.pad(grad_j, pad)), axis=1)
    np.testing.assert_allclose(
        world.temporaries.omega.to_numpy()[: cloud.count], expected, atol=1e-4 * np.abs(expected).max()
    )


@pytest.mark.parametrize("dim", [2, 3])
def test_vorticity_confinement_eq_10(dim):
    cloud = Cloud(dim, vorticity=2.0, vorticity_coherence=0.0)
    world = cloud.world
    smooth(cloud, 1)
    omega = world.temporaries.omega.to_numpy()[: cloud.count].astype(np.float64)
    confine_vorticity(world.particles, world.temporaries, world.grid, cloud.c, cloud.count, cloud.method)
    size = np.linalg.norm(omega, axis=1)
    pad = ((0, 0), (0, 0), (0, 3 - dim))
    eta = cloud.mass_over_rest_density() * np.sum(
        (size[None, :] - size[:, None])[..., None] * np.pad(cloud.grad_w(), pad), axis=1
    )
    n = eta / np.maximum(np.linalg.norm(eta, axis=1), 1e-6)[:, None]
    expected = cloud.v + cloud.c.dt * 2.0 * np.cross(n, omega)[:, :dim]
    np.testing.assert_allclose(
        world.particles.v.to_numpy()[: cloud.count], expected, atol=2e-4 * np.abs(expected).max()
    )


def test_calm_water_is_not_pushed():
    """Where the water turns slower than the smallest waves do there is no force, and else there is."""
    cloud = Cloud(3, vorticity=2.0, vorticity_coherence=0.01)
    world = cloud.world
    smooth(cloud, 1)
    size = np.linalg.norm(world.temporaries.omega.to_numpy()[: cloud.count], axis=1)
    c = dataclasses.replace(cloud.c, calm=float(np.median(size)))
    confine_vorticity(world.particles, world.temporaries, world.grid, c, cloud.count, cloud.method)
    pushed = np.any(world.particles.v.to_numpy()[: cloud.count] != cloud.v.astype(np.float32), axis=1)
    assert not pushed[size <= c.calm].any()
    assert pushed[size > 1.5 * c.calm].mean() > 0.8


def test_solid_rotation_has_twice_its_rate_as_vorticity():
    """curl of omega x r is 2 omega; inside a lattice Eq. 9 finds it up to the kernel's lattice error."""
    import wavetank as wt
    from wavetank.physics.coefficients import coefficients
    from wavetank.simulation.simulation import Simulation

    axis = np.arange(-5, 6) * 0.1
    x = np.stack(np.meshgrid(axis, axis, axis), -1).reshape(-1, 3).astype(np.float32)
    v = np.cross([0.0, 0.0, 3.0], x).astype(np.float32)
    sim = Simulation(wt.Scene(spacing=0.1, kernel="cubic", support=2.5, fluids=[wt.Points(positions=x, velocities=v)]))
    sim.frame()
    world = sim.world
    c = coefficients(sim.scene, 0.01)
    apply_xsph(world.spare, world.particles, world.temporaries, world.grid, c, sim.count, 2, 1)
    middle = np.argmin(np.linalg.norm(world.particles.x.to_numpy()[: sim.count], axis=1))
    assert world.temporaries.omega.to_numpy()[middle] == pytest.approx([0, 0, 6], rel=0.05, abs=1e-3)


@pytest.mark.parametrize("turning", [0, 1])
@cases
def test_xsph_eq_11(dim, kernel, turning):
    cloud = Cloud(dim, kernel=kernel, viscosity=0.2, calming=0.0)
    world = cloud.world
    smooth(cloud, turning)
    v_ij = cloud.v[None, :, :] - cloud.v[:, None, :]
    expected = cloud.v + 0.2 * cloud.mass_over_rest_density() * np.sum(v_ij * cloud.w()[..., None], axis=1)
    np.testing.assert_allclose(world.spare.v.to_numpy()[: cloud.count], expected, atol=1e-5 * np.abs(expected).max())


@pytest.mark.parametrize("spacing", [0.01, 0.03])
def test_xsph_makes_up_for_what_a_fluid_s_own_viscosity_lacks(spacing):
    """XSPH has a kinematic viscosity of 24 c d^2 /s; with a fluid that has half of that it takes half of its share."""
    water = wt.Block(lower=(0, 0), upper=(0.1, 0.1))
    params, own = wt.Scene(spacing=spacing, viscosity=0.1, fluids=[water]), 24.0 * 0.1 * spacing**2
    shares = [coefficients(params, 1 / 240, kinematic_viscosity=part * own).viscosity for part in (0.0, 0.5, 1.0, 9.0)]
    np.testing.assert_allclose(shares, [0.1, 0.05, 0.0, 0.0], atol=1e-9)


@pytest.mark.parametrize("turning", [0, 1])
@pytest.mark.parametrize("dim", [2, 3])
def test_slow_motion_is_taken_sooner(dim, turning):
    """Of a velocity difference that is slow, of sqrt(g d), Eq. 11 takes a larger share: `xsph_viscosity.py`."""
    cloud = Cloud(dim, viscosity=0.2, calming=0.9)
    smooth(cloud, turning)
    v_ij = cloud.v[None, :, :] - cloud.v[:, None, :]
    in_a_step = 1.0 - 0.1 ** min(1.0, (9.81 * cloud.c.dt**2 / cloud.scene.spacing / 0.1089) ** 0.5)
    slow = np.maximum(0.0, 1.0 - np.sum(v_ij**2, axis=-1) / (0.1**2 * 9.81 * cloud.scene.spacing))
    share = 0.2 + (in_a_step - 0.2) * slow
    assert np.sum(slow > 0.0) > cloud.count, "some pairs are slow"
    expected = cloud.v + cloud.mass_over_rest_density() * np.sum(v_ij * (share * cloud.w())[..., None], axis=1)
    found = cloud.world.spare.v.to_numpy()[: cloud.count]
    np.testing.assert_allclose(found, expected, atol=1e-5 * np.abs(expected).max())


@pytest.mark.parametrize("turning", [0, 1])
def test_xsph_keeps_momentum(turning):
    cloud = Cloud(3, viscosity=0.5)
    world = cloud.world
    smooth(cloud, turning)
    change = world.spare.v.to_numpy()[: cloud.count].astype(np.float64).sum(axis=0) - cloud.v.sum(axis=0)
    assert np.abs(change).max() < 1e-6 * np.abs(cloud.v).sum()


def test_chebyshev_damps_its_interval_evenly():
    """The error polynomial of the schedule is T_k scaled to one at zero (Saad 2003, Eq. 12.4)."""
    k, a, b = 4, 0.2, 3.0
    steps = schedule(k, a, b)
    for mu in np.linspace(a, b, 30):
        error, change = 1.0, 0.0
        for relaxation, momentum in steps:
            change = -relaxation * mu * error + momentum * change
            error += change
        chebyshev = np.polynomial.chebyshev.Chebyshev.basis(k)
        expected = chebyshev((b + a - 2 * mu) / (b - a)) / chebyshev((b + a) / (b - a))
        assert error == pytest.approx(expected, abs=1e-9)
    assert schedule(3, 0.0, 2.5) == [(0.8, 0.0)] * 3

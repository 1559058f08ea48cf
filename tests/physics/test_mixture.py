"""Fluids of different density: mass-weighted corrections, layers, and what a world of one fluid must not notice."""

import numpy as np
import pytest
from clouds import Cloud

import wavetank as wt
from wavetank.device.compiler import upload
from wavetank.foundation.materials import Material
from wavetank.physics.coefficients import correction_of
from wavetank.physics.density_constraint import correct_positions, start_multipliers
from wavetank.physics.mixture import blend, pack_multipliers, stiffening
from wavetank.physics.terms.xsph_viscosity import apply_mixed_xsph, pack_velocities


def mixed_cloud(dim: int, ratio: float = 100.0, **settings) -> tuple[Cloud, np.ndarray]:
    """A cloud whose particles are heavy or light at random, and its inverse masses."""
    cloud = Cloud(dim, **settings)
    weight = np.where(np.random.default_rng(1).random(cloud.count) < 0.5, 1.0, ratio)
    upload(cloud.world.temporaries.inverse_mass, weight)
    return cloud, weight


def solve(cloud: Cloud, mixed: int, correction: int = 0) -> np.ndarray:
    world = cloud.world
    start_multipliers(
        world.temporaries,
        world.particles,
        world.grid,
        world.solids,
        world.walls,
        cloud.c,
        cloud.count,
        cloud.method,
        mixed,
    )
    changes = world.temporaries.dlam
    correction = correction or 3 * mixed
    if correction > 3:
        changes = world.fluids.array("packed")
        pack_multipliers(changes, world.temporaries, cloud.count)
    correct_positions(
        world.spare,
        world.particles,
        world.temporaries,
        changes,
        world.grid,
        world.solids,
        world.walls,
        cloud.c,
        cloud.count,
        cloud.method,
        correction,
        0,
    )
    return cloud.predictions(world.spare) - cloud.x


@pytest.mark.parametrize("dim", [2, 3])
def test_multiplier_with_inverse_masses(dim):
    """lambda_i = -C_i / (sum_k w_k |grad_k C_i|^2 + w_i eps): Macklin and Müller 2013, Eq. 11, with masses."""
    cloud, w = mixed_cloud(dim, attraction=1.0, force_mixing=0.3)
    moved = solve(cloud, 1)
    volume = cloud.mass_over_rest_density()
    constraint = volume * cloud.w().sum(axis=1) - 1.0
    grad = volume * cloud.grad_w()
    own = np.sum(np.sum(grad, axis=1) ** 2, axis=1)
    squares = w * (own + cloud.c.eps) + np.sum(w[None, :] * np.sum(grad**2, axis=2), axis=1)
    lam = -constraint / squares
    np.testing.assert_allclose(
        cloud.world.temporaries.lam.to_numpy()[: cloud.count], lam, atol=2e-4 * np.abs(lam).max()
    )
    expected = w[:, None] * np.sum((lam[:, None] + lam[None, :])[..., None] * grad, axis=1)
    np.testing.assert_allclose(moved, expected, atol=5e-4 * np.abs(expected).max())


@pytest.mark.parametrize("dim", [2, 3])
def test_corrections_keep_momentum_at_any_ratio(dim):
    """sum m_i dp_i = 0, to rounding of the positions."""
    cloud, w = mixed_cloud(dim)
    momentum = solve(cloud, 1) / w[:, None]
    assert np.abs(momentum.sum(axis=0)).max() < 1e-5 * np.abs(momentum).sum()


@pytest.mark.parametrize("exponent", [3.0, 4.0])
def test_artificial_pressure_moves_the_lighter_of_two_as_among_its_like(exponent):
    """Eq. 7 is a pressure: what it moves particles by would go with the inverse masses, 100 times as far at 1 : 100."""
    cloud, w = mixed_cloud(3, tensile_strength=0.1, tensile_exponent=exponent)
    number = correction_of(cloud.scene, 1)
    moved = solve(cloud, 1, number) - solve(cloud, 1)
    shape = cloud.w() * cloud.mass_over_rest_density() / cloud.c.density_scale
    s_corr = -cloud.c.tensile * shape**exponent / np.maximum(w[:, None], w[None, :])
    expected = w[:, None] * np.sum(s_corr[..., None] * cloud.mass_over_rest_density() * cloud.grad_w(), axis=1)
    np.testing.assert_allclose(moved, expected, atol=2e-3 * np.abs(expected).max())
    momentum = moved / w[:, None]
    assert np.abs(momentum.sum(axis=0)).max() < 1e-4 * np.abs(momentum).sum()


def test_a_fluid_a_hundred_times_lighter_lies_still_on_water():
    """Hydrostatics: nothing moves; artificial pressure threw it about at 0.9 m/s after two seconds."""
    sim = wt.Simulation(two_layers("heavy", "light", 100.0, spacing=0.02))
    sim.advance(0.5)
    fastest = 0.0
    for frame in sim.frames(1.5, 20.0):
        fastest = max(fastest, float(np.linalg.norm(frame.velocities, axis=1).max()))
    assert fastest < 0.01


def test_equal_masses_give_the_result_of_one_fluid():
    cloud = Cloud(3)
    np.testing.assert_allclose(solve(cloud, 0), solve(cloud, 1), atol=1e-6)


@pytest.mark.parametrize("dim", [2, 3])
def test_smoothing_keeps_momentum_and_is_eq_11_for_equal_masses(dim):
    cloud, w = mixed_cloud(dim, viscosity=0.5, calming=0.0)
    world = cloud.world
    packed = world.fluids.array("packed")
    pack_velocities(packed, world.particles, world.temporaries.inverse_mass, cloud.count)
    grid = world.grid
    apply_mixed_xsph(world.spare, world.particles, packed, grid, cloud.c, cloud.count, cloud.method)
    smoothed = world.spare.v.to_numpy()[: cloud.count].astype(np.float64)
    momentum = (smoothed - cloud.v) / w[:, None]
    assert np.abs(momentum.sum(axis=0)).max() < 1e-6 * np.abs(cloud.v).sum()
    share = np.minimum(1.0, w[:, None] / w[None, :]) * cloud.w() * cloud.mass_over_rest_density()
    expected = cloud.v + cloud.c.viscosity * np.sum(share[..., None] * (cloud.v[None] - cloud.v[:, None]), axis=1)
    np.testing.assert_allclose(smoothed, expected, atol=1e-5 * np.abs(expected).max())


def two_layers(lower: str, upper: str, ratio: float, **settings) -> wt.Scene:
    return wt.Scene.parse(
        {
            "spacing": 0.05,
            "tank": {"size": [1.0, 1.0]},
            "materials": [{"name": "heavy", "density": 1000.0}, {"name": "light", "density": 1000.0 / ratio}],
            "fluids": [
                {"lower": [0, 0], "upper": [1, 0.3], "material": lower},
                {"lower": [0, 0.3], "upper": [1, 0.6], "material": upper},
            ],
            **settings,
        }
    )


@pytest.mark.parametrize("ratio", [2.0, 100.0])
def test_layers_stay_and_form(ratio):
    """Archimedes: the heavy fluid ends below, whether it starts there or beside; the light one keeps its volume."""
    beside = [
        {"lower": [0, 0], "upper": [0.5, 0.6], "material": "light"},
        {"lower": [0.5, 0], "upper": [1, 0.6], "material": "heavy"},
    ]
    layers = two_layers("heavy", "light", ratio)
    for scene, seconds in ((layers, 1.0), (layers.changed(fluids=beside), 3.0)):
        sim = wt.Simulation(scene)
        sim.advance(seconds)
        heavy = sim.frame().materials == 1
        y = sim.positions[:, 1]
        assert y[heavy].mean() < 0.25
        assert y[~heavy].mean() > 0.35
        assert np.isfinite(sim.positions).all()
    assert sim.stats()["density_error_mean"] < 0.02


@pytest.mark.parametrize("ratio", [1.5, 10.0])
def test_a_heavy_fluid_above_a_light_one_ends_below_it_to_the_last_drop(ratio):
    """Rayleigh and Taylor's instability ends in layers: least potential energy; single particles hung in the other."""
    sim = wt.Simulation(two_layers("light", "heavy", ratio, spacing=0.04))
    heavy = sim.frame().rest_densities > 999.0
    sim.advance(60.0)
    y = sim.positions[:, 1].astype(float)
    interface = np.sort(y)[heavy.sum() - 1]
    assert y[heavy].max() < interface + 0.04
    assert y[~heavy].min() > interface - 0.04


def test_layers_at_rest_have_the_push_of_one_fluid():
    """What lies level has no weight of its own: the layers beside an interface are as far apart as any."""
    sim = wt.Simulation(two_layers("heavy", "light", 3.0, spacing=0.025))
    heavy = sim.frame().rest_densities > 999.0
    start = sim.positions[:, 1].astype(float)
    sim.advance(5.0)
    rise = sim.positions[:, 1].astype(float) - start
    assert abs(rise[~heavy].mean() - rise[heavy].mean()) < 0.05 * 0.025


def test_densities_and_energies_are_those_of_each_fluid():
    sim = wt.Simulation(two_layers("heavy", "light", 4.0))
    heavy = sim.frame().materials == 1
    np.testing.assert_allclose(np.median(sim.densities[heavy]), 1000.0, rtol=0.01)
    np.testing.assert_allclose(np.median(sim.densities[~heavy]), 250.0, rtol=0.01)
    expected = 9.81 * (1000.0 * 0.3 * 0.15 + 250.0 * 0.3 * 0.45)
    assert sim.stats()["potential_energy"] == pytest.approx(expected, rel=1e-4)


def test_a_saved_mixture_continues_to_the_last_bit(tmp_path):
    sim = wt.Simulation(two_layers("light", "heavy", 3.0))
    sim.advance(0.3)
    sim.save(tmp_path / "state.npz")
    again = wt.Simulation.restore(tmp_path / "state.npz")
    sim.advance(0.2)
    again.advance(0.2)
    np.testing.assert_array_equal(sim.positions, again.positions)
    np.testing.assert_array_equal(sim.frame().materials, again.frame().materials)


def test_materials_of_one_density_cost_nothing():
    params = wt.Scene(spacing=0.1)
    same = blend({1: Material(name="a", density=500.0), 2: Material(name="b", density=500.0)}, params)
    assert (same.mixed, same.largest_density, stiffening(same.density_ratio)) == (0, 500.0, 0.0)
    assert blend({}, params).mixed == 0
    other = blend({1: Material(name="a", density=500.0), 2: Material(name="b")}, params)
    assert (other.mixed, other.density_ratio) == (1, 2.0)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"fluids": [{"lower": [0, 0], "upper": [1, 1], "material": "tar"}]}, "'tar' is not one of .* heavy, light"),
        ({"materials": [{"density": 3.0}], "fluids": []}, "every material needs a name"),
        ({"materials": [{"name": "a"}, {"name": "a"}], "fluids": []}, "the name 'a' is used twice"),
        ({"materials": [{"name": "heavy", "colour": "#000000"}, {"name": "light"}]}, "did you mean 'color'"),
        ({"materials": [{"name": "heavy", "color": "red"}, {"name": "light"}]}, "write it as '#rrggbb'"),
        ({"materials": [{"name": "heavy", "density": 0}, {"name": "light"}]}, "density = 0 is not .* at least 0.001"),
        ({"materials": [{"name": "heavy", "viscosity": 1e15}, {"name": "light"}]}, "at most 1000000"),
    ],
)
def test_mistakes_are_one_sentence(change, says):
    with pytest.raises(wt.WavetankError, match=says):
        two_layers("heavy", "light", 2.0, **change)


def test_new_particles_are_of_the_first_fluid_or_as_told():
    sim = wt.Simulation(two_layers("heavy", "light", 10.0))
    sim.add([[0.5, 0.8]])
    sim.add([[0.6, 0.8]], materials=[2])
    assert sim.frame().materials[-2:].tolist() == [1, 2]
    with pytest.raises(wt.WavetankError, match="materials must be 1 numbers, from 0 .* to 2"):
        sim.add([[0.7, 0.8]], materials=[3])


def test_a_world_that_goes_back_to_one_fluid_weighs_as_one():
    sim = wt.Simulation(two_layers("heavy", "light", 10.0).changed(fluids=[{"lower": [0, 0], "upper": [1, 0.3]}]))
    start = sim.snapshot()
    sim.add([[0.5, 0.8]], materials=[2])
    sim.advance(0.05)
    assert sim.densities.min() < 500.0
    sim.resume(start)
    assert sim.densities.min() > 500.0


def test_room_for_more_keeps_the_fluids():
    sim = wt.Simulation(two_layers("heavy", "light", 10.0))
    sim.add(np.random.default_rng(1).uniform(0.7, 0.9, (sim.count, 2)))
    assert sorted(sim.world.materials) == [1, 2]
    sim.advance(0.02)
    assert sim.densities.min() < 150.0

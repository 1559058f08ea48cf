"""The iterations of viscosity against a direct solve of the same system (Weiler et al. 2018; see the file's head)."""

import numpy as np
import pytest

import wavetank as wt
from wavetank.device.compiler import download, upload
from wavetank.physics.coefficients import coefficients
from wavetank.physics.mixture import blend
from wavetank.physics.terms.dynamic_viscosity import implicit_viscosity
from wavetank.physics.terms.dynamic_viscosity.conjugate_gradients import TOLERANCE
from wavetank.physics.terms.dynamic_viscosity.implicit_viscosity import damper_scale, solve_viscosity
from wavetank.physics.terms.tension import prepare_fluids
from wavetank.simulation.simulation import Simulation

D, DT = 0.05, 1 / 300
THICK, THIN = {"density": 1400.0, "viscosity": 3e4}, {"density": 700.0, "viscosity": 30.0}


def blob(dim: int, side: int, seed: int = 0) -> Simulation:
    """A shaken lattice of two fluids side by side in the open, whose particles move at random."""
    rng = np.random.default_rng(seed)
    places = (np.stack(np.meshgrid(*[np.arange(side)] * dim, indexing="ij"), -1).reshape(-1, dim) + 0.5) * D
    places += rng.normal(0, 0.1 * D, places.shape)
    left = places[:, 0] < 0.5 * side * D
    fluids = [
        wt.Points(positions=places[chosen], velocities=rng.normal(0, 1, (chosen.sum(), dim)), material=name)
        for name, chosen in (("thick", left), ("thin", ~left))
    ]
    materials = [{"name": "thick", **THICK}, {"name": "thin", **THIN}]
    sim = Simulation(wt.Scene(spacing=D, gravity=(0.0,) * dim, materials=materials, fluids=fluids))
    search(sim)
    sim.world.remember_viscosity()
    return sim


def search(sim: Simulation) -> None:
    """Predict nothing and find neighbours where the particles are."""
    sim.particles.outdated = True
    sim.frame()


def velocities(sim: Simulation) -> np.ndarray:
    """Velocities in device order."""
    return download(sim.world.particles.v)[: sim.count].astype(float)


def solve(sim: Simulation, most: int = 1000) -> int:
    world, scene = sim.world, sim.scene
    kinds = blend(world.materials, scene)
    prepare_fluids(world, kinds, scene, DT)
    return solve_viscosity(world, kinds, scene, coefficients(scene, DT), most)


def solved_directly(sim: Simulation) -> tuple[np.ndarray, np.ndarray]:
    """Return v with (1 + dt M^-1 L) v = b of the pairs one by one, and the masses over the largest."""
    x = download(sim.world.particles.x)[: sim.count].astype(float)
    kind = download(sim.world.particles.material)[: sim.count]
    thick = kind == 1
    mu, rho = (np.where(thick, THICK[name], THIN[name]) for name in ("viscosity", "density"))
    count, dim = x.shape
    h = sim.scene.support * D
    away = x[:, None] - x[None]
    length = np.linalg.norm(away, axis=2) + np.eye(count)
    f = np.maximum(1.0 - length / h, 0.0) * (1.0 - np.eye(count))
    pair = 2.0 * np.outer(mu, mu) / np.add.outer(mu, mu) * f / length**2
    blocks = -pair[..., None, None] * away[..., None] * away[..., None, :]
    blocks[np.arange(count), np.arange(count)] = -blocks.sum(axis=1)
    blocks *= (DT * damper_scale(dim, sim.scene.support, D) / rho)[:, None, None, None]
    matrix = np.eye(count * dim) + blocks.transpose(0, 2, 1, 3).reshape(count * dim, count * dim)
    return np.linalg.solve(matrix, velocities(sim).ravel()).reshape(count, dim), rho / rho.max()


@pytest.mark.parametrize(("dim", "side"), [(2, 16), (3, 7)])
def test_velocities_are_right_to_a_part_of_what_viscosity_changes(dim, side):
    """From rest and from what viscosity did before, in the norm of the kinetic energy; momentum is exact."""
    sim = blob(dim, side)
    rng = np.random.default_rng(1)
    numbers = []
    for _ in range(3):
        before = velocities(sim)
        exact, mass = solved_directly(sim)
        numbers.append(solve(sim))
        after = velocities(sim)
        error, change = (np.sqrt(np.sum(mass[:, None] * part**2)) for part in (after - exact, exact - before))
        assert error < TOLERANCE * change
        assert np.abs((mass[:, None] * (after - before)).sum(axis=0)).max() < 1e-5 * np.abs(before).sum()
        # As in the next step: much is as it was, and pressure has pushed a little.
        upload(sim.world.particles.v, before + rng.normal(0, 0.02, before.shape))
        search(sim)
    assert numbers[1] < numbers[0]
    assert numbers[2] < numbers[0]


def test_what_is_at_rest_stays_at_rest():
    sim = blob(2, 10)
    upload(sim.world.particles.v, np.zeros((sim.count, 2)))
    solve(sim)
    assert not velocities(sim).any()


@pytest.mark.parametrize(("viscosity", "density"), [(3e4, 1000.0), (1e6, 1e-3)])
def test_what_is_left_below_rounding_is_not_followed(viscosity, density, monkeypatch):
    """Iterations that go on when there is nothing left to gain, or to tell from rounding, bring no energy back."""
    monkeypatch.setattr("wavetank.physics.terms.dynamic_viscosity.conjugate_gradients.LOOK", 1000)
    monkeypatch.setattr(
        "wavetank.physics.terms.dynamic_viscosity.implicit_viscosity.iterations", lambda stiffest, most: most
    )
    for material in (THICK, THIN):
        monkeypatch.setitem(material, "viscosity", viscosity)
        monkeypatch.setitem(material, "density", density)
    sim = blob(2, 12)
    before = velocities(sim)
    assert solve(sim, 600) == 600
    assert np.sum(velocities(sim) ** 2) < 0.01 * np.sum(before**2)


def honey(**changes) -> Simulation:
    return Simulation(wt.Scene.load("honey-2d").changed(spacing=0.003, **changes))


def iterations_of(forgets: bool, monkeypatch) -> float:
    """Mean number of iterations in a step of honey that falls on the floor, or that starts anew in every step."""
    numbers = []

    def counted(*arguments):
        if forgets:
            arguments[0].particles.viscous.fill(0.0)
        numbers.append(solve_viscosity(*arguments))
        return numbers[-1]

    with monkeypatch.context() as patch:
        patch.setattr(implicit_viscosity, "solve_viscosity", counted)
        honey().advance(0.3)
    return float(np.mean(numbers))


def test_thick_fluids_go_on_where_they_were(monkeypatch):
    assert iterations_of(False, monkeypatch) < 0.7 * iterations_of(True, monkeypatch)


def test_a_saved_state_goes_on_to_the_last_bit(tmp_path):
    sim = honey()
    sim.advance(0.15)
    sim.save(tmp_path / "state.npz")
    instant = sim.snapshot()
    again = Simulation.restore(tmp_path / "state.npz")
    sim.advance(0.1)
    again.advance(0.1)
    np.testing.assert_array_equal(sim.positions, again.positions)
    later = sim.positions
    sim.resume(instant)
    sim.advance(0.1)
    np.testing.assert_array_equal(sim.positions, later)


def test_a_state_from_before_the_first_step_brings_no_pull_back():
    sim = honey()
    instant = sim.snapshot()
    sim.advance(0.1)
    once = sim.positions
    sim.resume(instant)
    sim.advance(0.1)
    np.testing.assert_array_equal(sim.positions, once)


def test_particles_that_go_take_their_pull_along():
    """What is left of a body starts anew: no force of a neighbour who has gone acts on."""
    sim = honey()
    sim.advance(0.1)
    assert download(sim.world.particles.viscous)[: sim.count].any()
    sim.remove(np.arange(10))
    assert not download(sim.world.particles.viscous)[: sim.count].any()
    sim.add(np.full((10, 2), (0.04, 0.15)))
    assert not download(sim.world.particles.viscous)[: sim.count].any()

"""Implicit viscosity: exact rates, momentum, bounds and no-slip (Weiler et al. 2018; see the file's head)."""

import math

import numpy as np
import pytest

import wavetank as wt
from wavetank.device.compiler import download
from wavetank.physics.coefficients import coefficients
from wavetank.physics.density_constraint import schedule
from wavetank.physics.mixture import blend
from wavetank.physics.planning import has_grid_pressure
from wavetank.physics.smoothing import TABLE_SIZE, rest_points
from wavetank.physics.terms.dynamic_viscosity.conjugate_gradients import TOLERANCE
from wavetank.physics.terms.dynamic_viscosity.implicit_viscosity import (
    CARRIED,
    damper_scale,
    drag_table,
    is_viscous,
    iterations,
    solve_viscosity,
    warm_start_of_thick,
)
from wavetank.physics.terms.tension import prepare_fluids
from wavetank.simulation.simulation import Simulation

D, DT = 0.05, 1 / 300


def solved(x: np.ndarray, v: np.ndarray, viscosity: float, most: int = 400, **settings):
    """Positions and velocities, in device order, before and after one solve; the number of iterations."""
    dim = x.shape[1]
    scene = wt.Scene(
        spacing=D,
        gravity=(0.0,) * dim,
        dynamic_viscosity=viscosity,
        fluids=[wt.Points(positions=x, velocities=v)],
        **settings,
    )
    sim = Simulation(scene)
    sim.frame()
    world = sim.world
    before = world.particles.v.to_numpy()[: sim.count].astype(np.float64)
    c = coefficients(scene, DT)
    kinds = blend(world.materials, scene)
    prepare_fluids(world, kinds, scene, DT)
    world.remember_viscosity()
    number = solve_viscosity(world, kinds, scene, c, most)
    after = world.particles.v.to_numpy()[: sim.count].astype(np.float64)
    return world.particles.x.to_numpy()[: sim.count].astype(np.float64), before, after, number


def lattice(dim: int, side: int) -> np.ndarray:
    return (np.stack(np.meshgrid(*[np.arange(side)] * dim, indexing="ij"), -1).reshape(-1, dim) + 0.5) * D


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("viscosity", [1.0, 10.0, 100.0])
def test_shear_wave_decays_as_an_implicit_step_of_nu_k_squared(dim, viscosity):
    """Momentum diffusion: v_x = sin(k y) becomes v / (1 + dt nu k^2), with the lattice's error of order (k d)^2."""
    side = 32 if dim == 2 else 14
    x = lattice(dim, side)
    k = 2 * math.pi / (side * D)
    v = np.zeros_like(x)
    v[:, 0] = np.sin(k * x[:, 1])
    place, before, after, _ = solved(x, v, viscosity)
    middle = np.all(np.abs(place - 0.5 * side * D) < 0.25 * side * D, axis=1)
    share = np.sum((after * before)[middle]) / np.sum((before**2)[middle])
    assert 1.0 / share - 1.0 == pytest.approx(DT * viscosity / 1000.0 * k**2, rel=0.06)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("most", [1, 3, 400])
def test_momentum_is_exact_and_energy_falls_wherever_the_iterations_end(dim, most):
    rng = np.random.default_rng(2)
    x = lattice(dim, 20 if dim == 2 else 8) + rng.normal(0, 0.15 * D, (20**2 if dim == 2 else 8**3, dim))
    v = rng.normal(0, 1, x.shape)
    place, before, after, number = solved(x, v, 1e5, most)
    assert number <= most
    assert np.abs((after - before).sum(axis=0)).max() < 1e-5 * np.abs(before).sum()
    turn = [
        np.cross(place, w).sum(axis=0) if dim == 3 else np.sum(place[:, 0] * w[:, 1] - place[:, 1] * w[:, 0])
        for w in (before, after)
    ]
    assert np.abs(np.subtract(*turn)).max() < 1e-5 * np.abs(before).sum()
    assert np.sum(after**2) <= np.sum(before**2)


@pytest.mark.parametrize("dim", [2, 3])
def test_rotation_is_left_alone(dim):
    """A rigid rotation has no strain: nothing changes, at the free faces neither."""
    x = lattice(dim, 10)
    away = x - x.mean(axis=0)
    v = np.zeros_like(x)
    v[:, 0], v[:, 1] = -3.0 * away[:, 1], 3.0 * away[:, 0]
    _, before, after, _ = solved(x, v, 1e3)
    np.testing.assert_allclose(after, before, atol=1e-4)


def test_a_thousand_times_thicker_is_stable_and_takes_no_more_than_asked():
    rng = np.random.default_rng(3)
    x = lattice(2, 16)
    _, before, after, number = solved(x, rng.normal(0, 1, x.shape), 1e6, 20)
    assert number == 20
    assert np.isfinite(after).all()
    assert np.sum(after**2) < 0.5 * np.sum(before**2)


def test_walls_continue_a_linear_profile():
    """Couette: with v = gamma y over a wall at rest the half lattice and the fluid balance, so that nothing changes."""
    side, slope = 12, 4.0
    x = lattice(2, side)
    v = np.zeros_like(x)
    v[:, 0] = slope * x[:, 1]
    tank = wt.Tank(size=(4.0, 4.0))
    place, before, after, _ = solved(x + [1.5, 0.0], v, 10.0, tank=tank)
    inside = (np.abs(place[:, 0] - 1.8) < 0.1) & (place[:, 1] < 5 * D)
    np.testing.assert_allclose(after[inside], before[inside], atol=1e-3 * slope * D)
    _, _, slipping, _ = solved(x + [1.5, 0.0], v, 10.0, tank=tank, no_slip=0.0)
    bottom = inside & (place[:, 1] < D)
    assert np.all(slipping[bottom, 0] > before[bottom, 0] + 1e-3 * slope * D)


@pytest.mark.parametrize("dim", [2, 3])
def test_drag_of_a_wall_is_half_the_lattice(dim):
    """At half a spacing the wall's layers give what the lattice's own layers beyond y = 0 would."""
    ratio = 1.9
    r = rest_points(dim, ratio)
    length = np.linalg.norm(r, axis=1)
    below = r[:, 1] < -0.5
    f = (1 - length / ratio) * r[:, 0] ** 2 / length**2
    expected = np.sum((f * -r[:, 1])[below]) / 0.5
    place = 0.5 / ratio * TABLE_SIZE
    table = drag_table(dim, ratio)
    k = int(place)
    value = table[k] + (table[k + 1] - table[k]) * (place - k)
    assert value == pytest.approx(expected, rel=0.01)
    assert table[-1] == 0.0
    assert damper_scale(dim, ratio, 0.1) == pytest.approx(damper_scale(dim, ratio, 1.0) * 100)


def test_thin_fluids_pay_nothing():
    scene = wt.Scene.load("still-tank").changed(dynamic_viscosity=0.0)
    sim = Simulation(scene)
    sim.step()
    assert sim.world.fluids.arrays == {}
    c = coefficients(scene, DT)
    kinds = blend(sim.world.materials, scene)
    assert not is_viscous(kinds, scene, c.dt)
    assert iterations(1.0, 60) == 0
    assert (
        1 <= iterations(1.1, 60) < iterations(100.0, 60) < iterations(1e4, 1000) == math.ceil(0.5 * 100 * math.log(100))
    )


def mean_height(steps: int) -> float:
    """Mean height [m] of a column of honey that has collapsed for 0.2 s in so many time steps a frame."""
    free = {"wave_courant": 100.0, "courant": 100.0}
    scene = wt.Scene.load("honey-2d").changed(spacing=0.003, substeps=steps, viscosity_iterations=400, **free)
    sim = Simulation(scene)
    for _ in range(12):
        sim.step()
    return float(sim.positions[:, 1].mean())


def test_thick_fluids_do_not_flow_faster_in_longer_steps(monkeypatch):
    """Carried pressure (Goda 1979): twelve steps a frame come as near as a hundred without it, which is first order."""
    carried = mean_height(12)
    monkeypatch.setattr("wavetank.physics.terms.dynamic_viscosity.implicit_viscosity.CARRIED", 0.0)
    split, fine = mean_height(12), mean_height(96)
    assert split < 0.8 * fine
    assert carried == pytest.approx(fine, rel=0.12)


@pytest.mark.parametrize("viscosity", [0.05, 1.0])
def test_thin_oil_runs_alike_with_the_grid_and_without(viscosity):
    """In time steps as long as the grid allows it as far, and stands as high, as in a quarter of them without."""

    def front_and_height(**changes) -> tuple[float, float]:
        fluids = [wt.Block(lower=(0, 0), upper=(0.4, 0.4))]
        tank = wt.Tank(size=(1.2, 0.6))
        scene = wt.Scene(spacing=0.02, tank=tank, fluids=fluids, rest_density=850.0, dynamic_viscosity=viscosity)
        sim = Simulation(scene.changed(**changes))
        assert has_grid_pressure(sim.world, sim.scene) is not bool(changes)
        sim.advance(0.4)
        return float(np.quantile(sim.positions[:, 0], 0.98)), float(sim.positions[:, 1].mean())

    assert front_and_height() == pytest.approx(front_and_height(grid_pressure=0.0, courant=0.3), rel=0.02)


def test_what_presses_is_carried_on_by_thick_fluids_only():
    shares = {}
    for viscosity in (0.0, 0.001, 1.0, 1000.0):
        scene = wt.Scene.load("still-tank-2d").changed(dynamic_viscosity=viscosity)
        sim = Simulation(scene)
        sim.step()
        assert has_grid_pressure(sim.world, scene) is (viscosity < 100.0), "thin fluids need no other time steps"
        shares[viscosity] = warm_start_of_thick(blend(sim.world.materials, scene), scene)
    assert shares.pop(1000.0) > 0.95 * CARRIED
    assert not any(shares.values())
    weightless = Simulation(wt.Scene.load("honey-2d").changed(gravity=(0, 0)))
    for _ in range(2):
        weightless.step()
    assert not download(weightless.world.particles.a).any()


@pytest.mark.parametrize(
    ("viscosity", "spacing", "size", "above"),
    [
        (1e6, 0.01, (1, 1), 0.0),
        (10.0, 0.001, (30, 18), 0.0),
        (70.0, 0.0015, (30, 18), 0.0),
        (1e5, 0.01, (30, 18), 0.0),
        (1e3, 0.01, (60, 10), 0.0),
        (1e6, 0.01, (1, 1), 10.0),
        (1e4, 0.01, (20, 10), 10.0),
        (1e4, 0.01, (8, 8, 8), 10.0),
    ],
)
def test_thick_fluids_lie_where_they_lie_and_do_not_bounce(viscosity, spacing, size, above):
    """What pressed in the last step presses no more once the floor is left; lengths in spacings."""
    wide = 2 * size[0] + 10
    lower = np.array([0.5 * (wide - size[0]), above, 0.5 * (wide - size[0])])[: len(size)] * spacing
    block = wt.Block(lower=tuple(lower), upper=tuple(lower + spacing * np.array(size)))
    tank = wt.Tank(size=tuple(spacing * np.array([wide, size[1] + above + 20, wide]))[: len(size)])
    gravity = (0.0, -9.81, 0.0)[: len(size)]
    sim = Simulation(
        wt.Scene(
            spacing=spacing, gravity=gravity, rest_density=1400, dynamic_viscosity=viscosity, tank=tank, fluids=[block]
        )
    )
    sim.advance(math.sqrt(2.0 * above * spacing / 9.81) + 0.05)
    for _ in range(30):
        sim.step()
        assert sim.positions[:, 1].min() < (2.0 if above else 0.6) * spacing


def test_ice_holds_what_sticks_to_it():
    """A beam of dough with one end frozen sags as a viscous beam does: q L^4 / (8 3 mu I) at its end, 4 mm in 0.2 s."""
    d, mu, density = 0.01, 1e5, 1400.0
    beam = wt.Block(lower=(0.0, 0.0), upper=(0.24, 0.06))
    sim = Simulation(
        wt.Scene(spacing=d, gravity=(0.0, -9.81), rest_density=density, dynamic_viscosity=mu, fluids=[beam])
    )
    sim.freeze_inside(np.array([0.0, 0.03, 0.0]), np.array([0.0, 0.03, 0.0]), 0.068)
    ice = np.sort(download(sim.world.particles.id)[: sim.count][download(sim.world.particles.frozen)[: sim.count] == 1])
    length, thick = 0.24 - 0.06, 0.06
    rate = density * 9.81 * thick * length**4 / (8.0 * 3.0 * mu * thick**3 / 12.0)
    end = sim.positions[:, 0] > 0.23
    before = sim.positions.copy()
    sim.advance(0.2)
    assert len(ice) > 20
    np.testing.assert_array_equal(sim.positions[ice], before[ice])
    sag = float((before[end] - sim.positions[end])[:, 1].mean())
    assert 0.2 * rate * 0.5 < sag < 0.2 * rate * 2.0  # it falls by 196 mm where ice does not hold it


@pytest.mark.parametrize("stiffest", [1.001, 1.1, 3.0, 100.0])
def test_iterations_are_as_many_as_the_worst_mode_needs(stiffest):
    """The polynomial of `schedule` at both ends of the spectrum: within TOLERANCE, and not with one iteration less."""

    def error(number: int) -> float:
        modes = np.linspace(1.0, stiffest, 400)
        now, before = np.ones(400), np.ones(400)
        for relaxation, momentum in schedule(number, 1.0, stiffest):
            now, before = now - relaxation * modes * now + momentum * (now - before), now
        return float(np.abs(now).max())

    number = iterations(stiffest, 1000)
    assert error(number) <= 1.001 * TOLERANCE
    assert number == 1 or error(number - 1) > TOLERANCE


def test_too_many_pairs_are_told_in_one_sentence(monkeypatch):
    sim = Simulation(wt.Scene.load("honey-2d").changed(spacing=0.004))
    monkeypatch.setattr(
        "wavetank.physics.terms.dynamic_viscosity.implicit_viscosity.MAX_ENTRIES", 8 * sim.world.grid.list.shape[0] - 1
    )
    with pytest.raises(wt.WavetankError, match="particles of viscous fluids are too many.*use a larger spacing"):
        sim.step()


@pytest.mark.parametrize(("viscosity", "dim"), [(1e3, 2), (1e4, 2), (1e6, 2), (1e5, 3)])
def test_dough_that_falls_does_not_bounce(viscosity, dim):
    """A body so stiff stops at once (Re < 0.1); it sprang back by a tenth of its fall, out of the floor."""
    d, n, fall = 0.01, 20 if dim == 2 else 8, 0.3
    lower = np.array([2 * n * d, fall, 2 * n * d])[:dim]
    sim = Simulation(
        wt.Scene(
            spacing=d,
            gravity=(0, -9.81, 0)[:dim],
            rest_density=1400,
            dynamic_viscosity=viscosity,
            tank=wt.Tank(size=(5 * n * d, fall + 2 * n * d, 5 * n * d)[:dim]),
            fluids=[wt.Block(lower=tuple(lower), upper=tuple(lower + n * d))],
        )
    )
    sim.advance(math.sqrt(2.0 * fall / 9.81) - 0.02)
    assert sim.velocities[:, 1].mean() < -2.0
    lowest, rise = math.inf, 0.0
    for _ in range(80):
        sim.advance(1 / 240)
        height = float(sim.positions[:, 1].mean(dtype=float))
        lowest = min(lowest, height)
        rise = max(rise, height - lowest)
    assert rise < 0.01 * fall
    assert abs(sim.velocities[:, 1].mean()) < 0.2
    assert sim.positions[:, 1].min() > 0.2 * d


@pytest.mark.parametrize(("viscosity", "d", "speed"), [(1e4, 0.02, 1.0), (1e6, 0.02, 2.0), (1e6, 0.0125, 1.0)])
def test_a_paddle_neither_flings_dough_nor_presses_it_together(viscosity, d, speed):
    """Nothing drives the dough but the paddle, and it has nowhere to go but up: a flow without divergence.

    It was flung at 1.4 to 1.9 times the paddle's speed, and pressed to 1.3 to 2 of its density.
    """
    x, frames = 0.3, round(0.33 * 60 / speed)
    paddle = wt.Box(name="paddle", center=(x, 0.25), size=(0.04, 0.5))
    sim = Simulation(
        wt.Scene(
            spacing=d,
            gravity=(0, -9.81),
            rest_density=1400,
            dynamic_viscosity=viscosity,
            tank=wt.Tank(size=(1.0, 0.6)),
            solids=[paddle],
            fluids=[wt.Block(lower=(0, 0), upper=(1.0, 0.2))],
        )
    )
    sim.advance(0.2)
    for _ in range(frames):
        x += speed / 60
        sim.move("paddle", position=(x, 0.25))
        sim.advance(1 / 60)
        assert np.linalg.norm(sim.velocities, axis=1).max() < 1.25 * speed
        assert np.percentile(sim.densities, 99) < 1.2 * 1400


def test_without_no_slip_a_body_still_stops_on_the_floor_and_slides():
    """`no_slip` = 0 is of the drag along the wall; across it the fluid is held all the same."""
    block = wt.Block(lower=(0.2, 0.3), upper=(0.4, 0.5), velocity=(1.0, 0.0))
    sim = Simulation(
        wt.Scene(
            spacing=0.01,
            gravity=(0, -9.81),
            rest_density=1400,
            dynamic_viscosity=1e4,
            no_slip=0.0,
            tank=wt.Tank(size=(1.5, 0.7)),
            fluids=[block],
        )
    )
    sim.advance(math.sqrt(2.0 * 0.3 / 9.81) + 0.05)
    assert abs(sim.velocities[:, 1].mean()) < 0.2
    assert sim.velocities[:, 0].mean() == pytest.approx(1.0, abs=0.1)


def test_honey_at_rest_does_not_creep_up_its_walls():
    """Walls bear nothing of its weight: pressure does, from the start of each step on (hydrostatics)."""
    honey = {"name": "honey", "density": 1400.0, "viscosity": 70.0}
    block = {"lower": [0.015, 0], "upper": [0.045, 0.05], "material": "honey"}
    sim = Simulation(
        wt.Scene.parse({"spacing": 0.002, "tank": {"size": [0.06, 0.06]}, "materials": [honey], "fluids": [block]})
    )
    sim.advance(3.0)
    start, height = sim.positions.astype(float), sim.positions[:, 1].mean()
    sim.advance(2.0)
    moved = np.linalg.norm(sim.positions - start, axis=1) / 2.0
    assert moved.max() < 0.002
    assert sim.positions[:, 1].mean() == pytest.approx(height, rel=2e-3)


def test_a_sheet_of_honey_does_not_hop():
    """What its floor bore in one step it bears in the next, where nothing moves (hydrostatics): 0.006 m/s before."""
    sim = Simulation(
        wt.Scene.parse(
            {
                "spacing": 0.0015,
                "rest_density": 1400.0,
                "dynamic_viscosity": 70.0,
                "tank": {"size": [0.06, 0.03]},
                "fluids": [{"lower": [0, 0], "upper": [0.03, 0.00675], "velocity": [0.01, -0.3]}],
            }
        )
    )
    sim.advance(5.0)
    speeds = []
    for _ in range(60):
        sim.advance(1.0 / 60.0)
        speeds.append(np.sqrt((sim.velocities.astype(float) ** 2).sum(axis=1).mean()))
    assert np.mean(speeds) < 0.002

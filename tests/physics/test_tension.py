"""Surface tension: calibration on the rest lattice, momentum, bounds, roundness, adhesion."""

import math

import numpy as np
import pytest

import wavetank as wt
from wavetank.foundation.materials import Material
from wavetank.physics.mixture import blend
from wavetank.physics.smoothing import rest_points
from wavetank.physics.terms.tension import adhesion_table, flat_surface, largest_tension, limited_tensions, substeps_for
from wavetank.simulation.simulation import Simulation


def drop(dim: int, number: int = 10, **settings) -> Simulation:
    """A cube of water, 10 mm wide, without weight."""
    side = 0.01
    settings = {"surface_tension": 0.072, "frame_time": 2e-3, "largest_substeps": 100, "viscosity": 0.05, **settings}
    scene = wt.Scene(
        spacing=side / number,
        gravity=(0.0,) * dim,
        fluids=[wt.Block(lower=(0,) * dim, upper=(side,) * dim)],
        **settings,
    )
    return Simulation(scene)


@pytest.mark.parametrize("dim", [2, 3])
def test_cube_becomes_round_and_keeps_its_momentum(dim):
    """Least area; the corners of a square are 41 % farther than its faces, those of a cube 73 %."""
    sim = drop(dim, dynamic_viscosity=0.005)
    sim.advance(0.04)
    x, v = sim.positions.astype(float), sim.velocities.astype(float)
    x = x - x.mean(axis=0)
    axes = np.vstack([np.eye(dim), -np.eye(dim), np.array(np.meshgrid(*[[-1, 1]] * dim)).reshape(dim, -1).T])
    axes = axes / np.linalg.norm(axes, axis=1)[:, None]
    extent = (x @ axes.T).max(axis=0)
    assert extent.max() / extent.min() < 1.2
    assert np.linalg.norm(x, axis=1).max() < 0.01
    assert np.abs(v.sum(axis=0)).max() < 2e-3 * np.abs(v).sum()


def test_without_tension_nothing_moves_and_nothing_is_paid_for():
    sim = drop(3, surface_tension=0.0, attraction=0.0)
    start = sim.positions
    sim.advance(0.01)
    np.testing.assert_allclose(sim.positions, start, atol=1e-7)
    assert set(sim.world.fluids.arrays) == {"packed"}, "what physics/terms/central_xsph.py needs in the open"


def test_any_tension_is_bounded():
    """A tension a million times too large for the budget of time steps acts as the largest that a step carries."""
    sim = drop(2, surface_tension=10.0, frame_time=0.05, substeps=1, largest_substeps=2, speed_limit=1e6)
    sim.advance(0.5)
    assert np.isfinite(sim.positions).all()
    d = sim.scene.spacing
    assert np.linalg.norm(sim.velocities, axis=1).max() < 10 * d / 0.025


def test_limit_and_time_steps_agree():
    params = wt.Scene(spacing=1e-3, surface_tension=0.072)
    kinds = blend({0: Material()}, params)
    steps = substeps_for(kinds, 3, 1.9, 1e-3, 1 / 60)
    assert steps > 5
    assert limited_tensions(kinds, 3, 1.9, 1e-3, 1 / 60 / steps)[0] == 0.072
    assert limited_tensions(kinds, 3, 1.9, 1e-3, 1 / 60)[0] < 0.072
    # sigma ~ rho d^3 / dt^2, as the capillary time step of Brackbill et al. 1992 has it
    water = kinds.fluids[0]
    assert largest_tension(water, 3, 1.9, 2e-3, 1e-3) == pytest.approx(8 * largest_tension(water, 3, 1.9, 1e-3, 1e-3))


@pytest.mark.parametrize("angle", [0.0, 60.0])
def test_a_drop_on_a_wetted_floor_comes_to_rest(angle):
    """Adhesion holds it; with time steps for the tension of its surface alone, it boils, and climbs up the walls."""
    block = wt.Block(lower=(0.007, 0), upper=(0.013, 0.004))
    sim = Simulation(
        wt.Scene(
            spacing=0.0005,
            tank=wt.Tank(size=(0.02, 0.01)),
            fluids=[block],
            surface_tension=0.072,
            contact_angle=angle,
            dynamic_viscosity=0.005,
            gravity=(0.0, -9.81),
        )
    )
    sim.advance(1.0)
    assert sim.positions[:, 1].max() < 0.006
    assert np.linalg.norm(sim.velocities, axis=1).max() < 0.1


@pytest.mark.parametrize("dim", [2, 3])
def test_flat_surface_sums(dim):
    flat = flat_surface(dim, 1.9)
    assert 0.0 < flat.quiet < 0.25
    assert flat.stress > 0.0
    assert adhesion_table(dim, 1.9)[100] > 0.0
    assert adhesion_table(dim, 1.9)[-1] == 0.0
    # A lattice cut along an axis misses bonds; what they cost is the tension, but for the direction of the cut.
    r = rest_points(dim, 1.9)
    cut = 0.5 * flat.bond * np.sum((1.0 - (np.linalg.norm(r, axis=1) / 1.9) ** 3) * np.maximum(r[:, 0], 0.0))
    assert cut == pytest.approx(1.0, rel=0.15)


def hanging(angle: float, radius: float) -> float:
    """Median height [m] of the water of half a drop of that `radius` [m] under a ceiling after a while."""
    d, size = 0.0005, (0.02, 0.012)
    axis = (np.arange(-8, 8) + 0.5) * d
    x = np.stack(np.meshgrid(axis, axis, indexing="ij"), -1).reshape(-1, 2)
    x = x[(np.sum(x**2, axis=1) < radius**2) & (x[:, 1] < 0)] + [0.01, size[1]]
    scene = wt.Scene(
        spacing=d,
        tank=wt.Tank(size=size),
        surface_tension=0.072,
        contact_angle=angle,
        dynamic_viscosity=0.005,
        frame_time=2e-3,
        largest_substeps=100,
        gravity=(0.0, -9.81),
        fluids=[wt.Points(positions=x)],
    )
    sim = Simulation(scene)
    sim.advance(0.06)
    return float(np.median(sim.positions[:, 1]))


def test_adhesion_makes_a_drop_cling():
    """Under a ceiling a wetting drop stays, one that does not wet falls: g t^2 / 2 is 18 mm, the room 12 mm.

    Its weight, rho g pi R^2 / 2, is 84 % of 2 sigma, the most that the two ends of its surface hold.
    """
    assert hanging(30.0, 0.0028) > 0.009
    assert hanging(180.0, 0.0028) < 0.006


@pytest.mark.xfail(reason="at 96 % of what can be held rounding decides whether it falls")
def test_adhesion_holds_a_drop_near_the_limit():
    """The same with a weight of 96 % of 2 sigma."""
    assert hanging(180.0, 0.003) < 0.006
    assert hanging(30.0, 0.003) > 0.009


def test_capillary_speed_lifts_the_speed_limit():
    """Without weight only tension moves the water: Taylor and Culick's sqrt(2 sigma / (rho d))."""
    sim = Simulation(wt.Scene.load("weightless-drop-2d"))
    assert sim._speed_limit(1 / 60) == pytest.approx(math.sqrt(2 * 0.072 / (1000 * 0.001)))

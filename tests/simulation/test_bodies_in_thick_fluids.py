"""The drag of thick fluids on bodies: Stokes' law between walls, momentum, floating, figures of the forces."""

import math

import numpy as np
import pytest

import wavetank as wt

pytest.importorskip("rapier3d")
HONEY = [{"name": "honey", "density": 1400.0, "viscosity": 10.0}]


def ball_in_duct(ratio, viscosity, start, seconds=0.6, **others):
    """Let a ball of 3 spacings go in a square duct; return its mean speed upwards over the last 0.2 s, over Stokes'.

    In a square duct of half width l Stokes' drag is larger by 1 / (1 - 1.9034 R / l + ...) (Happel and Brenner 1983,
    "Low Reynolds Number Hydrodynamics", Table 7-3.1); the cubic term is Faxen's of the cylinder, rounded.
    """
    density, radius, wide, high = 1400.0, 0.06, 0.48, 0.48
    scene = wt.Scene(
        spacing=0.02,
        tank=wt.Tank(size=(wide, high + 0.1, wide)),
        foam=0,
        materials=[{"name": "honey", "density": density, "viscosity": viscosity}],
        fluids=[wt.Block(lower=(0, 0, 0), upper=(wide, high, wide), material="honey")],
        solids=[wt.Sphere(name="b", center=(wide / 2, start * high, wide / 2), radius=radius, density=density * ratio)],
        **others,
    )
    sim = wt.Simulation(scene)
    sim.advance(seconds - 0.2)
    before = sim.bodies["b"].position[1]
    sim.advance(0.2)
    narrow = radius / (wide / 2)
    stokes = (1 - ratio) * density * 4 / 3 * math.pi * radius**3 * 9.81 / (6 * math.pi * viscosity * radius)
    stokes *= 1 - 1.9034 * narrow + 1.9 * narrow**3
    return (sim.bodies["b"].position[1] - before) / 0.2 / stokes


@pytest.mark.parametrize(("ratio", "viscosity", "start"), [(1.5, 10.0, 0.6), (0.5, 10.0, 0.4), (1.5, 30.0, 0.6)])
def test_a_ball_moves_at_stokes_speed(ratio, viscosity, start):
    """At Reynolds numbers up to 5 that is an upper bound; it fell at a third, or rose at a tenth of it."""
    assert ball_in_duct(ratio, viscosity, start) == pytest.approx(0.95, abs=0.3)


@pytest.mark.parametrize("viscosity", [1.0, 10.0])
def test_the_fluid_takes_the_momentum_that_its_drag_takes_from_a_body(viscosity):
    """Without gravity the sum of momenta stays (Newton's third law): none went to the fluid that drag held."""
    scene = wt.Scene(
        spacing=0.03,
        gravity=(0, 0, 0),
        calming=0,
        viscosity=0,
        materials=[{"name": "honey", "density": 1400.0, "viscosity": viscosity}],
        fluids=[wt.Block(lower=(-0.24,) * 3, upper=(0.24,) * 3, material="honey")],
        solids=[wt.Sphere(name="b", center=(0, 0, 0), radius=0.09, density=700, velocity=(1, 0, 0))],
    )
    sim = wt.Simulation(scene)
    body, mass = sim.bodies["b"], 1400 * 0.03**3

    def momentum():
        return mass * sim.velocities.astype(float).sum(axis=0) + body.mass * body.velocity + body.pending_impulse[:3]

    begin = momentum()
    sim.advance(0.3)
    assert body.velocity[0] < 0.5, "the fluid has stopped it"
    assert np.linalg.norm(momentum() - begin) < 1e-3 * begin[0]


def test_a_box_floats_in_honey_as_deep_as_it_is_heavy():
    """Archimedes; what holds it is its weight, all of which is the fluid's push."""
    scene = wt.Scene(
        spacing=0.03,
        tank=wt.Tank(size=(0.48, 0.5, 0.48)),
        foam=0,
        materials=HONEY,
        fluids=[wt.Block(lower=(0, 0, 0), upper=(0.48, 0.36, 0.48), material="honey")],
        solids=[wt.Box(name="b", center=(0.24, 0.36, 0.24), size=(0.18, 0.18, 0.18), density=700)],
    )
    sim = wt.Simulation(scene)
    sim.advance(1.5)
    body = sim.bodies["b"]
    assert body.immersed == pytest.approx(0.5, abs=0.06)
    assert body.force[1] == pytest.approx(body.mass * 9.81, rel=0.05)
    assert body.buoyancy[1] == pytest.approx(body.mass * 9.81, rel=0.12)
    assert (body.buoyancy + body.drag).tolist() == pytest.approx(body.force.tolist())
    assert np.linalg.norm(body.velocity) < 0.02


def test_it_goes_on_from_a_saved_state_to_the_last_bit(tmp_path):
    scene = wt.Scene(
        spacing=0.05,
        tank=wt.Tank(size=(0.6, 0.6, 0.6)),
        materials=HONEY,
        fluids=[wt.Block(lower=(0, 0, 0), upper=(0.6, 0.4, 0.6), material="honey")],
        solids=[wt.Sphere(name="b", center=(0.3, 0.3, 0.3), radius=0.1, density=2000)],
    )
    sim = wt.Simulation(scene)
    sim.advance(0.1)
    sim.save(tmp_path / "a.npz")
    other = wt.Simulation.restore(tmp_path / "a.npz")
    for one in (sim, other):
        one.advance(0.1)
    assert sim.digest() == other.digest()
    assert sim.bodies["b"].coupling.viscous_mass[0, 0] > 0.0

"""Terms of the time step that a script adds, with names of `wt` alone."""

import numpy as np
import pytest

import wavetank as wt


@wt.qd.kernel(fastcache=True)
def damp(particles: wt.Particles, factor: wt.qd.f32, count: wt.qd.i32):
    for i in range(count):
        particles.v[i] *= factor


def damping(rate: float) -> wt.Term:
    """Slow all particles down at a `rate` [1/s]."""

    def apply(world, plan, params, c):
        damp(world.particles, np.exp(-rate * c.dt), world.count)

    return wt.Term("damping", wt.Hook.VELOCITIES, apply)


def cloud(**more) -> wt.Simulation:
    points = wt.Points(positions=[(0.0, 0.0)], velocities=[(1.0, 0.0)])
    return wt.Simulation(wt.Scene(spacing=0.1, fluids=[points], gravity=(0.0, 0.0)), **more)


def test_a_term_acts_in_every_step_and_goes_with_copies():
    sim = cloud(terms=[damping(2.0)])
    sim.advance(0.5)
    assert sim.velocities[0] == pytest.approx((np.exp(-1.0), 0.0), rel=1e-5)
    copy = sim.clone()
    for world in (sim, copy):
        world.advance(0.5)
    assert copy.velocities[0] == pytest.approx((np.exp(-2.0), 0.0), rel=1e-5) and copy.digest() == sim.digest()
    sim.add(np.random.default_rng(0).uniform(5, 9, (100, 2)))  # other arrays, for more particles
    sim.advance(0.5)
    assert sim.velocities[0] == pytest.approx((np.exp(-3.0), 0.0), rel=1e-5)
    sim.terms.clear()
    before = sim.velocities[0]
    sim.advance(0.5)
    assert np.array_equal(sim.velocities[0], before)


def test_a_session_with_a_term_is_not_recorded():
    session = wt.Session.of(cloud(terms=[damping(1.0)]))
    session.tick()
    with pytest.raises(wt.WavetankError, match="cannot be recorded: a script changed its forces .*damping"):
        wt.Recording.of(session, session.scene)

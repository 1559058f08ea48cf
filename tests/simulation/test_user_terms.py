"""Terms of the time step that a script adds, with names of `wt` alone."""

import numpy as np
import pytest

import wavetank as wt


@wt.qd.kernel(fastcache=True)
def damp(particles: wt.Particles, factor: wt.qd.f32, count: wt.qd.i32):
    for i in range(count):
        particles.v[i] *= factor


class Damping(wt.Term):
    """Slows all particles down at a rate [1/s]."""

    def __init__(self, rate: float) -> None:
        self.rate = rate

    def apply(self, world, scene, dt):
        damp(world.particles, np.exp(-self.rate * dt), world.count)


def cloud(**more) -> wt.Simulation:
    points = wt.Points(positions=[(0.0, 0.0)], velocities=[(1.0, 0.0)])
    return wt.Simulation(wt.Scene(spacing=0.1, fluids=[points], gravity=(0.0, 0.0)), **more)


def test_a_term_acts_in_every_step_and_goes_with_copies():
    sim = cloud(terms=[Damping(2.0)])
    sim.advance(0.5)
    assert sim.velocities[0] == pytest.approx((np.exp(-1.0), 0.0), rel=1e-5)
    copy = sim.clone()
    for world in (sim, copy):
        world.advance(0.5)
    assert copy.velocities[0] == pytest.approx((np.exp(-2.0), 0.0), rel=1e-5) and copy.digest() == sim.digest()
    sim.terms.clear()
    before = sim.velocities
    sim.advance(0.5)
    assert np.array_equal(sim.velocities, before)


def test_a_session_with_a_term_is_not_recorded():
    session = wt.Session.of(cloud(terms=[Damping(1.0)]))
    session.tick()
    with pytest.raises(wt.WavetankError, match="cannot be recorded: a script changed its forces .*Damping"):
        wt.Recording.of(session, session.scene)

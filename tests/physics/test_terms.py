"""Terms of a step that a script adds, and that those of the package are entries of one tuple."""

import numpy as np
import pytest

import wavetank as wt
from wavetank.device.compiler import qd
from wavetank.device.state import Particles
from wavetank.physics.terms.builtin import TERMS
from wavetank.physics.terms.term import Hook, Term


@qd.kernel
def damp(particles: Particles, share: qd.f32, count: qd.i32):
    for i in range(count):
        particles.v[i] *= 1.0 - share


@pytest.mark.parametrize("acts", [True, False])
def test_a_term_of_a_script_acts_where_it_says(acts):
    """Without gravity water keeps its velocity; a term takes half of it at the end of each step in which it acts."""
    block = wt.Block(lower=(0.0, 0.0), upper=(0.5, 0.5))
    sim = wt.Simulation(wt.Scene(spacing=0.05, fluids=[block], gravity=(0.0, 0.0)))
    sim.velocities = np.tile(np.array([0.01, 0.0], np.float32), (sim.count, 1))
    steps = []

    def apply(world, plan, params, c):
        steps.append(c.dt)
        damp(world.particles, 0.5, world.count)

    sim.terms.append(Term("damping", Hook.VELOCITIES, apply, lambda plan: acts))
    sim.step()
    mean = sim.velocities[:, 0].mean()
    assert len(steps) > 0 if acts else not steps
    assert mean == pytest.approx(0.01 * 0.5 ** len(steps), rel=0.05)


def test_terms_have_names_of_their_own():
    assert len({term.name for term in TERMS}) == len(TERMS)

"""What cases read from a swing, and the theory that `u-tube`, `resonance` and `vortex` count with."""

import math

import numpy as np
import pytest

from wavetank.lab.cases import resonance, swing, vortex
from wavetank.lab.cases.u_tube import CORNER, DEPTH, LIFT, WIDTH, level, scene


def test_a_damped_swing_gives_its_period_and_what_it_keeps():
    t = np.linspace(0.0, 5.0, 1001)
    a = 0.8 ** (t / 1.7) * np.cos(2.0 * np.pi * t / 1.7)
    assert swing.period(t, a) == pytest.approx(1.7, rel=1e-3)
    assert swing.kept(t, a) == pytest.approx(0.8, rel=1e-3)
    assert len(swing.heights(t, a)) == len(swing.crossings(t, a)) - 1 == 5


def test_too_short_a_swing_has_no_period():
    t = np.linspace(0.0, 0.5, 11)
    assert math.isnan(swing.period(t, np.cos(t)))
    assert math.isnan(swing.kept(t, np.cos(t)))


def test_the_level_of_the_tube_is_that_of_its_legs():
    start = scene(16)
    assert level(start.particles()[0], start.spacing) == pytest.approx(LIFT)
    assert max(start.particles()[0][:, 1]) < DEPTH + LIFT
    assert start.spacing == WIDTH / 16


def test_a_corner_is_as_long_as_potential_flow_has_it():
    """The potential in a duct with a bend, by cells: between ends that are 3 widths off, its drop over the flow."""
    n, arm = 16, 3
    inside = np.zeros(((arm + 1) * n, (arm + 1) * n), bool)
    inside[:, :n] = inside[:n, :] = True
    number = np.cumsum(inside).reshape(inside.shape) - 1
    size = inside.sum()
    system, load = np.zeros((size, size)), np.zeros(size)
    for axis in (0, 1):
        both = np.moveaxis(inside, axis, 0)
        index = np.moveaxis(number, axis, 0)
        linked = both[1:] & both[:-1]
        for i, j in zip(index[1:][linked], index[:-1][linked], strict=True):
            system[i, i] += 1.0
            system[j, j] += 1.0
            system[i, j] -= 1.0
            system[j, i] -= 1.0
    for cells, value in ((number[-1, :n], 1.0), (number[:n, -1], 0.0)):  # half a cell from each end
        system[cells, cells] += 2.0
        load[cells] += 2.0 * value
    potential = np.linalg.solve(system, load)
    flow = float(np.sum(2.0 * (1.0 - potential[number[-1, :n]])))
    assert 1.0 / flow - 2 * arm == pytest.approx(CORNER, abs=0.01)  # the sharp corner costs cells 0.008


def test_the_swayed_mode_solves_its_equation():
    t, step = np.linspace(0.0, 4.0 * resonance.PERIOD, 4001, retstep=True)
    q = resonance.theory(t)
    force = 4.0 / math.pi * math.tanh(resonance.K * resonance.DEPTH) * resonance.ACCELERATION
    left = np.gradient(np.gradient(q, step), step) + resonance.OMEGA**2 * q
    assert left[2:-2] == pytest.approx(force * np.sin(resonance.OMEGA * t)[2:-2], abs=1e-3 * force)
    assert np.abs(q).max() == pytest.approx(4.0 * resonance.GROWTH, rel=1e-3)
    assert resonance.left_of(1) == 1.0
    assert resonance.left_of(2) == pytest.approx(0.985)


def test_the_vortex_has_a_quarter_of_its_greatest_energy_and_rests_at_walls():
    fluid = vortex.scene(20, 0.0).fluids[0]
    assert np.mean(np.sum(fluid.velocities**2, axis=1)) == pytest.approx(vortex.SPEED**2 / 2.0, rel=1e-3)
    assert np.abs(fluid.velocities[np.abs(fluid.positions[:, 0]) < 0.03, 0]).max() < 0.1 * vortex.SPEED

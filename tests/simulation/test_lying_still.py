"""What has sunk lies still: it neither rocks nor trembles, and its steps are not taken again."""

import numpy as np
import pytest

import wavetank as wt
from wavetank.simulation import bodies
from wavetank.simulation.coupling import Coupling

pytest.importorskip("rapier3d")


def lone() -> Coupling:
    """One body of 2 kg."""
    ones = np.ones(1)
    return Coupling(2.0 * ones, 2.0 * ones, np.eye(3)[None], ones, np.ones((1, 2)))


def late(pushes) -> np.ndarray:
    """What is expected to come late after these pushes came late, step by step."""
    coupling = lone()
    for push in pushes:
        coupling.impulse = np.zeros((1, 6))
        coupling.add_late_impulse()
        coupling.impulse = np.full((1, 6), float(push))
        coupling.record_late_impulse()
    return coupling.late_impulse


def test_what_alternates_is_not_expected_to_go_on():
    """The water's late push on a hull that rocks on its keel was taken for the next one's, which is the opposite."""
    assert np.abs(late([1.0, -1.0] * 10)).max() < 0.4
    assert late([1.0] * 10) == pytest.approx(1.0, abs=0.01)


def test_a_sunken_ship_does_not_rock(monkeypatch):
    """It lies on its keel; it rocked by 0.04 rad/s, to the other side in each step, and each was taken twice."""
    steps = []
    take_step = bodies.take_step
    monkeypatch.setattr(bodies, "take_step", lambda *args: (steps.append(1), take_step(*args))[1])
    sim = wt.Simulation(wt.Scene.load("sinking-ship").changed(spacing=0.05))
    sim.advance(20.0)
    steps.clear()
    turns, speeds = [], []
    for _ in range(120):
        sim.step()
        turns.append(np.linalg.norm(sim.bodies["ship"].angular_velocity))
        speeds.append(np.linalg.norm(sim.bodies["ship"].velocity))
    assert np.median(turns) < 0.015 and np.median(speeds) < 0.005
    assert len(steps) < 1.2 * 120

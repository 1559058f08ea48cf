"""Cups that are bodies hold water: nothing passes their walls, however they are knocked and shaken."""

import numpy as np
import pytest

import wavetank as wt
from wavetank.foundation.rotations import inverse, turned

pytest.importorskip("rapier3d")
WALL, WIDE, TALL = 0.05, 0.3, 0.4  # m: thickness, inner edge, height of the inside


def cup(bottom: float, **more) -> wt.Difference:
    """A cup whose floor's underside is at the height `bottom` [m]."""
    middle = bottom + 0.5 * (TALL + WALL)
    outer = wt.Box(center=(0, 0, 0), size=(WIDE + 2 * WALL, TALL + WALL, WIDE + 2 * WALL))
    inner = wt.Box(center=(0, WALL, 0), size=(WIDE, TALL + WALL, WIDE))
    return wt.Difference(name="cup", center=(0.6, middle, 0.5), parts=[outer, inner], density=2500.0, **more)


def water_in(bottom: float) -> wt.Block:
    floor = bottom + WALL
    half = 0.5 * WIDE
    return wt.Block(lower=(0.6 - half, floor, 0.5 - half), upper=(0.6 + half, floor + 0.2, 0.5 + half))


def outside(sim: wt.Simulation, over: np.ndarray | None = None) -> int:
    """Return how many particles are not where water can be that has not gone over the rim; mark who goes `over` it."""
    body = sim.bodies["cup"]
    x = turned(inverse(body.rotation), sim.positions.astype(float) - body.position)
    floor = 0.5 * (TALL + WALL) - TALL
    is_outside = (np.abs(x[:, [0, 2]]) > 0.5 * WIDE).any(axis=1) | (x[:, 1] < floor)
    if over is not None:
        over |= x[:, 1] > 0.5 * (TALL + WALL)
        is_outside &= ~over
    return int(is_outside.sum())


def test_a_cup_on_a_table_is_filled_and_knocked():
    table = wt.Box(name="table", center=(0.6, 0.15, 0.5), size=(1.1, 0.1, 0.9), friction=0.4)
    scene = wt.Scene(
        spacing=0.0375, tank=wt.Tank(size=(1.2, 1.0, 1.0)), fluids=[water_in(0.2)], solids=[table, cup(0.2)]
    )
    sim = wt.Simulation(scene)
    sim.advance(0.5)
    for knock in (0.5, -0.5, 0.4):
        sim.bodies["cup"].velocity = (knock, 0, 0.3 * knock)
        for _ in range(30):
            sim.step()
            assert outside(sim) == 0
    assert sim.bodies["cup"].position[1] == pytest.approx(0.425, abs=0.02), "it stands"


def test_a_cup_in_an_arm_is_shaken_for_twenty_seconds():
    grip = wt.Slider(name="arm", first="cup", at=(0.6, 0.6, 0.5), axis=(1, 0.15, 0), target="0.03*sin(11*t)")
    scene = wt.Scene(
        spacing=0.0375,
        tank=wt.Tank(size=(1.2, 1.2, 1.0)),
        fluids=[water_in(0.4)],
        solids=[cup(0.4)],
        joints=[grip.model_copy(update={"strength": 5000.0})],
    )
    sim, ways = wt.Simulation(scene), []
    over = np.zeros(sim.count, bool)
    for _ in range(1200):
        sim.step()
        ways.append(sim.joints["arm"].position)
        assert outside(sim, over) == 0
    assert over.sum() < 0.2 * sim.count, "it is shaken as fast as the water swings: sqrt(g k tanh(k h)) = 10 rad/s"
    assert max(ways) > 0.02 and min(ways) < -0.02, "it is shaken"

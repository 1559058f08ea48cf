"""Solids, gravity and forces that change by themselves in a running world."""

import math

import numpy as np
import pytest

import wavetank as wt
from wavetank import commands as c
from wavetank.device.compiler import download
from wavetank.scene.forces import Wind

TANK = wt.Tank(size=(1.0, 0.6))
POOL = wt.Block(lower=(0.2, 0.0), upper=(1.0, 0.2))


def piston(**fields) -> wt.Scene:
    """A pool with a piston at its left end."""
    box = wt.Box(name="piston", center=("0.05 + 0.08*sin(4*t)", 0.3), size=(0.2, 0.6))
    return wt.Scene(**{"spacing": 0.04, "tank": TANK, "fluids": [POOL], "solids": [box], "foam": 0.0} | fields)


def test_a_solid_is_where_its_motion_says_and_as_fast():
    sim = wt.Simulation(piston())
    for _ in range(20):
        sim.step()
        number = sim.solids.find("piston")
        x = sim.solids.poses[number][0][0]
        assert x == pytest.approx(0.05 + 0.08 * math.sin(4 * sim.time), abs=1e-12)
        sim.solids.follow(sim.time, 1 / 60)
        assert 0.0 < sim.solids.largest_speed(1 / 60, TANK.size) <= 0.33


def test_velocity_is_the_derivative_within_each_step():
    """Not of the frame: what water feels is the way of the solid in the step, over the step."""
    sim = wt.Simulation(piston(substeps=6))
    sim.step()
    sim.solids.follow(sim.time, 1 / 60)
    number = sim.solids.find("piston")
    for part in range(6):
        sim.solids.move_to(part / 6, (part + 1) / 6)
        ends = [download(a)[number, 0] for a in (sim.world.solids.old_position, sim.world.solids.position)]
        exact = [0.05 + 0.08 * math.sin(4 * (sim.time + (part + k) / 360)) for k in (0, 1)]
        assert ends == pytest.approx(exact, abs=1e-7)


def test_water_goes_with_the_wall():
    """What a piston pushes out of the way rises: a wall that moves by s lifts a pool by depth s / (L - s)."""
    box = wt.Box(name="piston", center=("0.1 + 0.1*smoothstep(0, 3, t)", 0.3), size=(0.2, 0.6))
    sim = wt.Simulation(piston(spacing=0.02, solids=[box]))
    sim.advance(4.0)
    x = sim.positions
    assert x[:, 0].min() > 0.299
    height = 2.0 * x[:, 1].mean()
    assert height == pytest.approx(0.2 * 0.8 / 0.7, rel=0.02)


def test_a_motion_is_the_same_again_and_from_a_file(tmp_path):
    sim = wt.Simulation(piston())
    sim.advance(0.3)
    sim.save(tmp_path / "state.npz")
    snapshot = sim.snapshot()
    sim.advance(0.3)
    whole = sim.digest()
    again = wt.Simulation.restore(tmp_path / "state.npz")
    again.advance(0.3)
    assert again.digest() == whole
    sim.resume(snapshot)
    sim.advance(0.3)
    assert sim.digest() == whole
    fresh = wt.Simulation(piston())
    fresh.advance(0.6)
    assert fresh.digest() == whole


def test_a_hand_takes_a_solid_from_its_motion_and_gives_it_back(tmp_path):
    sim = wt.Simulation(piston())
    sim.advance(0.2)
    sim.move("piston", position=(0.06, 0.3))
    sim.advance(0.2)
    number = sim.solids.find("piston")
    assert sim.solids.poses[number][0][0] == 0.06
    sim.save(tmp_path / "held.npz")
    sim = wt.Simulation.restore(tmp_path / "held.npz")
    sim.release("piston", within=0.3)
    places = []
    for _ in range(30):
        sim.step()
        places.append(float(sim.solids.poses[number][0][0]))
    assert max(np.abs(np.diff([0.06, *places]))) < 0.02  # no jump
    assert places[-1] == pytest.approx(0.05 + 0.08 * math.sin(4 * sim.time), abs=1e-9)
    with pytest.raises(wt.WavetankError, match="no motion of its own to go back to; solids with one: piston"):
        sim.release("tank x lower")


def test_grabbing_lets_go_to_the_motion():
    session = wt.Session(piston())
    session.apply(c.ToolBegin(tool="grab", origin=(0.05, 0.3, 1.0), direction=(0, 0, -1)))
    for _ in range(10):
        session.tick()
    number = session.sim.solids.find("piston")
    assert session.sim.solids.poses[number][0][0] == pytest.approx(0.05, abs=0.02)
    session.apply(c.ToolEnd())
    for _ in range(40):
        session.tick()
    expected = 0.05 + 0.08 * math.sin(4 * session.sim.time)
    assert session.sim.solids.poses[number][0][0] == pytest.approx(expected, abs=1e-9)
    scene = session.current_scene()
    assert scene.start_time == session.sim.time
    then = wt.Simulation(scene)
    assert then.solids.poses[number][0][0] == pytest.approx(expected, abs=1e-9)


def test_gravity_over_time_is_what_a_free_drop_feels(tmp_path):
    drop = wt.Ball(center=(0.5, 0.5), radius=0.1)
    scene = wt.Scene(spacing=0.05, gravity=["4*cos(3*t)", "-2*t"], fluids=[drop], foam=0.0)
    sim = wt.Simulation(scene)
    sim.advance(0.5)
    v = sim.velocities.mean(axis=0)
    assert v == pytest.approx([4 / 3 * math.sin(1.5), -0.25], abs=0.01)
    assert sim.gravity == pytest.approx((4 * math.cos(1.5), -1.0))
    sim.gravity = (0.0, 1.0)
    assert sim.gravity == (0.0, 1.0)
    sim.save(tmp_path / "held.npz")
    sim.step()
    held = wt.Simulation.restore(tmp_path / "held.npz")
    held.step()
    assert held.digest() == sim.digest()
    assert sim.velocities.mean(axis=0) - v == pytest.approx([0.0, 1 / 60], abs=1e-4)
    sim.release("gravity")
    assert sim.gravity == pytest.approx((4 * math.cos(3 * sim.time), -2 * sim.time))


def test_water_in_a_tilted_tank_stands_slanted():
    """Its surface is level in space: in the frame of the tank it slopes against the tilt."""
    tank = wt.Tank(size=(1.0, 0.6), tilt="10*deg*smoothstep(0, 2, t)")
    block = wt.Block(lower=(0, 0), upper=(1, 0.3))
    sim = wt.Simulation(wt.Scene(spacing=0.025, tank=tank, fluids=[block], foam=0.0))
    sim.advance(6.0)
    assert sim.gravity == pytest.approx((-9.81 * math.sin(math.radians(10)), -9.81 * math.cos(math.radians(10))))
    x = sim.positions
    columns = [x[np.abs(x[:, 0] - place) < 0.05, 1].max() for place in (0.1, 0.9)]
    assert (columns[1] - columns[0]) / 0.8 == pytest.approx(-math.tan(math.radians(10)), abs=0.05)


def test_forces_over_time():
    drop = wt.Ball(center=(0.5, 0.5), radius=0.1)
    wind = Wind(velocity=["5*step(0.25, t)", 0.0], drag=2.0)
    sim = wt.Simulation(wt.Scene(spacing=0.05, gravity=(0, 0), fluids=[drop], forces=[wind], foam=0.0))
    sim.advance(0.2)
    assert np.abs(sim.velocities).max() == 0.0
    sim.advance(0.3)
    assert sim.velocities[:, 0].mean() == pytest.approx(5 * (1 - math.exp(-0.5)), rel=0.03)


def test_what_has_no_value_later_stops_time_with_a_sentence():
    box = wt.Box(center=(0.1, 0.3), size=(0.1, 0.1), rotation="sqrt(90 - t)")
    session = wt.Session(piston(solids=[box], start_time=89.99))
    for _ in range(3):
        session.tick()
    assert session.paused
    assert session.notes == ["'sqrt(90 - t)' has no finite value at t = 90.0067 s; it must have one at every time."]

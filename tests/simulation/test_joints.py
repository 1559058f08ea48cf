"""Joints that are driven: angles and ways count from where they began, motors reach what they aim at."""

import math

import numpy as np
import pytest

import wavetank as wt
from wavetank.foundation.errors import WavetankError

pytest.importorskip("rapier3d")


def crane(**more) -> wt.Scene:
    """A mast that leans by 0.4 rad, an arm that hinges on it, a hook that slides out of the arm."""
    return wt.Scene(
        spacing=0.1,
        tank=wt.Tank(size=(2.0, 2.0, 1.0)),
        fluids=[wt.Block(lower=(0, 0, 0), upper=(2, 0.2, 1))],
        solids=[
            wt.Box(name="mast", center=(0.4, 1.0, 0.5), size=(0.1, 0.5, 0.1), mass=4.0, rotation=0.4, held=True),
            wt.Box(name="arm", center=(0.8, 1.25, 0.5), size=(0.7, 0.08, 0.1), mass=2.0, rotation=0.2),
            wt.Box(name="hook", center=(1.3, 1.35, 0.5), size=(0.2, 0.06, 0.06), mass=0.5, rotation=0.2),
        ],
        joints=[
            wt.Hinge(name="elbow", first="arm", second="mast", at=(0.4, 1.25, 0.5), **more),
            wt.Slider(name="tele", first="hook", second="arm", at=(1.2, 1.33, 0.5), axis=(1, 0.2, 0), target=0.0),
        ],
    )


def test_a_motor_turns_to_its_target():
    sim = wt.Simulation(crane(target=0.0))
    elbow = sim.joints["elbow"]
    assert elbow.position == pytest.approx(0.0, abs=1e-6)
    sim.advance(0.5)
    assert elbow.position == pytest.approx(0.0, abs=0.02), "it holds the arm up, against its weight"
    elbow.target = 0.5
    sim.joints["tele"].target = -0.1
    sim.advance(0.5)
    assert elbow.position == pytest.approx(0.5, abs=0.02)
    assert sim.joints["tele"].position == pytest.approx(-0.1, abs=0.005)
    assert elbow.velocity == pytest.approx(0.0, abs=0.02)
    elbow.strength = 5.0
    sim.advance(0.5)
    torque = 9.81 * sum(body.mass * (body.position[0] - 0.4) for body in sim.bodies.values() if body.name != "mast")
    assert torque > 5.0 and elbow.position < 0.3, "statics: it needs more than that"


def test_a_motor_follows_an_expression_and_limits_count_from_the_start():
    sim = wt.Simulation(crane(target="0.4*sin(4*t)"))
    for _ in range(60):
        sim.step()
        assert sim.joints["elbow"].position == pytest.approx(0.4 * math.sin(4 * sim.time), abs=0.03)
    assert sim.joints["elbow"].velocity == pytest.approx(1.6 * math.cos(4 * sim.time), abs=0.1)
    with pytest.raises(WavetankError, match="follows what its scene says"):
        sim.joints["elbow"].target = 1.0
    sim = wt.Simulation(crane(limits=(-0.3, 0.1)))
    sim.advance(1.0)
    assert sim.joints["elbow"].position == pytest.approx(-0.3, abs=0.02), "it hangs at its limit"


def test_what_a_hand_sets_is_saved_and_outlives_other_solids(tmp_path):
    sim = wt.Simulation(crane(target=0.0))
    sim.joints["elbow"].target = 0.3
    sim.advance(0.3)
    sim.save(tmp_path / "state.npz")
    again = wt.Simulation.restore(tmp_path / "state.npz")
    assert again.joints["elbow"].target == pytest.approx(0.3)
    sim.advance(0.2)
    again.advance(0.2)
    assert sim.digest() == again.digest()
    sim.add_solid(wt.Sphere(name="ball", center=(1.6, 1.6, 0.5), radius=0.1, density=300))
    sim.advance(0.3)
    assert sim.joints["elbow"].position == pytest.approx(0.3, abs=0.02)
    assert sim.joints["tele"].position == pytest.approx(0.0, abs=0.01), "and the hook has stayed in the arm"


def test_a_rope_between_bodies_keeps_its_ends_when_another_solid_comes():
    """Ends are where they were at the start, in the frames of their solids, however these have moved since."""
    sim = wt.Simulation(
        wt.Scene(
            spacing=0.1,
            tank=wt.Tank(size=(2.0, 2.0, 1.0)),
            fluids=[wt.Block(lower=(0, 0, 0), upper=(2, 0.2, 1))],
            solids=[
                wt.Sphere(name="a", center=(0.6, 1.7, 0.5), radius=0.1, mass=3.0, velocity=(1.0, 0, 0)),
                wt.Sphere(name="b", center=(1.0, 1.7, 0.5), radius=0.1, mass=3.0, velocity=(1.0, 0, 0)),
            ],
            joints=[wt.Rope(first="a", second="b", at=(0.6, 1.7, 0.5), to=(1.0, 1.7, 0.5))],
        )
    )
    sim.advance(0.3)
    before = sim.bodies["a"].velocity
    sim.add_solid(wt.Sphere(name="ball", center=(0.3, 0.6, 0.5), radius=0.1, density=300))
    sim.step()
    assert np.abs(sim.bodies["a"].velocity - before)[0] < 0.02, "nothing pulls at it"


@pytest.mark.parametrize(
    ("more", "what"),
    [
        ({"speed": 1.0, "target": 1.0}, "a speed or a target, not both"),
        ({"target": "1/0*t"}, "target"),
        ({"target": [1, 2]}, "one number"),
        ({"target": [{"time": 1, "value": 0}, {"time": 0, "value": 1}]}, "times must rise"),
        ({"response": 0}, "response = 0"),
    ],
)
def test_what_no_motor_can_do_is_said(more, what):
    with pytest.raises(WavetankError, match=what):
        crane(**more)


def test_unknown_joints_and_numbers_are_refused():
    sim = wt.Simulation(crane())
    with pytest.raises(WavetankError, match="no joint named 'knee'; joints: elbow, tele"):
        sim.joints["knee"]
    with pytest.raises(WavetankError, match="must be a finite number"):
        sim.joints["elbow"].target = float("nan")

"""Bodies, joints, aims and mouths that make no sense are refused with one sentence when a scene is made."""

import pytest

import wavetank as wt
from wavetank.foundation.errors import WavetankError


def pool(**others):
    return wt.Scene(
        **{
            "spacing": 0.05,
            "tank": wt.Tank(size=(1, 1, 1)),
            "fluids": [wt.Block(lower=(0, 0, 0), upper=(1, 0.3, 1))],
            **others,
        }
    )


def crate(**others):
    return wt.Box(**{"name": "crate", "center": (0.5, 0.6, 0.5), "size": (0.2, 0.2, 0.2), "density": 500, **others})


def test_a_body_outside_of_the_tank():
    with pytest.raises(WavetankError, match=r"body 'crate', begins outside of the tank: its x is 5 m"):
        pool(solids=[crate(center=(5, 0.6, 0.5))])
    assert pool(solids=[crate(center=(0.5, 1.4, 0.5))], tank=wt.Tank(size=(1, 1, 1), open=["top"])).solids
    assert pool(solids=[wt.Box(center=(5, 0.6, 0.5), size=(0.2, 0.2, 0.2))]).solids, "what stays may lie about"


def test_a_target_that_no_motor_reaches():
    with pytest.raises(WavetankError, match=r"target = 2 of a joint is outside of its limits"):
        wt.Hinge(first="crate", at=(0.5, 0.6, 0.5), target=2, limits=(-0.1, 0.1))
    assert wt.Hinge(first="crate", at=(0.5, 0.6, 0.5), target=0.1, limits=(-0.1, 0.1)).target == 0.1


def test_an_aim_that_asks_for_no_body():
    goal = {
        "text": "Bring it.",
        "seconds": 5,
        "aims": [{"kind": "bring", "body": "boat", "lower": [0, 0, 0], "upper": [1, 1, 1], "share": 0.5}],
    }
    with pytest.raises(
        WavetankError, match=r"goal\.aims\[0\]\.body = 'boat' is not a body of the scene; they are: crate"
    ):
        pool(solids=[crate()], goal=goal)
    assert pool(solids=[crate(name="boat")], goal=goal).goal is not None


def test_a_mouth_that_lets_nothing_out():
    tap = wt.Emitter(position=(0.5, 0.6, 0.5), direction=(0, -1, 0), radius=0.001, speed=1)
    with pytest.raises(WavetankError, match=r"emitters\[0\] has an inlet so small"):
        wt.Simulation(pool(emitters=[tap]))


def test_a_robot_in_a_flat_world(tmp_path):
    pytest.importorskip("rapier3d")
    (tmp_path / "a.xml").write_text("<mujoco><worldbody><body><geom size='0.1'/></body></worldbody></mujoco>")
    flat = wt.Scene(spacing=0.1, tank=wt.Tank(size=(1, 1)), fluids=[wt.Block(lower=(0, 0), upper=(1, 0.3))])
    with pytest.raises(WavetankError, match="needs a 3-D world"):
        wt.load_robot(tmp_path / "a.xml").joined(flat)

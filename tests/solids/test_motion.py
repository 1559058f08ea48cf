"""Solids that move by themselves, as data and as functions of time."""

import math

import numpy as np
import pytest

import wavetank as wt
from wavetank.foundation.rotations import turned, unit_quaternion

REST = (np.array([0.5, 0.2, 0.0]), unit_quaternion(0.0))


def test_keyframes_of_angles_may_turn_all_the_way():
    path = wt.Motion(keyframes=[{"time": 0, "rotation": 0}, {"time": 4, "rotation": "360*deg"}], after="loop").path()
    for time in (0.5, 1.0, 3.0, 5.0, 41.5):
        place, turn = path.pose(time, REST)
        assert place is REST[0]
        assert abs(turn @ unit_quaternion(time * math.pi / 2)) == pytest.approx(1.0)


def test_quaternions_go_the_shortest_way():
    a, b = unit_quaternion(0.0), unit_quaternion(1.0)
    keys = [{"time": 0, "rotation": a.tolist()}, {"time": 1, "rotation": (-b).tolist()}]
    path = wt.Motion(keyframes=keys).path()
    assert abs(path.rotation(0.25) @ unit_quaternion(0.25)) == pytest.approx(1.0)
    eased = wt.Motion(keyframes=keys, between="smooth").path()
    assert abs(eased.rotation(0.25) @ unit_quaternion(0.25**2 * 2.5)) == pytest.approx(1.0)


def test_expressions_of_a_place_and_an_angle_about_an_axis():
    path = wt.Motion(position=["0.5 + 0.1*t", 0.2], rotation="t", axis=[0, 2, 0]).path()
    place, turn = path.pose(2.0, REST)
    assert place.tolist() == pytest.approx([0.7, 0.2, 0.0])
    assert turned(turn, np.array([1.0, 0, 0])) == pytest.approx([math.cos(2), 0, -math.sin(2)])


def test_expressions_in_the_places_of_numbers_are_a_motion():
    box = wt.Box(center=["0.5 + 0.1*sin(t)", 0.3], size=(0.1, 0.1), rotation="0.4 + t")
    assert box.center == (0.5, 0.3)
    assert box.rotation == pytest.approx(0.4)
    assert box.motion == wt.Motion(position=["0.5 + 0.1*sin(t)", 0.3], rotation="0.4 + t")


def test_motion_goes_to_a_file_and_back_and_scales():
    solids = [
        wt.Box(center=["0.5 + 0.1*sin(t)", 0.3], size=(0.1, 0.1)),
        wt.Sphere(
            center=(0.2, 0.2),
            radius=0.05,
            motion=[{"time": 0, "position": [0.2, 0.2]}, {"time": 1, "position": ["0.1*2", 0.4]}],
        ),
    ]
    scene = wt.Scene(spacing=0.05, tank=wt.Tank(size=(1, 1), tilt="0.1*t"), gravity=["sin(t)", -9.81], solids=solids)
    assert wt.Scene.from_text(scene.text()) == scene
    assert wt.Scene.model_validate_json(scene.model_dump_json()) == scene
    big = scene.scaled(2.0)
    assert big.solids[0].motion.path().position(1.0) == pytest.approx([1.0 + 0.2 * math.sin(1), 0.6])
    assert big.solids[1].motion.path().position(0.5) == pytest.approx([0.4, 0.6])
    assert big.gravity_track == scene.gravity_track


def test_a_function_is_refused_and_can_be_sampled():
    with pytest.raises(wt.WavetankError, match="wt.Motion.sampled"):
        wt.Box(center=(0, 0), size=(1, 1), motion=lambda t: (None, t))
    motion = wt.Motion.sampled(lambda t: ((0.1 * t * t, 0.0), math.sin(t)), seconds=2.0, rate=100)
    box = wt.Box(center=(0, 0), size=(1, 1), motion=motion)
    assert box.motion.path().position(1.005)[0] == pytest.approx(0.1 * 1.005**2, abs=1e-5)
    assert wt.sampled(lambda t: 2 * t, 0.5, 4) == [{"time": 0.25 * k, "value": 0.5 * k} for k in range(3)]


@pytest.mark.parametrize(
    ("motion", "complaint"),
    [
        ([{"time": 1, "position": [0, 0]}, {"time": 0.5, "position": [1, 0]}], "keyframe 1 is at time = 0.5 s"),
        ([{"time": 1, "position": [0, 0]}, {"time": 2}], "either every keyframe or none must have a position"),
        ([{"time": 0}], "need a position or a rotation"),
        ([], "either keyframes"),
        ({"rotation": "1/(t-3)"}, "divides by zero at t = 3 s"),
        ({"rotation": ["sin(t)", 0, 0, 0]}, "not a quaternion"),
        ({"rotation": "t", "axis": [0, 0, 0]}, "has no direction"),
        ({"position": ["x", 0]}, "'x' in 'x' is not known"),
        ({"keyframes": [{"time": 0, "position": [0, 0]}, {"time": 1, "position": [1, 0]}], "after": "loop"}, "jump"),
        ({"keyframes": [{"time": 0, "rotation": 0}, {"time": 1, "rotation": 1}], "after": "loop"}, "whole turns"),
        ({"rotation": "t", "keyframes": [{"time": 0, "rotation": 0}]}, "either keyframes"),
        ([{"time": 0, "positon": [0, 0]}], "did you mean 'position'"),
    ],
)
def test_what_is_no_motion_is_told_in_one_sentence(motion, complaint):
    with pytest.raises(wt.WavetankError, match=complaint) as told:
        wt.Box(center=(0, 0), size=(1, 1), motion=motion)
    assert "\n" not in str(told.value)


def test_a_motion_lives_in_the_dimension_of_its_world():
    box = wt.Box(center=(0.5, 0.5), size=(0.1, 0.1), motion={"position": ["t", 0, 0]})
    with pytest.raises(wt.WavetankError, match=r"solids\[0\].motion.position .* 3 components in a 2-D world"):
        wt.Scene(spacing=0.1, tank=wt.Tank(size=(1, 1)), solids=[box])


def test_parts_move_with_the_whole():
    part = wt.Sphere(center=(0, "t"), radius=0.1)
    with pytest.raises(wt.WavetankError, match="parts of a solid cannot have a motion"):
        wt.Union(parts=[part, wt.Sphere(center=(1, 0), radius=0.1)])


def test_motion_and_an_expression_besides_is_one_too_many():
    with pytest.raises(wt.WavetankError, match="give one of the two"):
        wt.Sphere(center=(0, "t"), radius=0.1, motion={"rotation": "t"})

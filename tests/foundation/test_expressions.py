"""Numbers over time: the grammar of expressions, keyframes, and models that hold them."""

import math

import numpy as np
import pytest

from wavetank import WavetankError
from wavetank.foundation.expressions import expression
from wavetank.foundation.tracks import Keys, checked_track, track
from wavetank.scene.forces import Attract, Wind


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("0.3*sin(2*pi*0.8*t)", 0.3 * math.sin(2 * math.pi * 0.8 * 1.7)),
        ("-t**2 + 3", 3 - 1.7**2),
        ("t^2", 1.7**2),
        ("mod(t, 0.5)", 0.2),
        ("step(1, t) + step(2, t)", 1.0),
        ("smoothstep(1, 2, t)", 0.7**2 * (3 - 1.4)),
        ("clamp(t, 0, 1) + min(t, 4, 0.5) + max(t, 2)", 1.0 + 0.5 + 2.0),
        ("45*deg", math.pi / 4),
        (
            "atan2(sqrt(t), exp(-t)) + abs(log(t + 1)) + floor(t)",
            math.atan2(1.7**0.5, math.exp(-1.7)) + math.log(2.7) + 1,
        ),
    ],
)
def test_expressions_are_what_they_say(text, value):
    assert expression(text)(1.7) == pytest.approx(value, rel=1e-14)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("1/(t-2)", "divides by zero at t = 2 s"),
        ("sqrt(1-t)", "no finite value at t = 1.05 s"),
        ("exp(t**4)", "no finite value"),
        ("2**9999", "no finite value at t = 0 s"),
        ("speed*2", "'speed' in 'speed.2' is not known; known are t, pi"),
        ("t.real", "'t.real'"),
        ("__import__('os').system('true')", "is not known"),
        ("(lambda: 1)()", "is not known"),
        ("[t][0]", "is not known"),
        ("t if t else 1", "is not known"),
        ("True", "is not known"),
        ("'1'", "is not known"),
        ("sin(t, t)", "sin in .* takes 1 number"),
        ("sin(x=t)", "takes 1 number"),
        ("3 +", "is not an expression of t"),
        ("", "is not an expression of t"),
        ("t+" * 300 + "t", "at most 400"),
        ("(" * 190 + "t" + ")" * 190, "t"),
    ],
)
def test_what_is_no_expression_is_told_in_one_sentence(text, complaint):
    try:
        expression(text)
    except WavetankError as error:
        import re

        assert re.search(complaint, str(error)), str(error)
        assert "\n" not in str(error)
        assert len(str(error)) < 400
    else:
        assert text.startswith("(")  # brackets alone do no harm


def test_a_pole_beyond_the_first_minute_is_found_when_it_comes():
    late = expression("1/(t-90)")
    assert late(89.0) == -1.0
    with pytest.raises(WavetankError, match="divides by zero at t = 90 s"):
        late(90.0)


def test_keyframes_are_joined_by_lines_and_hold():
    keys = Keys([1.0, 2.0, 4.0], np.array([[0.0], [1.0], [0.0]]))
    assert [keys(t)[0] for t in (0.0, 1.5, 2.0, 3.0, 9.0)] == [0.0, 0.5, 1.0, 0.5, 0.0]
    loop = Keys([1.0, 2.0, 4.0], np.array([[0.0], [1.0], [0.0]]), after="loop")
    assert [loop(t)[0] for t in (0.0, 4.5, 6.0, 301.5)] == [0.0, 0.5, 0.5, 0.5]


def test_smooth_keyframes_never_overshoot_and_have_no_corners():
    """Fritsch and Carlson 1980: monotone where the keyframes are."""
    keys = Keys([0.0, 1.0, 1.2, 3.0, 4.0], np.array([[0.0], [0.1], [2.0], [2.0], [1.0]]), between="smooth")
    t = np.linspace(0.0, 4.0, 4001)
    values = np.array([keys(time)[0] for time in t])
    assert values.min() >= 0.0
    assert values.max() <= 2.0
    assert np.all(np.diff(values[t <= 1.2]) >= 0.0)
    slope = np.diff(values) / 1e-3
    assert np.abs(np.diff(slope)).max() < 0.5  # the steepest section has a slope of 14, lines would jump by 9
    assert [keys(time)[0] for time in (0.0, 1.0, 1.2, 3.0, 4.0)] == pytest.approx([0.0, 0.1, 2.0, 2.0, 1.0])


@pytest.mark.parametrize(
    ("plain", "size", "complaint"),
    [
        ([{"time": 1, "value": 0}, {"time": 1, "value": 2}], None, "flow: keyframes: keyframe 1 is at time = 1 s and"),
        ([{"time": 0, "value": [0, 1]}], None, "flow gives 2 numbers; it must give one number"),
        ([{"time": 0, "value": 0}, {"time": 1}], None, "time \\[s\\] and value"),
        ({"keyframes": [{"time": 0, "value": 0}], "after": "bounce"}, None, "hold, loop"),
        (["t", 1.0], 3, "gives 2 numbers; it must give 3"),
        ([math.nan], 1, "not a finite number"),
        (lambda t: t, None, "is a Python function"),
        ([True], 1, "not a finite number"),
    ],
)
def test_what_is_no_track_is_told_in_one_sentence(plain, size, complaint):
    with pytest.raises(WavetankError, match=complaint):
        checked_track(plain, "flow", size)


def test_a_track_of_components():
    assert track(["2*t", 1])(3.0).tolist() == [6.0, 1.0]


def test_numbers_of_a_model_change_with_time_and_stay_allowed():
    wind = Wind(velocity=["3*sin(t)", 0.0, "1"], drag=[{"time": 0, "value": 1.0}, {"time": 2, "value": 3.0}])
    assert wind.velocity == (0.0, 0.0, 1.0)
    later = wind.at(1.0)
    assert later.velocity == pytest.approx((3 * math.sin(1.0), 0.0, 1.0))
    assert later.drag == 2.0
    with pytest.raises(WavetankError, match="at t = 1.05 s: drag = -0.05.* at least 0"):
        Attract(center=(0, 0), radius=1, strength=1, drag="1-t")
    with pytest.raises(WavetankError, match="strength: 'x' in 'x' is not known"):
        Attract(center=(0, 0), radius=1, strength="x")

"""Rotations from numbers of any size: files say what they like."""

import warnings

import numpy as np
import pytest

from wavetank.formats.splishsplash_solids import turn_of
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.rotations import length_of, turn_from_y, unit_quaternion


@pytest.fixture(autouse=True)
def _no_warning():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


@pytest.mark.parametrize("scale", [1e-200, 1e-3, 1.0, 1e200])
def test_lengths_are_right_where_squares_overflow_and_where_they_vanish(scale):
    """A length is as large as its vector, and a turn does not depend on how long its axis is."""
    assert length_of(scale * np.array([3.0, 0.0, 4.0])) == pytest.approx(5.0 * scale, rel=1e-15)
    turn = turn_of({"rotationAngle": 0.5, "rotationAxis": (scale, 0.0, 0.0)})
    assert np.allclose(turn, [np.cos(0.25), np.sin(0.25), 0.0, 0.0], atol=1e-15)


def test_huge_quaternions_and_axes_turn_as_small_ones_do():
    assert np.allclose(unit_quaternion([1e200, 0.0, 0.0, 1e200]), [np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)])
    assert np.allclose(turn_from_y(np.array([1e200, 0.0, 0.0])), turn_from_y(np.array([1.0, 0.0, 0.0])))


@pytest.mark.parametrize("rotation", [float("inf"), float("nan"), [1e308] * 4, [float("nan")] * 4, [[1.0]], [0.0] * 4])
def test_what_is_no_rotation_is_refused_in_a_sentence(rotation):
    with pytest.raises(WavetankError, match="is not"):
        unit_quaternion(rotation)


def test_what_is_no_rotation_in_a_file_is_refused_in_a_sentence():
    for row in ({"rotationAngle": float("inf")}, {"rotationAngle": 1.0, "rotationAxis": [float("nan"), 0.0, 0.0]}):
        with pytest.raises(WavetankError, match="is not a rotation"):
            turn_of(row)

"""What `heave` compares with: it begins and ends where a body in that tank does."""

import math

import numpy as np
import pytest

from wavetank.lab.cases.heave import BARGE, extremes, passings, sphere_theory
from wavetank.lab.cases.linear_waves import decay


def test_a_barge_comes_to_rest_where_its_water_has_room():
    """Volume is kept: lower while the barge is held up, the water lies in the end as high as at rest."""
    times = np.linspace(0.0, 200.0, 4000)
    way = decay(BARGE, 0.05, times, rolls=False)
    assert way[0] == pytest.approx(1.0, abs=1e-9)
    assert abs(way.mean()) < 0.01


def test_a_sphere_swings_as_waves_of_all_frequencies_let_it():
    """Cummins 1962, stepped in time: 0.3900 s in open water, and 1.2 % more where water lies lower at the start."""
    times = np.arange(0, 73) / 60
    way = sphere_theory(times)
    first, second = passings(times, way)[:2]
    assert way[0] == pytest.approx(1.0, abs=3e-3)
    assert second - first == pytest.approx(0.3948, abs=1e-3)
    assert math.isclose(way.min(), -0.897, abs_tol=3e-3)


def test_extremes_are_found_between_samples():
    """A damped swing turns where its velocity is zero: tan(w t) = -k / w, half a period apart."""
    times, k, w = np.arange(0, 80) / 60, 1.3, 7.1
    trough, crest = extremes(times, np.exp(-k * times) * np.cos(w * times))
    first = (math.pi - math.atan(k / w)) / w
    assert trough == pytest.approx(first, abs=5e-4)
    assert crest - trough == pytest.approx(math.pi / w, abs=1e-3)

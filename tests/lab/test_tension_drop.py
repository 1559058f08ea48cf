"""How `validate tension-drop` reads a period."""

import numpy as np
import pytest

from wavetank.lab.cases.tension_drop import periods


@pytest.mark.parametrize("period", [0.83, 0.9, 1.0, 1.07])
@pytest.mark.parametrize("phase", [0.0, 0.4])
def test_a_period_is_read_between_the_samples(period, phase):
    """It was read to a fortieth of a period, the distance of the samples."""
    t = np.arange(0.0, 2.0, 1.0 / 40.0)
    swing = 0.2 + np.exp(-0.3 * t) * np.cos(2.0 * np.pi * t / period + phase)
    found = periods(t.tolist(), swing.tolist())
    assert len(found) >= 2
    np.testing.assert_allclose(found, period, rtol=0.003)


def test_a_curve_without_two_extremes_has_no_period():
    assert len(periods([0.025 * k for k in range(40)], [0.1 * k for k in range(40)])) == 0

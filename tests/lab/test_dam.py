"""How falls of one dam are compared."""

import numpy as np
import pytest

from wavetank.lab.cases.dam import Fall, compare, fall, scene


def moved(far: float, high: float) -> Fall:
    times = 0.1 * np.arange(1, 41)
    return Fall(times, far * (1.0 + times)[None], high * np.sin(times)[None])


def test_falls_differ_by_their_fronts_and_run_ups():
    figures = compare("x", {"one": moved(1.0, 1.0), "other": moved(1.02, 1.05)}, 1.5, 4.0)
    assert [figure.value for figure in figures] == pytest.approx([100 * 0.02 / 1.01, 5.0], rel=1e-3)
    assert [figure.passed for figure in figures] == [False, False]


def test_the_dam_reaches_the_wall_at_any_scale():
    """Ritter 1892: behind 98 % of the water the front is slower than 2 sqrt(g H)."""
    for high in (0.01, 10.0):
        one = fall(scene(12, high, frame_time=high**0.5 / 60), "cpu", 1, high)
        assert one.times[0] == pytest.approx(0.1)
        assert one.front[19] == pytest.approx(2.85, abs=0.25)
        assert one.run_up > 0.7

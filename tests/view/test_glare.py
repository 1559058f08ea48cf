"""Glare: the point spread function of an eye, by Spencer et al. (1995)."""

import math

import numpy as np
import pytest

import wavetank as wt
from wavetank.view.glare import BRIGHT, excess_of, kernel_of, spread_of

DEGREE = math.radians(1.0)


def test_the_shares_of_the_light_are_those_of_the_eye():
    """Eq. 8: a tenth of a degree off it is 0.478 f1 + 0.138 f2; 0.384 and more stay; none is lost."""
    kernel = kernel_of((256, 256), 0.1 * DEGREE)
    assert kernel.sum() == pytest.approx(1.0) and np.all(kernel >= 0.0)
    expected = (0.478 * 20.91 / 0.12**3 + 0.138 * 72.37 / 0.12**2) * (0.1 * DEGREE) ** 2
    assert kernel[0, 1] == pytest.approx(expected, rel=1e-3) and kernel[255, 0] == pytest.approx(kernel[0, 1])
    assert 0.7 < kernel[0, 0] < 0.9
    # Ten times as far off, the square to the cube of that less.
    assert 1e-3 < kernel[0, 10] / kernel[0, 1] < 1e-2


def test_what_a_display_can_show_is_left_as_it_is():
    picture = np.full((16, 24, 3), BRIGHT, np.float32)
    assert not excess_of(picture).any()
    picture[8, 12] = (8.0, 4.0, 2.0)
    excess = excess_of(picture)
    assert excess[8, 12] == pytest.approx(np.array([8.0, 4.0, 2.0]) * (1.0 - BRIGHT / 8.0))
    spread = spread_of(excess, 0.05 * DEGREE)
    assert spread.sum() <= excess.sum() and spread[8, 13].sum() > spread[8, 20].sum() > 0.0


@pytest.mark.parametrize("quality", ["high", "film"])
def test_the_sky_beside_the_sun_is_brighter_with_glare(quality):
    scene = wt.Scene(spacing=0.1, tank=wt.Tank(size=(1.0, 1.0, 1.0)), light={"environment": "sky"})
    sim = wt.Simulation(scene.changed(fluids=[wt.Points(positions=[[0.5, 0.05, 0.5]])]))
    camera = wt.Camera(eye=(0.5, 0.5, -2.0), target=(0.5, 1.0, 2.0), field_of_view=math.radians(30.0))
    options = {"quality": quality, "samples": 2, "sun": "0,16", "camera": camera, "edges": False}
    plain, glaring = (wt.render(sim, 96, 64, glare=on, **options).astype(int) for on in (False, True))
    change = (glaring - plain).sum(axis=2)
    # What is itself bright gives some of its light away.
    assert change.max() > 6 and change.mean() > 0.5 and (change >= -3).mean() > 0.99
    usual = wt.render(sim, 96, 64, **options)
    np.testing.assert_array_equal(usual, glaring)

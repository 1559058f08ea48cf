"""Solids at the seams of a world that repeats."""

import numpy as np
import pytest

import wavetank as wt
from wavetank.device.compiler import qd
from wavetank.device.periods import periods_of
from wavetank.device.state import vectors
from wavetank.solids.build import build
from wavetank.solids.distance import SolidSet, signed_distance
from wavetank.solids.seams import seen_periods


@qd.kernel(fastcache=True)
def ask(values: qd.types.ndarray(), x: qd.types.ndarray(), solids: SolidSet):
    for i in range(x.shape[0]):
        values[i] = signed_distance(solids, 0, x[i])


def distances(solid, x, axes=(0,), size=(2.0, 1.0, 1.0)):
    """(gradient, distance) of a solid at `x` in a world that repeats."""
    periods = periods_of(axes, (0, 0, 0), size)
    device = build([solid], 0, 0.0, 0.02, (periods.axes, seen_periods([solid], periods, 0.02)))
    places, found = vectors(3, len(x)), vectors(4, len(x))
    places.from_numpy(np.asarray(x, np.float32))
    ask(found, places, device)
    return found.to_numpy()


def test_a_ball_at_the_seam_is_seen_from_both_sides():
    ball = wt.Sphere(center=(1.95, 0.5, 0.5), radius=0.2)
    found = distances(ball, [[1.7, 0.5, 0.5], [0.2, 0.5, 0.5], [0.1, 0.5, 0.5]])
    np.testing.assert_allclose(found[:, 3], [0.05, 0.05, -0.05], atol=1e-6)
    np.testing.assert_allclose(found[:, 0], [-1.0, 1.0, 1.0], atol=1e-6)


def test_what_is_longer_than_half_the_world_is_seen_where_it_stands():
    floor = wt.Box(center=(1.0, 0.0, 0.5), size=(9.0, 0.2, 9.0))
    found = distances(floor, [[0.01, 0.3, 0.5], [1.99, 0.3, 0.5]])
    np.testing.assert_allclose(found[:, 3], 0.2, atol=1e-6)


@pytest.mark.parametrize(
    ("solid", "wrong"),
    [
        (wt.Box(center=(1.0, 0, 0.5), size=(1.95, 0.1, 9)), r"solids\[0\] goes from x = 0.025 to 1.975 m"),
        (wt.Capsule(start=(0.5, 0, 0.5), end=(2.2, 0, 0.5), radius=0.1), "too long to be seen on both sides"),
    ],
)
def test_what_is_too_long_for_the_seam_is_refused(solid, wrong):
    with pytest.raises(wt.WavetankError, match=wrong):
        wt.Scene(spacing=0.02, tank=wt.Tank(size=(2, 1, 1), periodic=["x"]), solids=[solid])


@pytest.mark.parametrize(
    "solid",
    [
        wt.Box(center=(1.0, 0, 0.5), size=(1.5, 0.1, 9)),
        wt.Box(center=(1.0, 0, 0.5), size=(2.2, 0.1, 9)),
        wt.HalfSpace(point=(0, 0.1, 0), normal=(0, 1, 0)),
        wt.Sphere(center=(0, 0.1, 0.5), radius=0.4),
    ],
)
def test_what_keeps_away_goes_through_or_is_short_is_allowed(solid):
    wt.Scene(spacing=0.02, tank=wt.Tank(size=(2, 1, 1), periodic=["x"]), solids=[solid])

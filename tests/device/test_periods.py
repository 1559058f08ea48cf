"""The nearest image, and the image within the world."""

import numpy as np
import pytest

from wavetank.device.compiler import qd
from wavetank.device.periods import NONE, Periods, nearest_image, periods_of, within
from wavetank.device.state import nowhere, vectors


@qd.kernel(fastcache=True)
def apply(images: qd.types.ndarray(), inside: qd.types.ndarray(), x: qd.types.ndarray(), periods: Periods):
    for i in range(x.shape[0]):
        images[i] = nearest_image(x[i], periods)
        inside[i] = within(x[i], periods)


def both(x, periods):
    """Nearest images of the vectors `x`, and their images within."""
    x = np.asarray(x, np.float32)
    device, images, inside = (vectors(x.shape[1], len(x)) for _ in range(3))
    device.from_numpy(x)
    apply(images, inside, device, periods)
    return images.to_numpy(), inside.to_numpy()


def test_a_world_that_does_not_repeat_changes_nothing():
    x = np.random.default_rng(0).normal(0, 9, (50, 3)).astype(np.float32)
    assert periods_of([], (0, 0, 0), (1, 1, 1)) is NONE
    for found in both(x, NONE):
        np.testing.assert_array_equal(found, x)


@pytest.mark.parametrize("axes", [[0], [1], [0, 2], [0, 1, 2]])
def test_differences_are_those_of_the_nearest_images(axes):
    size, lower = np.array([2.0, 3.0, 0.5]), np.array([-1.0, 0.5, 0.0])
    rng = np.random.default_rng(1)
    a, b = (lower + rng.uniform(0, 1, (200, 3)) * size for _ in range(2))
    found, _ = both(a - b, periods_of(axes, lower, size))
    expected = a - b
    expected[:, axes] -= (size * np.round((a - b) / size))[:, axes]
    np.testing.assert_allclose(found, expected, atol=2e-6)
    back, _ = both(b - a, periods_of(axes, lower, size))
    np.testing.assert_array_equal(back, -found)


def test_what_is_nowhere_stays_there_in_a_world_that_repeats_everywhere():
    found, _ = both([[nowhere.fn()] * 3], periods_of([0, 1, 2], (0, 0, 0), (1, 1, 1)))
    assert (np.abs(found) > 1e5).all()


def test_images_within_are_never_at_the_upper_end():
    """Rounding puts what is a hair below the lower end at the upper one, which is the lower one's image."""
    low, high = np.float32(0.1), np.float32(0.1) + np.float32(2.3)
    x = np.array([-1e-9, -1e-7, 2.3, 2.4, 4.6, -7.3, 0.5, 0.1], np.float32)
    _, found = both(np.stack([x, x], 1), periods_of([0], (0.1, 0.0), (2.3, 1.0)))
    assert (found[:, 0] >= low).all()
    assert (found[:, 0] < high).all()
    np.testing.assert_array_equal(found[:, 1], x)
    assert found[-2, 0] == x[-2]
    np.testing.assert_allclose(np.sin(2 * np.pi * (found[:, 0] - x) / 2.3), 0.0, atol=1e-5)


def test_what_is_no_number_stays_none():
    _, found = both([[np.nan, 1.0]], periods_of([0], (0, 0), (1, 1)))
    assert np.isnan(found[0, 0])

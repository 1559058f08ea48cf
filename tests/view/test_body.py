"""A tank as a body of water: panes that mirror totally from within, edges that do not fade, the bent ray's end."""

import numpy as np
import pytest
from test_ellipsoids import lattice
from worlds import frame_of

from wavetank import Box, Camera, Scene, Tank
from wavetank.view.renderer import Renderer

D = 0.05
SIZE = (240, 180)


def filled(height=0.6, solids=()):
    x = lattice((0, 0, 0), (1.0, height, 1.0)) if height else np.zeros((0, 3))
    return frame_of(Scene(spacing=D, tank=Tank(size=(1.0, 1.0, 1.0)), solids=list(solids)), x)


def picture(frame, camera):
    return Renderer(*SIZE).render(frame, camera, view="water").astype(int)


def around(image, camera, point, half=2):
    column, row, _ = camera.project(point, *SIZE)[0]
    return image[int(row) - half : int(row) + half + 1, int(column) - half : int(column) + half + 1].reshape(-1, 3)


@pytest.mark.parametrize("x", [0.04, 0.96])
def test_water_does_not_fade_towards_the_edges_of_a_pane(x):
    """Seen aslant the straight way through the far corner is short; the bent ray is mirrored and goes on."""
    camera = Camera(eye=(2.6 if x < 0.5 else -1.6, 0.9, 2.6), target=(0.5, 0.3, 0.5))
    wet, dry = (picture(filled(height), camera) for height in (0.6, 0.0))
    change = [np.abs(around(wet, camera, p) - around(dry, camera, p)).mean() for p in ((x, 0.3, 1.0), (0.5, 0.3, 1.0))]
    assert change[0] > 0.5 * change[1] > 15


def test_a_pane_mirrors_totally_what_comes_in_through_the_one_beside():
    """A red wall behind the right pane is not seen through the front pane: sin^2 + sin^2 > 1 for both angles (Snell).

    A ray that enters the front pane at any angle is within 48.6 degrees of its normal in the water, and at least 41.4
    degrees from that of the pane beside; it leaves there only where it came in at more than 62 degrees.
    """
    red = Box(center=(1.6, 0.5, 0.5), size=(0.1, 1.0, 2.4), color="#ff0000")
    camera = Camera(eye=(0.3, 0.45, 2.6), target=(0.9, 0.3, 1.0), field_of_view=0.5)

    def change(height):
        seen = [around(picture(filled(height, solids), camera), camera, (0.92, 0.3, 1.0), 3) for solids in ((red,), ())]
        return np.abs(seen[0] - seen[1]).mean()

    assert change(0.0) > 40
    assert change(0.6) < 3


def test_the_floor_is_lifted_as_snell_has_it():
    """From straight above, the floor below the depth h appears at 3/4 of it: a stripe is 4/3 of a spread nearer.

    The ray at the angle t from the vertical meets the floor h (tan t - tan asin(sin t / 1.33)) nearer to the middle.
    """
    camera = Camera(eye=(0.5, 2.0, 0.5), target=(0.5, 0.0, 0.5))
    stripe = Box(center=(0.8, -0.02, 0.5), size=(0.03, 0.05, 0.9), color="#000000")
    x = lattice((0, 0, 0), (1.0, 0.6, 1.0))
    columns = []
    for water in (x, np.zeros((0, 3))):
        frame = frame_of(Scene(spacing=D, tank=Tank(size=(1.0, 1.0, 1.0)), solids=[stripe]), water)
        row = picture(frame, camera)[88:92].sum(axis=(0, 2)).astype(float)
        window = row[150:215] - np.median(row[150:215])
        columns.append(150 + int(np.argmin(window)))
    lens = camera.lens(*SIZE)
    slope = (columns[0] + 0.5 - 120) * lens.pixel  # tan of the angle at which the wet stripe is seen
    angle = np.arctan(slope)
    met = 0.5 + slope * (2.0 - 0.6) + 0.6 * np.tan(np.arcsin(np.sin(angle) / 1.33))
    assert columns[0] != columns[1]
    assert met == pytest.approx(0.8, abs=0.02)

"""Forces at a seam of a world that repeats."""

import numpy as np
import pytest

import wavetank as wt
from wavetank.physics.forces.jet import opening_of
from wavetank.scene.forces import Attract, Burst, Drag, Vortex, Wind
from wavetank.scene.forces.images import with_images
from wavetank.scene.forces.jet import Jet

RING = wt.Tank(size=(2.0, 1.0), lower=(-1.0, 0.0), periodic=["x"])
BOTH = wt.Tank(size=(2.0, 1.0, 2.0), periodic=["x", "z"])


def centers(force, tank):
    return [one.center for one in with_images([force], tank)]


def test_without_seams_there_are_no_images():
    force = Attract(center=(0.0, 0.5), radius=0.3, strength=1.0)
    for tank in (None, wt.Tank(size=(2.0, 1.0)), wt.Tank(size=(2.0, 1.0), lower=(-1.0, 0.0), periodic=["x"])):
        assert [*with_images([force], tank)] == [force]


@pytest.mark.parametrize(
    ("force", "tank", "expected"),
    [
        (Attract(center=(0.9, 0.5), radius=0.3, strength=1.0), RING, [(0.9, 0.5), (-1.1, 0.5)]),
        (Drag(center=(-0.9, 0.5), velocity=(1.0, 0.0), radius=0.3), RING, [(-0.9, 0.5), (1.1, 0.5)]),
        (Burst(center=(0.0, 0.5), radius=1.2, speed=1.0), RING, [(0.0, 0.5)]),
        (Wind(velocity=(0.0, 2.0), center=(0.9, 0.5), radius=0.3), RING, [(0.9, 0.5), (-1.1, 0.5)]),
        (Wind(velocity=(2.0, 0.0), center=(0.9, 0.5), radius=0.3), RING, [(0.9, 0.5)]),
        (Vortex(center=(1.9, 0.5, 1.0), radius=0.5, speed=1.0), BOTH, [(1.9, 0.5, 1.0), (-0.1, 0.5, 1.0)]),
        (
            Attract(center=(0.1, 0.5, 1.9), radius=0.3, strength=1.0),
            BOTH,
            [(0.1, 0.5, 1.9), (0.1, 0.5, -0.1), (2.1, 0.5, 1.9), (2.1, 0.5, -0.1)],
        ),
    ],
)
def test_what_reaches_over_a_seam_acts_at_the_other_side(force, tank, expected):
    np.testing.assert_allclose(centers(force, tank), expected, atol=1e-6)


def test_a_jet_in_a_mouth_at_the_seam_has_an_image():
    opening = opening_of(np.array([0.98, 0.5, 0.0]), np.eye(3), (0.1, 0.1), is_round=0, length=0.1, speed=1.0, fall=0.0)
    found = [one.opening.middle for one in with_images([Jet(opening=opening)], RING)]
    np.testing.assert_allclose(found, [(0.98, 0.5, 0.0), (-1.02, 0.5, 0.0)], atol=1e-6)


@pytest.mark.parametrize("place", [0.0, 1.0 - 1e-7])
def test_a_pull_at_the_seam_does_what_it_does_in_the_middle(place):
    """Shifted along the axis with all that is in it, a world does the same."""
    found = []
    for shift in (0.5, place):
        tank = wt.Tank(size=(1.0, 1.0), periodic=["x"])
        x = np.stack(np.meshgrid(np.arange(20), np.arange(10)), -1).reshape(-1, 2) * 0.02 + (0.3, 0.4)
        x[:, 0] = (x[:, 0] + shift - 0.5) % 1.0
        force = Attract(center=(shift, 0.5), radius=0.3, strength=5.0)
        sim = wt.Simulation(
            wt.Scene(spacing=0.02, tank=tank, gravity=(0, 0), forces=[force], fluids=[wt.Points(positions=x)])
        )
        sim.step()
        found.append(sim.velocities)
    assert np.abs(found[0]).max() > 0.03
    np.testing.assert_allclose(*found, atol=2e-4)

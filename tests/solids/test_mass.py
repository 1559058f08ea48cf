"""Volume, mass and inertia of solids, against the formulas of solid geometry."""

import os
import subprocess
import sys

import numpy as np
import pytest

import wavetank as wt
from wavetank.simulation.mass_properties import added_mass
from wavetank.solids.mass import Ruler, inertia_of


@pytest.fixture(autouse=True)
def device():
    from wavetank.device import compiler

    compiler.start("cpu")


def inertia(solid, dim=3):
    return inertia_of(solid, Ruler(solid, dim, 0.02).cut())


def test_boxes_are_exact_and_balls_nearly():
    """m = rho V; box: I = m (b^2 + c^2) / 12; ball: I = 2/5 m r^2; capsule of length l between its ends."""
    box = inertia(wt.Box(center=(0, 0, 0), size=(0.2, 0.3, 0.4), density=500))
    assert box.mass == pytest.approx(500 * 0.2 * 0.3 * 0.4, rel=1e-5)
    assert np.diag(box.tensor) == pytest.approx(box.mass / 12 * np.array([0.25, 0.2, 0.13]), rel=1e-4)
    ball = inertia(wt.Sphere(center=(0, 0, 0), radius=0.1, density=500))
    assert ball.mass == pytest.approx(500 * 4 / 3 * np.pi * 1e-3, rel=2e-3)
    assert np.diag(ball.tensor) == pytest.approx(0.4 * ball.mass * 0.01, rel=4e-3)
    capsule = inertia(wt.Capsule(start=(0, 0, 0), end=(0.3, 0, 0), radius=0.1, density=1))
    assert capsule.mass == pytest.approx(np.pi * 0.01 * 0.3 + 4 / 3 * np.pi * 1e-3, rel=5e-3)
    disc = inertia(wt.Sphere(center=(0, 0), radius=0.1, density=500), 2)
    assert disc.tensor[2, 2] == pytest.approx(0.5 * disc.mass * 0.01, rel=5e-3)


def test_what_is_cut_out_weighs_nothing_and_moves_the_centre():
    """A box with a hole on one side."""
    parts = [wt.Box(center=(0, 0, 0), size=(0.4, 0.2, 0.2)), wt.Box(center=(0.1, 0, 0), size=(0.1, 0.1, 0.1))]
    whole = inertia(wt.Difference(parts=parts, density=1000))
    assert whole.mass == pytest.approx(16.0 - 1.0, rel=0.01)
    assert whole.center[0] == pytest.approx(-0.1 / 15.0, rel=0.1)


def test_a_hollow_ball_turns_like_a_shell():
    """I = 2/3 m r^2."""
    shell = inertia(wt.Sphere(center=(0, 0, 0), radius=0.1, mass=2.0, hollow=True))
    assert shell.mass == 2.0
    assert np.diag(shell.tensor) == pytest.approx(2.0 / 3.0 * 2.0 * 0.01, rel=0.02)


def test_added_mass_is_lambs():
    """Sphere 1/2; disc-like ellipsoid as 8/3 rho r^3; circle 1 (Lamb 1932, Sec. 92, 114, 68)."""
    assert added_mass((1.0, 1.0, 1.0)) == pytest.approx((0.5, 0.0), abs=1e-3)
    flat, _ = added_mass((0.05, 1.0, 1.0))
    assert flat * 4 / 3 * np.pi * 0.05 == pytest.approx(8 / 3, rel=0.06)
    assert added_mass((1.0, 1.0)) == (1.0, 0.0)


WEIGH = """
from wavetank.device import compiler
from wavetank.scene.scene import Scene
from wavetank.solids.mass import Ruler, inertia_of

compiler.start("cpu")
for solid in Scene.load("crates").solids[:4]:
    found = inertia_of(solid, Ruler(solid, 3, 0.02).cut())
    print(found.tensor.tobytes().hex(), found.center.tobytes().hex())
"""


def test_inertia_is_the_same_whatever_threads_matrix_products_have():
    """They were summed by the BLAS, and a pile of crates ended elsewhere on one processor than on two."""
    with_threads = (os.environ | {"OPENBLAS_NUM_THREADS": number} for number in "12")
    found = [
        subprocess.run([sys.executable, "-c", WEIGH], env=env, capture_output=True, text=True, check=True).stdout
        for env in with_threads
    ]
    assert found[0].count("\n") == 4
    assert found[0] == found[1]

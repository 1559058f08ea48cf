import numpy as np
import pytest

import wavetank as wt
from wavetank.foundation.materials import Material
from wavetank.simulation.state import State


def scene(dim):
    """An empty world with three materials."""
    names = [Material(name="oil"), Material(name="honey", color="#e0a526")]
    return wt.Scene(spacing=0.1, tank=wt.Tank(size=(1.0,) * dim), materials=names, foam=1.0)


@pytest.fixture(params=[2, 3])
def frame(request):
    """What an exporter reads of a frame."""
    random, count, dim = np.random.default_rng(4), 17, request.param
    arrays = {
        "ids": np.cumsum(random.integers(1, 4, count)).astype(np.int32),
        "dyes": np.where(random.random(count) < 0.5, 64 << 24 | 0xC01030, 0).astype(np.int32),
        "positions": random.normal(size=(count, dim)).astype(np.float32),
        "velocities": random.normal(size=(count, dim)).astype(np.float32) * 1e-3,
        "densities": random.uniform(900, 1100, count).astype(np.float32),
        "materials": random.integers(0, 3, count).astype(np.int32),
        "foam_positions": random.normal(size=(5, dim)).astype(np.float32),
        "foam_velocities": random.normal(size=(5, dim)).astype(np.float32),
        "foam_kinds": np.array([1, 2, 3, 2, 1], np.int32),
        "foam_ages": random.uniform(0, 2, 5).astype(np.float32),
        "foam_ids": np.array([3, 8, 9, 11, 2**31 - 1], np.int32),
        "foam_lives": random.uniform(2, 3, 5).astype(np.float32),
    }
    return State.read(scene(dim), 7, 0.125, arrays, ())


@pytest.fixture
def nothing():
    """An instant without particles."""
    return State.read(scene(3), 0, 0.0, {}, ())

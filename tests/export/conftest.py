from types import SimpleNamespace

import numpy as np
import pytest


@pytest.fixture(params=[2, 3])
def frame(request):
    """What an exporter reads of a frame."""
    random, count, dim = np.random.default_rng(4), 17, request.param
    return SimpleNamespace(
        dim=dim, count=count, time=0.125, number=7,
        positions=random.normal(size=(count, dim)).astype(np.float32),
        velocities=random.normal(size=(count, dim)).astype(np.float32) * 1e-3,
        densities=random.uniform(900, 1100, count).astype(np.float32),
    )  # fmt: skip


@pytest.fixture
def nothing():
    """An instant without particles."""
    empty = np.zeros((0, 3), np.float32)
    return SimpleNamespace(dim=3, count=0, time=0.0, number=0, positions=empty, velocities=empty, densities=empty[:, 0])

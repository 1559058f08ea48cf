import numpy as np
import pytest
from worlds import frame_of

from wavetank import Scene, Tank


@pytest.fixture
def make_frame():
    return frame_of


@pytest.fixture
def tank_scene():
    """A metre of tank without solids."""
    return Scene(spacing=0.05, tank=Tank(size=(1.0, 1.0, 1.0)))


@pytest.fixture
def splash(tank_scene):
    """Some hundred particles of different speeds in a tank."""
    random = np.random.default_rng(5)
    return frame_of(
        tank_scene,
        random.uniform(0.1, 0.9, (400, 3)),
        random.uniform(-1.5, 1.5, (400, 3)),
        random.uniform(950, 1050, 400),
    )

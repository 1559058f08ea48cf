"""What faces sideways is no roof, below which what lacks would be a slit and not air (`grid_pressure/slits.py`)."""

import numpy as np
import pytest

import wavetank as wt
from wavetank.device.compiler import download

SPACING, DEPTH = 0.02, 0.2


def cells_beside(center: tuple[float, float], angle: float) -> tuple[np.ndarray, np.ndarray]:
    """Fills and rooms [ny, nx] of the cells, in a plane, of water that a box of 0.24 m stands in after a step."""
    box = wt.Box(name="box", center=center, size=(0.24, 0.24), rotation=angle, density=300.0, held=True)
    block = wt.Block(lower=(0, 0), upper=(0.8, DEPTH))
    sim = wt.Simulation(wt.Scene(spacing=SPACING, tank=wt.Tank(size=(0.8, 0.6)), fluids=[block], solids=[box]))
    sim.step()
    level = sim.world.levels[0]
    fill, room = (download(getattr(level, name))[: level.nx * level.ny] for name in ("fill", "room"))
    return fill.reshape(level.ny, level.nx), room.reshape(level.ny, level.nx)


@pytest.mark.parametrize("angle", [0.1, -0.1])
def test_the_side_of_a_body_that_leans_is_no_roof(angle):
    """Open cells at the waterline beside it are as full as those far from it, wherever it stands in them."""
    for shift in np.arange(0.0, 2.0 * SPACING, 0.2 * SPACING):
        fill, room = cells_beside((0.4 + shift, 0.25), angle)
        line = int(DEPTH / (2.0 * SPACING))  # the row of cells that begins at the surface
        is_open = room[line] >= 0.97
        assert fill[line, is_open].max() < fill[line, 0] + 0.25

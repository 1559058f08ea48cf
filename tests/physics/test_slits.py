"""What faces sideways is no roof, below which what lacks would be a slit and not air (`pressure/liquid.py`)."""

import numpy as np
import pytest

import wavetank as wt
from wavetank.device.compiler import download

SPACING, DEPTH = 0.02, 0.2


def cells_beside(center: tuple[float, float], angle: float, *names: str) -> list[np.ndarray]:
    """Those fields [ny, nx] of the cells, in a plane, of water that a box of 0.24 m stands in after a step."""
    box = wt.Box(name="box", center=center, size=(0.24, 0.24), rotation=angle, density=300.0, held=True)
    block = wt.Block(lower=(0, 0), upper=(0.8, DEPTH))
    sim = wt.Simulation(wt.Scene(spacing=SPACING, tank=wt.Tank(size=(0.8, 0.6)), fluids=[block], solids=[box]))
    sim.step()
    level, workspace = sim.world.pressure.finest, sim.world.pressure.workspace
    return [
        download(getattr(workspace if name == "depth" else level, name))[: level.nx * level.ny].reshape(
            level.ny, level.nx
        )
        for name in names
    ]


@pytest.mark.parametrize("angle", [0.1, -0.1])
def test_the_side_of_a_body_that_leans_is_no_roof(angle):
    """Open cells at the waterline beside it are as full as those far from it, wherever it stands in them."""
    for shift in np.arange(0.0, 2.0 * SPACING, 0.2 * SPACING):
        fill, room = cells_beside((0.4 + shift, 0.25), angle, "liquid", "open_volume")
        line = int(DEPTH / (2.0 * SPACING))  # the row of cells that begins at the surface
        is_open = room[line] >= 0.97
        assert fill[line, is_open].max() < fill[line, 0] + 0.25


def test_nodes_that_a_body_takes_are_as_deep_as_those_beside_them():
    """Hydrostatics: the water is level; or what is at the waterline is carried or falls as the body takes a node."""
    for shift in np.arange(0.0, 2.0 * SPACING, 0.2 * SPACING):
        fields = cells_beside((0.4 + shift, 0.25), 0.0, "open_volume", "depth")
        row = int(DEPTH / (2.0 * SPACING)) - 1  # the highest that is full of water
        room, depth = (field[row] for field in fields)
        is_taken = np.flatnonzero(room == 0.0)
        rim = [n for n in is_taken if room[n - 1] > 0.0 or room[n + 1] > 0.0]
        assert len(rim) == 2
        assert np.abs(depth[rim] - depth[0]).max() < SPACING

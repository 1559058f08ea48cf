"""Slits between a wall and a box in the grid of pressure: what has room there, and water that rests in it.

Cells of these worlds are 0.08 m: their nodes lie at 0.04, 0.12, 0.20 m and so on.
"""

import numpy as np
import pytest

import wavetank as wt

D, CELL, WIDE, DEEP = 0.04, 0.08, 0.96, 0.4


def world(*solids) -> wt.Simulation:
    tank, block = wt.Tank(size=(WIDE, 0.8)), wt.Block(lower=(0, 0), upper=(WIDE, DEEP))
    return wt.Simulation(wt.Scene(spacing=D, tank=tank, fluids=[block], solids=list(solids), foam=0.0))


def beside(left: float, right: float, gap: float, *, held: bool) -> list:
    """A wall between two places along x, and a box beside it with a `gap` of so many spacings between."""
    body = {"density": 500.0, "held": True} if held else {}
    wall = wt.Box(center=(0.5 * (left + right), 0.2), size=(right - left, 0.4))
    return [wall, wt.Box(center=(right + gap * D + 0.12, 0.2), size=(0.24, 0.24), **body)]


def of_nodes(sim: wt.Simulation, name: str) -> np.ndarray:
    """Values at the nodes of the finest grid, rows along y first."""
    grid = sim.world.levels[0]
    return getattr(grid, name).to_numpy()[: grid.nx * grid.ny].reshape(grid.ny, grid.nx)


@pytest.mark.parametrize("held", [True, False])
@pytest.mark.parametrize(("left", "right", "gap"), [(0.0, 0.12, 1.0), (0.0, 0.1202, 1.0)], ids=["on", "in"])
def test_water_beside_a_lining_of_the_tank_rests(left, right, gap, held):
    """Hydrostatics. No node had room for the slit: the one in it lies in the wall by a hair, which was taken for thin.

    A wall on the tank's is thick whatever it measures.
    """
    sim = world(*beside(left, right, gap, held=held))
    sim.advance(4.0)
    fastest = max(float(np.linalg.norm(frame.velocities, axis=1).max()) for frame in sim.frames(seconds=1.0))
    room = of_nodes(sim, "room")[2:4]
    slit = round(right / CELL - 0.5)
    assert room[:, slit].min() > 0.1
    assert fastest < 0.05

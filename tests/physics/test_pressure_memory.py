"""Memory of the pressure grid's workspace: a world has the arrays that its kernels use, each counted once."""

import dataclasses

import pytest

import wavetank as wt

WATER = wt.Block(lower=(0.0, 0.0, 0.0), upper=(0.4, 0.4, 0.8))
SIZE = (0.2, 0.2, 0.2)
SOLIDS = {
    "water": [],
    "solids": [wt.Box(center=(1.2, 0.3, 0.4), size=SIZE)],
    "bodies": [wt.Box(center=(1.2, 0.3, 0.4), size=SIZE, density=500.0)],
}
#: Arrays with an entry for each node or more, of 39; solids, bodies, mixed fluids and enclosed regions need the others.
ARRAYS = {"water": 15, "solids": 30, "bodies": 32}


@pytest.mark.parametrize("kind", SOLIDS)
def test_a_world_has_only_the_arrays_that_it_uses(kind):
    if kind == "bodies":
        pytest.importorskip("rapier3d")
    sim = wt.Simulation(wt.Scene(spacing=0.04, tank=wt.Tank(size=(1.6, 1.2, 0.8)), fluids=[WATER], solids=SOLIDS[kind]))
    sim.step()
    finest, workspace = sim.world.pressure.finest, sim.world.pressure.workspace
    arrays = {id(a): a for a in (getattr(workspace, field.name) for field in dataclasses.fields(workspace))}
    nodes = finest.nx * finest.ny * finest.nz
    assert sum(array.shape[0] >= nodes for array in arrays.values()) == ARRAYS[kind]

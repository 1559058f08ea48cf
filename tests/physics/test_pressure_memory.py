"""Memory of the pressure grid's workspace: a world has the arrays that its kernels use, made when it first does."""

import dataclasses

import numpy as np
import pytest

import wavetank as wt
from wavetank.lab.bench.counts import device_bytes
from wavetank.physics.coefficients import coefficients
from wavetank.physics.pressure import correct
from wavetank.physics.pressure.grid import PARTS, Part, PressureGrid, new_pressure_grid

WATER = wt.Block(lower=(0.0, 0.0), upper=(0.4, 0.6))
OIL = wt.Block(lower=(0.6, 0.0), upper=(1.0, 0.4), material="oil")
BOX = wt.Box(name="box", center=(0.75, 0.15), size=(0.2, 0.2))
SHEET = wt.Box(name="sheet", center=(0.5, 0.3), size=(0.02, 0.4))
FLOAT = wt.Box(name="float", center=(0.75, 0.15), size=(0.2, 0.2), density=400.0)
FULL = wt.Block(lower=(0.0, 0.0), upper=(1.0, 0.8))
WORLDS = {"water": [WATER], "solids": [WATER, BOX], "bodies": [WATER, FLOAT], "fluids": [WATER, OIL], "full": [FULL]}
#: Numbers that a node has in the workspace: an array has one, sums have `PARTS`.
NUMBERS = {
    "water": 14 + PARTS,
    "solids": 29 + PARTS,
    "bodies": 31 + PARTS,
    "fluids": 14 + 2 * PARTS,
    "full": 18 + PARTS,
}


def world(*contents) -> wt.Simulation:
    """A 2-D world with these fluids and solids."""
    return wt.Simulation(
        wt.Scene(
            spacing=0.04,
            tank=wt.Tank(size=(1.0, 0.8)),
            fluids=[part for part in contents if isinstance(part, wt.Block)],
            solids=[part for part in contents if isinstance(part, wt.Box)],
            materials=[wt.Material(name="oil", density=800.0)],
        )
    )


def arrays_of(grid: PressureGrid) -> list:
    """The arrays of the workspace, each once."""
    workspace = grid.workspace
    return [*{id(a): a for a in (getattr(workspace, field.name) for field in dataclasses.fields(workspace))}.values()]


def test_the_workspace_of_a_million_particles_of_plain_water():
    """In a tank that they fill to three quarters: 35 MB with all arrays."""
    grid = new_pressure_grid((np.zeros(3), np.array([4.0 / 3.0, 1.0, 1.0])), 1.9 * 0.01)
    plain = device_bytes(grid.workspace)
    assert 13e6 < plain < 15e6
    grid.make_room(*Part)
    assert 34e6 < device_bytes(grid.workspace) < 36e6


@pytest.mark.parametrize("kind", WORLDS)
def test_a_world_has_only_the_arrays_that_it_uses(kind):
    if kind == "bodies":
        pytest.importorskip("rapier3d")
    sim = world(*WORLDS[kind])
    sim.step()
    grid = sim.world.pressure
    numbers = {grid.workspace.inside.shape: 1, grid.workspace.sums.shape: PARTS}
    assert sum(numbers.get(array.shape, 0) for array in arrays_of(grid)) == NUMBERS[kind]


# --- worlds that gain and lose what needs arrays ---


POISON = 7  # in the one entry of arrays that are not made


def poison(sim: wt.Simulation) -> list:
    """Write into the arrays that are not made, and return them: who uses one writes its first node."""
    found = [array for array in arrays_of(sim.world.pressure) if array.shape == (1,)]
    for array in found:
        array.fill(POISON)
    return found


@pytest.mark.parametrize("kind", WORLDS)
def test_no_kernel_writes_to_arrays_that_are_not_made(kind):
    """Beyond its one entry it would write over other arrays, which changes no digest if they are not read."""
    if kind == "bodies":
        pytest.importorskip("rapier3d")
    sim = world(*WORLDS[kind])
    poison(sim)
    sim.step()
    there = poison(sim)
    for _ in range(3):
        sim.step()
    left = [array for array in arrays_of(sim.world.pressure) if array.shape == (1,)]
    assert len(left) == len(there)
    assert all((array.to_numpy() == POISON).all() for array in left)


def test_a_world_without_solids_is_what_the_kernels_of_solids_find_where_none_is():
    sim = world(WATER)
    sim.step()
    grid, c = sim.world.pressure, coefficients(sim.scene, 1.0 / 60.0)
    found = ("open_volume", "overhang", "aperture_x", "aperture_y", "aperture_z")
    of_solids = ("far_from_solids", "blocked_faces")

    def arrays() -> list[np.ndarray]:
        named = [getattr(grid.finest, name) for name in found]
        return [array.to_numpy() for array in (*named, *(getattr(grid.workspace, name) for name in of_solids))]

    cleared = arrays()
    grid.make_room(Part.SOLIDS)
    has = dataclasses.replace(correct.variant_of(sim.world, thin_walls=False), solids=1)
    for name in found:
        getattr(grid.finest, name).fill(0.0)
    correct.find_nearest_walls(grid.finest, grid.workspace, grid.found, sim.world.solids, has)
    correct.find_open_volume(grid.finest, grid.workspace, sim.world.solids, c, correct.UNIT, 0.04, 2, has)
    correct.find_apertures(grid.finest, grid.workspace, 0.04, has)
    for own, other in zip(cleared, arrays(), strict=True):
        np.testing.assert_array_equal(own, other)


def add_fluid(sim: wt.Simulation, top: float, material: int = 0) -> None:
    """Add a lattice of a fluid at the right of the tank, up to `top` [m]."""
    x, y = np.meshgrid(np.arange(0.42, 1.0, 0.04), np.arange(0.02, top, 0.04), indexing="ij")
    places = np.stack([x.ravel(), y.ravel()], axis=1)
    places = places[sim.free_places(places, 0.03, 0.01)]
    sim.add(places, materials=np.full(len(places), material))


def change_solids(sim: wt.Simulation, first: wt.Box, second: wt.Box) -> None:
    """Add two solids and remove the first of them, and go back to when there was none, and on."""
    before = sim.snapshot()
    name = sim.add_solid(first)
    sim.step()
    sim.add_solid(second)
    sim.step()
    sim.remove_solid(name)
    sim.step()
    after = sim.snapshot()
    sim.resume(before)
    sim.step()
    sim.resume(after)


def close(sim: wt.Simulation) -> None:
    """Fill the tank up to its top."""
    add_fluid(sim, 0.8)
    sim.step()


def begin_again(sim: wt.Simulation) -> None:
    """Add a solid, and go back to the start."""
    sim.add_solid(BOX)
    sim.step()
    sim.reset()
    sim.step()
    sim.add_solid(SHEET)


CHANGES = {
    "solids": lambda sim: change_solids(sim, BOX, SHEET),
    "bodies": lambda sim: change_solids(sim, SHEET, FLOAT),
    "fluids": lambda sim: add_fluid(sim, 0.4, 1),
    "full": close,
    "reset": begin_again,
}


PAIRS = [*(("water", change) for change in CHANGES), ("bodies", "full"), ("fluids", "bodies"), ("full", "solids")]


@pytest.mark.parametrize(("kind", "change"), PAIRS)
def test_arrays_made_while_a_world_runs_are_as_good_as_those_from_its_start(kind, change, monkeypatch):
    """Equal digests, also of what is cloned and restored: those worlds have only what they use, too."""
    if "bodies" in (kind, change):
        pytest.importorskip("rapier3d")

    def digests() -> list[str]:
        sim = world(*WORLDS[kind])
        sim.step()
        CHANGES[change](sim)
        found = []
        for _ in range(3):
            sim.step()
            found.append(sim.digest())
        sim = sim.clone()
        sim.step()
        return [*found, sim.digest()]

    own = digests()
    monkeypatch.setattr(correct, "parts_for", lambda *_, **__: [*Part])
    assert digests() == own

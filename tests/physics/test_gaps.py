"""Gaps between rows of particles: rows that are drawn apart have some, water at rest has none, whatever its tank."""

import dataclasses

import numpy as np
import pytest

import wavetank as wt
from wavetank.lab.cases.energy import energies
from wavetank.physics.pressure import grid
from wavetank.scene.fluids import Points
from wavetank.simulation.simulation import Simulation


@pytest.mark.parametrize("height", [0.4, 0.41, 0.425, 0.45, 0.475])
def test_water_at_rest_has_no_gaps(height):
    """Wherever its surface lies between the nodes, and however well rows fit the tank."""
    block = wt.Block(lower=(0, 0), upper=(1.03, height))
    sim = Simulation(wt.Scene(spacing=0.025, tank=wt.Tank(size=(1.03, 0.9)), fluids=[block]))
    sim.advance(1.0)
    level, workspace = sim.world.pressure.finest, sim.world.pressure.workspace
    nodes = level.nx * level.ny
    voids, liquid = workspace.voids.to_numpy()[:nodes], level.liquid.to_numpy()[:nodes]
    assert voids[liquid > 0.85].mean() < 1e-3
    assert voids[liquid > 0.85].max() < 0.03
    assert level.lam.to_numpy()[:nodes].any()


def test_rows_that_are_drawn_apart_have_gaps():
    """A lattice an eighth wider leaves 1 - 1 / 1.125 of the room free, most of which is told; none next to a solid."""
    d = 0.025
    places = np.stack(np.meshgrid((np.arange(40) + 0.5) * 1.125 * d, (np.arange(40) + 0.5) * d), -1).reshape(-1, 2)
    scene = wt.Scene(
        spacing=d,
        tank=wt.Tank(size=(1.125, 1.2)),
        fluids=[Points(positions=places)],
        gravity=(0.0, -1e-3),
        solids=[wt.Box(center=(1.05, 0.05), size=(0.1, 0.1))],
    )
    sim = Simulation(scene)
    sim.step()
    level, workspace = sim.world.pressure.finest, sim.world.pressure.workspace
    voids = workspace.voids.to_numpy()[: level.nx * level.ny].reshape(level.ny, level.nx)
    inner = voids[3 : level.ny // 2, 2 : level.nx // 2]
    free = grid.THRESHOLDS.full - 1.0 / 1.125
    assert 0.5 * free < inner.mean() < 1.05 * free
    room = level.open_volume.to_numpy()[: level.nx * level.ny].reshape(level.ny, level.nx)
    assert (room < 1.0).any()
    assert not voids[room < 1.0].any()


def fastest_after(sim: Simulation, seconds: float) -> float:
    """Speed of the fastest particle [m/s] in the three seconds after these."""
    sim.advance(seconds)
    fastest = 0.0
    for _ in range(180):
        sim.advance(1.0 / 60.0)
        fastest = max(fastest, np.linalg.norm(sim.velocities, axis=1).max())
    return fastest


@pytest.mark.parametrize("quality", ["draft", "standard", "high"])
@pytest.mark.parametrize("size", [(21, 20, 10), (42, 42.9, 11), (42, 24, 12)], ids=str)
def test_water_rests_in_tanks_that_do_not_match_its_lattice(size, quality):
    """Hydrostatics: nothing acts on it (notebook/calm.md, "Tanks of another size").

    Width, height and depth in spacings make cells of 7/4 spacings, where water went on at 0.02 to 0.2 m/s for ever.
    """
    width, height, depth = (0.045 * edge for edge in size)
    block = wt.Block(lower=(0, 0), upper=(width, depth))
    sim = Simulation(wt.Scene(spacing=0.045, tank=wt.Tank(size=(width, height)), fluids=[block], quality=quality))
    assert fastest_after(sim, 4.0) < 0.005


@pytest.mark.parametrize("size", [(17, 13.8, 21, 8), (22, 22.4, 21, 9)], ids=str)
def test_water_rests_in_such_tanks_in_space(size):
    """The same; 0.15 and 0.03 m/s, width, height, length and depth in spacings."""
    width, height, length, depth = (0.045 * edge for edge in size)
    block = wt.Block(lower=(0, 0, 0), upper=(width, depth, length))
    sim = Simulation(wt.Scene(spacing=0.045, tank=wt.Tank(size=(width, height, length)), fluids=[block]))
    assert fastest_after(sim, 3.0) < 0.005


def energy_gained(*frames: int) -> np.ndarray:
    """What a block of water that falls apart into a lower pool has of its energy after `frames`, over the start's."""
    fluids = [wt.Block(lower=(0, 0), upper=(0.4, 0.6)), wt.Block(lower=(0.4, 0), upper=(1.2, 0.3))]
    scene = wt.Scene(spacing=0.025, tank=wt.Tank(size=(1.2, 0.8)), fluids=fluids)
    _, kinetic, potential = energies(scene, "cpu", max(frames) / 60.0)
    total = kinetic + potential
    return total[[*frames]] / total[0] - 1.0


def test_a_block_that_runs_into_a_pool_does_not_gain_height(monkeypatch):
    """Conservation of energy; notebook/grid-pressure.md, "Rows that are drawn apart"."""
    early, late = energy_gained(24, 36)
    assert early < 0.03
    assert late < 0.0
    monkeypatch.setattr(grid, "THRESHOLDS", dataclasses.replace(grid.THRESHOLDS, full=0.0))
    assert energy_gained(24)[0] > 0.06

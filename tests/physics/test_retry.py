"""A step that is taken again begins with the particles as they were."""

import numpy as np
import pytest

import wavetank as wt
from wavetank.device.compiler import download
from wavetank.device.state import LASTING
from wavetank.physics.retry import Retry
from wavetank.physics.step import Response, step


def arrays(sim: wt.Simulation) -> dict[str, np.ndarray]:
    """What particles are from step to step, in the order of the device."""
    return {name: download(getattr(sim.world.particles, name))[: sim.count].copy() for name in LASTING}


def test_particles_are_again_what_they_were_before_a_step_that_ended_early():
    """Predicted, sorted and pushed, then put back: as if the step had never been taken, to the last bit."""
    pytest.importorskip("rapier3d")
    box = wt.Box(name="box", center=(0.5, 0.35, 0.2), size=(0.2, 0.2, 0.2), density=300)
    block = wt.Block(lower=(0, 0, 0), upper=(1.0, 0.3, 0.4))
    sim = wt.Simulation(wt.Scene(spacing=0.05, tank=wt.Tank(size=(1.0, 0.8, 0.4)), fluids=[block], solids=[box]))
    sim.velocities = np.tile([2.0, 0.5, 0.0], (sim.count, 1))  # many change cells
    for _ in range(3):
        sim.step()
    before, retry = arrays(sim), Retry()
    for _ in range(2):  # arrays have changed hands in between
        retry.keep(sim.world)
        assert not step(sim.world, sim.scene, 0.01, respond=lambda: Response.RETRY)
        assert any(not np.array_equal(rows, before[name]) for name, rows in arrays(sim).items())
        retry.restore(sim.world)
        for name, rows in arrays(sim).items():
            assert np.array_equal(rows, before[name]), name

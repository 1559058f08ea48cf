"""Worlds with spray, foam and bubbles put where a test wants them."""

import numpy as np

from wavetank.physics.foam.pool import pool_from
from wavetank.scene.scene import Scene
from wavetank.simulation.simulation import Simulation


def with_diffuse(scene: Scene, positions, velocities=None, life=100.0) -> Simulation:
    """A simulation of `scene` that makes no foam of its own and holds some at `positions`."""
    sim = Simulation(scene.changed(foam=0.0))
    x = np.asarray(positions, np.float32).reshape(-1, scene.dim)
    n = len(x)
    rows = {
        "foam_positions": x,
        "foam_velocities": np.zeros_like(x) if velocities is None else np.asarray(velocities, np.float32),
        "foam_kinds": np.ones(n, np.int32),
        "foam_ages": np.zeros(n, np.float32),
        "foam_lives": np.broadcast_to(np.float32(life), n),
        "foam_ids": np.arange(n, dtype=np.int32),
    }
    sim.world.pool = pool_from(rows, n, sim.scene.foam_capacity, scene.dim, sim.count)
    return sim

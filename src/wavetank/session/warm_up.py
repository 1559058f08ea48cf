"""Kernels that a session may need at any moment, compiled ahead: those of tools, of picking and of foam."""

from collections.abc import Callable

import numpy as np

from wavetank.device.state import integers, vectors
from wavetank.physics import population
from wavetank.scene.forces import Attract, Burst, Drag, Force, Sway, Vortex, Wind
from wavetank.session.tools.picking import pick
from wavetank.simulation.forces import apply_force
from wavetank.simulation.simulation import Simulation


def launches(sim: Simulation) -> list[Callable[[], object]]:
    """Return launches that compile kernels, a few each, and change nothing: they act on no particle."""
    world, dim, zero = sim.world, sim.scene.dim, (0.0,) * sim.scene.dim
    water, capsule = world.particles, population.capsule_of(zero, zero, 0.0, world.grid.periods)
    row, number = vectors(dim, 1), integers(1)
    forces: tuple[Force, ...] = (
        Drag(center=zero, radius=1.0, velocity=zero),
        Vortex(center=zero, radius=1.0, speed=0.0),
        Attract(center=zero, radius=1.0, strength=0.0),
        Wind(velocity=zero, center=zero, radius=1.0),
        Burst(center=zero, radius=1.0, speed=0.0),
        Sway(acceleration=zero),
    )
    return [
        lambda: pick(sim, np.zeros(3), np.array([0.0, 0.0, -1.0])),
        *(lambda force=force: apply_force(force, water, 0, 1e-3, 0.0) for force in forces),
        lambda: population.append_rows(water, row, row, number, number, 0, 0, 0),
        lambda: sim.free_places(np.zeros((1, dim), np.float32), 0.0, 0.0),
        lambda: population.mark_particles(number, water, capsule, 0),
        lambda: population.copy_chosen(world.spare, water, world.grid, 0),
        lambda: population.dye_particles(water, capsule, 0, 0),
        lambda: population.freeze_particles(water, capsule, 0, 0),
        lambda: population.hold_ice(water, 0),
        lambda: population.stop_ice(water, 0),
        sim.load_kernels,
    ]

"""Water without perfect rows: the packing that particles of a shaken box settle to, 0.07 d off their places.

A lattice at the start is a crystal. Drawn out, its rows stay rows, and rows that are near in one direction and far in
the other read more density than the same number of particles in disorder, because a pointed kernel counts near
neighbours most: the water swells (notebook/packings.md). Rows that are a little uneven break up. Cases that draw
all of their water out start from this packing instead, as is usual in SPH: Colagrossi et al. 2012,
"Particle packing algorithm for SPH schemes" (10.1016/j.cpc.2012.02.032).
"""

from collections.abc import Sequence

import numpy as np

from wavetank.scene.fluids import Points
from wavetank.scene.scene import Scene
from wavetank.scene.tank import Tank
from wavetank.simulation.simulation import Simulation

SHAKEN, SEED = 0.3, 0  # d
SECONDS = 0.5


def settled(spacing: float, size: Sequence[float], arch: str = "cpu") -> np.ndarray:
    """Return as many particles as a lattice that fills a box of that `size` [m] has, at rest in it [n, dim]."""
    axes = [(np.arange(round(edge / spacing)) + 0.5) * spacing for edge in size]
    lattice = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, len(size))
    shaken = lattice + SHAKEN * spacing * np.random.default_rng(SEED).uniform(-1.0, 1.0, lattice.shape)
    weightless = Scene(
        spacing=spacing,
        gravity=(0.0,) * len(size),
        tank=Tank(size=tuple(size)),
        viscosity=1.0,
        fluids=[Points(positions=shaken)],
    )
    sim = Simulation(weightless, arch)
    sim.advance(SECONDS)
    return sim.positions.astype(float)

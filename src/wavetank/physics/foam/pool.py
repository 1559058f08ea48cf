"""Places for spray, foam and bubbles: who lives on moves up, births are appended, in an order that never depends on
threads.

Survivors keep their order and newborns follow in that of their water particles: both places are prefix sums.
"""

import dataclasses

import numpy as np

from wavetank.device.compiler import download, qd, upload
from wavetank.device.periods import within
from wavetank.device.state import (
    MARGIN,
    Air,
    Births,
    Coefficients,
    Diffuse,
    Grid,
    Particles,
    integers,
    new_diffuse,
    scalars,
    vectors,
)
from wavetank.device.sums import blocks_of
from wavetank.physics.foam.motion import kind_in, surroundings, water_at
from wavetank.physics.foam.noise import stream, uniform
from wavetank.solids.distance import SolidSet, lift

#: What a saved state holds of spray, foam and bubbles, and the array of it.
ROWS = {
    "foam_positions": "x",
    "foam_velocities": "v",
    "foam_kinds": "kind",
    "foam_ages": "age",
    "foam_lives": "life",
    "foam_ids": "id",
}


@dataclasses.dataclass
class Pool:
    """All spray, foam and bubbles of a world."""

    now: Diffuse
    spare: Diffuse
    births: Births
    capacity: int
    count: int = 0
    born: int = 0  # since the start; the number of the next one
    reluctance: np.ndarray | None = None  # what the device has of it

    def set_reluctance(self, values: np.ndarray) -> None:
        """Set at how much energy each material foams, float32 [materials]; see `update.reluctance`."""
        if self.reluctance is not None and np.array_equal(values, self.reluctance):
            return
        if self.births.reluctance.shape[0] != len(values):
            self.births = dataclasses.replace(self.births, reluctance=scalars(len(values)))
        upload(self.births.reluctance, values)
        self.reluctance = values


def new_pool(dim: int, capacity: int, water: int) -> Pool:
    """Allocate an empty pool beside room for `water` particles."""
    births = Births(
        normal=vectors(dim, water + MARGIN),
        first=integers(water + 1),
        kept=integers(capacity + 1),
        blocks=integers(blocks_of(max(capacity, water))),
        reluctance=scalars(1),
    )
    births.reluctance.fill(1.0)
    return Pool(new_diffuse(dim, capacity), new_diffuse(dim, capacity), births, capacity)


def pool_rows(pool: Pool | None, dim: int) -> dict[str, np.ndarray]:
    """Return all that is in a pool as host arrays by name, empty ones without a pool."""
    pool = pool or new_pool(dim, 0, 0)
    return {name: download(getattr(pool.now, array))[: pool.count].copy() for name, array in ROWS.items()}


def pool_from(rows: dict[str, np.ndarray], born: int, capacity: int, dim: int, water: int) -> Pool | None:
    """Return a pool with these rows beside room for `water` particles; None where there was none."""
    if born < 0 or "foam_kinds" not in rows:
        return None
    pool = new_pool(dim, capacity, water)
    for name, array in ROWS.items():
        upload(getattr(pool.now, array), rows[name])
    pool.count, pool.born = len(rows["foam_kinds"]), born
    return pool


@qd.kernel(fastcache=True)
def append_births(
    diffuse: Diffuse,
    births: Births,
    water: Particles,
    grid: Grid,
    solids: SolidSet,
    c: Coefficients,
    a: Air,
    frame: qd.i32,
    old: qd.i32,
    born: qd.i32,
    count: qd.i32,
):
    """Append the newborn behind the `old` ones, each around the way that its water particle came.

    Ihmsen et al. 2012, Sec. 3.2: a cylinder along the velocity. Here it lies behind the water particle rather than
    ahead, because the water has been moved already; velocities fan out with the distance from its axis.
    """
    room = diffuse.age.shape[0]
    for i in range(count):
        for place in range(births.first[i], births.first[i + 1]):
            slot = old + place
            if slot < room:
                state = stream(a.seed, frame, water.id[i])
                k = 1 + 8 * (place - births.first[i])
                v = water.v[i]
                ahead = v / qd.max(v.norm(), 1e-12)
                aside = v * 0.0
                for axis in qd.static(range(v.n)):
                    aside[axis] = 2.0 * uniform(state, k + axis) - 1.0
                aside -= ahead * aside.dot(ahead)
                x = water.x[i] - (a.interval * uniform(state, k + 3)) * v + a.spread * aside
                around = surroundings(lift(x), solids, c.h)
                if around[0] < c.wall_gap:  # inside of a solid: born where the water is
                    x = water.x[i]
                diffuse.x[slot] = within(x, grid.periods)
                diffuse.v[slot] = v + (0.25 * v.norm()) * aside
                diffuse.kind[slot] = kind_in(water_at(x, around[1], water, grid, c, a)[0])
                diffuse.age[slot] = 0.0
                diffuse.life[slot] = a.lifetime * (0.5 + uniform(state, k + 4))
                diffuse.id[slot] = born + place

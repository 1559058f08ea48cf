"""A world on the device: all that a step reads and writes."""

import dataclasses
from typing import Any

import numpy as np

from wavetank.device.compiler import upload
from wavetank.device.state import (
    Fluids,
    Grid,
    Particles,
    Temporaries,
    Walls,
    swapped,
    with_solids,
    with_viscosity,
    without_viscosity,
)
from wavetank.foundation.materials import Material
from wavetank.physics.bodies import Pieces
from wavetank.physics.broad_phase import Obstacles
from wavetank.physics.foam.pool import Pool
from wavetank.physics.near_solids import MAX_SOLIDS
from wavetank.physics.pressure.grid import PressureGrid
from wavetank.solids.distance import SolidSet


@dataclasses.dataclass
class World:
    """Everything on the device that a step reads and writes."""

    particles: Particles  # as they are
    spare: Particles  # where they are sorted to, and what is read of them is not written yet
    temporaries: Temporaries
    grid: Grid
    solids: SolidSet
    walls: Walls
    fluids: Fluids
    materials: dict[int, Material]  # in use, by their numbers
    count: int
    has_friction: bool
    pressure: PressureGrid | None  # of the tank, if there is one
    frozen: int = 0  # particles that are ice
    solids_version: int = 0  # changes with each motion of the solids
    solid_speed: float = 0.0  # m/s: the fastest that any solid moves in this frame
    known: dict[tuple[Any, ...], Any] = dataclasses.field(default_factory=dict)  # see `swapped`
    pieces: Pieces | None = None  # of the bodies, where there are any
    terms: tuple[Any, ...] = ()  # of the step besides `terms.builtin.TERMS`, each a `terms.term.Term`
    pool: Pool | None = None  # of spray, foam and bubbles; made when the first are

    @property
    def has_solids(self) -> bool:
        """Whether there is anything solid besides the walls of the tank, which are planes and need no search."""
        return bool(self.solids.count > self.solids.tank_count)

    @property
    def may_have_thin_walls(self) -> bool:
        """Whether some solid may be thinner than two cells of the pressure grid."""
        return self.has_solids

    @property
    def obstacles(self) -> Obstacles:
        """Which solids there are besides the walls of the tank."""
        if not self.has_solids:
            return Obstacles.NONE
        return Obstacles.TWO_WAY if self.pieces else Obstacles.ONE_WAY

    @property
    def remembers_viscosity(self) -> bool:
        """Whether there is room for what viscosity did to each particle."""
        return bool(self.particles.viscous.shape == self.particles.x.shape)

    def swap(self) -> None:
        """Let the spare particles be those that count: they have been sorted, or chosen."""
        self.particles, self.spare = self.spare, self.particles

    def swap_arrays(self, *names: str) -> None:
        """Let the arrays of those `names` be the spare ones, which have been written."""
        self.particles, self.spare = swapped(self.known, self.particles, self.spare, *names)

    def adopt(self, particles: Particles) -> None:
        """Take other particles, and make room for all that is known of them where they are sorted to."""
        self.particles = particles
        if self.remembers_viscosity:
            self.remember_viscosity()

    def keep_solids(self) -> None:
        """Make room for the solids near each particle where there are any."""
        if self.has_solids:
            self.temporaries = with_solids(self.temporaries, MAX_SOLIDS)

    def keep_viscosity(self, is_viscous: bool) -> None:
        """Keep what viscosity does to each particle where fluids are viscous, and forget it where none is any more."""
        if is_viscous:
            self.remember_viscosity()
        elif self.remembers_viscosity:
            self.forget_viscosity()

    def remember_viscosity(self, values: np.ndarray | None = None) -> None:
        """Make room for what viscosity did to each particle, and set it to `values` [m/s^2], [n, dim], if any."""
        self.particles, self.spare = with_viscosity(self.particles), with_viscosity(self.spare)
        if values is not None:
            upload(self.particles.viscous, values)

    def forget_viscosity(self) -> None:
        """Forget what viscosity did before it was switched off: the fluid will be elsewhere when it comes back."""
        self.particles, self.spare = without_viscosity(self.particles), without_viscosity(self.spare)

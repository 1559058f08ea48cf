"""Fluids of different density in one world: every particle has the same volume and a mass of its own.

The density constraint counts volumes, so that a heavy neighbour presses no more than a light one, and its corrections
carry the inverse masses: m_i dp_i stays antisymmetric in i and j, momentum is exact at any ratio. The idea is that of
Solenthaler and Pajarola 2008, "Density Contrast SPH Interfaces" (10.2312/SCA/SCA08/211-218), whose density of equal
volumes it is. Only ratios of masses matter: where all fluids are equally dense nothing here runs.

    code       symbol               meaning                                        unit
    weight     w_i = m_max / m_i    inverse mass, 1 for the heaviest               1
    packed                          velocity and, behind it, one property          m/s, -
            lambda_i, w_i           or change of the multiplier and inverse mass   m^2, 1

Where we differ: the multipliers are those of mass-weighted position-based dynamics,
lambda_i = -C_i / sum_k w_k |grad_k C_i|^2, and not an equation of state. The Jacobi matrix of the constraint keeps its
spectrum nearly whatever the masses are; what they add is in notebook/viscosity.md and in `stiffening`.
"""

import dataclasses
import math

import numpy as np

from wavetank.device.compiler import qd, upload
from wavetank.device.state import Fluids, Particles, Temporaries
from wavetank.foundation.materials import Material, Properties
from wavetank.foundation.params import Parameters

#: Largest eigenvalue that a factor of ten between the densities adds to the Jacobi matrix; notebook/viscosity.md.
PER_DECADE = 0.2


@dataclasses.dataclass(frozen=True)
class Blend:
    """What the fluids of a world have in common: decides which terms of a step run at all."""

    fluids: dict[int, Properties]  # of the materials in use, by their numbers
    largest_density: float  # kg/m^3

    @property
    def density_ratio(self) -> float:
        """Largest density over the smallest."""
        return self.largest_density / min(fluid.density for fluid in self.fluids.values())

    @property
    def mixed(self) -> int:
        """1 where densities differ, else 0: the number that kernels are specialised by."""
        return int(self.density_ratio > 1.0)

    @property
    def kinematic_viscosity(self) -> float:
        """Largest viscosity over density [m^2/s]."""
        return max(fluid.viscosity / fluid.density for fluid in self.fluids.values())

    @property
    def least_kinematic_viscosity(self) -> float:
        """Smallest viscosity over density [m^2/s]."""
        return min(fluid.viscosity / fluid.density for fluid in self.fluids.values())

    @property
    def surface_tension(self) -> float:
        """Largest surface tension [N/m]."""
        return max(fluid.surface_tension for fluid in self.fluids.values())


def blend(materials: dict[int, Material], params: Parameters) -> Blend:
    """Look up the materials in use, by their numbers, with the parameters as they are now."""
    fluids = {number: material.properties(params) for number, material in materials.items()}
    fluids = fluids or {0: Material().properties(params)}
    return Blend(fluids, max(fluid.density for fluid in fluids.values()))


def stiffening(density_ratio: float) -> float:
    """Return what a contrast of densities adds to the largest eigenvalue of the Jacobi matrix."""
    return PER_DECADE * math.log10(density_ratio)


def fill_table(device: Fluids, fluids: Blend, tensions: dict[int, float]) -> None:
    """Write the properties of `fluids` to the device where they changed; `tensions` [N/m] are those in effect."""
    rows = np.zeros((max(fluids.fluids) + 1, 4), np.float32)
    for number, fluid in fluids.fluids.items():
        wetting = 0.5 * (1.0 + math.cos(math.radians(fluid.contact_angle)))
        rows[number] = (fluids.largest_density / fluid.density, fluid.viscosity, tensions.get(number, 0.0), wetting)
    if device.written is None or not np.array_equal(device.written, rows):
        upload(device.rows, rows)
        device.written = rows


@qd.kernel(fastcache=True)
def weigh(temporaries: Temporaries, particles: Particles, rows: qd.types.ndarray(), count: qd.i32):
    """Write the inverse mass of every particle."""
    for i in range(count):
        temporaries.inverse_mass[i] = rows[particles.material[i]][0]


@qd.kernel(fastcache=True)
def pack_multipliers(packed: qd.types.ndarray(), temporaries: Temporaries, count: qd.i32):
    """Put the changes of multipliers and inverse masses side by side."""
    for i in range(count):
        row = packed[i]
        row[0], row[1] = temporaries.dlam[i], temporaries.inverse_mass[i]
        packed[i] = row

"""What bodies weigh, how that lies in them, and the water that goes along with them.

A body that is smaller than a particle is hit by what is many times heavier than itself, and knows only some of the
water around it: balls of a third of a spacing flew about at the speed limit for ever. While water pushes it, it is as
sluggish as a particle; it weighs what it weighs. One that hangs on a joint is not: what a motor gives is to be right.
"""

import dataclasses
from collections.abc import Collection, Sequence

import numpy as np

from wavetank.simulation.added_mass import added_mass
from wavetank.solids.mass import Inertia, Ruler, inertia_of, water_of
from wavetank.solids.solid import Solid

ROUND = 0.4  # moment of inertia of a ball, over mass times the square of its radius


@dataclasses.dataclass
class Weighed:
    """Bodies on the scales; rows of the arrays are bodies."""

    inertias: list[tuple[Inertia, Inertia]]  # of each, and of the water in its place
    weights: np.ndarray  # [n], kg: what gravity pulls
    masses: np.ndarray  # [n], kg: what is to be moved while water pushes
    tensors: np.ndarray  # [n, 3, 3], kg m^2
    reaches: np.ndarray  # [n], m
    added: np.ndarray  # [n, 2]: mass [kg] and moment of inertia [kg m^2] of the water that goes along


def weigh(solids: Sequence[Solid], dim: int, spacing: float, density: float, jointed: Collection[int]) -> Weighed:
    """Weigh bodies in a fluid of that `density` [kg/m^3] and `spacing` [m]; joints hold those at `jointed` places."""
    inertias, masses, tensors, added = [], [], [], []
    particle = density * spacing**dim
    for place, solid in enumerate(solids):
        cut = Ruler(solid, dim, spacing).cut()
        dry, wet = inertia_of(solid, cut), water_of(cut, density)
        axes = tuple(map(float, wet.axes[3 - dim :]))
        mass, inertia = added_mass(axes)
        # Of one that is round nothing goes along, but for what is about an edge or a wall near by.
        around = 2.0 * float(np.trace(wet.tensor)) / (3.0 if dim == 3 else 2.0)
        along = np.array([mass * wet.mass, inertia * wet.mass * max(axes) ** 2 + around])
        lacks = 0.0 if place in jointed else max(0.0, particle - wet.mass)
        masses.append(dry.mass + lacks)
        tensors.append(dry.tensor + ROUND * lacks * solid.reach() ** 2 * np.eye(3))
        added.append(along * (1.0 + lacks / wet.mass))
        inertias.append((dry, wet))
    weights, reaches = [dry.mass for dry, _ in inertias], [solid.reach() for solid in solids]
    return Weighed(inertias, *map(np.array, (weights, masses, tensors, reaches, added)))

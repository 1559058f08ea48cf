"""Mass and moments of inertia of bodies, of the water that they displace, and of the water that moves along with them.

Added mass is that of the ellipsoid with the inertia of the body: Lamb 1932, "Hydrodynamics", Sec. 71 and 114 (and 71
for an ellipse): potential flow, far from walls.

A body smaller than a particle is hit by what is many times heavier than itself, and samples only part of the water
around it: balls of a third of a spacing flew about at the speed limit indefinitely. While water pushes it, it has the
inertia of a particle; its weight is its own. One that is connected to a joint keeps its inertia: motors must be right.

    code     symbol             meaning                                                          unit
    axes     a, b, c            semi-axes of the ellipsoid                                       m
    alpha    alpha, beta, ...   abc int_0^oo dl / ((a^2 + l) sqrt((a^2 + l)(b^2 + l)(c^2 + l)))  1
"""

import dataclasses
import functools
from collections.abc import Collection, Sequence

import numpy as np

from wavetank.solids.mass import Inertia, Ruler, inertia_of, water_of
from wavetank.solids.solid import Solid

THINNEST = 0.05  # of the longest axis: flatter ellipsoids count as this
AFLOAT = 0.7  # of the added mass of an immersed body: that of a floating one is 0.4 to 1 of it


@functools.lru_cache(maxsize=64)
def added_mass(axes: tuple[float, ...]) -> tuple[float, float]:
    """Return the largest added mass over displaced mass, and the largest added inertia over displaced mass x reach^2.

    `axes` [m] are the semi-axes of the ellipsoid: three, or two in a 2-D world.
    """
    a = np.maximum(np.array(axes, float), THINNEST * max(axes))
    if len(a) == 2:
        short, long = sorted(a)
        return float(long / short), float((long**2 - short**2) ** 2 / (8.0 * long * short) / long**2)
    t = (np.arange(2000) + 0.5) / 2000  # l = a_max^2 (t / (1 - t))^2
    scale = max(a) ** 2
    length = scale * (t / (1.0 - t)) ** 2
    step = scale * 2.0 * t / (1.0 - t) ** 3 / 2000
    root = np.sqrt(np.prod(a[:, None] ** 2 + length, axis=0))
    alpha = np.array([np.prod(a) * np.sum(step / ((edge**2 + length) * root)) for edge in a])
    turning = []
    for i in range(3):
        b, c = a[(i + 1) % 3] ** 2, a[(i + 2) % 3] ** 2
        beta, gamma = alpha[(i + 1) % 3], alpha[(i + 2) % 3]
        lower = 2.0 * (b - c) + (b + c) * (beta - gamma)
        turning.append(0.2 * (b - c) ** 2 * (gamma - beta) / lower if abs(b - c) > 1e-9 * scale else 0.0)
    return float(np.max(alpha / (2.0 - alpha))), float(max(turning) / scale)


def grip(dim: int, dry: Inertia, wet: Inertia, added: np.ndarray, far: float) -> float:
    """Return the share of slip, 0 to 1, after which a body and the water up to `far` [m] from it are equally fast.

    The `added` mass and inertia [2] [kg, kg m^2] count as part of the body. Friction slows all of that water: where it
    is heavier than the body, an impulse above this share turns the body back and forth from step to step.
    """
    axes = wet.axes[3 - dim :]
    larger, outside = float(np.prod((axes + far) / axes)), float(np.sum((axes + far) ** 2))
    around = wet.mass * np.array([larger - 1.0, (larger * outside - float(np.sum(axes**2))) / (dim + 2)])
    own = added + np.array([dry.mass, 0.5 * np.trace(dry.tensor) if dim == 3 else dry.tensor[2, 2]])
    return float((own / (own + around)).min())


ROUND = 0.4  # moment of inertia of a ball, over mass times the square of its radius


@dataclasses.dataclass
class MassProperties:
    """Masses and inertias of bodies, one row for each body."""

    inertias: list[tuple[Inertia, Inertia]]  # of the body, and of the water that it displaces
    weights: np.ndarray  # kg [n]: gravitational mass
    masses: np.ndarray  # kg [n]: inertial mass while water pushes
    tensors: np.ndarray  # kg m^2 [n, 3, 3]
    reaches: np.ndarray  # m [n]
    added: np.ndarray  # kg, kg m^2 [n, 2]: added mass and moment of inertia of the immersed body


def mass_properties(
    solids: Sequence[Solid], dim: int, spacing: float, density: float, jointed: Collection[int]
) -> MassProperties:
    """Return the mass properties of bodies in a fluid of `density` [kg/m^3], with particles `spacing` [m] apart.

    Bodies at the `jointed` places are connected to joints.
    """
    inertias, masses, tensors, added_masses = [], [], [], []
    particle = density * spacing**dim
    for place, solid in enumerate(solids):
        cut = Ruler(solid, dim, spacing).cut()
        dry, wet = inertia_of(solid, cut), water_of(cut, density)
        axes = tuple(map(float, wet.axes[3 - dim :]))
        mass, inertia = added_mass(axes)
        # A sphere has no added inertia, except near an edge or a wall.
        around = 2.0 * float(np.trace(wet.tensor)) / (3.0 if dim == 3 else 2.0)
        added = np.array([mass * wet.mass, inertia * wet.mass * max(axes) ** 2 + around])
        lacks = 0.0 if place in jointed else max(0.0, particle - wet.mass)
        masses.append(dry.mass + lacks)
        tensors.append(dry.tensor + ROUND * lacks * solid.reach() ** 2 * np.eye(3))
        added_masses.append(added * (1.0 + lacks / wet.mass))
        inertias.append((dry, wet))
    weights, reaches = [dry.mass for dry, _ in inertias], [solid.reach() for solid in solids]
    return MassProperties(inertias, *map(np.array, (weights, masses, tensors, reaches, added_masses)))

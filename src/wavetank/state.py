"""The arrays of a world on the device, with unit and shape; allocated once at capacity.

Two sets of the moving arrays exist so that sorting and Jacobi updates can read one and write the other; which is
which is swapped on the host, nothing is copied.
"""

import dataclasses
from typing import Any

import numpy as np

from wavetank.compiler import qd


@dataclasses.dataclass
class Particles:
    """What a particle carries, in device order (sorted by cell)."""

    x: qd.types.ndarray()  # vec [capacity], m: position at the start of the substep
    p: qd.types.ndarray()  # vec [capacity], m: predicted position, Algorithm 1's x*
    v: qd.types.ndarray()  # vec [capacity], m/s
    id: qd.types.ndarray()  # i32 [capacity]: number of the particle, 0 .. count - 1
    near: qd.types.ndarray()  # i32 [capacity]: bit k is set where solid k is near, bit 30 for all solids from 30 on


@dataclasses.dataclass
class Scratch:
    """What a substep computes and forgets."""

    rho: qd.types.ndarray()  # f32 [capacity]: density over rest density
    lam: qd.types.ndarray()  # f32 [capacity], m^2: multiplier, the sum over the iterations of a substep
    dlam: qd.types.ndarray()  # f32 [capacity], m^2: its change in the last iteration
    omega: qd.types.ndarray()  # vec3 [capacity], 1/s: vorticity


@dataclasses.dataclass
class Grid:
    """Cells of edge h and the neighbour lists. Cells repeat: see `physics/neighbors.py`."""

    cell: qd.types.ndarray()  # i32 [capacity]: cell of each particle
    start: qd.types.ndarray()  # i32 [cells + 1]: first particle of each cell, in sorted order
    fill: qd.types.ndarray()  # i32 [cells]: particles placed so far
    blocks: qd.types.ndarray()  # i32 [blocks]: partial sums of the scan
    order: qd.types.ndarray()  # i32 [capacity]: which particle comes at each sorted place
    number: qd.types.ndarray()  # i32 [capacity]: neighbours of each particle
    list: qd.types.ndarray()  # i32 [capacity, room]: their indices
    nx: qd.i32  # cells before the pattern moves on along y
    ny: qd.i32
    nz: qd.i32
    cells: qd.i32


@dataclasses.dataclass
class Walls:
    """What a flat wall adds to the density: see `half_space_table`."""

    table: qd.types.ndarray()  # vec2 [samples]: I(s) and A(s) at s / h from -1 to 1


@dataclasses.dataclass
class Coefficients:
    """Scalars of a substep, from the scene's parameters."""

    dt: qd.f32  # s
    h: qd.f32  # m, support radius
    density_scale: qd.f32  # see RestLattice
    gradient_scale: qd.f32  # 1/m
    eps: qd.f32  # 1/m^2, constraint force mixing
    relaxation: qd.f32
    momentum: qd.f32
    attraction: qd.f32
    tensile: qd.f32  # m^2, artificial pressure of one iteration over w(dq)^n
    tensile_exponent: qd.f32
    largest_correction: qd.f32  # m, of one iteration
    viscosity: qd.f32  # share per substep
    vorticity: qd.f32  # m/s
    speed_limit: qd.f32  # m/s
    wall_density: qd.f32
    wall_gap: qd.f32  # m


def vectors(dim: int, capacity: int) -> Any:
    """Allocate a device array of `capacity` vectors with `dim` float32 components."""
    return qd.ndarray(qd.types.vector(dim, qd.f32), shape=(max(capacity, 1),))


def scalars(capacity: int) -> Any:
    """Allocate a device array of `capacity` float32 numbers."""
    return qd.ndarray(qd.f32, shape=(max(capacity, 1),))


def integers(*shape: int) -> Any:
    """Allocate a device array of int32 numbers."""
    return qd.ndarray(qd.i32, shape=tuple(max(n, 1) for n in shape))


def upload(array: Any, values: np.ndarray) -> None:
    """Write `values` to the front of a device array; what is beyond becomes zero."""
    host = np.zeros_like(array.to_numpy())
    host[: len(values)] = values
    array.from_numpy(host)


def new_particles(dim: int, capacity: int) -> Particles:
    """Allocate particles that all rest at the origin."""
    x, p, v = (vectors(dim, capacity) for _ in range(3))
    return Particles(x, p, v, id=integers(capacity), near=integers(capacity))


def new_scratch(capacity: int) -> Scratch:
    """Allocate the scratch arrays."""
    rho, lam, dlam = (scalars(capacity) for _ in range(3))
    return Scratch(rho, lam, dlam, omega=vectors(3, capacity))

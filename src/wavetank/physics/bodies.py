"""Rigid bodies as the water sees them: samples of their volume, and the reactions that they feel.

Whatever moves a particle at a solid, its share of the density (Eq. 6 with the wall's gradient), contact and friction,
moves it by some way within a step. The opposite, times the particle's mass, is what the solid is pushed
by; times the lever arm about its centre of mass, what it is turned by. Sums are of whole numbers, so that the order in
which threads come does not matter and runs repeat bit for bit; a body's unit is as fine as the number of particles that
can press on it allows (`simulation/bodies.py`).

    code      meaning                                                                unit
    push      way that a particle was moved by, times its mass                       m, heaviest particle's mass
    reaction  sums for each solid, `distance.parts` numbers: push, turn, the grid's push      1/unit
              and turn, the share of the solid that is under water, how viscous fluids hold it,
              and what of them it displaces
"""

import dataclasses

import numpy as np

from wavetank.device.compiler import qd, upload
from wavetank.device.state import integers, scalars, vectors
from wavetank.solids.distance import SolidSet, image_near, parts
from wavetank.solids.mass import lattice_of


@qd.func
def of_grid():
    """Where those of the grid begin."""
    return 6


@qd.func
def immersion():
    """Where the share under water is."""
    return 12


@qd.func
def rubbing():
    """Where the damper of viscous fluids is: the sum of the shares of particles in the drag table, times a spacing."""
    return 13


@qd.func
def displacing():
    """Where the share under water is, times the density of what is around over that of the heaviest fluid."""
    return 14


OF_GRID, IMMERSION, RUBBING, DISPLACING = (number.fn() for number in (of_grid, immersion, rubbing, displacing))


@qd.func
def add_to_body(solids: SolidSet, k, first, at, push):
    """Add a push [m] and its turn about the centre of mass, over the body's reach [m], to the sums from `first` on."""
    turn = (image_near(solids, k, at) - solids.center[k]).cross(push) / solids.reach[k]
    for axis in qd.static(range(3)):
        at_axis = parts() * k + first + axis
        qd.atomic_add(solids.reaction[at_axis], qd.cast(qd.round(solids.unit[k] * push[axis]), qd.i32))
        qd.atomic_add(solids.reaction[at_axis + 3], qd.cast(qd.round(solids.unit[k] * turn[axis]), qd.i32))


@qd.func
def push_back(solids: SolidSet, k, at, push):
    """Let solid `k` feel the opposite of what pushed a particle at `at`, if it is a body."""
    if solids.unit[k] > 0.0:
        add_to_body(solids, k, 0, at, -push)


@qd.func
def add_damper(solids: SolidSet, k, share):
    """Let body `k` know that a fluid holds it by that share, times a spacing [m]."""
    qd.atomic_add(solids.reaction[parts() * k + rubbing()], qd.cast(qd.round(solids.unit[k] * share), qd.i32))


@dataclasses.dataclass(frozen=True, eq=False)
class Pieces:
    """Small pieces of all bodies, on the device."""

    place: qd.types.ndarray()  # vec3 [pieces], m: in the frame of the solid
    solid: qd.types.ndarray()  # i32 [pieces]: number of the solid
    edges: qd.types.ndarray()  # vec3 [pieces], m: of the box that it is cut from
    volume: qd.types.ndarray()  # f32 [pieces]: over that of a particle
    ahead: qd.types.ndarray()  # vec3 [pieces]: by axis, which way the body's surface in the face ahead looks, 1 or -1;
    behind: qd.types.ndarray()  # 0 where it has none there, and the same of the face behind
    count: qd.i32
    reach: qd.f32  # m: radius of the largest body


def _less_beyond(places: np.ndarray, edges: np.ndarray, volumes: np.ndarray, side: int) -> np.ndarray:
    """Return by how much less than a piece's own volume that beyond its faces on a `side` is, along each axis, [n, 3].

    The pieces, with these `places` [n, 3] [m] and `volumes` [n], are of a lattice with boxes of these `edges` [3] [m].
    Over the edge it is the area of the body's surface that lies in the face and looks to that side.
    """
    place = lattice_of(places, edges)
    lattice = np.zeros(place.max(axis=0) + 2)
    lattice[tuple(place.T)] = volumes
    beyond = [lattice[tuple((place + side * np.eye(3, dtype=int)[axis]).T)] for axis in range(3)]
    less = volumes[:, None] - np.stack(beyond, axis=1)
    found: np.ndarray = np.where(np.abs(less) > 1e-4 * volumes.max(), less, 0.0)
    return found


def surface_sides(places: np.ndarray, edges: np.ndarray, volumes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return which way the surface in the faces ahead of and behind each piece looks, along each axis: 1, -1, or 0.

    It is 0 where there is no surface, [n, 3] each; the arguments are those of `new_pieces`.
    """
    cut = places, edges, volumes
    return np.sign(_less_beyond(*cut, 1)), -np.sign(_less_beyond(*cut, -1))


def largest_displacement(places: np.ndarray, edges: np.ndarray, volumes: np.ndarray) -> float:
    """Return the volume, in the unit of `volumes`, whose weight in a liquid at rest lifts a body at most.

    That is where the liquid stands up to its top everywhere but above what looks up: a tub floats by the volume to its
    rim. Of the six ways up along its axes it is the largest; the arguments are those of `new_pieces`.
    """
    largest = float(volumes.sum())
    for side in (1, -1):
        less = np.maximum(_less_beyond(places, edges, volumes, side), 0.0)
        for axis in np.flatnonzero(edges > 0.0).tolist():
            along = side * places[:, axis]
            deep = (along - along.min()) / edges[axis] + 1.0
            largest = max(largest, float(np.sum(less[:, axis] * deep)))
    return largest


def new_pieces(bodies: dict[int, tuple[np.ndarray, np.ndarray, np.ndarray]], reach: float) -> Pieces:
    """Put the pieces of bodies, none of which has a larger `reach` [m], on the device.

    By number of the solid: places [n, 3] [m], edges [3] [m], volumes [n] over that of a particle.
    """
    sizes = [len(places) for places, _, _ in bodies.values()]
    count = sum(sizes)
    place, solid, edges, volume = vectors(3, count), integers(count), vectors(3, count), scalars(count)
    ahead, behind = vectors(3, count), vectors(3, count)
    if count:
        upload(place, np.concatenate([places for places, _, _ in bodies.values()]))
        upload(solid, np.repeat(list(bodies), sizes))
        upload(edges, np.repeat([edges for _, edges, _ in bodies.values()], sizes, axis=0))
        upload(volume, np.concatenate([volumes for _, _, volumes in bodies.values()]))
        sides = [surface_sides(*cut) for cut in bodies.values()]
        upload(ahead, np.concatenate([one for one, _ in sides]))
        upload(behind, np.concatenate([one for _, one in sides]))
    return Pieces(place, solid, edges, volume, ahead, behind, count, reach)

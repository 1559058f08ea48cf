"""Packing: particles at rest, with even density, in the `Filled` shapes of a scene, outside of obstacles.

A shape gets V / d^dim particles, where V is its volume without solids, outside of the tank and of earlier fluids. They
start on the lattice with the deepest places, and are packed by the solver itself: the inverted shape is a container
whose walls count as water; in it, without gravity and with velocities reset after each step, density errors are removed
until they are even. Particles along the surface of the shape then lie as water at rest along a wall: half a spacing
from it, without gaps and without compression.

Solids are at rest where they are when the water starts: that they move, or have moved elsewhere, is not packing's.

Packing particles by their own density errors: Colagrossi et al. 2012, "Particle packing algorithm for SPH schemes"
(10.1016/j.cpc.2012.02.032); where we differ: corrections of positions (Eq. 6) instead of forces.

    code      meaning                                                unit
    s         signed distance to the volume to fill, negative inside        m
    cell      edge of the lattice on which the volume is measured    m
"""

import dataclasses
import itertools
from collections.abc import Callable
from typing import Protocol

import numpy as np

from wavetank.device.compiler import upload
from wavetank.foundation.errors import WavetankError
from wavetank.physics.world import World
from wavetank.scene.filled import Filled
from wavetank.scene.fluids import Ball, Block, Fluid, Points
from wavetank.scene.lattice import plain_lattice
from wavetank.scene.scene import Scene
from wavetank.solids.sampling import nearest_distances
from wavetank.solids.shapes import Box, Difference, Sphere, moved, still
from wavetank.solids.solid import ENDLESS, Solid

STEPS, MOST_STEPS = 30, 120  # frames of packing, at most
EVEN = 0.004  # mean of the positive density errors at which packing ends
FINE, COARSE = 4, 2  # lattice points per spacing that measure a volume; COARSE where FINE gives more than MOST_POINTS
MOST_POINTS = 40_000_000
DEEP = 0.3  # d: places for particles are where the shape is this deep, and half a spacing around
LEAST_VOLUME = 0.5  # share of the volume that must have places for particles
SLACK = 0.02  # d: by how much a shape may reach beyond the tank by rounding


class Packed(Protocol):
    """What packing needs of a simulation."""

    @property
    def world(self) -> World:
        """Its arrays on the device."""

    @property
    def positions(self) -> np.ndarray:
        """Positions [m] by id, [count, dim]."""

    def step(self) -> None:
        """Advance by a frame."""

    def stats(self) -> dict[str, float]:
        """Measure this instant."""


def pack(scene: Scene, simulate: Callable[[Scene], Packed]) -> Scene:
    """Return `scene` with its `Filled` fluids packed; `simulate` starts a world of a scene.

    Raises `WavetankError` for shapes that are open, too thin for the spacing or reach out of the tank.
    """
    if not any(isinstance(fluid, Filled) for fluid in scene.fluids):
        return scene
    fluids: list[Fluid] = []
    for number, fluid in enumerate(scene.fluids):
        fluids.append(
            _packed(f"fluids[{number}]", fluid, scene, fluids, simulate) if isinstance(fluid, Filled) else fluid
        )
    return scene.model_copy(update={"fluids": fluids})


def _packed(name: str, fluid: Filled, scene: Scene, before: list[Fluid], simulate: Callable[[Scene], Packed]) -> Filled:
    solids = [_at_rest(solid, scene.start_time) for solid in scene.solids]
    obstacles = [*solids, *(_as_solid(other) for other in before if not isinstance(other, Points))]
    measured = _measure(name, fluid, scene, obstacles)
    number = round(measured.volume / scene.spacing**scene.dim)
    places = measured.places(number)
    if len(places) < number:
        raise WavetankError(
            f"{name} has not enough places for its {number:,} particles; use a smaller spacing or a larger shape."
        )
    container = _inside_out(fluid.inside, scene.dim)
    world = scene.model_copy(
        update={
            "fluids": [Points(positions=places)],
            "solids": [*obstacles, still(container)],
            "forces": [],
            "materials": [],
            "goal": None,
            "joints": [],
            "emitters": [],
            "drains": [],
            "gravity": (0.0,) * scene.dim,
            "surface_tension": 0.0,
            "grid_pressure": 0.0,
            "vorticity": 0.0,
            "foam": 0.0,
            "friction": 0.0,
            "frame_time": 1.0 / 60.0,
        }
    )
    water = simulate(world)
    for step in range(MOST_STEPS):
        water.step()
        upload(water.world.particles.v, [])  # all zero; `fill` would read a kernel for each array
        upload(water.world.particles.a, [])
        if step >= STEPS and step % 10 == 0 and water.stats()["density_error_mean"] < EVEN:
            break
    return fluid.packed(water.positions.astype(float))


@dataclasses.dataclass(frozen=True)
class Measured:
    """The volume to fill, on a lattice `finer` times as fine as that of the particles."""

    volume: float  # m^dim: with places for particles
    points: np.ndarray  # [nx, ny, (nz,) dim], m
    s: np.ndarray  # m [nx, ny, (nz)]: signed distance, negative inside
    finer: int

    def places(self, number: int) -> np.ndarray:
        """Return `number` places [m], [number or fewer, dim], the deepest of a lattice of particles within this one.

        It is the lattice whose places lie deepest: on others some may start inside walls, which push them out to the
        nearer side, where they would be lost.
        """
        best, least = np.zeros((0, self.points.shape[-1])), np.inf
        for first in itertools.product(range(self.finer), repeat=self.s.ndim):
            part = tuple(slice(k, None, self.finer) for k in first)
            s = self.s[part].ravel()
            chosen = np.argsort(s, kind="stable")[:number]
            depth = s[chosen[-1]] if len(chosen) == number > 0 else np.inf
            if depth < least:
                best, least = self.points[part].reshape(-1, self.s.ndim)[np.sort(chosen)], depth
        return best


def _measure(name: str, fluid: Filled, scene: Scene, obstacles: list[Solid]) -> Measured:
    """Measure the volume to fill; raises `WavetankError` where it is empty, too thin, or outside of the tank."""
    lower, upper = fluid.bounds()
    d, dim = scene.spacing, scene.dim
    few = np.prod((upper - lower) / d + 1.0) * FINE**dim <= MOST_POINTS
    finest = FINE if few else COARSE
    points = plain_lattice(lower, upper, d / finest, 1)
    own = nearest_distances([fluid.inside], points, d)
    if scene.tank is not None:
        outside = (own < -SLACK * d) & (_to_tank(points, scene) < -SLACK * d)
        if outside.any():
            raise WavetankError(
                f"{name}: its shape reaches out of the tank, as far as {_shown(points[np.argmax(outside)])}; "
                "move it, make it smaller, or give an intersection of it with a box in the tank."
            )
    s = np.maximum(own, _to_others(points, scene, obstacles))
    counts = np.floor((upper - lower) / (d / finest) + 1e-6).astype(int) + 2
    inside = np.clip(0.5 - s * finest / d, 0.0, 1.0).reshape(counts)
    deep = (s < -DEEP * d).reshape(counts)
    wide = int(np.ceil(0.5 * finest))
    for axis in range(dim):
        padded = np.pad(deep, [(wide, wide) if k == axis else (0, 0) for k in range(dim)])
        deep = np.logical_or.reduce([np.take(padded, range(k, k + counts[axis]), axis) for k in range(2 * wide + 1)])
    cell = (d / finest) ** dim
    whole, held = float(inside.sum()) * cell, float(inside[deep].sum()) * cell
    if held < LEAST_VOLUME * max(whole, 1e-30):
        raise WavetankError(
            f"{name}: its shape is too thin for spacing = {d:g} m, or nothing of it is outside of solids and fluids: "
            f"{held:.3g} of {whole:.3g} m^{dim} have places for particles; use a smaller spacing or a larger shape."
        )
    return Measured(held, points.reshape(*counts, dim), s.reshape(counts), finest)


def _to_others(points: np.ndarray, scene: Scene, obstacles: list[Solid]) -> np.ndarray:
    """Return how deep points [n, dim] [m] are in obstacles or behind walls [m], negative outside of these."""
    s = -nearest_distances(obstacles, points, scene.spacing) if obstacles else np.full(len(points), -np.inf)
    return s if scene.tank is None else np.maximum(s, -_to_tank(points, scene))


def _to_tank(points: np.ndarray, scene: Scene) -> np.ndarray:
    """Return the distance of points [n, dim] to the walls of the tank [m], negative outside."""
    assert scene.tank is not None
    lower, upper = scene.tank.box()
    distances: np.ndarray = np.minimum(points - lower, upper - points).min(axis=1)
    return distances


def _at_rest(solid: Solid, time: float) -> Solid:
    """Return a solid that stays where its motion has it at a `time` [s]."""
    if solid.motion is None:
        return still(solid)
    return moved(still(solid), *solid.motion.path().pose(time, (solid.origin, solid.quaternion)))


def _inside_out(solid: Solid, dim: int) -> Solid:
    """Return the complement of `solid`."""
    if hasattr(solid, "invert"):
        return solid.model_copy(update={"invert": not solid.invert})
    return Difference(parts=[Box(center=(0.0,) * dim, size=(ENDLESS,) * dim), solid])


def _as_solid(fluid: Fluid) -> Solid:
    """Return the shape of a fluid as a solid."""
    if isinstance(fluid, Filled):
        return fluid.inside
    if isinstance(fluid, Ball):
        return Sphere(center=fluid.center, radius=fluid.radius)
    assert isinstance(fluid, Block)
    lower, upper = fluid.bounds()
    return Box(center=tuple(0.5 * (lower + upper)), size=tuple(upper - lower))


def _shown(point: np.ndarray) -> str:
    return "(" + ", ".join(f"{x:.3g}" for x in point) + ")"

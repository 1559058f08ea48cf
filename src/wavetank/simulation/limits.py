"""How short time steps must be, and how fast water may get: by what its world does to it."""

import math
from collections.abc import Sequence

import numpy as np

from wavetank.device.compiler import download
from wavetank.foundation.errors import NotFiniteError
from wavetank.physics.planning import capillary_speed, pace_of_solids, steps_in
from wavetank.physics.time_step import largest_speed
from wavetank.physics.world import World
from wavetank.scene.forces import Force
from wavetank.scene.forces.jet import Jet
from wavetank.scene.scene import Scene
from wavetank.simulation.jets import closing_speed
from wavetank.simulation.ledger import Ledger
from wavetank.simulation.moving_solids import MovingSolids
from wavetank.solids.solid import Solid

MOST_IDS = int(np.iinfo(np.int32).max)


def count_steps(
    world: World, scene: Scene, solids: MovingSolids, ledger: Ledger, forces: Sequence[Force], duration: float
) -> float:
    """Return how many time steps make up `duration` [s], no whole number."""
    box = scene.tank.box() if scene.tank else ledger.start_box
    solid = pace_of_solids(world, scene) * solid_speed(scene, solids, duration)
    fastest = largest_speed(world.particles, world.count)
    if not math.isfinite(fastest):
        _refuse(world, ledger)
    speed = max(solid, fastest, closing_speed(force for force in forces if isinstance(force, Jet)))
    speed += duration * sum(force.largest_acceleration() for force in forces)
    return steps_in(world, scene, duration, speed, box, forced=bool(forces))


def _refuse(world: World, ledger: Ledger) -> None:
    """Raise `NotFiniteError`, which says whose velocity or place is no number, or whose speed has no square."""
    x, v = (download(array)[: world.count] for array in (world.particles.x, world.particles.v))
    with np.errstate(over="ignore", invalid="ignore"):
        good = np.isfinite(x).all(axis=1) & np.isfinite((v * v).sum(axis=1))
    ids = download(world.particles.id)[: world.count]
    row = int(np.argmin(np.where(good, MOST_IDS, ids)))
    raise NotFiniteError(
        f"particle {ids[row]} at {x[row].tolist()} m has the velocity {v[row].tolist()} m/s at t = {ledger.time:.6g} s "
        f"and is no number that water can go on from, as are {int((~good).sum()) - 1:,} others; go back to a state of "
        "before, and try shorter steps (substeps) or weaker forces."
    )


def find_speed_limit(
    world: World, scene: Scene, solids: MovingSolids, ledger: Ledger, forces: Sequence[Force], duration: float
) -> float:
    """Return the largest speed [m/s] that gravity, the start, solids and forces can have given to a particle.

    Gravity gives that of a free fall through the tank. Without one, and along an axis that is periodic, a fall has no
    end, and neither has the limit. The ledger keeps the fastest of solids and forces.
    """
    if scene.tank is None:
        return math.inf
    ledger.fastest_solid = max(ledger.fastest_solid, solid_speed(scene, solids, duration))
    ledger.fastest_force = max(ledger.fastest_force, sum(force.largest_speed() for force in forces))
    if any(scene.gravity[axis] for axis in scene.tank.rings):
        return math.inf  # a slope that has no end
    start = max([ledger.fastest_start, *(_start_speed(solid) for solid in scene.solids)])
    fall = sum(2.0 * abs(g) * edge for g, edge in zip(scene.gravity, scene.tank.size, strict=True))
    ledger.steepest = max(ledger.steepest, 0.5 * fall)  # what gravity was a moment ago is still in the water
    fastest = math.sqrt(2.0 * ledger.steepest + start**2) + 2.0 * ledger.fastest_solid + ledger.fastest_force
    return scene.speed_limit * max(fastest + capillary_speed(world, scene), 1e-6)


def _start_speed(solid: Solid) -> float:
    """Return the largest speed [m/s] that any place of a body begins with."""
    if solid.velocity is None and solid.angular_velocity is None:
        return 0.0
    spin = math.hypot(*np.ravel(solid.angular_velocity if solid.angular_velocity is not None else 0.0))
    return math.hypot(*(solid.velocity or (0.0,))) + (spin * solid.reach() if spin else 0.0)


def solid_speed(scene: Scene, solids: MovingSolids, duration: float) -> float:
    """Return the largest speed [m/s] at which any solid moves through the tank in this frame."""
    return solids.largest_speed(duration, scene.tank.size if scene.tank else None)

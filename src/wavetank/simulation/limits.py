"""Bounds of a frame: the number of its time steps and the largest speed of water, by solids, forces and jets.

The largest speed is there for single particles that a position-based step throws. Gravity gives none more than its
energy, but what solids and forces drive has no such bound: a piston drives water through a neck as fast as continuity
asks for, and a force that lasts along a periodic axis as fast as friction allows. A flow moves whole neighbourhoods one
way. So where more particles than there are in the support of a kernel are as fast as the limit, and go the same way, it
is lifted for all that follows.
"""

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
from wavetank.simulation.inflow import closing_speed
from wavetank.simulation.solids import Solids
from wavetank.simulation.state import Counters
from wavetank.solids.solid import Solid

LIMITED = 1.0 - 1e-4  # of the speed limit: what is as fast has been held back
LIFT = 2.0  # by how much the speed limit is lifted in a frame
SAME_WAY = 0.8  # length of the sum of velocities over the sum of their lengths, from which particles go the same way
MOST_IDS = int(np.iinfo(np.int32).max)


def count_steps(
    world: World, scene: Scene, solids: Solids, counters: Counters, forces: Sequence[Force], duration: float
) -> float:
    """Return the number of time steps that `duration` [s] needs, not rounded."""
    box = scene.tank.box() if scene.tank else counters.start_box
    solid = pace_of_solids(world, scene) * solid_speed(scene, solids, duration)
    fastest = largest_speed(world.particles, world.count)
    if not math.isfinite(fastest):
        _refuse(world, counters)
    _lift_for_flow(world, scene, counters, fastest)
    speed = max(solid, fastest, closing_speed(force for force in forces if isinstance(force, Jet)))
    speed += duration * sum(force.largest_acceleration() for force in forces)
    return steps_in(world, scene, duration, speed, box, forced=bool(forces))


def _refuse(world: World, counters: Counters) -> None:
    """Raise `NotFiniteError` for a particle whose position, or squared speed, is not finite."""
    x, v = (download(array)[: world.count] for array in (world.particles.x, world.particles.v))
    with np.errstate(over="ignore", invalid="ignore"):
        good = np.isfinite(x).all(axis=1) & np.isfinite((v * v).sum(axis=1))
    ids = download(world.particles.id)[: world.count]
    row = int(np.argmin(np.where(good, MOST_IDS, ids)))
    raise NotFiniteError(
        f"particle {ids[row]} at {x[row].tolist()} m has the velocity {v[row].tolist()} m/s at t = "
        f"{counters.time:.6g} s, which is not finite or too large; so are {int((~good).sum()) - 1:,} others. Go back "
        "to an earlier state, and try shorter steps (substeps) or weaker forces."
    )


def find_speed_limit(
    world: World, scene: Scene, solids: Solids, counters: Counters, forces: Sequence[Force], duration: float
) -> float:
    """Return the largest speed [m/s] that gravity, initial velocities, solids and forces can have given to a particle.

    Gravity gives that of a free fall through the tank; without a tank, and along a periodic axis, there is no limit.
    The counters keep the largest speeds of solids and forces so far, and by how much flows have lifted the limit.
    """
    if scene.tank is None:
        return math.inf
    counters.fastest_solid = max(counters.fastest_solid, solid_speed(scene, solids, duration))
    counters.fastest_force = max(counters.fastest_force, sum(force.largest_speed() for force in forces))
    return _limit(world, scene, counters)


def _limit(world: World, scene: Scene, counters: Counters) -> float:
    """Return the largest speed [m/s] by what the counters say; raises them to the present gravity."""
    if scene.tank is None or any(scene.gravity[axis] for axis in scene.tank.periodic_axes):
        return math.inf  # falls without end along a periodic axis
    start = max([counters.fastest_start, *(_start_speed(solid) for solid in scene.solids)])
    fall = sum(2.0 * abs(g) * edge for g, edge in zip(scene.gravity, scene.tank.size, strict=True))
    counters.steepest = max(counters.steepest, 0.5 * fall)  # earlier, stronger gravity gave speed
    fastest = math.sqrt(2.0 * counters.steepest + start**2) + 2.0 * counters.fastest_solid + counters.fastest_force
    return scene.speed_limit * counters.lift * max(fastest + capillary_speed(world, scene), 1e-6)


def _lift_for_flow(world: World, scene: Scene, counters: Counters, fastest: float) -> None:
    """Lift the speed limit where particles as fast as it, `fastest` [m/s], are a flow."""
    limit = LIMITED * _limit(world, scene, counters)
    driven = counters.fastest_solid + counters.fastest_force > 0.0
    if fastest < limit or not driven or scene.speed_limit < 1.0:  # below 1 it is asked for
        return
    v = download(world.particles.v)[: world.count].astype(float)
    speed = np.linalg.norm(v, axis=1)
    of_flow = speed >= limit
    one_way = float(np.linalg.norm(v[of_flow].sum(axis=0))) > SAME_WAY * float(speed[of_flow].sum())
    ball = math.pi * scene.support**2 if scene.dim == 2 else 4.0 / 3.0 * math.pi * scene.support**3
    if one_way and of_flow.sum() > ball:
        counters.lift *= LIFT


def _start_speed(solid: Solid) -> float:
    """Return the largest initial speed [m/s] of any point of a body."""
    if solid.velocity is None and solid.angular_velocity is None:
        return 0.0
    spin = math.hypot(*np.ravel(solid.angular_velocity if solid.angular_velocity is not None else 0.0))
    return math.hypot(*(solid.velocity or (0.0,))) + (spin * solid.reach() if spin else 0.0)


def solid_speed(scene: Scene, solids: Solids, duration: float) -> float:
    """Return the largest speed [m/s] of any point of a solid within the tank in this frame."""
    return solids.largest_speed(duration, scene.tank.size if scene.tank else None)

"""A frame of spray, foam and bubbles, after the water's own steps; nothing of it acts back on the water."""

import math

import numpy as np

from wavetank.device.compiler import current_backend
from wavetank.device.state import Air, interned
from wavetank.foundation.materials import Material
from wavetank.foundation.params import SURFACE_TENSION, Parameters
from wavetank.physics.coefficients import coefficients, method_number
from wavetank.physics.foam.motion import move
from wavetank.physics.foam.pool import append_births, new_pool
from wavetank.physics.foam.potentials import count_births
from wavetank.physics.smoothing import sigma
from wavetank.physics.time_step import largest_speed
from wavetank.physics.world import World

RATE = 24.0  # births of a most agitated water particle in the time L / U, at foam = 1
SPRAY_DRAG = 0.25  # U / L: the terminal speed of spray is U / 0.25
BUBBLE_RISE = 0.1  # U
BUBBLE_PULL = 2.0  # g
SPREAD = 1.0  # d
INTERVAL = 0.15  # L / U: the longest between two births, and between two looks of a particle at the water around it
MOST_FRAMES = 2  # in an interval: births come in beats, which nobody shall see
#: Energy in U^2 up to which no water foams; a little below what `potentials.potential` spells out.
LEAST_ENERGY = 0.0499


def update_foam(world: World, params: Parameters, dt: float, frame: int) -> None:
    """Move what there is by `dt` [s] and add what the water makes in this frame."""
    is_empty = world.pool is None or not world.pool.count
    if is_empty and not (params.foam and world.count):
        return
    a = air(params, world.count, dt)
    makes = a.made > 0.0 and world.count > 0 and frame % a.every == 0
    if is_empty and not (makes and _can_foam(world, a)):
        return
    if world.pool is None:
        world.pool = new_pool(params.dim, params.foam_capacity, world.particles.id.shape[0])
    pool, water, grid, solids, count = world.pool, world.particles, world.grid, world.solids, world.count
    c, method = coefficients(params, dt), method_number(params)
    shared = int(current_backend() != "cpu")

    if not count:
        grid.start.fill(0)  # without water no step has found cells: those of the last one would still hold it
    if pool.count:
        kept = move(pool.spare, pool.now, pool.births, water, grid, solids, c, a, frame, pool.count, shared)
        pool.now, pool.spare, pool.count = pool.spare, pool.now, int(kept)
    if makes:
        # A fuller pool takes less, evenly everywhere, rather than all of what comes first.
        room = min(1.0, 2.0 * (1.0 - pool.count / pool.capacity))
        pool.set_reluctance(reluctance(world.materials, params))
        number = count_births(pool.births, water, grid, solids, world.walls, c, a, room, frame, count, method, shared)
        if number:
            append_births(pool.now, pool.births, water, grid, solids, c, a, frame, pool.count, pool.born, count)
        pool.count, pool.born = min(pool.count + int(number), pool.capacity), (pool.born + int(number)) % 2**31


def load_kernels(world: World, params: Parameters) -> None:
    """Launch all kernels of this folder for nobody, so that the first drops do not wait for them."""
    if not (params.foam and world.count):
        return
    pool, c, a = new_pool(params.dim, 1, 1), coefficients(params, params.frame_time), air(params, 1, params.frame_time)
    water, grid, solids, shared = world.particles, world.grid, world.solids, int(current_backend() != "cpu")
    count_births(pool.births, water, grid, solids, world.walls, c, a, 0.0, 0, 0, method_number(params), shared)
    append_births(pool.now, pool.births, water, grid, solids, c, a, 0, 0, 0, 0)
    move(pool.spare, pool.now, pool.births, water, grid, solids, c, a, 0, 0, shared)


def _can_foam(world: World, a: Air) -> bool:
    """Say whether any of the water is fast enough to make foam: where none is, not even the kernels are compiled."""
    return bool(largest_speed(world.particles, world.count) ** 2 > LEAST_ENERGY * a.speed**2)


def air(params: Parameters, water: int, dt: float) -> Air:
    """Return the scalars of a frame of `dt` [s] for `water` particles.

    L is the edge of a cube (2-D: a square) of all the water and U = sqrt(g L) its speed; in a world without gravity
    U = 0: nothing is made there, spray keeps its velocity and bubbles take that of the water.
    """
    ratio, dim = params.support, params.dim
    gravity = math.hypot(*params.gravity)
    length = params.spacing * max(water, 1) ** (1.0 / dim)
    speed = math.sqrt(gravity * length)
    rate = speed / length
    every = max(1, math.floor(min(INTERVAL / max(rate * dt, 1e-12), MOST_FRAMES)))
    interval = every * dt
    drag = _decay(SPRAY_DRAG * rate, dt)
    pull = BUBBLE_PULL * gravity / (BUBBLE_RISE * speed) if speed > 0.0 else math.inf
    follow, gained = _decay(pull, dt), _decay(pull, interval)
    return interned(
        Air(
            dt=dt,
            interval=interval,
            speed=speed,
            made=params.foam * RATE * rate * interval,
            lifetime=params.foam_lifetime,
            spread=SPREAD * params.spacing,
            share=sigma("poly6", dim) / ratio**dim,
            mean=1.0 / (math.pi / 3.0 * ratio**dim),
            spray_keep=drag[0],
            spray_path=drag[1],
            spray_bend=drag[2],
            bubble_path=follow[1],
            bubble_bend=follow[2],
            bubble_keep=gained[0],
            bubble_gain=gained[1],
            every=every,
            seed=params.foam_seed,
        )
    )


def reluctance(materials: dict[int, Material], params: Parameters) -> np.ndarray:
    """Return the energy at which each material begins to foam, in that of a fluid without viscosity, float32.

    Water breaks up where its inertia overcomes surface tension, We > We_c; viscosity takes part of the energy, so that
    We_c = 12 (1 + 1.077 Oh^1.6) (Brodkey 1967, as in Pilch and Erdman 1987, 10.1016/0301-9322(87)90063-2). At the size
    of the capillary length sqrt(sigma / (rho g)), that of drops and bubbles under gravity, the Ohnesorge number
    mu / sqrt(rho sigma l) is a quarter power of the Morton number g mu^4 / (rho sigma^3), which knows no size of a
    world and no resolution: 3e-11 for water, 100 for glycerol, 1e8 and more for honey.
    """
    gravity = math.hypot(*params.gravity)
    values = np.ones(max(materials, default=0) + 1, np.float32)
    for number, material in materials.items():
        fluid = material.properties(params)
        tension = fluid.surface_tension or SURFACE_TENSION
        morton = gravity * fluid.viscosity**4 / (fluid.density * tension**3)
        values[number] = min(1.0 + 1.077 * morton**0.4, 1e30)
    return values


def _decay(k: float, dt: float) -> tuple[float, float, float]:
    """Return (keep, path, bend) of linear drag at the rate `k` [1/s] over `dt` [s]; see `motion.py`."""
    if k * dt < 1e-4:  # the series: differences of nearly equal numbers lose their digits
        return 1.0 - k * dt, dt * (1.0 - 0.5 * k * dt), dt * dt * (0.5 - k * dt / 6.0)
    if math.isinf(k):
        return 0.0, 0.0, 0.0
    keep = math.exp(-k * dt)
    path = (1.0 - keep) / k
    return keep, path, (dt - path) / k

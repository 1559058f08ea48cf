"""One step of Position Based Fluids: Algorithm 1 of Macklin and Müller 2013, top to bottom.

The numbers on the right are the lines of Algorithm 1. Where we differ: forces and neighbours are renewed in every
substep, particles are sorted rather than hashed, and contact is part of every correction.
"""

import dataclasses

from wavetank.distance import SolidSet
from wavetank.physics.boundary import mark_near_solids
from wavetank.physics.density_constraint import correct_positions, measure_density, solve_multipliers
from wavetank.physics.integrate import accept_positions, forget_predictions, predict, update_velocities
from wavetank.physics.neighbors import find_neighbors, sort_particles
from wavetank.physics.smoothing import KERNELS, NAMES, kernel_shape, rest_lattice
from wavetank.physics.viscosity import apply_viscosity
from wavetank.physics.vorticity import confine_vorticity, find_vorticity
from wavetank.scene import Scene
from wavetank.state import Coefficients, Grid, Particles, Scratch, Walls

REFERENCE_RATE = 240.0  # substeps per second for which the viscosity parameter is the share of one substep


@dataclasses.dataclass
class World:
    """Everything on the device that a step reads and writes."""

    particles: Particles
    spare: Particles
    scratch: Scratch
    grid: Grid
    solids: SolidSet
    walls: Walls
    count: int


def step(world: World, scene: Scene, dt: float) -> None:
    """Advance `world` by `dt` [s]."""
    c, method, count = coefficients(scene, dt), method_number(scene), world.count
    now, spare, scratch, grid, solids, walls = (
        world.particles, world.spare, world.scratch, world.grid, world.solids, world.walls,
    )  # fmt: skip

    predict(now, solids, c, count, [*scene.gravity, 0.0, 0.0][:3])  # 1-4

    sort_particles(now, spare, grid, c, count)  # 5-7
    now, spare = spare, now
    find_neighbors(now, grid, c, count)
    mark_near_solids(now, scratch, solids, c, count)

    for _ in range(scene.iterations):  # 8-19
        solve_multipliers(scratch, now, grid, solids, walls, c, count, method)  # 9-11
        correct_positions(spare, now, scratch, grid, solids, walls, c, count, method)  # 12-18
        now.p, spare.p = spare.p, now.p

    update_velocities(now, c, count)  # 21
    if scene.vorticity > 0.0:
        find_vorticity(scratch, now, grid, c, count, method)  # 22
        confine_vorticity(now, scratch, grid, c, count, method)
    if scene.viscosity > 0.0:
        apply_viscosity(spare, now, grid, c, count, method)
        now.v, spare.v = spare.v, now.v
    accept_positions(now, count)  # 23

    world.particles, world.spare = now, spare


def update_densities(world: World, scene: Scene) -> None:
    """Measure the densities [kg/m^3] of `world` as it stands. The order of particles changes, the motion does not."""
    c, method, count = coefficients(scene, scene.frame_time), method_number(scene), world.count
    forget_predictions(world.particles, count)
    sort_particles(world.particles, world.spare, world.grid, c, count)
    world.particles, world.spare = world.spare, world.particles
    find_neighbors(world.particles, world.grid, c, count)
    mark_near_solids(world.particles, world.scratch, world.solids, c, count)
    measure_density(
        world.scratch, world.particles, world.grid, world.solids, world.walls, c, count, scene.rest_density, method
    )


def method_number(scene: Scene) -> int:
    """Return the place of the scene's smoothing kernel in KERNELS."""
    number = list(NAMES).index(scene.kernel)
    assert number < len(KERNELS)
    return number


def coefficients(scene: Scene, dt: float) -> Coefficients:
    """Return the scalars of a substep of `dt` [s]; lengths relative to the rest lattice become metres here."""
    h = scene.support * scene.spacing
    rest = rest_lattice(scene.kernel, scene.dim, scene.support)
    s_0 = rest.squared_gradients / h**2
    w_dq = float(kernel_shape(NAMES[scene.kernel][0], scene.tensile_distance)[0])
    return Coefficients(
        dt=dt,
        h=h,
        d=scene.spacing,
        density_scale=rest.density_scale,
        gradient_scale=rest.gradient_scale / h,
        eps=scene.force_mixing * s_0,
        relaxation=scene.relaxation,
        attraction=scene.attraction,
        tensile=scene.tensile_strength / s_0 / scene.iterations / w_dq**scene.tensile_exponent,
        tensile_exponent=scene.tensile_exponent,
        viscosity=min(1.0, scene.viscosity * REFERENCE_RATE * dt),
        vorticity=scene.vorticity,
        wall_density=scene.wall_density,
        wall_gap=scene.wall_gap * scene.spacing,
    )

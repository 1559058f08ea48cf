"""One step of Position Based Fluids: Algorithm 1 of Macklin and Müller 2013, top to bottom.

The numbers on the right are the lines of Algorithm 1. Where we differ: forces and neighbours are renewed in every
substep, particles are sorted rather than hashed, errors of the whole tank are removed on a grid before the iterations,
and contact is part of every correction.
"""

import dataclasses
import functools
import math
from typing import Any

import numpy as np

from wavetank.device.compiler import upload
from wavetank.device.state import (
    CoarseGrid,
    Coefficients,
    Fluids,
    Grid,
    Particles,
    Scratch,
    Walls,
    exchanged,
    remembered,
    with_viscosity,
    without_viscosity,
)  # fmt: skip
from wavetank.foundation.materials import Material
from wavetank.foundation.params import Parameters
from wavetank.physics.boundary import keep_out_of_solids
from wavetank.physics.density_constraint import (
    correct_positions,
    measure_density,
    schedule,
    solve_multipliers,
    start_multipliers,
)
from wavetank.physics.dynamic_viscosity.implicit_viscosity import (
    carried_share,
    carry_on,
    is_thick,
    is_viscous,
    solve_viscosity,
)
from wavetank.physics.foam.pool import Pool
from wavetank.physics.friction import apply_friction
from wavetank.physics.grid_pressure.correction import LARGEST_CARRIED, carried, correct_pressure
from wavetank.physics.integrate import predict, update_velocities
from wavetank.physics.mixture import Blend, blend, fill_table, pack_weights, stiffening, weigh
from wavetank.physics.neighbors import find_neighbors, sort_particles
from wavetank.physics.pairs import count_neighbors
from wavetank.physics.population import hold_frozen, stop_frozen
from wavetank.physics.smoothing import KERNELS, NAMES, kernel_shape, rest_lattice
from wavetank.physics.tension import apply_tension, limited_tensions, substeps_for
from wavetank.physics.time_step import pool_depth, steps_needed
from wavetank.physics.vorticity import confine_vorticity
from wavetank.physics.xsph_viscosity import apply_mixed_viscosity, apply_viscosity
from wavetank.solids.distance import SolidSet

LEAST_MIXING = 1e-6  # of S_0: a particle without neighbours has no gradient to divide by
REFERENCE_RATE = 240.0  # substeps per second for which the viscosity parameter is the share of one substep
#: By how much water in motion exceeds the stiffest mode of its rest lattice, in 2-D and 3-D; docs/notebook/solver.md.
DISORDER = {2: 0.75, 3: 0.35}
CALM = 0.1  # of sqrt(g / h), the rate of the shortest waves: water that turns slower counts as calm


@dataclasses.dataclass
class World:
    """Everything on the device that a step reads and writes."""

    particles: Particles
    spare: Particles
    scratch: Scratch
    grid: Grid
    solids: SolidSet
    walls: Walls
    fluids: Fluids
    materials: dict[int, Material]  # in use, by their numbers
    count: int
    has_friction: bool
    levels: list[CoarseGrid]  # of the tank, the finest first; none without a tank
    frozen: int = 0  # particles that are ice
    solids_version: int = 0  # changes with each motion of the solids
    room_version: int = -1  # of the solids when the grid was last told which room they leave
    known: dict[tuple[Any, ...], Any] = dataclasses.field(default_factory=dict)  # see `exchanged`
    pool: Pool | None = None  # of spray, foam and bubbles; made when the first are

    @property
    def has_solids(self) -> bool:
        """Whether there is anything solid besides the walls of the tank, which are planes and need no search."""
        return bool(self.solids.count > self.solids.tank_count)

    @property
    def remembers_viscosity(self) -> bool:
        """Whether there is room for what viscosity did to each particle."""
        return bool(self.particles.viscous.shape == self.particles.x.shape)

    def adopt(self, particles: Particles) -> None:
        """Take other particles, and make room for all that is known of them where they are sorted to."""
        self.particles = particles
        if self.remembers_viscosity:
            self.remember_viscosity()

    def remember_viscosity(self, values: np.ndarray | None = None) -> None:
        """Make room for what viscosity did to each particle, and set it to `values` [m/s^2], [n, dim], if any."""
        self.particles, self.spare = with_viscosity(self.particles), with_viscosity(self.spare)
        if values is not None:
            upload(self.particles.viscous, values)

    def forget_viscosity(self) -> None:
        """Forget what viscosity did before it was switched off: the fluid will be elsewhere when it comes back."""
        self.particles, self.spare = without_viscosity(self.particles), without_viscosity(self.spare)


def step(world: World, params: Parameters, dt: float, speed_limit: float = math.inf) -> None:
    """Advance `world` by `dt` [s]; no particle leaves it faster than `speed_limit` [m/s]."""
    on_grid, method, count = has_grid_pressure(world, params), method_number(params), world.count
    kinds = blend(world.materials, params)
    carries_on = is_thick(kinds, params)
    if is_viscous(kinds, params, dt):
        world.remember_viscosity()
    elif world.remembers_viscosity:
        world.forget_viscosity()
    # What thick fluids carry on has been shortened to their share already.
    share = carried(dt, params.frame_time) if on_grid else float(carries_on)
    c = coefficients(params, dt, speed_limit, carries=share)
    now, spare, scratch, grid, solids, walls = (
        world.particles, world.spare, world.scratch, world.grid, world.solids, world.walls,
    )  # fmt: skip

    searched = int(world.has_solids)
    predict(now, grid, solids, c, count, searched, grid.lanes)  # 1-4

    sort_particles(now, spare, grid, count)  # 5-7
    now, spare = spare, now
    grid = world.grid = find_neighbors(now, grid, c, count)
    kinds = prepare_fluids(world, now, params, dt)
    if act_on_fluids(world, now, kinds, params, c):
        keep_out_of_solids(now, solids, c, count)
    if on_grid:
        correct_on_grid(world, now, kinds, params, c)

    tensile, lanes = int(params.tensile_strength > 0.0), grid.lanes
    for number, (relaxation, momentum) in enumerate(relaxations(params, kinds.density_ratio)):  # 8-19
        c = in_iteration(c, relaxation, momentum)
        if number == 0:
            start_multipliers(scratch, now, grid, solids, walls, c, count, method, kinds.mixed, lanes)  # 9-11
        else:
            solve_multipliers(scratch, now, grid, solids, walls, c, count, method, lanes)
        correct_positions(
            spare, now, scratch, grid, solids, c, count, method, tensile, kinds.mixed, searched, lanes
        )  # 12-18
        now, spare = exchanged(world.known, now, spare, "px", "py", "pz")
        if world.frozen:
            hold_frozen(now, count)

    if carries_on:
        carry_on(now, world.fluids, c, kinds, params, count)
    update_velocities(now, c, count)  # 21, 23
    if world.has_friction:
        apply_friction(now, scratch, solids, walls, c, count)
    if params.viscosity > 0.0 or params.vorticity > 0.0:
        now, spare = smooth_and_confine(world, now, spare, kinds, params, c)  # 22
    if world.frozen:
        stop_frozen(now, count)

    world.particles, world.spare = now, spare


@functools.lru_cache(maxsize=256)
def in_iteration(c: Coefficients, relaxation: float, momentum: float) -> Coefficients:
    """Return `c` with the numbers of one iteration, the same object for the same numbers."""
    return dataclasses.replace(c, relaxation=relaxation, momentum=momentum)


def correct_on_grid(world: World, particles: Particles, kinds: Blend, params: Parameters, c: Coefficients) -> None:
    """Remove what the densities of the whole tank are off, before the iterations between particles."""
    method, count = method_number(params), world.count
    measure_density(
        world.scratch, particles, world.grid, world.solids, world.walls, c, count, 1.0, method, world.grid.lanes
    )
    stiffness = rest_lattice(params.kernel, params.dim, params.support).stiffness
    correct_pressure(
        world.levels, particles, world.grid, world.scratch, world.solids, world.walls, c, stiffness,
        params.spacing**params.dim, count, params.grid_pressure, searched=world.has_solids, mixed=bool(kinds.mixed),
        moved=world.room_version != world.solids_version,
    )  # fmt: skip
    world.room_version = world.solids_version


def smooth_and_confine(
    world: World, particles: Particles, spare: Particles, kinds: Blend, params: Parameters, c: Coefficients
) -> tuple[Particles, Particles]:
    """Apply XSPH viscosity and vorticity confinement, both of the velocities as they are before either.

    Returns the two sets of particles, the velocities in the first.
    """
    scratch, grid, count, method = world.scratch, world.grid, world.count, method_number(params)
    turning, mixed = int(params.vorticity > 0.0), bool(kinds.mixed) and params.viscosity > 0.0
    if turning or not mixed:
        apply_viscosity(spare, particles, scratch, grid, c, count, method, turning, grid.lanes)
    if mixed:
        packed = world.fluids.array("packed")
        pack_weights(packed, particles, scratch, count)
        apply_mixed_viscosity(spare, particles, packed, grid, c, count, method, grid.lanes)
    particles, spare = exchanged(world.known, particles, spare, "v")
    if turning:
        confine_vorticity(particles, scratch, grid, c, count, method, grid.lanes)
    return particles, spare


def has_grid_pressure(world: World, params: Parameters) -> bool:
    """Whether errors of the whole tank are removed on a grid: in a tank, and without ice, which it would move.

    It is gravity that needs it. Thick fluids, and water so fine that tension rules within a cell, are held by forces
    that vary from particle to particle; the grid would take what they press together for a lack of room.
    """
    if not (params.grid_pressure > 0.0 and world.levels) or world.frozen:
        return False
    kinds, h = blend(world.materials, params), params.support * params.spacing
    weight = kinds.largest_density * math.hypot(*params.gravity) * h**2  # of water as high as a cell, per length
    return weight >= kinds.surface_tension and not is_thick(kinds, params)


def update_densities(world: World, params: Parameters) -> None:
    """Measure the densities [kg/m^3] of `world` as it stands. The order of particles changes, the motion does not."""
    c, method, count = coefficients(params, 0.0), method_number(params), world.count
    predict(world.particles, world.grid, world.solids, c, count, int(world.has_solids), world.grid.lanes)
    sort_particles(world.particles, world.spare, world.grid, count)
    world.particles, world.spare = world.spare, world.particles
    world.grid = find_neighbors(world.particles, world.grid, c, count)
    kinds = prepare_fluids(world, world.particles, params, params.frame_time)
    measure_density(
        world.scratch, world.particles, world.grid, world.solids, world.walls, c, count, kinds.largest_density, method,
        world.grid.lanes,
    )  # fmt: skip


def neighbor_numbers(world: World, params: Parameters) -> np.ndarray:
    """Return how many neighbours every particle had in the last search, int32 [count], in device order."""
    return count_neighbors(world.particles, world.grid, coefficients(params, 0.0), world.count)


def act_on_fluids(world: World, particles: Particles, kinds: Blend, params: Parameters, c: Coefficients) -> bool:
    """Let tension and viscosity act on velocities and predictions, and say whether there was any."""
    tense, viscous = kinds.surface_tension > 0.0, is_viscous(kinds, params, c.dt)
    if tense:
        apply_tension(
            particles, world.scratch, world.fluids, world.grid, world.solids, c, kinds, world.count, params.support
        )
    if viscous:
        solve_viscosity(
            particles, world.scratch, world.fluids, world.grid, world.solids, c, kinds, world.count, params.support,
            params.no_slip, params.viscosity_iterations,
        )  # fmt: skip
    return tense or viscous


def prepare_fluids(world: World, particles: Particles, params: Parameters, dt: float) -> Blend:
    """Look up the fluids of `world` for a substep of `dt` [s]; weigh the sorted `particles` if densities differ."""
    kinds = blend(world.materials, params)
    fill_table(world.fluids, kinds, limited_tensions(kinds, params.dim, params.support, params.spacing, dt))
    if kinds.mixed:
        weigh(world.scratch, particles, world.fluids.rows, world.count)
    elif world.fluids.weighed:
        world.scratch.weight.fill(1.0)
    world.fluids.weighed = bool(kinds.mixed)
    return kinds


def relaxations(params: Parameters, density_ratio: float = 1.0) -> list[tuple[float, float]]:
    """Return (relaxation, momentum) of each iteration; fewer iterations have to damp a narrower range of modes."""
    rest = rest_lattice(params.kernel, params.dim, params.support)
    stiffest = (rest.stiffest_mode + DISORDER[params.dim] + stiffening(density_ratio)) / params.relaxation
    return schedule(params.iterations, 4.0 * params.slowest_mode / params.iterations, stiffest)


def steps_in(
    world: World, params: Parameters, duration: float, speed: float, box: tuple[np.ndarray, np.ndarray], *, forced: bool
) -> float:
    """Return how many time steps make up `duration` [s], no whole number; what bounds them is in `time_step.py`.

    The fastest particle or solid has the `speed` [m/s], more than gravity acts where `forced`, and the water rests on
    the bottom of the `box` from one corner to another [m]. Surface tension needs steps of its own.
    """
    on_grid, kinds = has_grid_pressure(world, params), blend(world.materials, params)
    depth = 0.0 if on_grid else pool_depth(world.particles, world.count, params.gravity, *box)
    carried_on = carried_share(kinds, params)
    needed = steps_needed(params, duration, speed, depth, on_grid=on_grid, forced=forced, carried=carried_on)
    capillary = substeps_for(kinds, params.dim, params.support, params.spacing, duration)
    return max(needed, min(capillary, params.largest_substeps))


def capillary_speed(world: World, params: Parameters) -> float:
    """Return the speed [m/s] at which a sheet one spacing thick draws back (Taylor 1959, Culick 1960)."""
    fluids = blend(world.materials, params).fluids.values()
    return math.sqrt(max(2.0 * f.surface_tension / (f.density * params.spacing) for f in fluids))


def method_number(params: Parameters) -> int:
    """Return the place of the chosen smoothing kernel in KERNELS."""
    number = list(NAMES).index(params.kernel)
    assert number < len(KERNELS)
    return number


def coefficients(params: Parameters, dt: float, speed_limit: float = math.inf, *, carries: float = 0.0) -> Coefficients:
    """Return the scalars of a substep of `dt` [s]; lengths relative to the rest lattice become metres here."""
    h, gravity = params.support * params.spacing, (*params.gravity, 0.0)
    rest = rest_lattice(params.kernel, params.dim, params.support)
    s_0 = rest.squared_gradients / h**2
    w_dq = float(kernel_shape(NAMES[params.kernel][0], np.array(params.tensile_distance))[0])
    return remembered(
        Coefficients(
            dt=dt,
            gravity_x=gravity[0],
            gravity_y=gravity[1],
            gravity_z=gravity[2],
            h=h,
            inverse_h=1.0 / h,
            inverse_h2=1.0 / h**2,
            density_scale=rest.density_scale,
            gradient_scale=rest.gradient_scale / h**2,
            eps=max(params.force_mixing, LEAST_MIXING) * s_0,
            relaxation=params.relaxation,
            momentum=0.0,
            attraction=params.attraction,
            tensile=params.tensile_strength / s_0 / params.iterations / w_dq**params.tensile_exponent,
            tensile_exponent=params.tensile_exponent,
            largest_correction=h / params.iterations,
            viscosity=min(1.0, params.viscosity * REFERENCE_RATE * dt),
            vorticity=params.vorticity,
            coherence=params.vorticity_coherence,
            calm=CALM * math.sqrt(math.hypot(*params.gravity) / h),
            speed_limit=speed_limit,
            carried=carries,
            largest_carried=LARGEST_CARRIED * math.hypot(*params.gravity),
            wall_density=params.wall_density,
            wall_gap=params.wall_gap * params.spacing,
        )
    )

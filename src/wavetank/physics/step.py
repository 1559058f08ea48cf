"""One step of Position Based Fluids: Algorithm 1 of Macklin and Müller 2013, top to bottom.

The numbers on the right are the lines of Algorithm 1. Where we differ: forces and neighbours are renewed in every
substep, particles are sorted rather than hashed, errors of the whole tank are removed on a grid before the iterations,
and contact is part of every correction.
"""

import math
from collections.abc import Callable

from wavetank.device.state import Coefficients
from wavetank.foundation.params import Parameters
from wavetank.physics.boundary import keep_out_of_solids
from wavetank.physics.central_xsph import apply_central_xsph
from wavetank.physics.coefficients import before_fall, coefficients, in_iteration, relaxations
from wavetank.physics.density_constraint import correct_positions, measure_density, solve_multipliers, start_multipliers
from wavetank.physics.dynamic_viscosity.implicit_viscosity import carry_on, solve_viscosity
from wavetank.physics.friction import apply_friction
from wavetank.physics.integrate import bring_within, predict, update_velocities
from wavetank.physics.mixture import pack_multipliers
from wavetank.physics.near_solids import FARTHEST, hand_over_pushes, look_again, look_at_solids
from wavetank.physics.neighbors import find_neighbors
from wavetank.physics.plan import Plan, plan_step
from wavetank.physics.population import hold_frozen, stop_frozen
from wavetank.physics.pressure.correct import correct_pressure
from wavetank.physics.sorting import sort_particles
from wavetank.physics.tension import apply_tension, prepare_fluids
from wavetank.physics.vorticity import confine_vorticity
from wavetank.physics.world import World
from wavetank.physics.xsph_viscosity import apply_mixed_xsph, apply_xsph, pack_velocities

SETTLING = 2  # iterations after bodies have yielded
Settle = Callable[[], bool | None]


def step(
    world: World, params: Parameters, dt: float, speed_limit: float = math.inf, settle: Settle | None = None
) -> bool:
    """Advance `world` by `dt` [s]; no particle leaves it faster than `speed_limit` [m/s].

    `settle` lets bodies yield to what the water has done to them so far. True: they have, and the water is to follow.
    None: one was hit so hard that the step is to be taken again; it ends here, and returns False.
    """
    plan = plan_step(world, params, dt)
    c = coefficients(
        params, dt, speed_limit, carries=plan.carried, parts=plan.parts, held=plan.held, iterations=plan.iterations
    )
    world.keep_viscosity(plan.is_viscous)
    world.keep_solids()

    predict(world.particles, world.grid, world.solids, world.fluids.rows, c, world.count, plan.searched)  # 1-4

    sort_particles(world.particles, world.spare, world.grid, world.count)  # 5-7
    world.swap()
    world.grid = find_neighbors(world.particles, world.grid, c, world.count)

    prepare_fluids(world, plan.kinds, params, dt)
    act_on_fluids(world, plan, params, c)
    if plan.searched:
        look_at_solids(world.scratch, world.particles, world.solids, c, world.count)
    if plan.on_grid:
        correct_on_grid(world, plan, params, c)

    sweeps = relaxations(params, plan.kinds.density_ratio, plan.iterations)
    for number, (relaxation, momentum) in enumerate(sweeps):  # 8-19
        if settle and number == max(0, len(sweeps) - SETTLING) and not settle_bodies(world, c, settle):
            return False
        c = in_iteration(c, relaxation, momentum)
        find_multipliers(world, plan, c, first=number == 0)  # 9-11
        apply_corrections(world, plan, c, first=number == 0)  # 12-18

    if plan.is_thick:
        carry_on(world, plan.kinds, params, c, stirred=plan.is_stirred)
    update_velocities(world.particles, c, world.count)  # 21, 23
    if plan.is_rubbed:
        apply_friction(
            world.particles,
            world.scratch,
            world.grid,
            world.solids,
            world.walls,
            c,
            world.count,
            int(plan.on_grid),
            int(plan.searched == 2),
        )
    if plan.searched == 2:
        hand_over_pushes(world.scratch, world.particles, world.solids, world.count)
    if plan.is_smoothed or plan.turning:
        smooth_and_confine(world, plan, c)  # 22
    if world.frozen:
        stop_frozen(world.particles, world.count)
    if world.grid.periods.axes:
        bring_within(world.particles, world.grid.periods, world.count)
    return True


def settle_bodies(world: World, c: Coefficients, settle: Settle) -> bool:
    """Let bodies yield, and the water follow in the iterations to come; return False where the step begins anew."""
    hand_over_pushes(world.scratch, world.particles, world.solids, world.count)
    yielded = settle()
    if yielded:
        look_at_solids(world.scratch, world.particles, world.solids, c, world.count)
    return yielded is not None


def act_on_fluids(world: World, plan: Plan, params: Parameters, c: Coefficients) -> None:
    """Let tension and viscosity act on velocities and predictions, which may then lead into solids."""
    if plan.is_tense:
        apply_tension(world, plan.kinds, params, c)
    if plan.is_viscous:
        solve_viscosity(world, plan.kinds, params, c, params.viscosity_iterations)
    if plan.is_tense or plan.is_viscous:
        keep_out_of_solids(world.particles, world.scratch, world.solids, c, world.count)


def correct_on_grid(world: World, plan: Plan, params: Parameters, c: Coefficients) -> None:
    """Remove what the densities of the whole tank are off, before the iterations between particles."""
    grid, of_heaviest = world.grid, 1.0
    c = before_fall(c)
    measure_density(
        world.scratch, world.particles, grid, world.solids, world.walls, c, of_heaviest, world.count, plan.method
    )
    correct_pressure(world, plan.kinds, params, c)


def find_multipliers(world: World, plan: Plan, c: Coefficients, *, first: bool) -> None:
    """Find the multipliers that correct the densities: the `first` of a step, or better ones."""
    scratch, particles, grid = world.scratch, world.particles, world.grid
    solids, walls, count = world.solids, world.walls, world.count
    if plan.searched and not first:
        look_again(scratch, particles, solids, c, FARTHEST * c.h, count)
    if first:
        start_multipliers(scratch, particles, grid, solids, walls, c, count, plan.method, plan.kinds.mixed)
    else:
        solve_multipliers(scratch, particles, grid, solids, walls, c, count, plan.method)


def apply_corrections(world: World, plan: Plan, c: Coefficients, *, first: bool) -> None:
    """Move the predicted positions by what the multipliers say, outside of solids; ice stays."""
    correction = plan.correction if first else plan.later_correction
    changes = world.scratch.dlam
    if correction > 3:  # of fluids of different density, with artificial pressure
        changes = world.fluids.array("packed")
        pack_multipliers(changes, world.scratch, world.count)
    correct_positions(
        world.spare,
        world.particles,
        world.scratch,
        changes,
        world.grid,
        world.solids,
        world.walls,
        c,
        world.count,
        plan.method,
        correction,
        plan.searched,
    )
    world.exchange("px", "py", "pz")
    if world.frozen:
        hold_frozen(world.particles, world.count)


def smooth_and_confine(world: World, plan: Plan, c: Coefficients) -> None:
    """Apply XSPH viscosity and vorticity confinement, both of the velocities as they are before either."""
    particles, spare, scratch, grid, count = world.particles, world.spare, world.scratch, world.grid, world.count
    mixed = plan.kinds.mixed and plan.is_smoothed
    if plan.turning or not (mixed or plan.is_central):
        apply_xsph(spare, particles, scratch, grid, c, count, plan.method, plan.turning)
    if mixed:
        packed = world.fluids.array("packed")
        pack_velocities(packed, particles, scratch.weight, count)
        apply_mixed_xsph(spare, particles, packed, grid, c, count, plan.method)
    elif plan.is_central:
        packed = world.fluids.array("packed")
        pack_velocities(packed, particles, scratch.lam, count)
        apply_central_xsph(spare, particles, packed, grid, c, count, plan.method)
    world.exchange("v")
    if plan.turning:
        confine_vorticity(world.particles, scratch, grid, c, count, plan.method)

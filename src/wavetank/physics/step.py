"""One step of Position Based Fluids: Algorithm 1 of Macklin and Müller 2013, top to bottom.

The numbers on the right are the lines of Algorithm 1. Where we differ: forces and neighbours are renewed in every
substep, particles are sorted rather than hashed, errors of the whole tank are removed on a grid before the iterations,
and contact is part of every correction.
"""

import enum
import math
from collections.abc import Callable

from wavetank.device.state import Coefficients
from wavetank.foundation.params import Parameters
from wavetank.physics.broad_phase import Obstacles, mark_solids
from wavetank.physics.coefficients import before_fall, coefficients, in_iteration, relaxations
from wavetank.physics.contact import resolve_contacts
from wavetank.physics.density_constraint import correct_positions, measure_density, solve_multipliers, start_multipliers
from wavetank.physics.integrate import find_cells, predict, update_velocities, wrap_positions
from wavetank.physics.mixture import pack_multipliers
from wavetank.physics.near_solids import FARTHEST, apply_reactions, query_solids, requery_solids
from wavetank.physics.neighbors import find_neighbors
from wavetank.physics.plan import Plan
from wavetank.physics.planning import plan_step
from wavetank.physics.population import hold_ice, stop_ice
from wavetank.physics.pressure.correct import correct_pressure
from wavetank.physics.sorting import sort_particles
from wavetank.physics.terms.builtin import TERMS
from wavetank.physics.terms.tension import prepare_fluids
from wavetank.physics.terms.term import Hook
from wavetank.physics.world import World

COUPLED_ITERATIONS = 2  # after bodies have responded


class Response(enum.Enum):
    """How bodies responded within a step to what the water has done to them so far."""

    UNCHANGED = enum.auto()
    MOVED = enum.auto()  # the water follows in the iterations to come
    RETRY = enum.auto()  # one was hit so hard that the step is to be taken again


Respond = Callable[[], Response]


def step(
    world: World, params: Parameters, dt: float, speed_limit: float = math.inf, respond: Respond | None = None
) -> bool:
    """Advance `world` by `dt` [s]; no particle leaves it faster than `speed_limit` [m/s].

    `respond` moves bodies by what the water has done to them so far. Where the step is to be taken again it ends there,
    and returns False.
    """
    plan = plan_step(world, params, dt)
    c = coefficients(
        params,
        dt,
        speed_limit,
        warm_start=plan.warm_start,
        pressure_iterations=plan.pressure_iterations,
        push_limit=plan.push_limit,
        iterations=plan.iterations,
        kinematic_viscosity=plan.kinds.least_kinematic_viscosity,
    )
    world.keep_viscosity(plan.has_viscosity)
    world.keep_solids()

    predict(world.particles, world.temporaries, world.grid, world.solids, c, world.count, int(plan.obstacles))  # 1-4
    keep_out_of_solids(world, plan, c)

    find_cells(world.particles, world.grid, c, world.count)
    sort_particles(world.particles, world.spare, world.grid, world.count)  # 5-7
    world.swap()
    world.grid = find_neighbors(world.particles, world.grid, c, world.count)

    prepare_fluids(world, plan.kinds, params, dt)
    if act(Hook.FORCES, world, plan, params, c):
        mark_solids(world.particles, world.temporaries, world.solids, c, world.count, int(plan.obstacles))
        keep_out_of_solids(world, plan, c)
    if plan.obstacles:
        query_solids(world.temporaries, world.particles, world.solids, c, world.count)
    if plan.on_grid:
        correct_on_grid(world, plan, params, c)

    sweeps = relaxations(params, plan.kinds.density_ratio, plan.iterations)
    for number, (relaxation, momentum) in enumerate(sweeps):  # 8-19
        if respond and number == max(0, len(sweeps) - COUPLED_ITERATIONS) and not couple_bodies(world, c, respond):
            return False
        c = in_iteration(c, relaxation, momentum)
        find_multipliers(world, plan, c, first=number == 0)  # 9-11
        apply_corrections(world, plan, c, first=number == 0)  # 12-18

    act(Hook.END_OF_ITERATIONS, world, plan, params, c)
    update_velocities(world.particles, c, world.count)  # 21, 23
    act(Hook.VELOCITIES, world, plan, params, c)  # 22
    if plan.obstacles == Obstacles.TWO_WAY:
        apply_reactions(world.temporaries, world.particles, world.solids, world.count)
    if world.frozen:
        stop_ice(world.particles, world.count)
    if world.grid.periods.axes:
        wrap_positions(world.particles, world.grid.periods, world.count)
    return True


def couple_bodies(world: World, c: Coefficients, respond: Respond) -> bool:
    """Let bodies respond, and query them where they have moved; return False where the step is to be taken again."""
    apply_reactions(world.temporaries, world.particles, world.solids, world.count)
    response = respond()
    if response is Response.MOVED:
        query_solids(world.temporaries, world.particles, world.solids, c, world.count)
    return response is not Response.RETRY


def act(hook: Hook, world: World, plan: Plan, params: Parameters, c: Coefficients) -> bool:
    """Apply the terms of this step that act at a `hook`; return whether there are any."""
    acting = [term for term in (*TERMS, *world.terms) if term.hook is hook and term.acts(plan)]
    for term in acting:
        term.apply(world, plan, params, c)
    return bool(acting)


def correct_on_grid(world: World, plan: Plan, params: Parameters, c: Coefficients) -> None:
    """Remove what the densities of the whole tank are off, before the iterations between particles."""
    grid, of_heaviest = world.grid, 1.0
    c = before_fall(c)
    measure_density(
        world.temporaries, world.particles, grid, world.solids, world.walls, c, of_heaviest, world.count, plan.method
    )
    correct_pressure(world, plan.kinds, params, c)


def keep_out_of_solids(world: World, plan: Plan, c: Coefficients) -> None:
    """Move the predicted positions of particles that may touch solids out of these."""
    if plan.obstacles:
        coupled = int(plan.obstacles == Obstacles.TWO_WAY)
        resolve_contacts(world.particles, world.temporaries, world.solids, world.fluids.rows, c, world.count, coupled)


def find_multipliers(world: World, plan: Plan, c: Coefficients, *, first: bool) -> None:
    """Find the multipliers that correct the densities: the `first` of a step, or better ones."""
    temporaries, particles, grid = world.temporaries, world.particles, world.grid
    solids, walls, count = world.solids, world.walls, world.count
    if plan.obstacles and not first:
        requery_solids(temporaries, particles, solids, c, FARTHEST * c.h, count)
    if first:
        start_multipliers(temporaries, particles, grid, solids, walls, c, count, plan.method, plan.kinds.mixed)
    else:
        solve_multipliers(temporaries, particles, grid, solids, walls, c, count, plan.method)


def apply_corrections(world: World, plan: Plan, c: Coefficients, *, first: bool) -> None:
    """Move the predicted positions by what the multipliers say, outside of solids; ice stays."""
    correction = plan.correction if first else plan.later_correction
    changes = world.temporaries.dlam
    if correction.needs_masses:
        changes = world.fluids.array("packed")
        pack_multipliers(changes, world.temporaries, world.count)
    correct_positions(
        world.spare,
        world.particles,
        world.temporaries,
        changes,
        world.grid,
        world.solids,
        world.walls,
        c,
        world.count,
        plan.method,
        int(correction),
        int(plan.obstacles),
    )
    world.swap_arrays("px", "py", "pz")
    keep_out_of_solids(world, plan, c)
    if world.frozen:
        hold_ice(world.particles, world.count)

"""What a time step consists of, and how many there are: both follow from fluids, parameters and motion."""

import math

import numpy as np

from wavetank.foundation.params import Parameters
from wavetank.physics.coefficients import correction_of, method_number
from wavetank.physics.mixture import Blend, blend
from wavetank.physics.plan import Plan
from wavetank.physics.pressure.correct import warm_start_share
from wavetank.physics.terms.dynamic_viscosity.implicit_viscosity import (
    has_high_viscosity,
    high_viscosity_share,
    is_viscous,
    steps_with_bodies,
    warm_start_of_thick,
)
from wavetank.physics.terms.tension import substeps_for
from wavetank.physics.time_step import pool_depth, steps_needed
from wavetank.physics.world import World

SOLIDS_IN_THICK = 3.0  # the constraint alone makes way for them, a few spacings far; notebook/viscosity.md
STIRRED = 0.02  # d: way of a solid in a step from which on
FARTHER = 4.0  # times as many iterations make way


def plan_step(world: World, params: Parameters, dt: float) -> Plan:
    """Plan a step of `dt` [s]."""
    kinds, on_grid = blend(world.materials, params), has_grid_pressure(world, params)
    thick, correction = warm_starts_pressure(world, kinds, params), correction_of(params, kinds.mixed)
    share = high_viscosity_share(kinds, params) if thick else 0.0
    stirred = thick and world.solid_speed * dt > STIRRED * params.spacing
    return Plan(
        kinds=kinds,
        method=method_number(params),
        obstacles=world.obstacles,
        correction=correction,
        # Beside the grid, which carries the water, all of it comes at once: it keeps packings even, and costs a fifth.
        later_correction=correction.without_pressure if on_grid else correction,
        pressure_iterations=1 if on_grid else params.iterations,
        confines_vorticity=int(params.vorticity > 0.0),
        has_surface_tension=kinds.surface_tension > 0.0,
        has_viscosity=is_viscous(kinds, params, dt),
        high_viscosity=thick,
        stirred_by_solids=stirred,
        push_limit=0.0 if stirred else share,  # it takes the speed then, not the way: `implicit_viscosity.warm_start`
        iterations=round(params.iterations * (1.0 + (FARTHER - 1.0) * share)) if stirred else params.iterations,
        has_friction=world.has_friction or params.calming > 0.0,
        has_xsph=params.viscosity > 0.0 or params.calming > 0.0,
        xsph_is_central=not (world.pressure or kinds.mixed),
        on_grid=on_grid,
        # What thick fluids carry on has been shortened to their share already.
        warm_start=warm_start_share(params, dt) if on_grid else float(thick),
    )


def has_grid_pressure(world: World, params: Parameters) -> bool:
    """Whether errors of the whole tank are removed on a grid: in a tank, and without ice, which it would move.

    It is gravity that needs it. Thick fluids, and water so fine that tension rules within a cell, are held by forces
    that vary from particle to particle; the grid would take what they press together for a lack of room.
    """
    if not has_grid(world, params):
        return False
    kinds, h = blend(world.materials, params), params.support * params.spacing
    weight = kinds.largest_density * math.hypot(*params.gravity) * h**2  # of water as high as a cell, per length
    return weight >= kinds.surface_tension and not warm_starts_pressure(world, kinds, params)


def has_grid(world: World, params: Parameters) -> bool:
    """Whether there is a grid to carry pressure, should the fluids need it: in a tank, and without ice."""
    return bool(params.grid_pressure > 0.0 and world.pressure and not world.frozen)


def warm_starts_pressure(world: World, kinds: Blend, params: Parameters) -> bool:
    """Whether fluids are so thick that they carry on what pressed them: not where bodies, in a tank, need the grid."""
    return has_high_viscosity(kinds, params) and not (world.pieces and has_grid(world, params))


def steps_in(
    world: World, params: Parameters, duration: float, speed: float, box: tuple[np.ndarray, np.ndarray], *, forced: bool
) -> float:
    """Return how many time steps make up `duration` [s], no whole number; what bounds them is in `time_step.py`.

    The fastest particle or solid has the `speed` [m/s], more than gravity acts where `forced`, and the water rests on
    the bottom of the `box` from one corner to another [m]. Surface tension needs steps of its own.
    """
    on_grid, kinds = has_grid_pressure(world, params), blend(world.materials, params)
    repeats = world.grid.periods.axes  # what slides along an axis without an end rests on nothing there
    across = tuple(0.0 if repeats >> axis & 1 else g for axis, g in enumerate(params.gravity))
    depth = 0.0 if on_grid else pool_depth(world.particles, world.count, across, *box)
    carried_on = warm_start_of_thick(kinds, params) if warm_starts_pressure(world, kinds, params) else 0.0
    needed = steps_needed(params, duration, speed, depth, on_grid=on_grid, forced=forced, carried=carried_on)
    if world.pieces:
        needed = max(needed, min(steps_with_bodies(kinds, params, duration), params.largest_substeps))
    capillary = substeps_for(kinds, params.dim, params.support, params.spacing, duration)
    return max(needed, min(capillary, params.largest_substeps))


def pace_of_solids(world: World, params: Parameters) -> float:
    """Return how many times as fast solids count for the time step as they are, where thick fluids are in their way."""
    kinds = blend(world.materials, params)
    share = high_viscosity_share(kinds, params) if warm_starts_pressure(world, kinds, params) else 0.0
    return 1.0 + (SOLIDS_IN_THICK - 1.0) * share


def capillary_speed(world: World, params: Parameters) -> float:
    """Return the speed [m/s] at which a sheet one spacing thick draws back (Taylor 1959, Culick 1960)."""
    fluids = blend(world.materials, params).fluids.values()
    return math.sqrt(max(2.0 * f.surface_tension / (f.density * params.spacing) for f in fluids))

"""The numbers of a step, from the parameters of a scene."""

import dataclasses
import functools
import math

import numpy as np

from wavetank.device.state import Coefficients, interned
from wavetank.foundation.params import Parameters
from wavetank.physics.density_constraint import Correction, schedule
from wavetank.physics.mixture import stiffening
from wavetank.physics.pressure.grid import THRESHOLDS
from wavetank.physics.smoothing import KERNELS, NAMES, SLOPES, kernel_shape, rest_lattice

LEAST_MIXING = 1e-6  # of S_0: a particle without neighbours has no gradient to divide by
REFERENCE_RATE = 240.0  # substeps per second for which the viscosity parameter is the share of one substep
#: By how much water in motion exceeds the stiffest mode of its rest lattice, in 2-D and 3-D; notebook/solver.md.
DISORDER = {2: 0.75, 3: 0.35}
#: Of sqrt(g d): below which motion past neighbours, and along solids, is slow. A wave that can be seen is faster.
SLOW, SLOW_AT_SOLIDS = 0.1, 0.2
STATIC_FRICTION = 0.05  # coefficient of what lies on solids while it is slow; on steep ones at least a fifth of it
XSPH_VISCOSITY = 0.1  # kinematic viscosity of XSPH, over d^2 times the share that it takes in a second
CALM = 0.1  # of sqrt(g / h), the rate of the shortest waves: water that turns slower counts as calm


def coefficients(
    params: Parameters,
    dt: float,
    speed_limit: float = math.inf,
    *,
    warm_start: float = 0.0,
    pressure_iterations: int = 0,
    push_limit: float = 0.0,
    iterations: int = 0,
    kinematic_viscosity: float = 0.0,
) -> Coefficients:
    """Return the scalars of a substep of `dt` [s]; lengths relative to the rest lattice become metres here.

    Artificial pressure comes in so many `parts`, one an iteration where 0. Pushes of thick fluids are `held` back.
    `iterations` are those of `params` where 0. XSPH makes up for what the fluids' `kinematic_viscosity` [m^2/s] lacks
    of its own, so that a viscosity that is asked for is the one that acts.
    """
    h, gravity = params.support * params.spacing, (*params.gravity, 0.0)
    iterations = iterations or params.iterations
    rest = rest_lattice(params.kernel, params.dim, params.support)
    s_0 = rest.squared_gradients / h**2
    w_dq = float(kernel_shape(NAMES[params.kernel][0], np.array(params.tensile_distance))[0])
    tensile = params.tensile_strength / s_0 / (pressure_iterations or iterations) / w_dq**params.tensile_exponent
    # Packings need it that gravity presses; without gravity it would blow them up (notebook/calm.md). It is the
    # same force in steps of any length.
    usual_steps = params.usual_steps(dt)
    tensile *= usual_steps**2
    lacking = max(0.0, params.viscosity * REFERENCE_RATE - kinematic_viscosity / XSPH_VISCOSITY / params.spacing**2)
    viscosity = min(1.0, lacking * dt)
    calming = 1.0 - (1.0 - params.calming) ** usual_steps
    # Of what an iteration may move a particle by: as fast as it goes, and as it falls past a neighbour.
    pace = dt / iterations / push_limit if push_limit > 0.0 else 0.0
    # Without gravity nothing is slow: there is no speed to compare with.
    slow = 1.0 / max(math.hypot(*params.gravity) * params.spacing, 1e-30)
    return interned(
        Coefficients(
            dt=dt,
            gravity_x=gravity[0],
            gravity_y=gravity[1],
            gravity_z=gravity[2],
            h=h,
            inverse_h=1.0 / h,
            inverse_h2=1.0 / h**2,
            density_scale=rest.density_scale,
            gradient_scale=rest.gradient_scale * SLOPES[NAMES[params.kernel][1]] / h**2,
            eps=max(params.force_mixing, LEAST_MIXING) * s_0,
            relaxation=params.relaxation,
            momentum=0.0,
            attraction=params.attraction,
            tensile=tensile,
            tensile_exponent=params.tensile_exponent,
            largest_correction=h / iterations,
            push_limit=pace * math.sqrt(2.0 * math.hypot(*params.gravity) * h),
            push_time=pace,
            viscosity=viscosity,
            calming=max(0.0, calming - viscosity),
            slow=slow / SLOW**2,
            calming_at_solids=calming,
            static_friction=STATIC_FRICTION * params.calming * math.hypot(*params.gravity) * dt,
            slow_at_solids=slow / SLOW_AT_SOLIDS**2,
            vorticity=params.vorticity,
            coherence=params.vorticity_coherence,
            calm=CALM * math.sqrt(math.hypot(*params.gravity) / h),
            speed_limit=speed_limit,
            warm_start=warm_start,
            largest_warm_start=THRESHOLDS.largest_warm_start * math.hypot(*params.gravity),
            wall_density=params.wall_density,
            wall_gap=params.wall_gap * params.spacing,
        )
    )


@functools.lru_cache(maxsize=256)
def in_iteration(c: Coefficients, relaxation: float, momentum: float) -> Coefficients:
    """Return `c` with the numbers of one iteration, the same object for the same numbers."""
    return dataclasses.replace(c, relaxation=relaxation, momentum=momentum)


def relaxations(params: Parameters, density_ratio: float = 1.0, iterations: int = 0) -> list[tuple[float, float]]:
    """Return (relaxation, momentum) of each iteration; fewer iterations have to damp a narrower range of modes."""
    rest, iterations = rest_lattice(params.kernel, params.dim, params.support), iterations or params.iterations
    stiffest = (rest.stiffest_mode + DISORDER[params.dim] + stiffening(density_ratio)) / params.relaxation
    return schedule(iterations, 4.0 * params.slowest_mode / iterations, stiffest)


@functools.lru_cache(maxsize=256)
def before_fall(c: Coefficients) -> Coefficients:
    """Return `c` for densities of places before gravity, less what is carried on, moved all of them alike."""
    return dataclasses.replace(c, fallen=(1.0 - c.warm_start) * c.dt**2)


def correction_of(params: Parameters, mixed: int) -> Correction:
    """Return which correction of positions the parameters ask for, of fluids of different density where `mixed`."""
    if params.tensile_strength == 0.0:
        return Correction.MIXED if mixed else Correction.PLAIN
    if params.tensile_exponent == 4.0:
        return Correction.MIXED_QUARTIC if mixed else Correction.QUARTIC
    return Correction.MIXED_TENSILE if mixed else Correction.TENSILE


def method_number(params: Parameters) -> int:
    """Return the place of the chosen smoothing kernel in KERNELS."""
    number = list(NAMES).index(params.kernel)
    assert number < len(KERNELS)
    return number

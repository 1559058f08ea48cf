"""Dynamic viscosity from water to honey: an implicit step for the velocities, stable at any time step.

Every pair of neighbours is joined by a damper along the line between them, as in Weiler et al. 2018, "A Physically
Consistent Implicit Viscosity Solver for SPH Fluids" (10.1111/cgf.13349):

    rho_i dv_i/dt = sum_j mu_ij B f(q_ij) ((v_j - v_i) . n) n,     B = 2 dim (dim + 2) / sum_lattice f(q) r^2

which is mu lap v for a flow without divergence. A damper along the line leaves translations and rotations alone, at a
free surface too, and m_i dv_i is antisymmetric: from rest, momentum and angular momentum about where particles are
predicted are exact however far the solver gets.

    code      symbol          meaning                                                     unit
    n         n               unit vector from j to i                                     1
    mu        mu_ij           2 mu_i mu_j / (mu_i + mu_j) (Cleary 1998)                   Pa s
    rate      dt B / rho      what a pair does in a substep, over mu                      1/(Pa s)
    packed                    iterate of the velocity, and mu_i                           m/s, Pa s
    drag      T v_w, T        rate of the walls' drag in this substep over mu             1

Where we differ, and why:
- f(q) = 1 - q, the weights of Müller et al. 2003 (10.2312/SCA03/154-159), not the gradient of a kernel: it has no
  pole, and B makes its second moment on the rest lattice exact, averaged over directions.
- Conjugate gradients (`conjugate_gradients.py`) start at what viscosity did in the last step, which is not far off:
  half of the iterations that they take from rest, a quarter of Chebyshev's, where the fluid is thick
  (notebook/viscosity.md). Momentum is still exact; what is so stiff that it is turned (`rigid_guess.py`) keeps it
  to 1 %.
- Solids hold the fluid back along their surface (no-slip) as half a rest lattice would that continues the
  velocity linearly to its value at the wall (Takeda et al. 1994, 10.1143/ptp/92.5.939; Morris et al. 1997,
  10.1006/jcph.1997.5776), from a table of the distance. Across it they do as well where the fluid strikes: closer
  than it rests, faster than it falls half past a neighbour, sqrt(g h). So what is stiff stops at once on a floor.
  Pushed out of it by the constraint, a few spacings deep in each of several steps, it sprang back.
- The constraint displaces a thick fluid without knowing its viscosity, which the next solve takes back: where a solid
  moves through it particles were flung about at several times the solid's speed, and pressed together all the same. In
  a step it may move them as far as they go, and fall past a neighbour, sqrt(2 g h), over k / (`HALF` + k); where a
  solid does move, any way, in several times the iterations, but that gives them little speed (`PUSHED`).
- Viscosity acts before the constraint, so that what pressure adds to the motion is damped in the next step only. That
  made honey flow a fifth too fast at any affordable step. A thick fluid therefore begins a step with the share w of
  what pressed it in the last one, and only the change comes afterwards: the incremental projection of Goda 1979
  (10.1016/0021-9991(79)90088-3; Guermond et al. 2006, 10.1016/j.cma.2005.10.010). w = `CARRIED` k / (`HALF` + k) of the
  `thickness` k: thin water carries nothing here, it would keep its noise. notebook/viscosity.md has the figures.
- Bodies feel the opposite of their part of the drag. Where there are any, the grid carries thick fluids as it carries
  thin ones, in steps of a `thickness` of `WITH_BODIES` at most: between particles alone, in steps so short, a ball of
  three spacings does not sink through fluid of two thirds of its density, not even through water (docs/bodies.md).
  Walls hold what pressure is still to act on as if it had: fluid that begins its step falling pulled bodies down.
- At rest nearly all of it is carried on (`CALM`). With a fifth left out, honey began each step falling; as walls hold
  that back, they bore a third of its weight: it crept up them, and down between them, for ever. And it lasts where
  nothing moves (`LASTS`): the push that remains is a fiftieth of gravity's. Where it was none for a step, as single
  particles stood a thousandth too high, all was forgotten; they fell, were pressed, rose, and a sheet hopped for ever.
"""

import dataclasses
import functools
import math

import numpy as np

from wavetank.device.compiler import qd, upload
from wavetank.device.state import Coefficients, Grid, Particles, interned, scalars
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.params import Parameters
from wavetank.physics.clusters import chunks, end_cluster, first_cluster
from wavetank.physics.integrate import accelerate, free_motion
from wavetank.physics.mixture import Blend
from wavetank.physics.neighbors import MAX_ENTRIES
from wavetank.physics.pairs import keep_pairs
from wavetank.physics.plan import Plan
from wavetank.physics.predicted_positions import predict_at, predicted
from wavetank.physics.smoothing import TABLE_SIZE, rest_points
from wavetank.physics.terms.dynamic_viscosity.conjugate_gradients import TOLERANCE, Damping, solve
from wavetank.physics.terms.dynamic_viscosity.drag import Holding, drag_bodies, drag_table, find_drag
from wavetank.physics.terms.dynamic_viscosity.rigid_guess import FORGET, RIGID, SHEARED, STIFF, rotate_guess
from wavetank.physics.terms.term import Hook, Term
from wavetank.physics.world import World

ANY = 1e9  # m/s
STIFFER = 3.0  # times as stiff as the rest lattice: water in motion, and the drag of walls
WORTH = 1e-5  # smallest kappa - 1 on the rest lattice for which a substep solves anything
STIFFEST = 1e7  # eigenvalue beyond which single precision cannot tell what moves as a whole
THICK = 1.0  # `thickness` in a usual step above which pressure is carried on; oil at centimetres has 0.06
CARRIED, HALF = 0.83, 10.0  # largest share of the pressure that is carried on; `thickness` with half of it
LARGEST = 5.0  # of gravity, that is carried on
AGAIN = 6.0  # times the push of the same step, that is carried on; at rest it is `CARRIED` / (1 - `CARRIED`) = 4.9
TOUCHING = 0.5  # d: closer to a wall than at rest, what strikes it is held back along the normal as well
SLIPS = 1e-9  # least share of the drag along a wall, where there should be none
WITH_BODIES = 4.0  # `thickness` in a step, at most, where bodies are in the fluid
CALM = 0.9  # share of what is not carried on that is, where nothing moves
LASTS = 0.95  # of what was carried on that is again where nothing moves, whatever pressed
PUSHED = 0.1  # of its own speed and of sqrt(2 g h): the speed that a push gives where solids move through


def damper_scale(dim: int, ratio: float, d: float) -> float:
    """Return B [1/m^2] for the support radius `ratio` * `d` and the spacing `d` [m]."""
    distance = np.linalg.norm(rest_points(dim, ratio), axis=1)
    return float(2.0 * dim * (dim + 2) / np.sum((1.0 - distance / ratio) * distance**2)) / d**2


@functools.cache
def stiffness(dim: int, ratio: float) -> float:
    """Return a bound of the largest eigenvalue of dt M^-1 L over dt nu B on the rest lattice.

    That is twice what a particle's own dampers do: the matrix of one damper is at most twice its diagonal blocks,
    hence so is their sum.
    """
    distance = np.linalg.norm(rest_points(dim, ratio), axis=1)
    return float(2.0 * np.sum(1.0 - distance / ratio) / dim)


@qd.func
def damper(square, a, b, c: Coefficients):
    """Return mu_ij f(q) / r^2, which does not change while the velocities are solved for."""
    f = qd.max(1.0 - qd.sqrt(square) * c.inverse_h, 0.0)
    mu = 2.0 * a[3] * b[3] / qd.max(a[3] + b[3], 1e-20)
    return mu * f / qd.max(square, 1e-24)


@qd.kernel(fastcache=True)
def find_dampers(
    dampers: qd.types.ndarray(),
    packed: qd.types.ndarray(),
    particles: Particles,
    grid: Grid,
    c: Coefficients,
    count: qd.i32,
):
    """Keep the dampers of all pairs."""
    for chunk in range(chunks(grid, count)):
        for cluster in range(first_cluster(chunk, grid, count), end_cluster(chunk, grid, count)):
            keep_pairs(dampers, damper, cluster, particles, packed, grid, c)


@qd.kernel(fastcache=True)
def guess_velocities(velocities: qd.types.ndarray(), particles: Particles, c: Coefficients, count: qd.i32):
    """Start at the velocities that there are if viscosity does what it did in the last step; ice has none."""
    for i in range(count):
        for k in qd.static(range(particles.v[i].n)):
            v = particles.v[i][k] + c.dt * particles.viscous[i][k]
            velocities[i][k] = v * (1.0 - particles.frozen[i])


@qd.kernel(fastcache=True)
def take_velocities(
    particles: Particles, packed: qd.types.ndarray(), normal: qd.types.ndarray(), c: Coefficients, count: qd.i32
):
    """Adopt the velocities that were found, and move the predicted positions with them.

    What strikes a wall was predicted to stop there already: its prediction begins anew, or it would be stopped twice.
    """
    for i in range(count):
        before = particles.v[i]
        v = before
        for k in qd.static(range(v.n)):
            v[k] = packed[i][k]
        particles.viscous[i] = (v - before) * (1.0 - particles.frozen[i]) / c.dt
        accelerate(particles, i, v, c)
        if particles.near[i] != 0 and normal[i].w > 0.0:
            predict_at(particles, i, free_motion(particles.x[i], v, c))


@dataclasses.dataclass(frozen=True)
class WarmStart:
    """How much of what pressed them thick fluids carry on."""

    rate: qd.f32  # 1/(Pa s): `thickness` of the heaviest fluid over its viscosity
    most: qd.f32  # share of the thickest
    half: qd.f32  # thickness with half of that share
    largest: qd.f32  # m/s^2
    calm: qd.f32  # share of what is not carried on that is, where nothing moves
    lasts: qd.f32  # of what there was, that is carried on anyway where nothing moves
    again: qd.f32  # of the push of this step: what has left the floor is not pushed any more
    own: qd.f32  # of its own speed: that which a push gives, at most, beside
    falling: qd.f32  # m/s


@qd.kernel(fastcache=True)
def keep_pressure(particles: Particles, rows: qd.types.ndarray(), c: Coefficients, w: WarmStart, count: qd.i32):
    """Keep the share of what pressure and solids accelerated thick fluids by that the next prediction begins with.

    It is called before velocities are read off. What a push should not give to them is taken by moving where the way
    began.
    """
    for i in range(count):
        row = rows[particles.material[i]]
        pushed = predicted(particles, i) - free_motion(particles.x[i], particles.v[i], c)
        a = particles.a[i] + pushed / (c.dt * c.dt)
        thick = w.rate * row[0] * row[1]
        way = predicted(particles, i) - particles.x[i]
        calm = qd.max(0.0, 1.0 - way.norm_sqr() * c.slow / (c.dt * c.dt))
        passed = 1.0 - w.calm * calm
        share = 1.0 - (1.0 - w.most) * passed
        share *= thick / (w.half + thick)
        limit = qd.min(w.largest, w.again / passed * pushed.norm() / (c.dt * c.dt))
        limit = qd.max(limit, w.lasts * calm * particles.a[i].norm())
        particles.a[i] = a * (share * qd.min(1.0, limit / qd.max(a.norm(), 1e-12)))
        most = (w.own * particles.v[i].norm() + w.falling) * (w.half + thick) / qd.max(thick, 1e-6)
        if pushed.norm() > c.dt * most:
            particles.x[i] += pushed * (1.0 - c.dt * most / pushed.norm())


def thickness(viscosity: float, params: Parameters, dt: float) -> float:
    """Return what `viscosity` [m^2/s] does to the fastest mode within `dt` [s]: kappa - 1 on the rest lattice."""
    return dt * viscosity * 4.0 * (params.dim + 2) / params.spacing**2  # dt nu 2 B sum f / dim, within a factor of two


def thickness_in_usual_step(viscosity: float, params: Parameters) -> float:
    """Return the `thickness` in a time step as long as calm water takes it."""
    return thickness(viscosity, params, params.frame_time / params.substeps)


def is_viscous(kinds: Blend, params: Parameters, dt: float) -> bool:
    """Say whether the viscosity of any fluid matters in a substep of `dt` [s]."""
    return thickness(kinds.kinematic_viscosity, params, dt) > WORTH


def has_high_viscosity(kinds: Blend, params: Parameters) -> bool:
    """Say whether viscosity rules the motion of any fluid from particle to particle, and gravity presses it."""
    return thickness_in_usual_step(kinds.kinematic_viscosity, params) > THICK and any(params.gravity)


def solve_viscosity(world: World, kinds: Blend, params: Parameters, c: Coefficients, most: int) -> int:
    """Make velocities and predicted positions those of viscous fluids; return the number of iterations, `most` at most.

    Raises `WavetankError` for more pairs than there is room for.
    """
    particles, grid, fluids, count = world.particles, world.grid, world.fluids, world.count
    dim, ratio = params.dim, params.support
    rate = c.dt * damper_scale(dim, ratio, c.h / ratio) / kinds.largest_density
    stiffest = 1.0 + STIFFER * rate * kinds.largest_density * kinds.kinematic_viscosity * stiffness(dim, ratio)
    largest = STIFFEST / (STIFFER * rate * stiffness(dim, ratio))
    if "drag table" not in fluids.arrays:
        fluids.arrays["drag table"] = scalars(TABLE_SIZE + 1)
        upload(fluids.arrays["drag table"], drag_table(dim, ratio))
    if 8 * grid.list.shape[0] > MAX_ENTRIES:
        raise WavetankError(
            f"{count:,} particles of viscous fluids are too many: what joins their pairs has at most {MAX_ENTRIES:,} "
            f"places, enough for {MAX_ENTRIES // grid.room:,} particles; use a larger spacing, less fluid, or "
            "viscosity = 0 in its materials and dynamic_viscosity = 0."
        )
    packed, drag, normal = (fluids.array(name) for name in ("packed", "drag", "normal"))
    dampers = fluids.pairs(grid)
    table = fluids.arrays["drag table"]
    holding = interned(
        Holding(
            no_slip=max(params.no_slip, SLIPS),
            most=largest,
            touching=TOUCHING * params.spacing,
            to_come=(1.0 - c.warm_start) * c.dt if world.pieces else 0.0,
        )
    )
    find_drag(packed, drag, normal, particles, fluids.rows, world.solids, table, c, holding, count)
    find_dampers(dampers, packed, particles, grid, c, count)
    guess_velocities(packed, particles, c, count)
    if stiffest > STIFF:
        full = 0.5 * dim * stiffness(dim, ratio)
        rotate_guess(particles, packed, dampers, grid, c, RIGID / SHEARED[dim], FORGET, full, count)
        guess_velocities(packed, particles, c, count)
    damping = fluids.together(Damping, dampers, drag, normal)
    number = solve(world, damping, packed, c, rate, iterations(min(stiffest, STIFFEST), most))
    if world.pieces:
        per_damper = params.spacing / min(largest, largest_viscosity(kinds))
        drag_bodies(
            packed, normal, particles, world.temporaries, world.solids, table, c, holding, rate, per_damper, count
        )
    take_velocities(particles, packed, normal, c, count)
    return number


def largest_viscosity(kinds: Blend) -> float:
    """Return the viscosity [Pa s] of the thickest fluid."""
    return max(fluid.viscosity for fluid in kinds.fluids.values())


def hold_on_bodies(kinds: Blend, params: Parameters, dt: float) -> tuple[float, float]:
    """Return what the dampers of a body are [kg] in a step of `dt` [s], over their sum in spacings, and nu dt [m^2]."""
    d, thickest, density = params.spacing, largest_viscosity(kinds), kinds.largest_density
    stiff = dt * damper_scale(params.dim, params.support, d) / density * thickest
    return stiff * density * d**params.dim, dt * thickest / density


def steps_with_bodies(kinds: Blend, params: Parameters, duration: float) -> float:
    """Return how many steps `duration` [s] has at least where bodies are in the fluids."""
    return thickness(kinds.kinematic_viscosity, params, duration) / WITH_BODIES


def store_warm_start(world: World, plan: Plan, params: Parameters, c: Coefficients) -> None:
    """Store the share of the pressure on thick fluids that the next step begins with, at little speed if stirred."""
    rate, gravity = thickness(1.0 / plan.kinds.largest_density, params, c.dt), math.hypot(*params.gravity)
    own, falling = (PUSHED, PUSHED * math.sqrt(2.0 * gravity * c.h)) if plan.stirred_by_solids else (0.0, ANY)
    carried = interned(
        WarmStart(
            rate=rate,
            most=CARRIED,
            half=HALF,
            largest=LARGEST * gravity,
            again=AGAIN,
            calm=CALM,
            lasts=LASTS,
            own=own,
            falling=falling,
        )
    )
    keep_pressure(world.particles, world.fluids.rows, c, carried, world.count)


def high_viscosity_share(kinds: Blend, params: Parameters) -> float:
    """Return how thick all fluids are, the thinnest of them included: k / (`HALF` + k) of its `thickness` k."""
    if not has_high_viscosity(kinds, params):
        return 0.0
    thick = thickness_in_usual_step(min(fluid.viscosity / fluid.density for fluid in kinds.fluids.values()), params)
    return thick / (HALF + thick)


def warm_start_of_thick(kinds: Blend, params: Parameters) -> float:
    """Return the share of what presses them in a frame that all fluids carry on, the thinnest of them included."""
    return CARRIED * high_viscosity_share(kinds, params)


def iterations(stiffest: float, most: int) -> int:
    """Return how many iterations bring every mode of 1 to `stiffest` within `TOLERANCE`, at most `most`."""
    if stiffest <= 1.0 + 1e-9:
        return 0
    # In the energy norm no polynomial is better than theirs, and Chebyshev's is at most 1 / T_n(sigma) (Saad 2003,
    # Theorem 6.25).
    sigma = (stiffest + 1.0) / (stiffest - 1.0)
    return min(most, math.ceil(math.acosh(1.0 / TOLERANCE) / math.acosh(sigma)))


def apply_viscosity(world: World, plan: Plan, params: Parameters, c: Coefficients) -> None:
    """Solve for the velocities of viscous fluids."""
    solve_viscosity(world, plan.kinds, params, c, params.viscosity_iterations)


VISCOSITY = Term("viscosity", Hook.FORCES, apply_viscosity, lambda plan: plan.has_viscosity)
WARM_START = Term("warm start", Hook.END_OF_ITERATIONS, store_warm_start, lambda plan: plan.high_viscosity)

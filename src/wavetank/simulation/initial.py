"""The initial water around solids: which lattice places solids leave free, and its hydrostatic pressure.

Culling. Keeping only places half a spacing clear of a solid leaves a gap of up to a spacing beside it, into which still
water falls: it started at 0.5 m/s around a box. Here water keeps its volume: a place counts by the share of its cell
that is outside, and of the places whose cells are cut, the outermost stay, as many as these shares add up to. Those too
close to a solid are led out of it by the relaxation.

Hydrostatic relaxation. A lattice has gaps beside solids and is everywhere some thousandths less dense than at rest. The
first step would close that at once and take the displacement for a velocity: a jolt, on which a body of water's density
glides for seconds (notebook/bodies.md). So before the first step the water takes some steps in which solids and bodies
are fixed and velocities are reset, but the warm-started pressure of the grid stays: water at rest gets the density that
its weight gives it. No particle moves by more than `FARTHEST` in each step. What falls freely stays where it is. Where
the water still moves after all steps, moving particles return to their start, so that the front of a dam is a plane.

    code     meaning                                                            unit
    s        distance of a place to the nearest solid, negative inside          spacings
    share    of a place's cell that is outside: exact for a plane along the     1
             cells, and for all planes in the mean
    start_v  velocities by id                                                   m/s
    start_x  positions by id, before all steps                                  m
    before   positions before a step                                            m
    move     displacement of particles in a step, by id                         m
    fall     displacement of a particle in free fall                            m
"""

from collections.abc import Callable

import numpy as np

from wavetank.device.compiler import upload
from wavetank.foundation.errors import WavetankError
from wavetank.physics.population import Clearance, free_places
from wavetank.physics.world import World
from wavetank.scene.scene import Lattice, Scene
from wavetank.simulation.particles import by_id, put_by_id
from wavetank.simulation.solids import Solids
from wavetank.solids.distance import SolidSet
from wavetank.solids.sampling import nearest_of

CUT = 0.5  # spacings: cells closer than this to a surface are cut by it
TOUCH = 0.1  # spacings: between solids closer to each other than this there is no place for water
EVEN = 0.2  # spacings: dither in the order of places, which spreads a part of a row along it
SPREAD = np.array([0.8191725134, 0.6710436067, 0.5497004779])  # low-discrepancy dither of cells: Roberts 2018, R3
FEWEST, MOST, MOST_BESIDE_BODIES = 8, 60, 24  # steps; the last also of water that is nearly at rest
CALM = 0.04  # of the fall: mean displacement in a step of what does not fall freely, below which all water is at rest
STILL = 0.005  # of the fall, the same: below it steps end early
RUNS = 0.1  # of the fall, the same: above it water flows
CALMER = 0.98  # mean displacement over that in the step before: where it falls by less, water flows and will not rest
FARTHEST = 0.1  # of a spacing: largest displacement in a step
FREE = 0.1  # of the fall: particles whose displacement differs from it by less fall freely
STANDING = 0.3  # of the fall: water that moved less in the last step is at rest; at twice that it is not
LIVELY = 0.002  # of the particles: where fewer move by more than that, steps end


def cull(scene: Scene, lattice: Lattice, solids: Solids, world: World, *, clear: bool) -> np.ndarray:
    """Return which particles of a scene's `lattice` are outside of its solids, bool [n]; all `Points` stay.

    With `clear` only those as far from solids as water rests; else as many as there is volume for, some of them closer.
    Raises `WavetankError` where none is.
    """
    places = lattice.positions
    if not solids.reaches_into(scene):
        return np.ones(len(places), bool)
    if clear:
        clearance = Clearance(0.0, scene.wall_gap * scene.spacing, solids.tank_count)
        free = free_places(places, world.particles, solids.device, 0, clearance)
    else:
        free = outside_solids(scene, lattice, solids.device, solids.tank_count)
    free |= lattice.has_own_place
    if not free.any():
        raise WavetankError("the fluids of this scene are inside of its solids; move them, or make them larger.")
    return free


def outside_solids(scene: Scene, lattice: Lattice, solids: SolidSet, first: int) -> np.ndarray:
    """Return which particles of a scene's `lattice` the solids from number `first` on leave free, bool [n]."""
    places = lattice.positions
    s, nearest = nearest_of(solids, first, places, TOUCH * scene.spacing)
    s /= scene.spacing
    free, cut = s >= CUT, np.flatnonzero(np.abs(s) < CUT)
    cells = np.floor(places[cut] / scene.spacing)
    order = s[cut] + EVEN * ((cells @ SPREAD[: places.shape[1]]) % 1.0 - 0.5)
    kinds = lattice.kinds[cut]
    for kind, solid in {*zip(kinds.tolist(), nearest[cut].tolist(), strict=True)}:
        chosen = np.flatnonzero((kinds == kind) & (nearest[cut] == solid))
        number = round(float((CUT + s[cut[chosen]]).sum()))
        free[cut[chosen[np.argsort(-order[chosen], kind="stable")[:number]]]] = True
    return free


def relax(
    world: World,
    step: Callable[[], None],
    fall: np.ndarray,
    spacing: float,
    *,
    near: Callable[[np.ndarray], np.ndarray] | None,
) -> bool:
    """Relax a world to hydrostatic pressure and return whether its water is at rest.

    `step` takes one step, `fall` [dim] [m] is the displacement of free fall in it. Particles that still move return to
    their start where not all is calm, except those that started too close to a solid: `near` returns which positions
    [n, dim] are, bool [n]. Without it, with bodies, particles that move always return.
    """
    count = world.count
    start_v, start_x = by_id(world.particles, count, "v"), by_id(world.particles, count, "x")
    free_fall = max(float(np.linalg.norm(fall)), 1e-30)
    length, is_free, mean = np.zeros(count), np.zeros(count, bool), np.inf
    for number in range(MOST_BESIDE_BODIES if near is None else MOST):
        upload(world.particles.v, [])  # all zero; `fill` would read a kernel for each array
        before = by_id(world.particles, count, "x")
        step()
        move = by_id(world.particles, count, "x") - before
        length = np.linalg.norm(move, axis=1)
        is_free = np.linalg.norm(move - fall, axis=1) < FREE * free_fall
        move *= np.where(is_free, 0.0, np.minimum(1.0, FARTHEST * spacing / np.maximum(length, 1e-30)))[:, None]
        put_by_id(world.particles, count, "x", before + move)
        borne = length if near is None else length[~is_free]
        mean, last = float(borne.sum()) / max(len(borne), 1) / free_fall, mean
        lively = near is not None and np.count_nonzero(borne > STANDING * free_fall) >= LIVELY * count
        at_rest = mean < CALM and not lively and (mean < STILL or number + 1 >= MOST_BESIDE_BODIES)
        if number + 1 >= FEWEST and (at_rest or mean > max(CALM, CALMER * last)):
            break
    if near is None or mean >= CALM:
        too_near = False if near is None else near(start_x)
        share = np.where(too_near, 1.0, np.clip(2.0 - length / (STANDING * free_fall), 0.0, 1.0))[:, None]
        put_by_id(world.particles, count, "x", start_x + share * (by_id(world.particles, count, "x") - start_x))
    put_by_id(world.particles, count, "v", start_v)
    return bool(mean < RUNS and 2 * np.count_nonzero(is_free) < count)

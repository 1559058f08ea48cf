"""Surface tension and adhesion: a skin that pulls along the surface, and solids that attract the fluid.

The skin is the continuum surface stress of Lafaurie et al. 1994 (10.1006/jcph.1994.1123),
Pi = sigma (|g| 1 - g g / |g|) with the gradient g of the density, as a pairwise force of smoothed particles (Hu
and Adams 2006, 10.1016/j.jcp.2005.09.001):

    F_i = -sum_j A w(q_ij) (Pi_i + Pi_j) n - sum_j B (|g_i| + |g_j|) f(q_ij) n

The second term, cohesion (Akinci et al. 2013, "Versatile Surface Tension and Adhesion for SPH Fluids",
10.1145/2508363.2508395), holds the skin on the fluid. Both change sign with i and j: momentum is exact.

    code       symbol         meaning                                                         unit
    n          n              unit vector from j to i                                         1
    surface    g, sigma       h times the gradient of the relative density, and the tension   1, N/m
    skin       A              what makes the stress of a flat lattice surface sigma           m^(dim - 2)
    cohesion   B              bond of a pair over h                                           m^(dim - 2)
    wetting    (1 + cos t)/2  work of adhesion over 2 sigma (Young and Dupre)                 1

Where we differ, and why:
- A follows from the rest lattice by the virial of a flat surface, times a measured factor (`CALIBRATION`), so that
  sigma is in N/m. Inside, where g is noise,
  it is cut off (`QUIET`), and nothing pulls.
- Cohesion acts at the surface alone. Attraction inside presses the particles into a crystal that does not flow: a drop
  made of it keeps its corners. `COHESION` is the smallest share that keeps the skin whole; notebook/viscosity.md.
- Solids pull like half a rest lattice of the fluid times `wetting`, from a table of the distance.
- The tension is limited to what a time step can carry, and `substeps_for` asks for the time steps that the real one
  needs; so nothing explodes where the budget of time steps ends.
- A fluid feels its interface to one of weaker tension with the difference of both (Antonow 1907).
"""

import dataclasses
import functools
import math

import numpy as np

from wavetank.device.compiler import qd, upload
from wavetank.device.state import MARGIN, Coefficients, Grid, Particles, Temporaries, interned, scalars
from wavetank.foundation.materials import Properties
from wavetank.foundation.params import Parameters
from wavetank.physics.bodies import push_back
from wavetank.physics.broad_phase import is_marked
from wavetank.physics.clusters import chunks, end_cluster, end_of, first_cluster
from wavetank.physics.integrate import accelerate
from wavetank.physics.mixture import Blend, fill_table, weigh
from wavetank.physics.pairs import add_neighbors, column
from wavetank.physics.plan import Plan
from wavetank.physics.predicted_positions import predicted
from wavetank.physics.smoothing import TABLE_SIZE, interpolated, rest_points
from wavetank.physics.terms.term import Hook, Term
from wavetank.physics.world import World
from wavetank.solids.distance import SolidSet, lift, signed_distance, vec3, vec4

COHESION = 0.2  # share of the bond that alone would give the tension
#: Brings the measured period of an oscillating drop to Rayleigh's: curved surfaces pull otherwise than flat ones.
CALIBRATION = {2: 1.35, 3: 0.62}
QUIET = 0.2  # of the top layer's |g|: what is less is no surface
#: How far a particle with all bonds of that tension may turn in a step [rad]; at 2 a drop in the plane hardly swings.
TURN = 1.4
#: What a wall that is wetted adds to the stiffness: with less, drops of water on walls of 0 and 60 degrees boil.
WETTED = 2.0
MEAN_COSINE = {2: 1.0 / math.pi, 3: 0.25}  # of max(cos, 0) over all directions


# --- the rest lattice, on the host ---


@dataclasses.dataclass(frozen=True)
class FlatSurface:
    """Sums over a flat surface of the rest lattice, lengths in d."""

    gradient_scale: float  # g = gradient_scale * sum_j 20 q t^3 n
    quiet: float  # |g| below which there is no surface
    stress: float  # of the skin for A = 1
    bond: float  # e / (sigma d^(dim - 1)): the bond of a pair whose missing bonds cost sigma
    stiffness: float  # sum_lattice -f'(q)


@functools.cache
def flat_surface(dim: int, ratio: float) -> FlatSurface:
    """Return the sums for the support radius `ratio` d."""
    x = rest_points(dim, ratio)
    r = np.linalg.norm(x, axis=1)
    q = r / ratio
    t = 1.0 - q
    gradient_scale = 1.0 / float(1.0 + np.sum(t**4 * (1.0 + 4.0 * q)))
    up = np.rint(x[:, 0]).astype(int)
    layers = range(int(ratio) + 2)
    missing = np.array([np.sum((20.0 * q * t**3 * x[:, 0] / r)[up > layer]) for layer in layers]) * gradient_scale
    quiet = QUIET * float(missing[0])
    g = np.maximum(missing - quiet, 0.0)
    # The stress along the surface is half the sum of force times distance (virial), pair by pair.
    stress = 0.0
    for layer in layers:
        other = layer - up
        pairs = (other >= 0) & (other < len(g))
        stress += 0.5 * float(np.sum((q * t**2 * x[:, 1] ** 2 / r)[pairs] * (g[layer] + g[other[pairs]])))
    bond = 2.0 / (MEAN_COSINE[dim] * float(np.sum((1.0 - q**3) * r)))
    return FlatSurface(gradient_scale, quiet, stress, bond, float(np.sum(6.0 * q)))


@functools.cache
def adhesion_table(dim: int, ratio: float) -> np.ndarray:
    """Sample the pull of a flat wall, over e / h, at s / h from 0 to 1, float32 [TABLE_SIZE + 1]."""
    depth = np.linspace(0.0, 1.0, TABLE_SIZE + 1)[:, None, None] * ratio + np.arange(int(ratio) + 2)[:, None] + 0.5
    plane = rest_points(dim, ratio)
    plane = np.vstack([np.zeros(dim), plane[np.abs(plane[:, 0]) < 1e-12]])[:, 1:]
    r = np.sqrt(depth**2 + np.sum(plane**2, axis=1))
    force = np.where(r < ratio, 3.0 * (r / ratio) ** 2 * depth / r, 0.0)
    table: np.ndarray = np.sum(force, axis=(1, 2)).astype(np.float32)
    return table


def largest_tension(fluid: Properties, dim: int, ratio: float, d: float, dt: float) -> float:
    """Return the tension [N/m] whose bonds turn the stiffest particle by `TURN` in a step of `dt` [s].

    A wall that pulls more than half as much as the fluid does makes particles stiffer, by `WETTED` times the excess.
    """
    flat = flat_surface(dim, ratio)
    stiffness = flat.stiffness * (1.0 + WETTED * max(0.0, math.cos(math.radians(fluid.contact_angle))))
    return fluid.density * d**3 * (TURN * ratio / dt) ** 2 / (flat.bond * stiffness)


def limited_tensions(kinds: Blend, dim: int, ratio: float, d: float, dt: float) -> dict[int, float]:
    """Return the tension [N/m] of each material, limited for a time step of `dt` [s]."""
    return {
        number: min(fluid.surface_tension, largest_tension(fluid, dim, ratio, d, dt))
        for number, fluid in kinds.fluids.items()
    }


def substeps_for(kinds: Blend, dim: int, ratio: float, d: float, duration: float) -> int:
    """Return how many time steps within `duration` [s] let every fluid have its full tension."""
    shares = [
        fluid.surface_tension / largest_tension(fluid, dim, ratio, d, duration) for fluid in kinds.fluids.values()
    ]
    return max(1, math.ceil(math.sqrt(max(shares))))


# --- on the device ---


@qd.func
def add_gradient(sums: qd.template(), r, square, a, b, c: Coefficients, method: qd.template()):
    """Add neighbour j to -sum_j 20 q t^3 n (Wendland C2); of another fluid only as far as its tension reaches."""
    t = qd.max(1.0 - qd.sqrt(square) * c.inverse_h, 0.0)
    sums -= r * (20.0 * t * t * t / c.h * qd.min(1.0, b[0] / qd.max(a[0], 1e-20)))


@qd.func
def add_pull(sums: qd.template(), r, square, a, b, c: Coefficients, method: qd.template()):
    """Add neighbour j to the force F_i of skin and cohesion; A and B are `c.skin` and `c.cohesion`.

    `a` and `b` are of i and j: h times the gradient of the relative density, and the tension [N/m].
    """
    length = qd.sqrt(square)
    q = length * c.inverse_h
    n = lift(r) / qd.max(length, 1e-15)
    g_a = vec3(a.x, a.y, a.z)
    g_b = vec3(b.x, b.y, b.z)
    size_a = qd.max(g_a.norm(), 1e-9)
    size_b = qd.max(g_b.norm(), 1e-9)
    stress = n * (size_a + size_b) - g_a * (g_a.dot(n) / size_a) - g_b * (g_b.dot(n) / size_b)
    t = qd.max(1.0 - q, 0.0)
    bond = c.cohesion * 3.0 * q * q * qd.cast(t > 0.0, qd.f32)
    force = c.skin * q * t * t * stress + bond * (size_a + size_b) * n
    tension = qd.min(a.w, b.w)
    for k in qd.static(range(r.n)):
        sums[k] -= tension * force[k]


@dataclasses.dataclass(frozen=True)
class Pull:
    """Numbers of surfaces and walls that pull; those of pairs are `skin` and `cohesion` of the `Coefficients`."""

    scale: qd.f32  # |g| over the sum of `add_gradient`
    quiet: qd.f32  # |g| below which there is no surface
    rate: qd.f32  # s/kg: dt over the largest mass of a particle
    adhesion: qd.f32  # m^(dim - 2): pull of a wall that is wetted, over the tension and the table


@qd.kernel(fastcache=True)
def find_tensions(tension: qd.types.ndarray(), particles: Particles, rows: qd.types.ndarray(), count: qd.i32):
    """Write the tension of every particle."""
    for i in range(count):
        tension[i] = rows[particles.material[i]][2]


@qd.kernel(fastcache=True)
def find_surface(
    surface: qd.types.ndarray(),
    tension: qd.types.ndarray(),
    particles: Particles,
    grid: Grid,
    c: Coefficients,
    pull: Pull,
    count: qd.i32,
):
    """Find where the surface is and which way it faces: g, without what is noise."""
    for chunk in range(chunks(grid, count)):
        for cluster in range(first_cluster(chunk, grid, count), end_cluster(chunk, grid, count)):
            sums = qd.Matrix.zero(qd.f32, particles.x[cluster].n, grid.lanes)
            add_neighbors(sums, add_gradient, cluster, particles, tension, grid, c, 0)
            for i in range(cluster * grid.lanes, end_of(cluster, grid, count)):
                g = column(sums, i - cluster * grid.lanes)
                size = pull.scale * g.norm()
                g3 = lift(g) * (pull.scale * qd.max(size - pull.quiet, 0.0) / qd.max(size, 1e-12))
                surface[i] = vec4(g3.x, g3.y, g3.z, tension[i])


@qd.func
def add_adhesion(
    force: qd.template(),
    wetting,
    i,
    particles: Particles,
    solids: SolidSet,
    table: qd.template(),
    c: Coefficients,
    pull: Pull,
):
    """Add what solids attract particle `i` by to its `force`, `wetting` times the table; bodies feel the opposite."""
    p = predicted(particles, i)
    for k in range(solids.count):
        if is_marked(particles.near[i], k, solids) == 1:
            value = signed_distance(solids, k, lift(p))
            if value.w < c.h:
                n = vec3(value.x, value.y, value.z)
                share = wetting * interpolated(table, value.w / c.h)
                for axis in qd.static(range(p.n)):
                    force[axis] -= share * n[axis]
                push_back(solids, k, lift(p), -n * (share * pull.rate * c.dt))


@qd.kernel(fastcache=True)
def attract(
    pulled: qd.types.ndarray(),
    surface: qd.types.ndarray(),
    particles: Particles,
    temporaries: Temporaries,
    rows: qd.types.ndarray(),
    grid: Grid,
    solids: SolidSet,
    table: qd.types.ndarray(),
    c: Coefficients,
    pull: Pull,
    count: qd.i32,
):
    """Find the velocities after the pull of neighbours and solids."""
    for chunk in range(chunks(grid, count)):
        for cluster in range(first_cluster(chunk, grid, count), end_cluster(chunk, grid, count)):
            sums = qd.Matrix.zero(qd.f32, particles.x[cluster].n, grid.lanes)
            add_neighbors(sums, add_pull, cluster, particles, surface, grid, c, 0)
            for i in range(cluster * grid.lanes, end_of(cluster, grid, count)):
                force = column(sums, i - cluster * grid.lanes)
                if particles.near[i] != 0:
                    wetting = pull.adhesion * surface[i].w * rows[particles.material[i]][3]
                    add_adhesion(force, wetting, i, particles, solids, table, c, pull)
                v = lift(particles.v[i] + force * (pull.rate * temporaries.inverse_mass[i]))
                pulled[i] = vec4(v.x, v.y, v.z, 0.0)


@qd.kernel(fastcache=True)
def take_pull(particles: Particles, pulled: qd.types.ndarray(), c: Coefficients, count: qd.i32):
    """Adopt the velocities that `attract` found, and move the predicted positions with them."""
    for i in range(count):
        v = particles.v[i]
        for k in qd.static(range(v.n)):
            v[k] = pulled[i][k]
        accelerate(particles, i, v, c)


def prepare_fluids(world: World, kinds: Blend, params: Parameters, dt: float) -> None:
    """Write what the fluids are to the device, for a step of `dt` [s]; weigh the particles where densities differ."""
    fill_table(world.fluids, kinds, limited_tensions(kinds, params.dim, params.support, params.spacing, dt))
    if kinds.mixed:
        weigh(world.temporaries, world.particles, world.fluids.rows, world.count)
    elif world.fluids.weighed:
        world.temporaries.inverse_mass.fill(1.0)
    world.fluids.weighed = bool(kinds.mixed)


def apply_tension(world: World, plan: Plan, params: Parameters, c: Coefficients) -> None:
    """Let surfaces and solids pull the fluid for one substep."""
    particles, grid, fluids, count = world.particles, world.grid, world.fluids, world.count
    dim, ratio = params.dim, params.support
    d = c.h / ratio
    if "adhesion table" not in fluids.arrays:
        fluids.arrays["adhesion table"] = scalars(TABLE_SIZE + 1)
        upload(fluids.arrays["adhesion table"], adhesion_table(dim, ratio))
        fluids.arrays["tension"] = scalars(fluids.capacity + MARGIN)
    pulled, surface = fluids.array("packed"), fluids.array("normal")
    tension, table = fluids.arrays["tension"], fluids.arrays["adhesion table"]
    flat = flat_surface(dim, ratio)
    adhesion = flat.bond * d ** (dim - 2) / ratio
    stretch = CALIBRATION[dim] * (1.0 - COHESION) * d ** (dim - 2) / flat.stress
    c = interned(dataclasses.replace(c, skin=stretch, cohesion=CALIBRATION[dim] * COHESION * adhesion))
    rate = c.dt / (plan.kinds.largest_density * d**dim)
    pull = interned(Pull(scale=flat.gradient_scale, quiet=flat.quiet, rate=rate, adhesion=adhesion))
    find_tensions(tension, particles, fluids.rows, count)
    find_surface(surface, tension, particles, grid, c, pull, count)
    attract(pulled, surface, particles, world.temporaries, fluids.rows, grid, world.solids, table, c, pull, count)
    take_pull(particles, pulled, c, count)


TENSION = Term("surface tension", Hook.FORCES, apply_tension, lambda plan: plan.has_surface_tension)

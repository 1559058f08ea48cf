"""Dynamic viscosity from water to honey: an implicit step for the velocities, stable at any time step.

Every pair of neighbours is joined by a damper along the line between them, as in Weiler et al. 2018, "A Physically
Consistent Implicit Viscosity Solver for SPH Fluids" (10.1111/cgf.13349):

    rho_i dv_i/dt = sum_j mu_ij B f(q_ij) ((v_j - v_i) . n) n,     B = 2 dim (dim + 2) / sum_lattice f(q) r^2

which is mu lap v for a flow without divergence. A damper along the line leaves translations and rotations alone, at a
free surface too, and m_i dv_i is antisymmetric, so momentum and angular momentum are exact however far the solver gets.

    code      symbol          meaning                                                     unit
    n         n               unit vector from j to i                                     1
    mu        mu_ij           2 mu_i mu_j / (mu_i + mu_j) (Cleary 1998)                   Pa s
    rate      dt B / rho      what a pair does in a substep, over mu                      1/(Pa s)
    packed                    iterate of the velocity, and mu_i                           m/s, Pa s
    drag      T v_w, T        rate of the walls' drag in this substep over mu             1
    stiffest  kappa           bound of the largest eigenvalue of 1 + dt M^-1 L            1

Where we differ, and why:
- f(q) = 1 - q, the weights of Müller et al. 2003 (10.2312/SCA03/154-159), not the gradient of a kernel: it has no
  pole, and B makes its second moment on the rest lattice exact, averaged over directions.
- Chebyshev iterations instead of conjugate gradients. All eigenvalues of 1 + dt M^-1 L lie between 1 and a bound
  that one pass finds (`stiffest_particle`), which fixes the number of iterations beforehand: no dot products, hence no
  sums whose order threads decide, and the error of no mode ever grows, wherever the iterations end.
- Solids hold the fluid back along their surface (no-slip) as half a rest lattice would that continues the
  velocity linearly to its value at the wall (Takeda et al. 1994, 10.1143/ptp/92.5.939; Morris et al. 1997,
  10.1006/jcph.1997.5776), from a table of the distance.
"""

import functools
import math

import numpy as np

from wavetank.compiler import qd, upload
from wavetank.distance import SolidSet, lift, signed_distance, vec3, vec4
from wavetank.physics.boundary import is_near
from wavetank.physics.density_constraint import schedule
from wavetank.physics.friction import surface_velocity
from wavetank.physics.integrate import accelerate
from wavetank.physics.mixture import Blend
from wavetank.physics.pairs import add_neighbors, column, part_of, teams, turns
from wavetank.physics.places import predicted
from wavetank.physics.smoothing import TABLE_SIZE, rest_points
from wavetank.state import Coefficients, Fluids, Grid, Particles, Scratch, scalars

TOLERANCE = 1e-2  # of the slowest mode's error after the iterations
WORTH = 1e-5  # smallest kappa - 1 on the rest lattice for which a substep solves anything
NEAREST = 0.25  # d: closer to a wall than this its drag grows no further


def damper_scale(dim: int, ratio: float, d: float) -> float:
    """Return B [1/m^2] for the support radius `ratio` * `d` and the spacing `d` [m]."""
    distance = np.linalg.norm(rest_points(dim, ratio), axis=1)
    return float(2.0 * dim * (dim + 2) / np.sum((1.0 - distance / ratio) * distance**2)) / d**2


@functools.cache
def drag_table(dim: int, ratio: float) -> np.ndarray:
    """Sample T d^2 / (B d^2) of a flat wall at s / h from 0 to 1, float32 [TABLE_SIZE + 1].

    T = sum f(q) (t^2 / r^2) (1 + depth / s) over half a lattice behind the wall, t along it, depth below its surface.
    """
    s = np.linspace(0.0, 1.0, TABLE_SIZE + 1) * ratio
    depth = np.arange(int(ratio) + 2) + 0.5
    plane = rest_points(dim, ratio)
    plane = plane[np.abs(plane[:, 0]) < 1e-12][:, 1:]
    along = np.sum(plane**2, axis=1)
    square = (s[:, None, None] + depth[:, None]) ** 2 + along
    f = np.maximum(1.0 - np.sqrt(square) / ratio, 0.0)
    extrapolation = 1.0 + depth[:, None] / np.maximum(s, NEAREST)[:, None, None]
    table: np.ndarray = np.sum(f * along / (dim - 1) / square * extrapolation, axis=(1, 2)).astype(np.float32)
    return table


@qd.func
def add_damping(sums: qd.template(), r, square, a, b, c: Coefficients, method: qd.template()):
    """Add neighbour j to sum_j mu_ij f(q) ((v_j - v_i) . n) n."""
    approach = 0.0
    for k in qd.static(range(r.n)):
        approach += (b[k] - a[k]) * r[k]
    f = qd.max(1.0 - qd.sqrt(square) * c.inverse_h, 0.0)
    mu = 2.0 * a[3] * b[3] / qd.max(a[3] + b[3], 1e-20)
    sums += r * (mu * f * approach / qd.max(square, 1e-30))


@qd.func
def add_stiffness(sums: qd.template(), r, square, a, b, c: Coefficients, method: qd.template()):
    """Add neighbour j to the rows' sums of |sum_j mu_ij f(q) n n^T|, element by element from above."""
    f = qd.max(1.0 - qd.sqrt(square) * c.inverse_h, 0.0)
    mu = 2.0 * a[3] * b[3] / qd.max(a[3] + b[3], 1e-20)
    for k in qd.static(range(r.n)):
        for m in qd.static(range(r.n)):
            sums[k * r.n + m] += mu * f * r[k] * r[m] / qd.max(square, 1e-30)


@qd.kernel(fastcache=True)
def pack_velocities(
    packed: qd.types.ndarray(), other: qd.types.ndarray(), particles: Particles, rows: qd.types.ndarray(), count: qd.i32
):
    """Start the iterations at the velocities as they are."""
    for i in range(count):
        v = lift(particles.v[i])
        row = vec4(v.x, v.y, v.z, rows[particles.material[i]][1])
        packed[i] = row
        other[i] = row


@qd.kernel(fastcache=True)
def find_drag(
    drag: qd.types.ndarray(), normal: qd.types.ndarray(), particles: Particles, rows: qd.types.ndarray(),
    solids: SolidSet, table: qd.types.ndarray(), c: Coefficients, count: qd.i32, no_slip: qd.f32,
):  # fmt: skip
    """Find how fast the walls hold every particle back, over B dt / rho, and along which normal they do not."""
    for i in range(count):
        near = particles.near[i]
        pull = vec4(0.0, 0.0, 0.0, 0.0)
        free = vec4(0.0, 0.0, 0.0, 0.0)
        if near != 0:
            p = lift(predicted(particles, i))
            last = table.shape[0] - 1
            walls = 0
            for k in range(solids.count):
                if is_near(near, k) == 1:
                    value = signed_distance(solids, k, p)
                    if value.w < c.h:
                        t = qd.min(qd.max(value.w / c.h, 0.0), 1.0) * last
                        m = qd.min(qd.cast(t, qd.i32), last - 1)
                        share = table[m] + (table[m + 1] - table[m]) * (t - m)
                        v = surface_velocity(solids, k, p, c.dt) * share
                        pull += vec4(v.x, v.y, v.z, share)
                        free = vec4(value.x, value.y, value.z, 0.0)
                        walls += 1
            if walls > 1:  # in a corner the fluid is held in every direction
                free = vec4(0.0, 0.0, 0.0, 0.0)
            pull *= no_slip * rows[particles.material[i]][1]
        drag[i] = pull
        normal[i] = free


@qd.kernel(fastcache=True)
def stiffest_particle(
    packed: qd.types.ndarray(), drag: qd.types.ndarray(), particles: Particles, scratch: Scratch, grid: Grid,
    c: Coefficients, count: qd.i32, rate: qd.f32, lanes: qd.template(),
) -> qd.i32:  # fmt: skip
    """Return the bits of kappa - 1: twice the largest row sum of a particle's own dampers, and the walls' drag.

    The matrix of one damper is at most twice its diagonal blocks, hence so is their sum.
    """
    most = 0
    for turn in range(turns(teams(count, lanes), grid.parts, lanes)):
        part = part_of(turn, teams(count, lanes), grid.parts, lanes)
        for team in range(part[0], part[1]):
            dim = qd.static(particles.x[team].n)
            sums = qd.Matrix.zero(qd.f32, dim * dim, lanes)
            add_neighbors(sums, add_stiffness, team, particles, packed, grid, c, 0)
            for i in range(team * lanes, qd.min(team * lanes + lanes, count)):
                sum = column(sums, i - team * lanes)
                largest = 0.0
                for k in qd.static(range(dim)):
                    row = 0.0
                    for m in qd.static(range(dim)):
                        row += qd.abs(sum[k * dim + m])
                    largest = qd.max(largest, row)
                own = rate * scratch.weight[i] * (2.0 * largest + drag[i].w)
                qd.atomic_max(most, qd.bit_cast(own, qd.i32))
    return most


@qd.kernel(fastcache=True)
def relax_velocities(
    following: qd.types.ndarray(), packed: qd.types.ndarray(), drag: qd.types.ndarray(), normal: qd.types.ndarray(),
    particles: Particles, scratch: Scratch, grid: Grid, c: Coefficients, count: qd.i32, rate: qd.f32,
    relaxation: qd.f32, momentum: qd.f32, lanes: qd.template(),
):  # fmt: skip
    """One Chebyshev iteration; `following` holds the iterate before `packed` and receives the next."""
    for turn in range(turns(teams(count, lanes), grid.parts, lanes)):
        part = part_of(turn, teams(count, lanes), grid.parts, lanes)
        for team in range(part[0], part[1]):
            sums = qd.Matrix.zero(qd.f32, particles.v[team].n, lanes)
            add_neighbors(sums, add_damping, team, particles, packed, grid, c, 0)
            for i in range(team * lanes, qd.min(team * lanes + lanes, count)):
                v = particles.v[i]
                row = packed[i]
                before = following[i]
                force = column(sums, i - team * lanes)
                wall = vec3(drag[i].x, drag[i].y, drag[i].z) - vec3(row.x, row.y, row.z) * drag[i].w
                n = vec3(normal[i].x, normal[i].y, normal[i].z)
                wall -= n * n.dot(wall)
                share = rate * scratch.weight[i]
                result = row
                for k in qd.static(range(v.n)):
                    residual = v[k] - row[k] + share * (force[k] + wall[k])
                    result[k] = row[k] + relaxation * residual + momentum * (row[k] - before[k])
                following[i] = result


@qd.kernel(fastcache=True)
def take_velocities(particles: Particles, packed: qd.types.ndarray(), c: Coefficients, count: qd.i32):
    """Adopt the velocities that were found, and move the predicted positions with them."""
    for i in range(count):
        v = particles.v[i]
        for k in qd.static(range(v.n)):
            v[k] = packed[i][k]
        accelerate(particles, i, v, c)


def is_thick(kinds: Blend, c: Coefficients, dim: int, ratio: float) -> bool:
    """Say whether any fluid is viscous enough to matter in a substep."""
    lattice = 2.0 * 2.0 * (dim + 2) * (ratio / c.h) ** 2  # of 2 B sum f / dim, within a factor of two
    return c.dt * kinds.kinematic_viscosity * lattice > WORTH


def solve_viscosity(
    particles: Particles, scratch: Scratch, fluids: Fluids, grid: Grid, solids: SolidSet, c: Coefficients,
    kinds: Blend, count: int, ratio: float, no_slip: float, largest_number: int,
) -> int:  # fmt: skip
    """Make velocities and predicted positions those of viscous fluids; return the number of iterations it took.

    `ratio` is h / d; at most `largest_number` iterations are taken.
    """
    dim = particles.x.element_shape[0]
    d = c.h / ratio
    if "drag table" not in fluids.arrays:
        fluids.arrays["drag table"] = scalars(TABLE_SIZE + 1)
        upload(fluids.arrays["drag table"], drag_table(dim, ratio))
    packed, spare, drag, normal = (fluids.array(name) for name in ("packed", "spare", "drag", "normal"))
    rate = c.dt * damper_scale(dim, ratio, d) / kinds.largest_density
    pack_velocities(packed, spare, particles, fluids.rows, count)
    find_drag(drag, normal, particles, fluids.rows, solids, fluids.arrays["drag table"], c, count, no_slip)
    bits = stiffest_particle(packed, drag, particles, scratch, grid, c, count, rate, grid.lanes)
    stiffest = 1.0 + 1.01 * float(np.int32(bits).view(np.float32))
    number = iterations(stiffest, largest_number)
    for relaxation, momentum in schedule(number, 1.0, stiffest) if number else []:
        relax_velocities(
            spare, packed, drag, normal, particles, scratch, grid, c, count, rate, relaxation, momentum,
            grid.lanes,
        )  # fmt: skip
        packed, spare = spare, packed
    take_velocities(particles, packed, c, count)
    return number


def iterations(stiffest: float, most: int) -> int:
    """Return how many Chebyshev iterations bring every mode of 1 to `stiffest` within `TOLERANCE`, at most `most`."""
    if stiffest <= 1.0 + 1e-9:
        return 0
    return min(most, math.ceil(0.5 * math.sqrt(stiffest) * math.log(2.0 / TOLERANCE)))

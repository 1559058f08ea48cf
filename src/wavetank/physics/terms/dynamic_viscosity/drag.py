"""How solids hold viscous fluids back, and what bodies feel of it: the walls of `implicit_viscosity.py`.

code      symbol          meaning                                                     unit
packed                    velocity, and mu_i                                          m/s, Pa s
drag      T v_w, T        rate of the walls' drag in this substep over mu             1
"""

import dataclasses
import functools

import numpy as np

from wavetank.device.compiler import qd
from wavetank.device.state import Coefficients, Particles, Temporaries
from wavetank.physics.bodies import add_damper, push_back
from wavetank.physics.broad_phase import is_marked
from wavetank.physics.integrate import free_motion
from wavetank.physics.predicted_positions import predicted
from wavetank.physics.smoothing import TABLE_SIZE, interpolated, rest_points
from wavetank.physics.terms.dynamic_viscosity.conjugate_gradients import along_walls
from wavetank.physics.terms.friction import surface_velocity
from wavetank.solids.distance import SolidSet, lift, signed_distance, vec3, vec4

NEAREST = 0.25  # d: closer to a wall than this its drag grows no further


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


@dataclasses.dataclass(frozen=True)
class Holding:
    """How walls hold fluids."""

    no_slip: qd.f32  # share of the drag along a wall
    most: qd.f32  # Pa s: the largest viscosity
    touching: qd.f32  # m: closer than this, what strikes a wall is held along its normal, too
    to_come: qd.f32  # s: times what pressed a particle in the last step, the velocity that pressure will give it


@qd.func
def wall_velocity(solids: SolidSet, k, i, p, particles: Particles, holding: Holding, c: Coefficients):
    """Velocity [m/s] of a wall as a particle sees it that pressure is still to act on."""
    return surface_velocity(solids, k, p, c.dt) - lift(particles.a[i]) * holding.to_come


@qd.kernel(fastcache=True)
def find_drag(
    packed: qd.types.ndarray(),
    drag: qd.types.ndarray(),
    normal: qd.types.ndarray(),
    particles: Particles,
    rows: qd.types.ndarray(),
    solids: SolidSet,
    table: qd.types.ndarray(),
    c: Coefficients,
    holding: Holding,
    count: qd.i32,
):
    """Pack velocities and viscosities [Pa s], and find how fast the walls hold every particle back.

    That is over B dt / rho, with the normal along which they do not, unless it strikes: what stands behind the normal
    is the share of the pull there, over that along the wall.
    """
    for i in range(count):
        own = lift(particles.v[i])
        mu = qd.min(rows[particles.material[i]][1], holding.most)
        packed[i] = vec4(own.x, own.y, own.z, mu)
        pull = vec4(0.0, 0.0, 0.0, 0.0)
        free = vec4(0.0, 0.0, 0.0, 0.0)
        if particles.near[i] != 0:
            find_pull(pull, free, i, own, particles, solids, table, c, holding)
            pull *= holding.no_slip * mu
        drag[i] = pull
        normal[i] = free


@qd.func
def find_pull(
    pull: qd.template(),
    free: qd.template(),
    i,
    own,
    particles: Particles,
    solids: SolidSet,
    table: qd.template(),
    c: Coefficients,
    holding: Holding,
):
    """Find the pull (T v_w, T) of the walls on particle `i` of the velocity `own`, and the normal without any.

    In a corner, at two walls, that is 0: there the fluid is held in every direction.
    """
    p = lift(predicted(particles, i))
    fast = qd.sqrt(vec3(c.gravity_x, c.gravity_y, c.gravity_z).norm() * c.h)
    walls = 0
    for k in range(solids.count):
        if is_marked(particles.near[i], k, solids) == 1:
            value = signed_distance(solids, k, p)
            if value.w < c.h:
                share = interpolated(table, value.w / c.h)
                moving = wall_velocity(solids, k, i, p, particles, holding, c)
                v = moving * share
                pull += vec4(v.x, v.y, v.z, share)
                free = vec4(value.x, value.y, value.z, 0.0)
                if value.w < holding.touching and (own - moving).dot(vec3(value.x, value.y, value.z)) < -fast:
                    free[3] = 1.0 / holding.no_slip
                walls += 1
    if walls > 1:
        free = vec4(0.0, 0.0, 0.0, 0.0)


@qd.func
def way_given_back(i, packed: qd.template(), normal: qd.template(), particles: Particles, c: Coefficients):
    """Return how far [m] a stop at a solid has moved particle `i` that its new velocity takes back, if it struck."""
    freed = vec3(0.0, 0.0, 0.0)
    if normal[i].w > 0.0:
        v = particles.v[i]
        for axis in qd.static(range(v.n)):
            v[axis] = packed[i][axis]
        freed = lift(free_motion(particles.x[i], v, c) - predicted(particles, i))
        freed -= lift(v - particles.v[i]) * c.dt
    return freed


@qd.kernel(fastcache=True)
def drag_bodies(
    packed: qd.types.ndarray(),
    normal: qd.types.ndarray(),
    particles: Particles,
    temporaries: Temporaries,
    solids: SolidSet,
    table: qd.types.ndarray(),
    c: Coefficients,
    holding: Holding,
    rate: qd.f32,
    per_damper: qd.f32,
    count: qd.i32,
):
    """Let bodies feel the opposite of their part of the drag, with the velocities that were found for the fluid.

    What strikes one was stopped there when it was predicted, which they felt: that is taken back, as the stop is.
    How stiffly it holds them is told as well, `per_damper`, a spacing over the thickest fluid [m/(Pa s)].
    """
    for i in range(count):
        near = particles.near[i]
        if near >> solids.tank_count != 0 and particles.frozen[i] == 0:
            mu = holding.no_slip * packed[i].w
            for k in range(solids.tank_count, solids.count):
                if solids.unit[k] > 0.0 and is_marked(near, k, solids) == 1:
                    p = lift(predicted(particles, i))
                    value = signed_distance(solids, k, p)
                    if value.w < c.h:
                        share = mu * interpolated(table, value.w / c.h)
                        moving = wall_velocity(solids, k, i, p, particles, holding, c)
                        own = vec3(packed[i].x, packed[i].y, packed[i].z)
                        push_back(solids, k, p, along_walls((moving - own) * share, normal[i]) * (rate * c.dt))
                        add_damper(solids, k, share * per_damper)
                        freed = way_given_back(i, packed, normal, particles, c)
                        push_back(solids, k, p, freed / temporaries.inverse_mass[i])

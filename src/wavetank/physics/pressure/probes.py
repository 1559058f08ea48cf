"""The pressure at a place, as a gauge reads it there: 0 in the air.

In a step the grid moves the liquid by M grad lambda, and a share w of what it did before acts with the prediction
(`correct.py`). What has acted in step n, over the density of the heaviest fluid, is therefore

    P_n = w P_(n-1) - M lambda / dt^2

from the first step on that someone has asked for pressures; before, P = -M lambda / dt^2 / (1 - w), as at rest.

A place reads the nodes around that are open to it and lie in liquid, straight on by the slope of liquid at rest: where
all of them do, this is the interpolation between them, and beside walls and below the surface it is hydrostatic. What
the iterations between particles do is not in it: films thinner than a cell, and errors of single particles.

    code       symbol    meaning                                       unit
    pressure   P         pressure over the density of the heaviest     m^2/s^2
    fallen               place where the grid has what is at a point   m
"""

import dataclasses
from typing import Any

import numpy as np

from wavetank.device.compiler import download, qd, upload
from wavetank.device.state import scalars, vectors
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.params import Parameters
from wavetank.physics.contact import flattened
from wavetank.physics.mixture import blend
from wavetank.physics.planning import has_grid_pressure
from wavetank.physics.pressure.correct import variant_of, warm_start_share
from wavetank.physics.pressure.grid import Level, Variant, Workspace, corners, hat_weights, in_cells
from wavetank.physics.pressure.thin_walls import is_open_to, way_from
from wavetank.physics.smoothing import rest_lattice
from wavetank.physics.world import World
from wavetank.solids.distance import lift, vec3


@qd.kernel(fastcache=True)
def add_step(grid: Level, pressure: qd.types.ndarray(), kept: qd.f32, per_lambda: qd.f32):
    """Keep that share of the pressure of the steps before and add what the grid has pressed with in the last one."""
    for n in range(grid.nx * grid.ny * grid.nz):
        pressure[n] = kept * pressure[n] - per_lambda * grid.lam[n]


@qd.func
def is_in_tank(grid: Level, s):
    """Say whether the place `s` [cells] is in the box of the grid, all of which counts along axes that repeat."""
    found, most = True, vec3(grid.nx - 0.49, grid.ny - 0.49, grid.nz - 0.49)
    for axis in qd.static(range(3)):
        if qd.static(not grid.periodic >> axis & 1):
            found = found and s[axis] > -0.51 and s[axis] < most[axis]
    return found


@dataclasses.dataclass(frozen=True)
class Reading:
    """The numbers of `read_pressure`."""

    gravity_x: qd.f32  # m/s^2
    gravity_y: qd.f32
    gravity_z: qd.f32
    fallen_time: qd.f32  # s^2: the grid has the liquid where it has fallen by gravity times this
    density: qd.f32  # kg/m^3, of the heaviest fluid


@qd.func
def pressure_on_side(
    grid: Level, w: Workspace, pressure: qd.template(), place, side, gravity, dim: qd.template(), has: Variant
):
    """Pressure [m^2/s^2] at a `place` of the liquid or air at the place `side`, both in cells; 0 in the air."""
    low = qd.floor(side, qd.i32)
    nodes = corners(grid, low, dim)
    weights = hat_weights(side - qd.floor(side), dim)
    total, weight = 0.0, 0.0
    for corner in range(qd.static(2**dim)):
        node = qd.Vector([low[0] + (corner & 1), low[1] + (corner >> 1 & 1), low[2] + (corner >> 2)])
        n = nodes[corner]
        is_liquid = pressure[n] > 0.0 and grid.inverse_diagonal[n] > 0.0  # the former fades for a hundred steps
        if is_liquid and is_open_to(grid, w, n, node, side, has.thin_walls) > 0.0:
            total += weights[corner] * (pressure[n] + grid.density[n] * gravity.dot(way_from(grid, node, place)))
            weight += weights[corner]
    return qd.max(total / qd.max(weight, 1e-9), 0.0)


@qd.kernel(fastcache=True)
def read_pressure(
    grid: Level,
    w: Workspace,
    pressure: qd.types.ndarray(),
    found: qd.types.ndarray(),
    points: qd.types.ndarray(),
    sides: qd.types.ndarray(),
    count: qd.i32,
    reading: Reading,
    has: Variant,
):
    """Find the pressures [Pa] at `count` points.

    They are those of the liquid or air at the places `sides` near by: a point may lie in a surface, or a little behind.
    """
    for i in range(count):
        gravity = vec3(reading.gravity_x, reading.gravity_y, reading.gravity_z)
        fallen = gravity * reading.fallen_time
        found[i] = 0.0
        if is_in_tank(grid, in_cells(grid, points[i])) and is_in_tank(grid, in_cells(grid, sides[i])):
            place = in_cells(grid, flattened(lift(points[i]) + fallen, points[i]))
            side = in_cells(grid, flattened(lift(sides[i]) + fallen, sides[i]))
            dim = qd.static(points[i].n)
            found[i] = reading.density * pressure_on_side(grid, w, pressure, place, side, gravity, dim, has)


def record_pressure(world: World, params: Parameters, dt: float) -> None:
    """Add what the grid has pressed with in a step of `dt` [s], where someone asks for pressures."""
    grid = world.pressure
    if grid is not None and not has_grid_pressure(world, params):
        grid.forget_pressure()
    elif grid is not None:
        grid.last_step = dt
        if grid.pressure is not None:
            add_step(grid.finest, grid.pressure, warm_start_share(params, dt), _per_lambda(params, dt))


def knows_pressure(world: World) -> bool:
    """Say whether the last step was on the grid, and its liquid is still where that left it."""
    return world.pressure is not None and world.pressure.last_step > 0.0


def pressures(world: World, params: Parameters, points: np.ndarray, sides: np.ndarray | None = None) -> np.ndarray:
    """Return the pressures [Pa] at `points` [n, dim] at the end of the last step, float32 [n].

    They are those of the liquid or air at the places `sides` [n, dim], or there.
    """
    places = vectors(points.shape[1], len(points))
    upload(places, points)
    there = places
    if sides is not None:
        there = vectors(points.shape[1], len(points))
        upload(there, sides)
    found: np.ndarray = download(pressures_at(world, params, places, there, len(points)))[: len(points)]
    return found.copy()


def pressures_at(world: World, params: Parameters, places: Any, sides: Any, count: int) -> Any:
    """Do so for the first `count` of device arrays of vectors; return a device array f32."""
    grid = world.pressure
    assert grid is not None and knows_pressure(world), "no step has been taken on the grid"
    dt, share = grid.last_step, warm_start_share(params, grid.last_step)
    if grid.pressure is None:
        grid.pressure = scalars(grid.finest.lam.shape[0])
        add_step(grid.finest, grid.pressure, 0.0, _per_lambda(params, dt) / (1.0 - share))
    found = scalars(count)
    x, y, z = (*params.gravity, 0.0)[:3]
    density = blend(world.materials, params).largest_density
    reading = Reading(x, y, z, fallen_time=(1.0 - share) * dt**2, density=density)
    has = variant_of(world, thin_walls=grid.has_thin_walls)
    read_pressure(grid.finest, grid.workspace, grid.pressure, found, places, sides, count, reading, has)
    return found


def recorded_pressure(world: World) -> np.ndarray:
    """Return what `restore_pressure` takes: a number for each node, none where no one has asked for pressures yet."""
    grid = world.pressure
    if grid is None or grid.pressure is None:
        return np.zeros(0, np.float32)
    recorded: np.ndarray = download(grid.pressure).copy()
    return recorded


def restore_pressure(world: World, recorded: np.ndarray) -> None:
    """Go on from the pressures of another instant; they are known again after the next step.

    Raises `WavetankError` for those of another grid.
    """
    grid = world.pressure
    if grid is None:
        return
    grid.forget_pressure()
    if len(recorded):
        grid.pressure = scalars(grid.finest.lam.shape[0])
        if recorded.shape != tuple(grid.pressure.shape):
            raise WavetankError(
                f"the state has pressures of {len(recorded)} nodes; its tank has {grid.pressure.shape[0]}."
            )
        upload(grid.pressure, recorded)


def _per_lambda(params: Parameters, dt: float) -> float:
    """Return M / dt^2 [1/s^2]."""
    return rest_lattice(params.kernel, params.dim, params.support).stiffness / dt**2

"""Particles of a running world: their arrays on the device, and those that come, go, or change.

Arrays from outside are checked here. Users see particles ordered by id; on the device they are sorted by cell.
"""

import dataclasses
from typing import Any

import numpy as np

from wavetank.device.compiler import download, upload
from wavetank.device.periods import NONE
from wavetank.device.state import LASTING, Fluids, Particles, Walls, new_particles, new_temporaries, vectors
from wavetank.foundation.arguments import array_of, finite, instance_of
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.model import FARTHEST
from wavetank.physics import population
from wavetank.physics.bodies import Pieces
from wavetank.physics.foam.pool import pool_from, pool_rows
from wavetank.physics.measure import update_densities
from wavetank.physics.neighbors import list_room, new_grid
from wavetank.physics.pressure.grid import OPEN_CELLS, new_pressure_grid
from wavetank.physics.smoothing import half_space_table
from wavetank.physics.world import World
from wavetank.scene.scene import MAX_PARTICLES, Scene
from wavetank.simulation.cost import check_cost
from wavetank.simulation.solids import Solids
from wavetank.simulation.state import VISCOUS, Counters, State
from wavetank.solids.distance import SolidSet

HASH = np.array([1_000_003, 8_191_000_111, 67_280_421_310_721])  # odd factors of the bits of coordinates
CROWD = 100  # particles within a cube of one spacing, at most


@dataclasses.dataclass(frozen=True)
class Newcomers:
    """Particles that are to be added."""

    x: np.ndarray  # m, float32 [n, dim]
    v: np.ndarray  # m/s, float32 [n, dim]
    dye: np.ndarray  # int32 [n]
    material: np.ndarray  # int32 [n]

    @property
    def fastest(self) -> float:
        """The largest of their speeds [m/s]."""
        return largest_norm(self.v)


class ParticleSystem:
    """The particles of a world, and all arrays on the device that go with them."""

    world: World

    def __init__(self, scene: Scene, counters: Counters) -> None:
        """Begin without arrays; `allocate` makes them."""
        self.scene, self.counters = scene, counters
        self.default_kind = scene.first_kind()  # number of the material of new particles that are not given any
        self.outdated = True  # whether particles moved or changed since densities were measured

    @property
    def count(self) -> int:
        """Number of particles."""
        return self.world.count

    def allocate(self, capacity: int, solids: Solids, pieces: Pieces | None) -> None:
        """Create the arrays of an empty world for `capacity` particles, these solids and `pieces` of bodies."""
        self.world = _new_world(self.scene, capacity, solids.device, pieces, has_friction=solids.has_friction)
        self.counters.capacity, self.outdated = capacity, True

    def set_solids(self, solids: Solids, pieces: Pieces | None) -> None:
        """Replace the solids and the pieces of bodies."""
        world = self.world
        world.solids, world.has_friction, world.pieces = solids.device, solids.has_friction, pieces
        self.outdated = True

    def measure(self) -> None:
        """Update neighbors and densities where they are outdated."""
        if self.outdated and self.count:
            update_densities(self.world, self.scene)
        self.outdated = False

    # --- arrays by id ---

    def set_positions(self, values: Any) -> None:
        """Set the positions [m], [count, dim] by id; raises `WavetankError` for other shapes and for crowds."""
        self.measure()  # sorts, as reading positions does
        x = check_rows("positions", values, (self.count, self.scene.dim))
        x = self.scene.tank.within(x) if self.scene.tank else x
        check_crowd("positions", x, self.scene.spacing)
        check_inside(self.scene, x)
        x = parted(x, x[:0], self.scene.spacing)
        if not np.array_equal(x, by_id(self.world.particles, self.count, "x")):
            population.clear_forces(self.world.particles, self.count)  # the pressure there was is that of other places
            put_by_id(self.world.particles, self.count, "x", x)
            self.outdated = True

    def set_velocities(self, values: Any) -> None:
        """Set the velocities [m/s], [count, dim] by id; raises `WavetankError` for other shapes."""
        self.measure()
        v = check_rows("velocities", values, (self.count, self.scene.dim))
        if not np.array_equal(v, by_id(self.world.particles, self.count, "v")):
            put_by_id(self.world.particles, self.count, "v", v)
            self.counters.fastest_start = max(self.counters.fastest_start, largest_norm(v))

    # --- particles that come and go ---

    def add(self, new: Newcomers) -> np.ndarray:
        """Add particles and return their ids, [n]; see `Simulation.add`."""
        counters, number = self.counters, len(new.x)
        count = self.count + number
        if count > MAX_PARTICLES:
            raise WavetankError(f"{count:,} particles are more than the {MAX_PARTICLES:,} that are allowed.")
        if count > counters.capacity:
            # Half as much again, so that an emitter does not allocate arrays in every frame.
            self.enlarge(max(count, counters.capacity * 3 // 2))
        if number:
            population.append(self.world.particles, self.count, new.x, new.v, new.dye, new.material, counters.next_id)
            self.world.materials |= self.scene.materials_of(new.material)
        ids = np.arange(counters.next_id, counters.next_id + number)
        self.world.count, counters.next_id, self.outdated = count, counters.next_id + number, True
        counters.fastest_start = max(counters.fastest_start, new.fastest)
        return ids

    def remove(self, ids: Any) -> int:
        """Remove the particles with these ids and return their number; the others keep their ids."""
        gone = np.isin(download(self.world.particles.id)[: self.count], array_of("ids", ids, np.int64, "[n]"))
        return self._keep(~gone)

    def remove_inside(self, start: Any, end: Any, radius: float) -> int:
        """Remove the particles within `radius` [m] of the segment between two points [dim]; return their number."""
        capsule = self._capsule(start, end, radius)
        return self._keep(~population.inside_capsule(self.world.particles, self.count, capsule))

    def remove_escaped(self) -> None:
        """Remove the particles that have crossed an open side of the tank."""
        if self.scene.tank is not None and self.scene.tank.open:
            box = [
                np.array([*corner, far][:3])
                for corner, far in zip(self.scene.tank.open_box(), (-1.0, 1.0), strict=True)
            ]
            marks = self.world.grid.cell  # free until the next step
            keep = population.inside_box(self.world.particles, marks, box[0], box[1], self.count)
            if keep is not None:
                self._keep(keep)

    def free_places(self, places: np.ndarray, gap: float, wall: float) -> np.ndarray:
        """Return which `places` [n, dim] are `gap` [m] from all particles and `wall` [m] from all solids, bool [n]."""
        clearance = population.Clearance(gap, wall, periods=self.world.grid.periods)
        places = check_rows("places", places, (len(np.atleast_1d(places)), self.scene.dim))
        gap, wall = finite("gap", gap, 0.0), finite("wall", wall, -FARTHEST)
        return population.free_places(places, self.world.particles, self.world.solids, self.count, clearance)

    def paint_inside(self, start: Any, end: Any, radius: float, dye: int) -> None:
        """Dye the particles within `radius` [m] of a segment; 0 removes their dye."""
        dye = int(array_of("dye", dye, np.int32, "[], a number as Particles.dye"))
        if self.count:
            population.dye_particles(self.world.particles, self._capsule(start, end, radius), dye, self.count)

    def freeze_inside(self, start: Any, end: Any, radius: float, frozen: bool = True) -> None:
        """Turn the particles within `radius` [m] of a segment to ice that keeps its place, or back to water."""
        instance_of("frozen", frozen, bool, "True or False")
        if self.count:
            capsule = self._capsule(start, end, radius)
            self.world.frozen = int(population.freeze_particles(self.world.particles, capsule, int(frozen), self.count))

    def enlarge(self, capacity: int) -> None:
        """Move to arrays for more particles; raises `WavetankError` where there is not enough memory."""
        check_cost(self.scene, capacity)
        before, scene = self.world, self.scene
        self.world = _new_world(scene, capacity, before.solids, before.pieces, has_friction=before.has_friction)
        self.world.pressure = before.pressure  # as large as before, and asked for pressures perhaps
        self.counters.capacity, self.outdated = capacity, True
        self.world.adopt(population.at_capacity(before.particles, scene.dim, capacity))
        self.world.count, self.world.frozen, self.world.materials = before.count, before.frozen, before.materials
        if before.pool is not None:
            rows = pool_rows(before.pool, scene.dim)
            self.world.pool = pool_from(rows, before.pool.born, before.pool.capacity, scene.dim, capacity)

    def _capsule(self, start: Any, end: Any, radius: Any) -> population.Capsule:
        return population.capsule_of(start, end, radius, self.world.grid.periods)

    def _keep(self, keep: np.ndarray) -> int:
        removed = int(len(keep) - keep.sum())
        if removed:
            self.world.frozen = population.keep_only(self.world.particles, self.world.spare, self.world.grid, keep)
            self.world.particles, self.world.spare = self.world.spare, self.world.particles
            self.world.count -= removed
            self.outdated = True
        return removed

    # --- states ---

    def state_arrays(self) -> dict[str, np.ndarray]:
        """Return the columns of particles and foam of a `State`."""
        world = self.world
        names = (*LASTING, VISCOUS) if world.remembers_viscosity else LASTING
        columns = {name: download(getattr(world.particles, name))[: world.count].copy() for name in names}
        return columns | pool_rows(world.pool, self.scene.dim)

    def restore(self, state: State) -> None:
        """Restore particles and foam of a state; `allocate` has made room for them."""
        world, arrays, more = self.world, state.arrays, state.resumable
        for name in LASTING:
            upload(getattr(world.particles, name), arrays[name])
        if VISCOUS in arrays or world.remembers_viscosity:
            world.remember_viscosity(arrays.get(VISCOUS, np.zeros(0)))
        self.default_kind = more.default_kind
        world.materials = self.scene.materials_of(np.array(more.known_kinds, int))
        world.count, world.frozen = len(arrays["id"]), int(arrays["frozen"].sum())
        capacity = self.counters.capacity
        world.pool = pool_from(arrays, more.foam_born, more.foam_capacity, self.scene.dim, capacity)


def _new_world(scene: Scene, capacity: int, solids: SolidSet, pieces: Pieces | None, *, has_friction: bool) -> World:
    """Return an empty world with arrays for `capacity` particles, these solids and `pieces` of bodies."""
    dim, h = scene.dim, scene.support * scene.spacing
    table = half_space_table(scene.kernel, dim, scene.support)
    walls = Walls(vectors(2, len(table)))
    upload(walls.table, table)
    size = scene.tank.size if scene.tank else None
    periods = scene.tank.periods() if scene.tank else NONE
    return World(
        grid=new_grid(dim, capacity, size, h, list_room(dim, scene.support), periods),  # first: it may be refused
        particles=new_particles(dim, capacity),
        spare=new_particles(dim, capacity),
        temporaries=new_temporaries(capacity),
        solids=solids,
        walls=walls,
        fluids=Fluids(capacity, rows=vectors(4, len(scene.materials) + 1)),
        materials={},
        count=0,
        has_friction=has_friction,
        pressure=new_pressure_grid(scene.tank.beyond(OPEN_CELLS * h), h, periods.axes) if scene.tank else None,
        pieces=pieces,
    )


def check_newcomers(
    scene: Scene, positions: Any, velocities: Any, dyes: Any, materials: Any, default_kind: int = 0
) -> Newcomers:
    """Return the arguments of `Simulation.add` as arrays; raises `WavetankError` for wrong shapes and numbers."""
    rows = f"[n, {scene.dim}]"
    x = np.atleast_1d(array_of("positions", positions, np.float32, rows))
    v = np.zeros_like(x) if velocities is None else array_of("velocities", velocities, np.float32, rows)
    dye = np.zeros(len(x), np.int32) if dyes is None else array_of("dyes", dyes, np.int32, "[n]")
    material = scene.checked_kinds(materials, len(x), default_kind)
    shape = (len(x), scene.dim)
    if x.shape != shape or v.shape != shape or dye.shape != shape[:1]:
        raise WavetankError(
            f"positions have shape {list(x.shape)}, velocities {list(v.shape)}, dyes {list(dye.shape)}; they must be "
            f"{rows}, {rows} and [n]."
        )
    if not (bool((np.abs(x) <= FARTHEST).all()) and bool((np.abs(v) <= FARTHEST).all())):
        raise WavetankError(f"positions and velocities of new particles must be finite numbers within {FARTHEST:g}.")
    x = scene.tank.within(x) if scene.tank else x
    check_crowd("positions", x, scene.spacing)
    return Newcomers(x, v, dye, material)


def check_crowd(name: str, x: np.ndarray, spacing: float) -> None:
    """Raise `WavetankError` where more than `CROWD` of positions `x` [n, dim] lie within a cube of edge `spacing` [m].

    Each would be a neighbor of all others: work and memory grow with the square of their number.
    """
    if len(x) <= CROWD:
        return
    cells = np.floor(np.clip(x.astype(np.float64) / spacing, -(2.0**50), 2.0**50))
    order = np.lexsort(cells.T)
    new = np.concatenate([[True], (np.diff(cells[order], axis=0) != 0.0).any(axis=1), [True]])
    first = np.flatnonzero(new)
    most = int(np.argmax(np.diff(first)))
    number = int(first[most + 1] - first[most])
    if number > CROWD:
        place = x[order[first[most]]].tolist()
        raise WavetankError(
            f"{name}: {number:,} particles lie in one place, within a spacing of {place}; at most {CROWD} can: at rest "
            "there is one."
        )


def check_inside(scene: Scene, x: np.ndarray) -> None:
    """Raise `WavetankError` where a position of `x` [n, dim] [m] is outside of the tank by half a spacing or more."""
    if scene.tank is None:
        return
    lower, upper = scene.tank.box()
    far = (np.maximum(lower - x, x - upper) > 0.5 * scene.spacing).any(axis=1)
    if far.any():
        row = int(np.argmax(far))
        raise WavetankError(
            f"positions[{row}] = {x[row].tolist()} is outside of the tank, as are {int(far.sum()) - 1:,} others; it "
            f"must lie between {lower.tolist()} and {upper.tolist()}."
        )


def parted(x: np.ndarray, others: np.ndarray, spacing: float) -> np.ndarray:
    """Return positions `x` [n, dim] [m], moved by 0.01 spacings where they equal another one of them or of `others`.

    Particles in exactly one place have no direction to part in.
    """
    if not len(x):
        return x
    near = others[((others >= x.min(axis=0)) & (others <= x.max(axis=0))).all(axis=1)]
    both = np.concatenate([near, x]).astype(np.float32) + np.float32(0.0)  # no -0.0
    hashes = np.sort(both.view(np.int32).astype(np.int64) @ HASH[: x.shape[1]])
    if (hashes[1:] != hashes[:-1]).all():  # far cheaper than to sort rows
        return x
    _, first, place = np.unique(both, axis=0, return_index=True, return_inverse=True)
    again = np.flatnonzero(first[place.reshape(-1)] != np.arange(len(both)))
    again = again[again >= len(near)] - len(near)
    if not len(again):
        return x
    result, angle = x.copy(), 2.4 * np.arange(1, len(again) + 1)  # the golden angle: no two directions are near
    result[again, 0] += 0.01 * spacing * np.cos(angle).astype(np.float32)
    result[again, 1] += 0.01 * spacing * np.sin(angle).astype(np.float32)
    return result


def check_rows(name: str, values: Any, shape: tuple[int, ...]) -> np.ndarray:
    """Return `values` as float32 of that shape; raises `WavetankError` for another one and for what is not finite."""
    try:
        rows = np.asarray(values, np.float32)
    except (TypeError, ValueError):
        raise WavetankError(f"{name} must be an array of numbers of shape {list(shape)}.") from None
    if rows.shape != shape:
        raise WavetankError(
            f"{name} have shape {list(rows.shape)}; they must have {list(shape)}, a row for each particle by id."
        )
    bad = ~(np.abs(rows) <= FARTHEST).all(axis=1)
    if bad.any():
        row = int(np.argmax(bad))
        why = (
            f"beyond {FARTHEST:g}; every number must be within it"
            if np.isfinite(rows[row]).all()
            else ("not finite; every number must be")
        )
        raise WavetankError(f"{name}[{row}] = {rows[row].tolist()} is {why}.")
    return rows


def by_id(particles: Particles, count: int, name: str) -> np.ndarray:
    """Return an array of the particles from the device, ordered by id."""
    order = np.argsort(download(particles.id)[:count], kind="stable")
    rows: np.ndarray = download(getattr(particles, name))[:count][order]
    return rows


def put_by_id(particles: Particles, count: int, name: str, values: np.ndarray) -> None:
    """Write an array of the particles, given by id, to the device in device order."""
    order = np.argsort(download(particles.id)[:count], kind="stable")
    rows = np.empty_like(values)
    rows[order] = values
    upload(getattr(particles, name), rows)


def largest_norm(vectors: np.ndarray) -> float:
    """Return the largest norm of vectors [n, dim], 0 without any."""
    return float(np.linalg.norm(vectors, axis=1).max(initial=0.0))

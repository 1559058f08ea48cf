"""A running world: the public face of the solver."""

import dataclasses
import math
import time
from collections.abc import Iterator, Sequence
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np

from wavetank.device import compiler
from wavetank.device.state import Fluids, Walls, new_particles, new_scratch, vectors
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.params import LIVE, refuse_assignment
from wavetank.physics import population
from wavetank.physics.foam.pool import pool_from, pool_rows
from wavetank.physics.foam.update import load_kernels, update_foam
from wavetank.physics.grid_pressure.coarse_grid import OPEN_CELLS, new_levels
from wavetank.physics.neighbors import list_room, new_grid
from wavetank.physics.smoothing import half_space_table
from wavetank.physics.step import step
from wavetank.physics.time_step import filled_share, whole
from wavetank.physics.world import World
from wavetank.scene.forces import Force
from wavetank.scene.scene import MAX_PARTICLES, Scene
from wavetank.simulation import limits
from wavetank.simulation import snapshot as snapshots
from wavetank.simulation.arrays import check_newcomers
from wavetank.simulation.contents import Contents
from wavetank.simulation.filling import fill
from wavetank.simulation.frame import Frame
from wavetank.simulation.ledger import Ledger
from wavetank.simulation.moving_solids import MovingSolids
from wavetank.simulation.snapshot import Snapshot
from wavetank.solids.solid import Solid


class Simulation(Contents):
    """Water that moves. See `Scene` for what it is made of."""

    def __init__(self, scene: Scene, arch: str = "cpu") -> None:
        compiler.start(arch)
        self.arch = compiler.current_backend()
        self.scene = Scene.checked(scene).model_copy(deep=True)
        self.reset()

    def reset(self) -> None:
        """Put everything back to the start of the scene."""
        start = fill(self.scene, lambda scene: type(self)(scene, self.arch or "cpu"))
        positions, velocities = start.particles()
        self.solids = MovingSolids(self._walls(), self.scene.solids, self.scene.friction, self.scene.spacing)
        self.forces: list[Force] = [*self.scene.forces]  # these act in every frame
        self.pushed: list[Force] = []  # these in the next one only
        self.ledger = Ledger()
        self._fill(len(positions))
        free = self.solids.find_free_places(start, positions, self.world.particles)
        self.add(positions[free], velocities[free], materials=start.kinds()[free])
        box = positions[free] if free.any() else np.zeros((1, self.scene.dim))
        self.ledger.start_box = (box.min(axis=0), box.max(axis=0))
        self.seconds_per_frame = math.nan  # that the last frame took to compute
        self.time_steps = 1  # of the last frame

    def _fill(self, capacity: int) -> None:
        """Make an empty world with room for `capacity` particles."""
        scene, dim = self.scene, self.scene.dim
        h = scene.support * scene.spacing
        table = half_space_table(scene.kernel, dim, scene.support)
        walls = Walls(vectors(2, len(table)))
        compiler.upload(walls.table, table)
        size = scene.tank.size if scene.tank else None
        levels = new_levels(scene.tank.beyond(OPEN_CELLS * h), h) if scene.tank else []
        self.world = World(
            grid=new_grid(dim, capacity, size, h, list_room(dim, scene.support)),  # first: it may be refused
            particles=new_particles(dim, capacity),
            spare=new_particles(dim, capacity),
            scratch=new_scratch(capacity),
            solids=self.solids.device,
            walls=walls,
            fluids=Fluids(capacity, rows=vectors(4, len(scene.materials) + 1)),
            materials={},
            count=0,
            has_friction=self.solids.has_friction,
            levels=levels,
        )
        self.ledger.capacity, self._outdated = capacity, True

    def _walls(self) -> list[Solid]:
        return self.scene.tank.walls() if self.scene.tank else []

    # --- time ---

    def step(self) -> None:
        """Advance by one frame, `scene.frame_time`."""
        self._advance_frame(self.scene.frame_time)

    def advance(self, seconds: float) -> None:
        """Advance by `seconds` of water, in equal frames no longer than `scene.frame_time`.

        What is shorter than a fifth of a usual time step is kept and taken with the next call: a position-based step
        turns the density error of the steps before into velocity, and a much shorter one into much velocity.
        """
        if not (math.isfinite(seconds) and seconds >= 0):
            raise WavetankError(f"seconds = {seconds} is not allowed; it must be a finite number of at least 0.")
        frame, ledger = self.scene.frame_time, self.ledger
        ledger.owed += seconds
        if ledger.owed < 0.2 * frame / self.scene.substeps:
            return
        count = max(1, math.ceil(ledger.owed / frame - 1e-3))
        duration, ledger.owed = ledger.owed / count, 0.0
        for _ in range(count):
            self._advance_frame(duration)

    def load_kernels(self) -> None:
        """Load what a splash needs before there is one: a tenth of a second for each kernel, of water that stands."""
        load_kernels(self.world, self.scene)

    def full_steps_time(self, duration: float) -> float:
        """Return the time [s] up to `duration` that time steps of full length fill; see `time_step.filled_share`."""
        return duration * filled_share(self._steps_in(duration))

    def frames(self, seconds: float, fps: float = 60.0) -> Iterator[Frame]:
        """Yield the present frame and then one every 1 / `fps` until `seconds` of water have passed."""
        if not (math.isfinite(fps) and fps > 0):
            raise WavetankError(f"fps = {fps} is not allowed; it must be a positive number.")
        start = self.time
        yield self.frame()
        for number in range(1, round(seconds * fps) + 1):
            self.advance(max(0.0, start + number / fps - self.time - self.ledger.owed))
            yield self.frame()

    def push(self, force: Force) -> None:
        """Let a force act during the next frame only."""
        self.pushed.append(force)

    def _advance_frame(self, duration: float) -> None:
        began = time.perf_counter()
        limit = self._speed_limit(duration)
        parts = self.time_steps = whole(self._steps_in(duration))
        self.solids.grow(duration)
        for part in range(parts):
            self.world.solids_version = self.solids.move_to(part / parts, (part + 1) / parts)
            if self.count:
                for force in self._acting:
                    force.apply(self.world.particles, self.count, duration / parts, self.time + duration * part / parts)
                step(self.world, self.scene, duration / parts, limit)
        self.solids.move_to(0.0, 1.0)
        self._let_out()
        update_foam(self.world, self.scene, duration, self.frame_number)
        self.pushed = []
        self.solids.arrive()
        compiler.synchronize()
        self.seconds_per_frame = time.perf_counter() - began
        self.ledger.time += duration
        self.ledger.frame_number += 1
        self._outdated = True

    def _let_out(self) -> None:
        """Take what has crossed an open side of the tank out of the world."""
        if self.scene.tank is not None and self.scene.tank.open:
            box = [
                np.array([*corner, far][:3])
                for corner, far in zip(self.scene.tank.open_box(), (-1.0, 1.0), strict=True)
            ]
            marks = self.world.grid.cell  # is found anew in the next step
            keep = population.inside_box(self.world.particles, marks, box[0], box[1], self.count)
            if keep is not None:
                self._keep(keep)

    @property
    def _acting(self) -> tuple[Force, ...]:
        """The forces of the next frame."""
        return (*self.forces, *self.pushed)

    def _steps_in(self, duration: float) -> float:
        return limits.count_steps(self.world, self.scene, self.solids, self.ledger, self._acting, duration)

    def _speed_limit(self, duration: float) -> float:
        return limits.find_speed_limit(self.world, self.scene, self.solids, self.ledger, self._acting, duration)

    # --- solids ---

    def move(self, name: str, position: Sequence[float] | None = None, rotation: Any = None) -> None:
        """Set the pose that the solid `name` reaches at the end of the next frame; its velocity follows.

        `position` [m] is that of the solid's frame (the centre of a box), `rotation` a quaternion (w, x, y, z) or an
        angle about z [rad]; None keeps what is. A solid without a name is called "solid 1" and so on.
        """
        self.solids.aim(name, position, rotation, self.scene.dim)

    def add_solid(self, solid: Solid, grow: float = 0.0) -> str:
        """Put a solid into the world and return its name.

        With `grow` [s] it swells to its size within that time and pushes the water where it appears aside.
        """
        self.scene.assign("solids", [*self.scene.solids, solid])
        name = self.solids.add(solid, grow)
        self._renew_solids()
        return name

    def remove_solid(self, name: str) -> None:
        """Take the solid `name` out of the world; the water closes behind it."""
        number = self.solids.find(name) - self.solids.tank_count
        if number < 0:
            raise WavetankError(f"{name!r} is a wall of the tank, which stays; only other solids can be removed.")
        self.scene.assign("solids", [solid for k, solid in enumerate(self.scene.solids) if k != number])
        device, reach = self.solids.device, 2.0 * self.scene.support * self.scene.spacing
        population.forget_solid(self.world.particles, self.count, device, number + self.solids.tank_count, reach)
        self.solids.remove(number + self.solids.tank_count)
        self._renew_solids()

    def _renew_solids(self) -> None:
        self.world.solids, self.world.has_friction = self.solids.device, self.solids.has_friction
        self._outdated = True

    # --- particles that come and go ---

    def add(self, positions: Any, velocities: Any = None, dyes: Any = None, materials: Any = None) -> np.ndarray:
        """Add particles at `positions` [m], shape [n, dim], with `velocities` [m/s] and return their new ids, [n].

        `materials` are numbers in `Scene.palette`, [n]; that of the scene's first fluid where None.
        Where there is room is for the caller to know: see `free_places`. Raises `WavetankError` for wrong shapes.
        """
        ledger, new = self.ledger, check_newcomers(self.scene, positions, velocities, dyes, materials)
        number = len(new.x)
        count = self.count + number
        if count > MAX_PARTICLES:
            raise WavetankError(f"{count:,} particles are more than the {MAX_PARTICLES:,} that are allowed.")
        if count > ledger.capacity:
            # Half as much again, so that a hose does not make a new world in every frame.
            self._make_room(max(count, ledger.capacity * 3 // 2))
        if number:
            population.append(self.world.particles, self.count, new.x, new.v, new.dye, new.material, ledger.next_id)
            self.world.materials |= self.scene.materials_of(new.material)
        ids = np.arange(ledger.next_id, ledger.next_id + number)
        self.world.count, ledger.next_id, self._outdated = count, ledger.next_id + number, True
        ledger.fastest_start = max(ledger.fastest_start, new.fastest)
        return ids

    def remove(self, ids: Any) -> int:
        """Remove the particles with these ids and return how many there were; the others keep theirs."""
        gone = np.isin(compiler.download(self.world.particles.id)[: self.count], np.asarray(ids))
        return self._keep(~gone)

    def remove_inside(self, start: np.ndarray, end: np.ndarray, radius: float) -> int:
        """Remove the particles within `radius` [m] of the segment between two points [3]; return how many."""
        return self._keep(~population.inside_capsule(self.world.particles, self.count, start, end, radius))

    def free_places(self, places: np.ndarray, gap: float, wall: float) -> np.ndarray:
        """Say which `places` [n, dim] keep the distances `gap` [m] to all particles and `wall` to all solids."""
        return population.free_places(places, self.world.particles, self.world.solids, self.count, gap, wall)

    def paint_inside(self, start: np.ndarray, end: np.ndarray, radius: float, dye: int) -> None:
        """Dye the particles in that capsule; 0 washes them."""
        if self.count:
            population.paint_capsule(self.world.particles, self.count, start, end, radius, dye)

    def freeze_inside(self, start: np.ndarray, end: np.ndarray, radius: float, frozen: bool = True) -> None:
        """Turn the particles in that capsule to ice that keeps its place, or back to water."""
        if self.count:
            self.world.frozen = population.freeze_capsule(
                self.world.particles, self.count, start, end, radius, int(frozen)
            )

    def _keep(self, keep: np.ndarray) -> int:
        removed = int(len(keep) - keep.sum())
        if removed:
            self.world.frozen = population.keep_only(self.world.particles, self.world.spare, self.world.grid, keep)
            self.world.particles, self.world.spare = self.world.spare, self.world.particles
            self.world.count -= removed
            self._outdated = True
        return removed

    def _make_room(self, capacity: int) -> None:
        """Move to a world with room for more particles."""
        before = self.world
        self._fill(capacity)
        self.world.adopt(population.at_capacity(before.particles, self.scene.dim, capacity))
        self.world.count, self.world.frozen, self.world.materials = before.count, before.frozen, before.materials
        if before.pool is not None:
            rows = pool_rows(before.pool, self.scene.dim)
            self.world.pool = pool_from(rows, before.pool.born, before.pool.capacity, self.scene.dim, capacity)

    # --- states ---

    def snapshot(self) -> Snapshot:
        """Return this instant as host arrays, for `resume`."""
        return snapshots.take_snapshot(self.scene, self.world, self.solids, self.ledger)

    def resume(self, snapshot: Snapshot) -> None:
        """Go back (or on) to an instant; parameters and forces stay as they are now."""
        self.scene.assign("solids", snapshot.solids)
        self.solids = snapshots.restore_solids(self.scene, self._walls(), snapshot)
        if snapshot.ledger.capacity > self.ledger.capacity:
            self._fill(snapshot.ledger.capacity)
        self._renew_solids()
        before, self.ledger, self.pushed = self.ledger, snapshot.ledger.copy(), []
        self.ledger.capacity = before.capacity
        self.ledger.next_id = max(self.ledger.next_id, before.next_id)
        snapshots.put_particles(snapshot, self.scene, self.world, self.ledger.capacity)

    def clone(self) -> "Simulation":
        """Return a world of its own that goes on from here to the same bits, with the same forces and parameters."""
        empty = self.scene.model_copy(update={"fluids": [], "solids": []})
        copy = type(self)(empty, self.arch or "cpu")
        copy.scene = self.scene.model_copy(deep=True)
        copy.resume(dataclasses.replace(self.snapshot(), solids=[*copy.scene.solids]))
        copy.forces, copy.pushed = deepcopy((self.forces, self.pushed))
        return copy

    def digest(self) -> str:
        """Return the hex SHA-256 of the state: time, particles by id, foam, poses of the solids, to the last bit."""
        return snapshots.digest(self.snapshot())

    # --- parameters ---

    def __getattr__(self, name: str) -> Any:
        """Read a parameter of the scene."""
        if name in LIVE:
            return getattr(self.scene, name)
        raise AttributeError(f"'Simulation' object has no attribute {name!r}")

    def __setattr__(self, name: str, value: Any) -> None:
        """Set an attribute; a live parameter is checked and holds from the next substep on."""
        if name in LIVE:
            self.scene.assign(name, value)
        else:
            if name not in self.__dict__ and not hasattr(type(self), name):
                refuse_assignment(name)
            super().__setattr__(name, value)

    # --- files ---

    def save(self, path: str | Path) -> None:
        """Write the whole state to an .npz file, replaced in one move; `restore` continues from it exactly."""
        snapshots.write_snapshot(path, self.snapshot(), self.scene.model_dump_json(exclude={"fluids"}))

    @classmethod
    def restore(cls, path: str | Path, arch: str = "cpu") -> "Simulation":
        """Continue from a file that `save` wrote, bit for bit on the same back end."""
        snapshot, text = snapshots.read_snapshot(path, lambda text: Scene.model_validate_json(text).solids)
        self = cls(Scene.model_validate_json(text), arch)
        self.resume(snapshot)
        return self

"""A running world: the public face of the solver."""

import math
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from wavetank.device import compiler
from wavetank.device.state import KINDS, Fluids, Walls, new_particles, new_scratch, vectors
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.params import LIVE, refuse_assignment
from wavetank.physics import measure, plan, population
from wavetank.physics.foam.pool import pool_from, pool_rows
from wavetank.physics.foam.update import load_kernels, update_foam
from wavetank.physics.grid_pressure.coarse_grid import new_levels
from wavetank.physics.neighbors import list_room, new_grid
from wavetank.physics.smoothing import half_space_table
from wavetank.physics.step import step
from wavetank.physics.time_step import filled_share, largest_speed, whole
from wavetank.physics.world import World
from wavetank.scene.forces import Force
from wavetank.scene.scene import MAX_PARTICLES, Scene
from wavetank.simulation.frame import Frame
from wavetank.simulation.moving_solids import MovingSolids
from wavetank.simulation.snapshot import Snapshot, put_snapshot, read_snapshot, take_snapshot, write_snapshot
from wavetank.solids.solid import Solid


class Simulation:
    """Water that moves. See `Scene` for what it is made of."""

    def __init__(self, scene: Scene, arch: str = "cpu") -> None:
        compiler.start(arch)
        self.arch = compiler.current_backend()
        self.scene = Scene.checked(scene).model_copy(deep=True)
        self.reset()

    def reset(self) -> None:
        """Put everything back to the start of the scene."""
        positions, velocities = self.scene.particles()
        self.solids = MovingSolids(self._walls(), self.scene.solids, self.scene.friction, self.scene.spacing)
        self.forces: list[Force] = [*self.scene.forces]  # these act in every frame
        self.pushed: list[Force] = []  # these in the next one only
        self._next_id, self._fastest_start, self._fastest_solid, self._fastest_force = 0, 0.0, 0.0, 0.0
        self._fill(len(positions))
        free = self.solids.free_of(self.scene, positions, self.world.particles)
        self.add(positions[free], velocities[free], materials=self.scene.kinds()[free])
        box = positions[free] if free.any() else np.zeros((1, self.scene.dim))
        self._start_box = (box.min(axis=0), box.max(axis=0))
        self.time, self.frame_number, self._owed, self.seconds_per_frame = 0.0, 0, 0.0, math.nan
        self.time_steps = 1  # of the last frame

    def _fill(self, capacity: int) -> None:
        """Make an empty world with room for `capacity` particles."""
        scene, dim = self.scene, self.scene.dim
        h = scene.support * scene.spacing
        table = half_space_table(scene.kernel, dim, scene.support)
        walls = Walls(vectors(2, len(table)))
        compiler.upload(walls.table, table)
        size = scene.tank.size if scene.tank else None
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
            levels=new_levels(size, h) if size else [],
        )
        self._capacity, self._outdated = capacity, True

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
        self._owed += seconds
        frame = self.scene.frame_time
        if self._owed < 0.2 * frame / self.scene.substeps:
            return
        count = max(1, math.ceil(self._owed / frame - 1e-3))
        duration, self._owed = self._owed / count, 0.0
        for _ in range(count):
            self._advance_frame(duration)

    def load_kernels(self) -> None:
        """Load what a splash needs before there is one: a tenth of a second for each kernel, of water that stands."""
        load_kernels(self.world, self.scene)

    def filled(self, duration: float) -> float:
        """Return the time [s] up to `duration` that time steps of full length fill; see `time_step.filled_share`."""
        return duration * filled_share(self._steps_in(duration))

    def frames(self, seconds: float, fps: float = 60.0) -> Iterator[Frame]:
        """Yield the present frame and then one every 1 / `fps` until `seconds` of water have passed."""
        if not (math.isfinite(fps) and fps > 0):
            raise WavetankError(f"fps = {fps} is not allowed; it must be a positive number.")
        start = self.time
        yield self.frame()
        for number in range(1, round(seconds * fps) + 1):
            self.advance(max(0.0, start + number / fps - self.time - self._owed))
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
                for force in (*self.forces, *self.pushed):
                    force.apply(self.world.particles, self.count, duration / parts, self.time + duration * part / parts)
                step(self.world, self.scene, duration / parts, limit)
        self.solids.move_to(0.0, 1.0)
        update_foam(self.world, self.scene, duration, self.frame_number)
        self.pushed = []
        self.solids.arrive()
        compiler.synchronize()
        self.seconds_per_frame = time.perf_counter() - began
        self.time += duration
        self.frame_number += 1
        self._outdated = True

    def _steps_in(self, duration: float) -> float:
        """Return how many time steps make up `duration` [s], no whole number."""
        scene, forces = self.scene, (*self.forces, *self.pushed)
        box = (np.zeros(scene.dim), np.array(scene.tank.size)) if scene.tank else self._start_box
        speed = max(self._solid_speed(duration), largest_speed(self.world.particles, self.count))
        speed += duration * sum(force.largest_acceleration() for force in forces)
        return plan.steps_in(self.world, scene, duration, speed, box, forced=bool(forces))

    def _solid_speed(self, duration: float) -> float:
        """Return the largest speed [m/s] at which any solid moves through the tank in this frame."""
        return self.solids.largest_speed(duration, self.scene.tank.size if self.scene.tank else None)

    def _speed_limit(self, duration: float) -> float:
        """Return the largest speed [m/s] that gravity, the start, solids and forces can have given to a particle.

        Gravity gives that of a free fall through the tank. Without one a fall has no end, and neither has the limit.
        """
        if self.scene.tank is None:
            return math.inf
        self._fastest_solid = max(self._fastest_solid, self._solid_speed(duration))
        fall = sum(2.0 * abs(g) * edge for g, edge in zip(self.scene.gravity, self.scene.tank.size, strict=True))
        pushes = sum(force.largest_speed() for force in (*self.forces, *self.pushed))
        self._fastest_force = max(self._fastest_force, pushes)
        given = math.sqrt(fall + self._fastest_start**2) + 2.0 * self._fastest_solid + self._fastest_force
        return self.scene.speed_limit * max(given + plan.capillary_speed(self.world, self.scene), 1e-6)

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
        x = np.asarray(positions, np.float32)
        v = np.zeros_like(x) if velocities is None else np.asarray(velocities, np.float32)
        dye = np.zeros(len(x), np.int32) if dyes is None else np.asarray(dyes, np.int32)
        material = self.scene.checked_kinds(materials, len(x))
        shape = (len(x), self.scene.dim)
        if x.shape != shape or v.shape != shape or dye.shape != shape[:1]:
            raise WavetankError(
                f"positions have shape {list(x.shape)}, velocities {list(v.shape)}; both must be [n, {self.scene.dim}]."
            )
        if not (np.isfinite(x).all() and np.isfinite(v).all()):
            raise WavetankError("positions and velocities of new particles must be finite numbers.")
        count = self.count + len(x)
        if count > MAX_PARTICLES:
            raise WavetankError(f"{count:,} particles are more than the {MAX_PARTICLES:,} that are allowed.")
        if count > self._capacity:
            # Half as much again, so that a hose does not make a new world in every frame.
            self._make_room(max(count, self._capacity * 3 // 2))
        if len(x):
            population.append(self.world.particles, self.count, x, v, dye, material, self._next_id)
            self.world.materials |= self.scene.materials_of(material)
        ids = np.arange(self._next_id, self._next_id + len(x))
        self.world.count, self._next_id, self._outdated = count, self._next_id + len(x), True
        self._fastest_start = max(self._fastest_start, float(np.linalg.norm(v, axis=1).max(initial=0.0)))
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
        return take_snapshot(self)

    def resume(self, snapshot: Snapshot) -> None:
        """Go back (or on) to an instant; parameters and forces stay as they are now."""
        put_snapshot(self, snapshot)

    # --- what is there ---

    @property
    def count(self) -> int:
        """Number of particles."""
        return self.world.count

    @property
    def positions(self) -> np.ndarray:
        """Positions [m], float32 [count, dim], ordered by particle id."""
        return self.frame().positions

    @property
    def velocities(self) -> np.ndarray:
        """Velocities [m/s], float32 [count, dim], ordered by particle id."""
        return self.frame().velocities

    @property
    def densities(self) -> np.ndarray:
        """Densities [kg/m^3], float32 [count], ordered by particle id; walls count as water of rest density."""
        return self.frame().densities

    @property
    def foam_positions(self) -> np.ndarray:
        """Positions [m] of spray, foam and bubbles, float32 [n, dim], in the order of their birth."""
        return self.frame().foam_positions

    @property
    def foam_kinds(self) -> np.ndarray:
        """What they are, int32 [n]: 1 spray, 2 foam, 3 bubble."""
        return self.frame().foam_kinds

    @property
    def foam_ages(self) -> np.ndarray:
        """Time since their birth [s], float32 [n]."""
        return self.frame().foam_ages

    def frame(self, measured: bool = True) -> Frame:
        """Return this instant for a viewer or an exporter; valid until the water moves on.

        Without `measured` its densities are those of some moment before, and no time is spent on them.
        """
        if measured:
            self._measure()
        world = self.world
        return Frame(
            scene=self.scene, number=self.frame_number, time=self.time, count=world.count, x=world.particles.x,
            v=world.particles.v, rho=world.scratch.rho, id=world.particles.id, material=world.particles.material,
            solids=world.solids, dye=world.particles.dye,
            diffuse=world.pool.now if world.pool else None, foam_count=world.pool.count if world.pool else 0,
        )  # fmt: skip

    def stats(self) -> dict[str, float]:
        """Measure this instant; see `physics.measure.statistics` for the keys, and foam in numbers of particles."""
        frame = self.frame()
        numbers = measure.neighbor_numbers(self.world, self.scene)
        figures = measure.statistics(
            frame.positions, frame.velocities, frame.densities, numbers, self.scene, frame.rest_densities
        )
        return {
            "time": self.time,
            "frame": self.frame_number,
            **figures,
            **{KINDS[kind]: int(np.sum(frame.foam_kinds == kind)) for kind in (1, 2, 3)},
            "foaming": int(frame.foaming.sum()),
            "substeps": self.time_steps,
            "milliseconds_per_frame": 1e3 * self.seconds_per_frame,
        }

    def _measure(self) -> None:
        """Renew neighbours and densities for the positions as they are."""
        if self._outdated and self.count:
            measure.update_densities(self.world, self.scene)
        self._outdated = False

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
            if name not in self.__dict__:
                refuse_assignment(name)
            super().__setattr__(name, value)

    # --- files ---

    def save(self, path: str | Path) -> None:
        """Write the whole state to an .npz file, replaced in one move; `restore` continues from it exactly."""
        write_snapshot(path, self.snapshot(), self.scene.model_dump_json(exclude={"fluids"}))

    @classmethod
    def restore(cls, path: str | Path, arch: str = "cpu") -> "Simulation":
        """Continue from a file that `save` wrote, bit for bit on the same back end."""
        snapshot, text = read_snapshot(path, lambda text: Scene.model_validate_json(text).solids)
        self = cls(Scene.model_validate_json(text), arch)
        self.resume(snapshot)
        return self

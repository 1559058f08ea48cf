"""A running world: the public face of the solver."""

import contextlib
import math
import time
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from wavetank.device import compiler
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.params import LIVE, refuse_assignment
from wavetank.physics import population
from wavetank.physics.foam.pool import pool_from, pool_rows
from wavetank.physics.foam.update import load_kernels, update_foam
from wavetank.physics.planning import has_grid_pressure
from wavetank.physics.time_step import filled_share, whole
from wavetank.scene.forces import Force
from wavetank.scene.forces.images import with_images
from wavetank.scene.scene import MAX_PARTICLES, Scene
from wavetank.scene.schedule import changes_gravity, gravity_at
from wavetank.simulation import limits
from wavetank.simulation.arrays import check_newcomers
from wavetank.simulation.bodies import Bodies
from wavetank.simulation.cost import check_cost, check_frames, check_time
from wavetank.simulation.filling import fill
from wavetank.simulation.frame import Frame
from wavetank.simulation.joints import Joints
from wavetank.simulation.ledger import Ledger
from wavetank.simulation.moving_solids import solids_of
from wavetank.simulation.new_world import new_world
from wavetank.simulation.settling import settle
from wavetank.simulation.sources import Sources, check_places
from wavetank.simulation.states import States
from wavetank.solids.solid import Solid

NEAR = 0.99  # of what water keeps from walls: what is nearer than that to a solid at the start is led out of it


class Simulation(States):
    """Water that moves. See `Scene` for what it is made of."""

    gravity_by_hand: tuple[float, ...] | None  # m/s^2, in place of what changes by itself
    notes: list[str]  # what a person should know, one sentence each; whoever shows them takes them away

    def __init__(self, scene: Scene, arch: str = "cpu") -> None:
        compiler.start(arch)
        self.arch = compiler.current_backend()
        self.scene = Scene.checked(scene).model_copy(deep=True)
        self.reset()

    def reset(self) -> None:
        """Put everything back to the start of the scene."""
        check_cost(self.scene)
        start, scene = fill(self.scene, lambda scene: type(self)(scene, self.arch or "cpu")), self.scene
        self.solids = solids_of(scene, self._walls(), scene.solids)
        self.sources, self.notes = Sources(scene), []
        self.gravity_by_hand = None
        self.forces: list[Force] = [*self.scene.forces]  # these act in every frame
        self.pushed: list[Force] = []  # these in the next one only
        self.seconds_per_frame = math.nan  # that the last frame took to compute
        self.time_steps = 1  # of the last frame
        has_bodies = any(solid.is_body for solid in scene.solids)
        if self._begin(start, clear=has_bodies) and not self._settle() and not has_bodies:
            self._begin(start, clear=True)
        check_places(self)

    def _begin(self, start: Scene, *, clear: bool) -> bool:
        """Put the water of `start` where solids leave it room, see `find_free_places`; say whether any of them does."""
        positions, velocities = start.particles()
        self.ledger, self.bodies = Ledger(), Bodies(self.scene, self.solids)
        self._fill(len(positions))
        free = self.solids.find_free_places(start, positions, self.world.particles, clear=clear)
        self.add(positions[free], velocities[free], materials=start.kinds()[free])
        box = positions[free] if free.any() else np.zeros((1, self.scene.dim))
        self.ledger.start_box = (box.min(axis=0), box.max(axis=0))
        return bool(free.any()) and (bool(self.bodies) or self.solids.reaches_into(start))

    def _fill(self, capacity: int) -> None:
        """Make an empty world with room for `capacity` particles."""
        self.world = new_world(self.scene, capacity, self.solids, self.bodies.pieces)
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
        check_time(self.count, self.scene, seconds, f"advance({seconds:g})")
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
        self.solids.follow(self.time, duration)
        return duration * filled_share(self._steps_in(duration))

    def frames(self, seconds: float, fps: float = 60.0) -> Iterator[Frame]:
        """Yield the present frame and then one every 1 / `fps` until `seconds` of water have passed."""
        for _, frame in self.numbered_frames(seconds, fps, self.time):
            yield frame

    def numbered_frames(self, seconds: float, fps: float, start: float, done: int = -1) -> Iterator[tuple[int, Frame]]:
        """Yield such frames from the time `start` [s] on with their numbers, but for those up to number `done`."""
        check_frames(self.count, self.scene, seconds, fps)
        for number in range(done + 1, round(seconds * fps) + 1):
            if number:
                self.advance(max(0.0, start + number / fps - self.time - self.ledger.owed))
            yield number, self.frame()

    def push(self, force: Force) -> None:
        """Let a force act during the next frame only."""
        self.pushed.append(force)

    def _advance_frame(self, duration: float) -> None:
        began = time.perf_counter()
        self.solids.follow(self.time, duration)
        self.pushed += self.sources.forces(self.scene, self.time, duration)
        limit = self._speed_limit(duration)
        parts = self.time_steps = whole(self._steps_in(duration))
        self.world.solid_speed = limits.solid_speed(self.scene, self.solids, duration)
        self.solids.grow(duration)
        for part in range(parts):
            start, dt = self.time + duration * part / parts, duration / parts
            shares = part / parts, (part + 1) / parts
            scene = self._scene_at(start + 0.5 * dt)
            self._take_step(scene, self._acting_at(start + 0.5 * dt), start, dt, shares, limit)
        self.solids.passing = None
        self.solids.move_to(0.0, 1.0)
        update_foam(self.world, self._scene_at(self.time + 0.5 * duration), duration, self.frame_number)
        self._let_out()  # after the foam, which looks for water in the cells of the last step
        self.pushed = []
        self.solids.arrive()
        if self.sources:
            self.sources.act(self, self.time, duration)
        compiler.synchronize()
        self.seconds_per_frame = time.perf_counter() - began
        self.ledger.time += duration
        self.ledger.frame_number += 1
        self._outdated = True

    def _take_step(
        self, scene: Scene, acting: Sequence[Force], start: float, dt: float, shares: tuple[float, float], limit: float
    ) -> None:
        """Let bodies, solids and water take a step of `dt` [s] from `start` [s] on, those `shares` of a frame."""
        if self.bodies:
            self.bodies.apply_forces(acting, dt, start)
            self.bodies.advance(scene.gravity, dt, shares[1], limit, start + dt + self.scene.start_time)
        self.world.solids_version = self.solids.move_to(*shares)
        if self.count:
            for force in with_images(acting, scene.tank):
                force.apply(self.world.particles, self.count, dt, start)
            self.bodies.step(self.world, scene, dt, limit, shares)

    def _settle(self) -> bool:
        """Let the water around solids find the pressure that it would have had before the start; say if it stands."""
        scene, duration = self._scene_at(0.0), self.scene.frame_time
        if not (any(scene.gravity) and has_grid_pressure(self.world, scene)):
            return False
        dt, limit = duration / whole(self._steps_in(duration)), self._speed_limit(duration)
        fall = np.array(scene.gravity, np.float32) * np.float32(dt) ** 2
        with self.bodies.frozen() if self.bodies else contextlib.nullcontext():
            stands = settle(
                self.world,
                lambda: self._take_step(scene, (), 0.0, dt, (0.0, 1.0), limit),
                fall,
                scene.spacing,
                near=None if self.bodies else self._too_near,
            )
        self.solids.passing = None
        self.solids.move_to(0.0, 1.0)
        return stands

    def _too_near(self, places: np.ndarray) -> np.ndarray:
        return self.solids.nearer(places, NEAR * self.scene.wall_gap * self.scene.spacing)

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

    def _acting_at(self, time: float) -> tuple[Force, ...]:
        """The same with their numbers at `time` [s] of the water."""
        return tuple(force.at(time + self.scene.start_time) for force in self._acting)

    def _scene_at(self, time: float) -> Scene:
        """The scene with gravity as it is at `time` [s] of the water."""
        if not changes_gravity(self.scene):
            return self.scene
        now = self.gravity_by_hand or gravity_at(self.scene, time)
        return self.scene.model_copy(update={"gravity": now})

    def _steps_in(self, duration: float) -> float:
        middle = self.time + 0.5 * duration
        scene, acting = self._scene_at(middle), self._acting_at(middle)
        return limits.count_steps(self.world, scene, self.solids, self.ledger, acting, duration)

    def _speed_limit(self, duration: float) -> float:
        middle = self.time + 0.5 * duration
        scene, acting = self._scene_at(middle), self._acting_at(middle)
        return limits.find_speed_limit(self.world, scene, self.solids, self.ledger, acting, duration)

    # --- solids ---

    def move(self, name: str, position: Sequence[float] | None = None, rotation: Any = None) -> None:
        """Set the pose that the solid `name` reaches at the end of the next frame; its velocity follows.

        `position` [m] is that of the solid's frame (the centre of a box), `rotation` a quaternion (w, x, y, z) or an
        angle about z [rad]; None keeps what is. A solid without a name is called "solid 1" and so on.
        """
        self.solids.aim(name, position, rotation, self.scene.dim)

    @property
    def joints(self) -> Joints:
        """Joints by name, with where they are and what their motors do: see `LiveJoint`."""
        return self.bodies.joints

    def hold(self, name: str, held: bool = True) -> None:
        """Let the body `name` stay where it is, or is moved to by `move`; with `held` = False let it go."""
        body = self.bodies[name]
        body.solid = self.solids.members[body.number] = body.solid.model_copy(update={"held": held})
        self.scene.assign("solids", self.solids.members[self.solids.tank_count :])

    def release(self, name: str, within: float = 0.5) -> None:
        """Give the solid `name` that `move` has taken back to its own motion, which it joins within so long [s].

        "gravity" gives gravity back to its expressions and to the tilt of the tank. Raises `WavetankError` for a solid
        without a motion.
        """
        if name == "gravity" and name not in self.solids.names:
            self.gravity_by_hand = None
        else:
            self.solids.release(name, self.time, within)

    def add_solid(self, solid: Solid, grow: float = 0.0) -> str:
        """Put a solid into the world and return its name.

        With `grow` [s] it swells to its size within that time and pushes the water where it appears aside.
        """
        before = self.scene.solids
        self.scene.assign("solids", [*before, solid])
        try:
            name = self.solids.add(solid, grow)
            self._renew_solids()
        except BaseException:
            self.scene.assign("solids", before)
            for number in range(self.solids.tank_count + len(before), len(self.solids.members)):
                self.solids.remove(number)
            raise
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

    def _renew_solids(self, density: float = 0.0) -> None:
        self.bodies = self.bodies.renewed(self.scene, self.solids, density)
        self.world.pieces = self.bodies.pieces
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

    def remove_inside(self, start: Any, end: Any, radius: float) -> int:
        """Remove the particles within `radius` [m] of the segment between two points [dim]; return how many.

        Raises `WavetankError` for what is none.
        """
        capsule = self._capsule(start, end, radius)
        return self._keep(~population.inside_capsule(self.world.particles, self.count, capsule))

    def free_places(self, places: np.ndarray, gap: float, wall: float) -> np.ndarray:
        """Say which `places` [n, dim] keep the distances `gap` [m] to all particles and `wall` to all solids."""
        clearance = population.Clearance(gap, wall, periods=self.world.grid.periods)
        return population.free_places(places, self.world.particles, self.world.solids, self.count, clearance)

    def _capsule(self, start: Any, end: Any, radius: Any) -> population.Capsule:
        return population.capsule_of(start, end, radius, self.world.grid.periods)

    def paint_inside(self, start: Any, end: Any, radius: float, dye: int) -> None:
        """Dye the particles in that capsule; 0 washes them."""
        if self.count:
            population.dye_particles(self.world.particles, self._capsule(start, end, radius), dye, self.count)

    def freeze_inside(self, start: Any, end: Any, radius: float, frozen: bool = True) -> None:
        """Turn the particles in that capsule to ice that keeps its place, or back to water."""
        if self.count:
            capsule = self._capsule(start, end, radius)
            self.world.frozen = int(population.freeze_particles(self.world.particles, capsule, int(frozen), self.count))

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

    # --- parameters ---

    def __getattr__(self, name: str) -> Any:
        """Read a parameter of the scene."""
        if name in LIVE:
            return getattr(self._scene_at(self.time) if name == "gravity" else self.scene, name)
        raise AttributeError(f"'Simulation' object has no attribute {name!r}")

    def __setattr__(self, name: str, value: Any) -> None:
        """Set an attribute; a live parameter is checked and holds from the next substep on."""
        if name == "gravity" and changes_gravity(self.scene):
            trial = self.scene.model_copy(update={"gravity_track": None})
            trial.assign(name, value)
            self.gravity_by_hand = trial.gravity
        elif name in LIVE:
            self.scene.assign(name, value)
        else:
            if name not in self.__dict__ and not hasattr(type(self), name):
                refuse_assignment(name)
            super().__setattr__(name, value)

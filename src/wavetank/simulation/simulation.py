"""A running world: `Simulation`, composed of parameters, particles, solids, bodies and sources."""

import contextlib
import dataclasses
import math
import time
from collections.abc import Iterable, Iterator, Sequence
from copy import deepcopy
from pathlib import Path
from typing import Any, Self

import numpy as np
from typing_extensions import override

from wavetank.device import compiler
from wavetank.device.state import KINDS, scalars
from wavetank.device.turns import TURN, one_at_a_time
from wavetank.foundation.arguments import KnownAttributes, array_of, finite, instance_of
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.input_limits import explain_errors, printable
from wavetank.foundation.params import LIVE, refuse_assignment
from wavetank.physics import measure, population
from wavetank.physics.foam.update import load_kernels, update_foam
from wavetank.physics.mixture import blend
from wavetank.physics.planning import has_grid_pressure
from wavetank.physics.pressure.probes import (
    knows_pressure,
    pressures,
    pressures_at,
    record_pressure,
    recorded_pressure,
    restore_pressure,
)
from wavetank.physics.terms.term import Term
from wavetank.physics.time_step import filled_share, whole
from wavetank.physics.world import World
from wavetank.scene.forces import Force
from wavetank.scene.forces.images import with_images
from wavetank.scene.scene import Scene
from wavetank.simulation import limits
from wavetank.simulation.bodies import Bodies
from wavetank.simulation.cost import check_cost, check_frames, check_time
from wavetank.simulation.coupling import density_in
from wavetank.simulation.forces import apply_force
from wavetank.simulation.frame import Frame
from wavetank.simulation.initial import cull, relax
from wavetank.simulation.instant import PlacedSolid
from wavetank.simulation.joints import Joints
from wavetank.simulation.loads import Load, Panels, load_of, panels_of, panels_of_wall, unknown_load
from wavetank.simulation.packing import pack
from wavetank.simulation.parameters import LiveParameters
from wavetank.simulation.particles import ParticleSystem, by_id, check_inside, check_newcomers, parted
from wavetank.simulation.solids import Solids, restored_solids, solids_of
from wavetank.simulation.sources import Sources, check_places
from wavetank.simulation.state import PRESSURE, Continuation, Counters, State
from wavetank.simulation.state_file import read_state, write_state
from wavetank.solids.solid import Solid

NEAR = 0.99  # of the distance that water keeps from walls: particles that start closer to a solid are led out of it


@one_at_a_time("advance", "frames", "numbered_frames")
class Simulation(KnownAttributes):
    """A running world of a scene.

    Any thread may make, read and move it: what reads or changes it waits for the end of a frame that is computed.

    Live parameters are attributes too: `sim.viscosity = 0.1` is `sim.parameters.viscosity = 0.1`.
    """

    scene: Scene  # as it is now: live parameters and solids change
    arch: str | None  # back end
    parameters: LiveParameters
    particles: ParticleSystem
    solids: Solids
    bodies: Bodies
    sources: Sources
    counters: Counters
    forces: list[Force]  # that act in every frame; scripts may append their own
    pushed: list[Force]  # that act in the next frame only
    terms: list[Term]  # of a script, that act in every time step
    _panels: dict[int, tuple[Solid, Panels]]  # of solids that loads were asked for, by number
    notes: list[str]  # for people, one sentence each; who shows them removes them
    time_steps: int  # of the last frame
    seconds_per_frame: float  # s that the last frame took to compute

    def __init__(self, scene: Scene, arch: str = "cpu", terms: Iterable[Term] = ()) -> None:
        """Start a scene on a back end: cpu, gpu (the best there is), cuda, vulkan, metal or amdgpu.

        `terms` of a script act in every time step, at their hooks.

        Raises `WavetankError` for a back end that is not there, and for a scene that cannot run or needs too much
        memory.
        """
        self._start(Scene.checked(scene), arch)
        self.terms += [_checked_term(term) for term in instance_of("terms", terms, Iterable, "a list of wt.Term")]

    def _start(self, scene: Scene, arch: str) -> None:
        compiler.start(arch)
        self.arch = compiler.current_backend()
        self.counters, self.terms, self._panels = Counters(), [], {}
        self.scene = scene.model_copy(deep=True)
        self.parameters = LiveParameters(self.scene, self.counters)
        self.particles = ParticleSystem(self.scene, self.counters)
        self.reset()

    @classmethod
    def _of(cls, scene: Scene, arch: str) -> Self:
        """Return a world of a scene that follows from one that was checked."""
        self = cls.__new__(cls)
        self._start(scene, arch)
        return self

    def reset(self) -> None:
        """Put everything back to the start of the scene."""
        scene = self.scene
        check_cost(scene)
        start = pack(scene, lambda scene: self._of(scene, self.arch or "cpu"))
        self.solids = solids_of(scene, self._walls(), scene.solids)
        self.notes = []
        self.sources = Sources(scene, self.notes)
        self.parameters.release_gravity()
        self.forces, self.pushed = [*scene.forces], []
        self.seconds_per_frame, self.time_steps = math.nan, 1
        has_bodies = any(solid.is_body for solid in scene.solids)
        if self._begin(start, clear=has_bodies) and not self._relax() and not has_bodies:
            self._begin(start, clear=True)
        check_places(self.particles, scene.frame_time)

    def _begin(self, start: Scene, *, clear: bool) -> bool:
        """Place the water of `start` outside of solids (see `cull`); return whether solids may displace any of it."""
        lattice = start.lattice()
        positions, velocities = lattice.positions, lattice.velocities
        self.counters.assign(Counters())
        self.bodies = Bodies(self.scene, self.solids)
        self.particles.allocate(len(positions), self.solids, self.bodies.pieces)
        free = cull(start, lattice, self.solids, self.world, clear=clear)
        self.add(positions[free], velocities[free], materials=lattice.kinds[free])
        box = positions[free] if free.any() else np.zeros((1, self.scene.dim))
        self.counters.start_box = (box.min(axis=0), box.max(axis=0))
        return bool(free.any()) and (bool(self.bodies) or self.solids.reaches_into(start))

    def _walls(self) -> list[Solid]:
        return self.scene.tank.walls() if self.scene.tank else []

    def replace_state(self, other: Self) -> None:
        """Become the world of `other`, which must not be used any more; who holds this object holds that world."""
        self.__dict__.clear()
        self.__dict__.update(other.__dict__)

    def __repr__(self) -> str:
        bodies = f", {len(self.bodies)} bod{'y' if len(self.bodies) == 1 else 'ies'}" if self.bodies else ""
        title = self.scene.title or "without title"
        return (
            f"<Simulation {title!r}: t = {self.time:.3f} s, {self.count:,} particles of {self.scene.spacing:g} m in "
            f"{self.scene.dim}-D{bodies}, on {self.arch}>"
        )

    # --- what there is ---

    @property
    def world(self) -> World:
        """All arrays on the device that a step reads and writes."""
        return self.particles.world

    @property
    def time(self) -> float:
        """Seconds of water since the start [s]."""
        return self.counters.time

    @property
    def frame_number(self) -> int:
        """Frames since the start."""
        return self.counters.frame_number

    @property
    def count(self) -> int:
        """Number of particles."""
        return self.particles.world.count

    @property
    def positions(self) -> np.ndarray:
        """Positions [m], float32 [count, dim], ordered by particle id. Writable."""
        return self.frame().positions

    @positions.setter
    def positions(self, values: Any) -> None:
        self.particles.set_positions(values)

    @property
    def velocities(self) -> np.ndarray:
        """Velocities [m/s], float32 [count, dim], ordered by particle id. Writable."""
        return self.frame().velocities

    @velocities.setter
    def velocities(self, values: Any) -> None:
        self.particles.set_velocities(values)

    @property
    def densities(self) -> np.ndarray:
        """Densities [kg/m^3], float32 [count], ordered by particle id; walls count as water of rest density."""
        return self.frame().densities

    @property
    def foam_positions(self) -> np.ndarray:
        """Positions [m] of spray, foam and bubbles, float32 [n, dim], in the order of their births."""
        return self.frame().foam_positions

    @property
    def foam_kinds(self) -> np.ndarray:
        """Their kinds, int32 [n]: 1 spray, 2 foam, 3 bubble."""
        return self.frame().foam_kinds

    @property
    def foam_ages(self) -> np.ndarray:
        """Time since their births [s], float32 [n]."""
        return self.frame().foam_ages

    @property
    def joints(self) -> Joints:
        """Joints by name, with their positions and motors: see `LiveJoint`."""
        return self.bodies.joints

    def frame(self, measured: bool = True) -> Frame:
        """Return this instant for pictures and exports; valid until the water moves on.

        Without `measured` its densities are those of an earlier moment, and no time is spent on them.
        """
        if measured:
            self.particles.measure()
        world = self.world
        return Frame(
            scene=self.scene,
            number=self.frame_number,
            time=self.time,
            count=world.count,
            x=world.particles.x,
            v=world.particles.v,
            rho=world.temporaries.rho,
            id=world.particles.id,
            material=world.particles.material,
            solids=world.solids,
            diffuse=world.pool.now if world.pool else None,
            foam_count=world.pool.count if world.pool else 0,
            frozen=world.particles.frozen,
            frozen_count=world.frozen,
            dye=world.particles.dye,
            read_placed=self._placed_solids,
            read_pressure=self._pressure_of_particles,
        )

    def _placed_solids(self) -> tuple[PlacedSolid, ...]:
        """Return the solids at their poses, without the walls of the tank."""
        solids, bodies = self.solids, {body.number: body for body in self.bodies.values()}
        found = []
        for number in range(solids.tank_count, len(solids.members)):
            (position, rotation), body = solids.poses[number], bodies.get(number)
            velocity, spin = np.split(np.zeros(6) if body is None else self.bodies.coupling.velocity[body.row], 2)
            if body is not None:
                velocity = velocity + np.cross(spin, position - body.center)
            pose = (position.copy(), rotation.copy(), velocity.copy(), spin.copy())
            found.append(PlacedSolid(solids.names[number], solids.members[number], *pose))
        return tuple(found)

    def stats(self) -> dict[str, float]:
        """Measure this instant; see `physics.measure.statistics` and `Bodies.figures` for the keys.

        Foam is in numbers of particles.
        """
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
            **(self.sources.figures() if self.sources else {}),
            **self.bodies.figures(),
            **self._probe_figures(),
            "substeps": self.time_steps,
            "milliseconds_per_frame": 1e3 * self.seconds_per_frame,
        }

    def pressure(self, points: Any) -> np.ndarray:
        """Return the pressure [Pa] at `points` [m], [n, dim] or one [dim], float32 [n] or a single one; 0 in the air.

        It is that of the last time step, from the pressure grid, and reading it changes nothing. Liquid at rest reads
        rho g h within half a percent of the depth, waves are right within a tenth; films thinner than two spacings read
        too little. At a wall ask for a place before it: inside of a wall no side is meant. From the first call on
        changes are followed from step to step; the first one takes the pressure for steady.

        Raises `WavetankError` before the first step, and where the world has no pressure grid.
        """
        dim = self.scene.dim
        places = array_of("points", points, np.float32, f"of shape [n, {dim}] or [{dim}]")
        if places.shape[-1:] != (dim,) or places.ndim > 2 or not np.isfinite(places).all():
            raise WavetankError(
                f"points have shape {list(places.shape)}; give finite numbers of shape [n, {dim}] or [{dim}] [m]."
            )
        self._check_pressure()
        places = self.scene.tank.within(places) if self.scene.tank else places
        return pressures(self.world, self.parameters.at(self.time), places.reshape(-1, dim)).reshape(places.shape[:-1])

    def load_on(self, name: str) -> Load:
        """Return force [N] and moment [N m] of the liquid's pressure on a solid, still, moving or a body.

        Walls of the tank are "tank y lower", "tank x upper" and so on; in a 2-D world both are per metre of depth. The
        moment is about the origin of the solid's frame, or the middle of the wall. Right within one percent for gates,
        discs and walls in water at rest; what lies beyond the walls of the tank, or in them, bears nothing. `pressure`
        says what is not in it. Raises `WavetankError` as it does, for unknown names and solids without an end.
        """
        self._check_pressure()
        number = self.solids.find(name)
        if number in self.solids.growing:
            raise WavetankError(f"the solid {name!r} is still growing; ask for the load on it when it has its size.")
        return self._load_on(number)

    def _load_on(self, number: int) -> Load:
        scene, solid = self.parameters.at(self.time), self.solids.members[number]
        if number not in self._panels or self._panels[number][0] is not solid:
            if scene.tank and number < self.solids.tank_count:
                self._panels[number] = solid, panels_of_wall(scene.tank, solid, scene.spacing)
            else:
                self._panels[number] = solid, panels_of(solid, scene.dim, scene.spacing)
        return load_of(self.world, scene, self._panels[number][1], self.solids.poses[number], scene.dim)

    def _has_grid_pressure(self) -> bool:
        return bool(self.count and has_grid_pressure(self.world, self.parameters.at(self.time)))

    def _knows_pressure(self) -> bool:
        return self._has_grid_pressure() and knows_pressure(self.world)

    def _check_pressure(self) -> None:
        if not self._has_grid_pressure():
            raise WavetankError(
                "there is no pressure to read; it comes from the pressure grid, which needs a tank, liquid without ice "
                "that is thin enough to splash, gravity, and grid_pressure above 0."
            )
        if not knows_pressure(self.world):
            raise WavetankError("there is no pressure yet; it is found in a time step, so call step() first.")

    @TURN
    def _pressure_of_particles(self) -> Any:
        """Return the pressure at each particle [Pa], a device array in device order; 0 where none is known."""
        if not self._knows_pressure():
            return scalars(self.count)
        x = self.world.particles.x
        return pressures_at(self.world, self.parameters.at(self.time), x, x, self.count)

    def _probe_figures(self) -> dict[str, float]:
        """Return the pressure [Pa] at each probe, or force [N] and moment [N m]; not a number where none is known."""
        scene, probes = self.parameters.at(self.time), self.scene.probes
        if not probes:
            return {}
        known = self._knows_pressure()
        places = [self.solids.carried(probe.solid, probe.at) for probe in probes if probe.at is not None]
        rows = pressures(self.world, scene, np.array(places)) if known and places else np.full(len(places), math.nan)
        read = iter(rows.tolist())
        figures: dict[str, float] = {}
        for probe in probes:
            if probe.at is None:
                number = self.solids.find(probe.solid)
                is_known = known and number not in self.solids.growing
                found = (self._load_on(number) if is_known else unknown_load(scene.dim)).figures()
            else:
                found = {"pressure": next(read)}
            figures |= {f"probes.{probe.name}.{what}": value for what, value in found.items()}
        return figures

    def _probe_arrays(self) -> dict[str, np.ndarray]:
        return {PRESSURE: recorded_pressure(self.world)} if self.scene.probes else {}

    # --- time ---

    def step(self) -> None:
        """Advance by one frame, `scene.frame_time`."""
        self._advance_frame(self.scene.frame_time)

    def advance(self, seconds: float) -> None:
        """Advance by `seconds` of water, in equal frames no longer than `scene.frame_time`.

        What is shorter than a fifth of a usual time step is kept for the next call: a position-based step turns the
        density error of the steps before into velocity, and a much shorter one into much velocity.
        """
        seconds = finite("seconds", seconds, 0.0)
        frame, counters = self.scene.frame_time, self.counters
        check_time(self.count, self.scene, seconds, f"advance({seconds:g})")
        counters.pending_time += seconds
        if counters.pending_time < 0.2 * frame / self.scene.substeps:
            return
        count = max(1, math.ceil(counters.pending_time / frame - 1e-3))
        duration, counters.pending_time = counters.pending_time / count, 0.0
        for _ in range(count):
            self._advance_frame(duration)

    def load_kernels(self) -> None:
        """Load the kernels that a splash needs before there is one: each takes a tenth of a second."""
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
        """Yield the frames after number `done` with their numbers, counted from the time `start` [s]."""
        check_frames(self.count, self.scene, seconds, fps)
        for number in range(done + 1, round(seconds * fps) + 1):
            if number:
                self.advance(max(0.0, start + number / fps - self.time - self.counters.pending_time))
            yield number, self.frame()

    def push(self, force: Force) -> None:
        """Let a force act during the next frame only; raises `WavetankError` for what is not a `wt.Force`."""
        self.pushed.append(_checked_force(force))

    @TURN
    def _advance_frame(self, duration: float) -> None:
        began = time.perf_counter()
        for force in self.forces:
            _checked_force(force)
        for term in self.terms:
            _checked_term(term)
        self.solids.follow(self.time, duration)
        self.pushed += self.sources.forces(self.scene, self.time, duration)
        parts = self.time_steps = whole(self._steps_in(duration))
        limit = self._speed_limit(duration)
        self.world.solid_speed = limits.solid_speed(self.scene, self.solids, duration)
        self.world.terms = tuple(self.terms)
        self.solids.grow(duration)
        for part in range(parts):
            start, dt = self.time + duration * part / parts, duration / parts
            shares = part / parts, (part + 1) / parts
            scene = self.parameters.at(start + 0.5 * dt)
            self._take_step(scene, self._forces_at(start + 0.5 * dt), start, dt, shares, limit)
        self.solids.passing = None
        self.solids.move_to(0.0, 1.0)
        update_foam(self.world, self.parameters.at(self.time + 0.5 * duration), duration, self.frame_number)
        self.particles.remove_escaped()  # after the foam, which looks for water in the cells of the last step
        self.pushed = []
        self.solids.arrive()
        if self.sources:
            self.sources.act(self.particles, self.time, duration, self.scene.frame_time / parts)
        compiler.synchronize()
        self.seconds_per_frame = time.perf_counter() - began
        self.counters.time += duration
        self.counters.frame_number += 1
        self.particles.outdated = True

    def _take_step(
        self, scene: Scene, forces: Sequence[Force], start: float, dt: float, shares: tuple[float, float], limit: float
    ) -> None:
        """Step bodies, solids and water by `dt` [s] from `start` [s] on, between these `shares` of a frame."""
        if self.bodies:
            self.bodies.apply_forces(forces, dt, start)
            self.bodies.advance(scene.gravity, dt, shares[1], limit, start + dt + self.scene.start_time)
        self.world.solids_version = self.solids.move_to(*shares)
        if self.count:
            for force in with_images(forces, scene.tank):
                apply_force(force, self.world.particles, self.count, dt, start)
            self.bodies.step(self.world, scene, dt, limit, shares)
            record_pressure(self.world, scene, dt)

    def _relax(self) -> bool:
        """Relax the water around solids to hydrostatic pressure; return whether it is at rest."""
        scene, duration = self.parameters.at(0.0), self.scene.frame_time
        if not (any(scene.gravity) and has_grid_pressure(self.world, scene)):
            return False
        dt, limit = duration / whole(self._steps_in(duration)), self._speed_limit(duration)
        fall = np.array(scene.gravity, np.float32) * np.float32(dt) ** 2
        with self.bodies.frozen() if self.bodies else contextlib.nullcontext():
            at_rest = relax(
                self.world,
                lambda: self._take_step(scene, (), 0.0, dt, (0.0, 1.0), limit),
                fall,
                scene.spacing,
                near=None if self.bodies else self._too_near,
            )
        self.solids.passing = None
        self.solids.move_to(0.0, 1.0)
        assert self.world.pressure is not None, "it relaxed on the grid"
        self.world.pressure.forget_pressure()  # what it pressed with in these steps is not that of the start
        return at_rest

    def _too_near(self, places: np.ndarray) -> np.ndarray:
        return self.solids.closer_than(places, NEAR * self.scene.wall_gap * self.scene.spacing)

    def _forces_at(self, time: float) -> tuple[Force, ...]:
        """Return the forces of the next frame with their values at `time` [s] of the water."""
        return tuple(force.at(time + self.scene.start_time) for force in (*self.forces, *self.pushed))

    def _steps_in(self, duration: float) -> float:
        middle = self.time + 0.5 * duration
        scene, forces = self.parameters.at(middle), self._forces_at(middle)
        return limits.count_steps(self.world, scene, self.solids, self.counters, forces, duration)

    def _speed_limit(self, duration: float) -> float:
        middle = self.time + 0.5 * duration
        scene, forces = self.parameters.at(middle), self._forces_at(middle)
        return limits.find_speed_limit(self.world, scene, self.solids, self.counters, forces, duration)

    # --- solids ---

    def move(self, name: str, position: Sequence[float] | None = None, rotation: Any = None) -> None:
        """Set the pose that the solid `name` reaches at the end of the next frame; see `Solids.move`.

        A solid without a name is called "solid 1" and so on.
        """
        self.solids.move(name, position, rotation)

    def hold(self, name: str, held: bool = True) -> None:
        """Hold the body `name` at its pose, or where `move` moves it; with `held` = False let it go."""
        body = self.bodies[name]
        instance_of("held", held, bool, "True or False")
        body.solid = self.solids.members[body.number] = body.solid.model_copy(update={"held": held})
        self._set_solids(self.solids.members[self.solids.tank_count :])

    def release(self, name: str, within: float = 0.5) -> None:
        """Let the solid `name` that `move` took return to its own motion `within` [s].

        "gravity" gives gravity back to its expressions and to the tilt of the tank. Raises `WavetankError` for a solid
        without a motion.
        """
        if name == "gravity" and name not in self.solids.names:
            self.parameters.release_gravity()
        else:
            self.solids.release(name, self.time, within)

    def add_solid(self, solid: Solid, grow: float = 0.0) -> str:
        """Add a solid and return its name; with `grow` [s] it grows to its size within that time, and displaces water.

        Raises `WavetankError` and changes nothing where it cannot be built.
        """
        before = self.scene.solids
        self._set_solids([*before, solid])
        try:
            name = self.solids.add(solid, grow)
            self._renew_solids()
        except BaseException:
            self.scene.solids = before
            for number in range(self.solids.tank_count + len(before), len(self.solids.members)):
                self.solids.remove(number)
            raise
        return name

    def remove_solid(self, name: str) -> None:
        """Remove the solid `name`; water fills its place."""
        number = self.solids.find(name) - self.solids.tank_count
        if number < 0:
            raise WavetankError(f"{name!r} is a wall of the tank, which stays; only other solids can be removed.")
        probe = next((probe.name for probe in self.scene.probes if probe.solid == name), None)
        if probe is not None:
            raise WavetankError(f"the probe {probe!r} measures {name!r}; take it out of the scene's probes first.")
        self.scene.solids = [solid for k, solid in enumerate(self.scene.solids) if k != number]
        device, reach = self.solids.device, 2.0 * self.scene.support * self.scene.spacing
        population.forget_solid(self.world.particles, self.count, device, number + self.solids.tank_count, reach)
        self.solids.remove(number + self.solids.tank_count)
        self._renew_solids()

    def _set_solids(self, solids: Sequence[Any]) -> None:
        self.scene.solids = list(solids)

    def _renew_solids(self, density: float = 0.0) -> None:
        """Update bodies and device arrays to the present solids, in fluids of `density` [kg/m^3] (0: as before)."""
        if not density and not self.bodies:  # a state without bodies does not hold it
            density = blend(self.world.materials, self.scene).largest_density
        self.bodies = self.bodies.renewed(self.scene, self.solids, density)
        self.particles.set_solids(self.solids, self.bodies.pieces)

    # --- particles that come, go and change ---

    def add(self, positions: Any, velocities: Any = None, dyes: Any = None, materials: Any = None) -> np.ndarray:
        """Add particles at `positions` [m], shape [n, dim], with `velocities` [m/s] and return their new ids, [n].

        `materials` are numbers in `Scene.palette`, [n]; that of the first fluid at the start where None. Particles may
        overlap others: see `free_places`. Raises `WavetankError` for wrong shapes, and places outside of the tank.
        """
        rows = len(positions) if hasattr(positions, "__len__") else 0
        if self.count + rows > self.counters.capacity:  # before any of them is copied
            check_cost(self.scene, self.count + rows)
        new = check_newcomers(self.scene, positions, velocities, dyes, materials, self.particles.default_kind)
        check_inside(self.scene, new.x)
        there = by_id(self.world.particles, self.count, "x")
        new = dataclasses.replace(new, x=parted(new.x, there, self.scene.spacing))
        return self.particles.add(new)

    def remove(self, ids: Any) -> int:
        """Remove the particles with these ids and return their number; the others keep their ids."""
        return self.particles.remove(ids)

    def remove_inside(self, start: Any, end: Any, radius: float) -> int:
        """Remove the particles within `radius` [m] of the segment between two points [dim]; return their number.

        Raises `WavetankError` for points of other shapes.
        """
        return self.particles.remove_inside(start, end, radius)

    def free_places(self, places: np.ndarray, gap: float, wall: float) -> np.ndarray:
        """Return which `places` [n, dim] are `gap` [m] from all particles and `wall` [m] from all solids, bool [n]."""
        return self.particles.free_places(places, gap, wall)

    def paint_inside(self, start: Any, end: Any, radius: float, dye: int) -> None:
        """Dye the particles within `radius` [m] of a segment; 0 removes their dye."""
        self.particles.paint_inside(start, end, radius, dye)

    def freeze_inside(self, start: Any, end: Any, radius: float, frozen: bool = True) -> None:
        """Turn the particles within `radius` [m] of a segment to ice that keeps its place, or back to water."""
        self.particles.freeze_inside(start, end, radius, frozen)

    # --- states ---

    def snapshot(self) -> State:
        """Return this instant on the host, for `resume`."""
        pool = self.world.pool
        return State(
            scene=self.parameters.fixed(),
            number=self.frame_number,
            time=self.time,
            arrays=self.particles.state_arrays() | self.bodies.state_arrays() | self._probe_arrays(),
            continuation=Continuation(
                counters=self.counters.copy(),
                foam_born=pool.born if pool else -1,
                foam_capacity=pool.capacity if pool else 0,
                solids=self.solids.state(),
                sources=self.sources.plain(),
                default_kind=self.particles.default_kind,
                known_kinds=tuple(sorted(self.world.materials)),
            ),
        )

    def resume(self, state: State) -> None:
        """Go back (or on) to a state of `snapshot`; parameters and forces stay as they are now."""
        instance_of("state", state, State, "a state of sim.snapshot()")
        more, now = state.resumable, self.counters.copy()
        self.scene.solids = state.scene.solids
        self.solids = restored_solids(self.scene, self._walls(), more.solids, state.scene.solids)
        if more.counters.capacity > now.capacity:
            self.particles.allocate(more.counters.capacity, self.solids, self.bodies.pieces)
        self._renew_solids(density_in(state.arrays))
        capacity, next_id = self.counters.capacity, max(more.counters.next_id, now.next_id)
        self.counters.assign(dataclasses.replace(more.counters, capacity=capacity, next_id=next_id))
        self.pushed = []
        restore_pressure(self.world, state.arrays.get(PRESSURE, np.zeros(0, np.float32)))
        self.particles.restore(state)
        self.bodies.restore(state.arrays)
        self.sources = Sources(self.scene, self.notes)
        self.sources.read(more.sources)

    def clone(self) -> Self:
        """Return another world that continues from here to the same bits, with the same forces and parameters."""
        empty = self.scene.model_copy(update={"fluids": [], "solids": []})
        copy = self._of(empty, self.arch or "cpu")
        scene = self.scene.model_copy(deep=True)
        copy.scene = copy.particles.scene = scene
        copy.parameters = LiveParameters(scene, copy.counters)
        copy.resume(dataclasses.replace(self.snapshot(), scene=scene))
        copy.forces, copy.pushed = deepcopy((self.forces, self.pushed))
        copy.terms = [*self.terms]
        copy.parameters.take_over(self.parameters)
        return copy

    def digest(self) -> str:
        """Return the hex SHA-256 of all that decides the future, to the last bit: see `State.digest`.

        Equal digests continue to equal digests, on the same back end. Forces and terms that a script added are not part
        of it.
        """
        return self.snapshot().digest()

    def save(self, path: str | Path, *, lasting: bool = False) -> None:
        """Write the whole state to an .npz file, replaced in one move; `restore` continues from it exactly.

        A `lasting` one is on the disk before this returns. Raises `WavetankError` for water with non-finite numbers.
        """
        write_state(path, self.snapshot(), lasting=lasting)

    @classmethod
    def restore(cls, path: str | Path, arch: str = "cpu") -> Self:
        """Continue from a file that `save` wrote, bit for bit on the same back end.

        Raises `WavetankError` for any other file, one that is damaged, and one that needs too much memory.
        """
        state = read_state(path)
        with explain_errors(printable(path), "state"):
            check_cost(state.scene, state.resumable.counters.capacity)
            self = cls(state.scene, arch)
            self.resume(state)
            self.bodies.check_poses(state.resumable.solids.poses)
        return self

    # --- live parameters as attributes ---

    def __getattr__(self, name: str) -> Any:
        if name in LIVE:
            return getattr(self.parameters, name)
        raise AttributeError(f"'Simulation' object has no attribute {name!r}")

    def __setattr__(self, name: str, value: Any) -> None:
        if name in LIVE:
            setattr(self.parameters, name, value)
            return
        if not hasattr(type(self), name):
            refuse_assignment(name)
        super().__setattr__(name, value)

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *LIVE})

    # --- copies ---

    def __copy__(self) -> Self:
        return self.clone()

    def __deepcopy__(self, memo: Any) -> Self:
        return self.clone()

    @override
    def __reduce__(self) -> Any:
        raise WavetankError(
            "a Simulation lives on a device and cannot be pickled; sim.save(path) and Simulation.restore(path), or its "
            "scene, go to another process."
        )


def _checked_force(force: Any) -> Force:
    checked: Force = instance_of("a force", force, Force, "a wt.Force, as wt.Wind(...)")
    return checked


def _checked_term(term: Any) -> Term:
    checked: Term = instance_of("a term", term, Term, "a wt.Term")
    return checked

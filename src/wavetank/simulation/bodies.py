"""Rigid bodies: solids that water and other solids move. Contact, joints and motion are the engine's (Rapier).

A step of water sees bodies as it sees every solid, in the motion that the engine gave them for the step: no particle
penetrates them. The impulses of the water move them in the next step, or within the step where they changed much
(`coupling.py`).
"""

import contextlib
import functools
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from typing_extensions import override

from wavetank.device.compiler import Mirror, synchronize
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.rotations import quaternion_of
from wavetank.physics.bodies import DISPLACING, IMMERSION, OF_GRID, RUBBING, Pieces, largest_displacement, new_pieces
from wavetank.physics.mixture import blend
from wavetank.physics.pressure.correct import warm_start_share
from wavetank.physics.pressure.grid import THRESHOLDS
from wavetank.physics.retry import Retry
from wavetank.physics.step import Response
from wavetank.physics.step import step as take_step
from wavetank.physics.terms.dynamic_viscosity.implicit_viscosity import hold_on_bodies
from wavetank.physics.world import World
from wavetank.scene.forces import Force
from wavetank.scene.scene import Scene
from wavetank.simulation.body import Body
from wavetank.simulation.body_forces import BodyForces
from wavetank.simulation.coupling import DENSITY, Coupling, limited_lift
from wavetank.simulation.engine import import_engine, isometry, keep_in_plane, poses_of, shapes_of, velocities_of
from wavetank.simulation.joints import Joints, joint_reaction, put_joints
from wavetank.simulation.mass_properties import AFLOAT, grip, mass_properties
from wavetank.simulation.solids import Solids
from wavetank.solids.distance import parts
from wavetank.solids.mass import Inertia, Ruler
from wavetank.solids.motion import Pose
from wavetank.solids.solid import Solid

MOST_TRIES = 4  # of a step
FARTHEST = 0.3  # of a spacing: a larger correction of a body repeats the step
FEWEST = 4.0  # pieces across a body
IN_JOINTS = 16  # inner iterations of the engine with joints: with 1 a motor sagged by 0.3 rad/s under a load
IN_CONTACTS = 2  # without joints: with 1 a heavy box at rest on the floor had 5 mm/s, by which it did not move
DRY = 0.5  # Coulomb's coefficient between solids where none is given: wood on wood
SMALL = 1.5  # spacings: radius of the equivalent ball of a body that counts as small; one of twice that does not
LAYERS = 16.0  # particles that can press on a body at once, over those of a layer around its bounding ball
AXES = "xyz"


class Bodies(Mapping[str, Body]):
    """All bodies of a world by name, and the engine that moves them; empty where no solid is a body.

    Raises `WavetankError` for an unknown name, and where there are bodies but no engine is installed.
    """

    def __init__(self, scene: Scene, solids: Solids, density: float = 0.0) -> None:
        """Place the bodies among `solids`, in fluids of at most `density` [kg/m^3]; that of the scene's fluids if 0."""
        self._scene, self._solids, self._dim = scene, solids, scene.dim
        self.members: list[Body] = []
        self._rigid: list[Any] = []  # of the members in the engine's world
        self._speed_limit = 0.0  # m/s: speed limit of the present step
        self._retry = Retry()
        self._gravity = np.array([*scene.gravity, 0.0][:3])  # m/s^2, of the present step
        self.pieces: Pieces | None = None  # of all bodies, on the device
        self.joints = Joints()
        self._forces: BodyForces | None = None  # made when the first force acts
        self._force_impulses: np.ndarray | None = None  # kg m/s, kg m^2/s: of forces, in the next step
        self._engine_masses = np.zeros((0, 2))  # kg, kg m^2: added mass and inertia that the engine has
        self._density = density
        self._frozen = False
        solids.bodies, solids.passing = {}, None
        numbers = [number for number, solid in enumerate(solids.members) if solid.is_body]
        if not numbers:
            return
        self._density = density or blend(scene.materials_of(scene.kinds()), scene).largest_density
        self._engine = import_engine()
        self._engine_world = self._engine.PhysicsWorld(gravity=(0.0, 0.0, 0.0))
        self._engine_world.integration_parameters.length_unit = max(10.0 * scene.spacing, 1e-3)
        self._handles = [self._add_collider_body(number, solid) for number, solid in enumerate(solids.members)]
        self.joints = put_joints(self._engine, lambda: self._engine_world, self._handles, solids, scene.joints)
        for joint in self.joints.values():
            joint.read_reaction(functools.partial(joint_reaction, self.members, self.joints))
        self._numbers = np.array(numbers)
        self._bind_world()
        self._find_mass_properties(numbers)
        far, added = scene.support * scene.spacing, AFLOAT * self.coupling.full_added_mass
        solids.set_bodies(
            {
                body.number: (body.dry.center, body.unit, grip(self._dim, body.dry, body.wet, added[body.row], far))
                for body in self.members
            }
        )
        self._units = np.array([body.unit for body in self.members])  # 1/m
        self._displaced_masses = np.array([body.wet.mass for body in self.members])  # kg
        displaced = self._displaced_masses / self._density
        self._radii = np.cbrt(0.75 / np.pi * displaced) if self._dim == 3 else np.sqrt(displaced / np.pi)  # m
        self.coupling.smallness = np.clip(2.0 - self._radii / (SMALL * scene.spacing), 0.0, 1.0)
        self.coupling.sinks = self.coupling.weights > self._displaced_masses
        self.pieces, self._largest_lifts = self._cut_pieces()
        self._sums = Mirror(solids.device.reaction)
        self._levers = np.repeat(np.stack([np.ones(len(numbers)), self.coupling.reaches], axis=1), 3, axis=1)  # 1, m

    @override
    def __getitem__(self, name: str) -> Body:
        for body in self.members:
            if body.name == name:
                return body
        known = ", ".join(self) or "none"
        raise WavetankError(f"there is no body named {name!r}; bodies: {known}.")

    @override
    def __contains__(self, name: object) -> bool:
        return any(body.name == name for body in self.members)

    @override
    def __iter__(self) -> Iterator[str]:
        return iter([body.name for body in self.members])

    @override
    def __len__(self) -> int:
        return len(self.members)

    # --- the engine's world ---

    def _bind_world(self) -> None:
        """Read handles to all bodies of the engine's world, after it was created or restored."""
        # Threads of the engine wait for each other longer than they work.
        self._engine_world.set_num_threads(1)
        self._rigid_solids = [self._engine_world.rigid_bodies[handle] for handle in self._handles]
        self._rigid = [self._rigid_solids[number] for number in self._numbers]
        self._engine_masses = np.full((len(self._numbers), 2), np.nan)
        self._were_held: Sequence[bool | None] = [None] * len(self._numbers)

    def _add_collider_body(self, number: int, solid: Solid) -> Any:
        engine, pose = self._engine, self._solids.poses[number]
        maker = engine.RigidBody.dynamic() if solid.is_body else engine.RigidBody.kinematic_position_based()
        maker = maker.position(isometry(engine, *pose)).can_sleep(False)
        if self._dim == 2:
            # The engine finds no friction where one of its two directions is locked: `keep_in_plane`.
            maker = maker.enabled_rotations((False, False, True))
        else:
            maker = maker.gyroscopic_forces(True)
        handle = self._engine_world.add_body(maker)
        friction = (self._solids.friction or DRY) if solid.friction is None else solid.friction
        for position, rotation, shape in shapes_of(solid, self._dim, self._scene.spacing):
            collider = engine.Collider.new(shape).position(isometry(engine, position, rotation))
            self._engine_world.add_collider(
                collider.density(0.0).friction(friction).restitution(solid.restitution), handle
            )
        return handle

    def _find_mass_properties(self, numbers: list[int]) -> None:
        """Compute masses, inertias and added masses of the bodies, and create them."""
        solids = [self._solids.members[number] for number in numbers]
        joined = {name for joint in self._scene.joints for name in (joint.first, joint.second)}
        jointed = [place for place, number in enumerate(numbers) if self._solids.names[number] in joined]
        found = mass_properties(solids, self._dim, self._scene.spacing, self._density, jointed)
        self.coupling = Coupling(found.weights, found.masses, found.tensors, found.reaches, found.added)
        self._centers = [dry.center.tolist() for dry, _ in found.inertias]
        self._moments, frames = np.linalg.eigh(found.tensors)
        frames[np.linalg.det(frames) < 0.0, :, 0] *= -1.0
        self._principal_axes = [self._engine.Rotation3(*quaternion_of(matrix)) for matrix in frames]
        for row, number in enumerate(numbers):
            self._add_body(row, number, *found.inertias[row])
        self._set_engine_masses()

    def _add_body(self, row: int, number: int, dry: Inertia, wet: Inertia) -> None:
        """Add a body; the unit of its fixed-point sums follows from how many particles can press on it."""
        solid, handle, spacing = self._solids.members[number], self._handles[number], self._scene.spacing
        around = LAYERS * self._dim * (solid.reach() / spacing + 3.0) ** (self._dim - 1)
        unit = 2.0**31 / (4.0 * (wet.mass / (self._density * spacing**self._dim) + around) * spacing)
        body = Body(
            self._solids.names[number],
            number,
            solid,
            lambda: self._engine_world.rigid_bodies[handle],
            lambda: self._solids.poses[number],
            lambda: self._gravity,
            self._dim,
            dry,
            wet,
            unit,
            self.coupling,
            row,
        )
        self.members.append(body)
        if solid.velocity is not None:
            body.velocity = solid.velocity
        if solid.angular_velocity is not None:
            spin = solid.angular_velocity
            body.angular_velocity = (0.0, 0.0, spin) if isinstance(spin, int | float) else spin

    def _set_engine_masses(self) -> None:
        """Set masses and moments of inertia in the engine, those of the fluid included."""
        added = self.coupling.fluid_inertia
        masses, moments = (self.coupling.masses + added[:, 0]).tolist(), (self._moments + added[:, 1:]).tolist()
        for row in np.flatnonzero((added != self._engine_masses).any(axis=1)).tolist():
            properties = self._engine.MassProperties(
                self._centers[row], masses[row], moments[row], self._principal_axes[row]
            )
            self._rigid[row].set_additional_mass_properties(properties)
        self._engine_masses = added

    def _cut_pieces(self) -> tuple[Pieces, np.ndarray]:
        """Return the pieces of all bodies on the device, and the masses of fluid that each displaces at most [kg]."""
        spacing, table = self._scene.spacing, {}
        for body in self.members:
            edge = min(spacing, 2.0 * float(body.wet.axes[3 - self._dim]) / FEWEST)
            cut = Ruler(body.solid, self._dim, spacing).cut_for_surface(edge)
            inside = cut.volumes > 0.0
            # Their volumes add up to the body's: with a cut surface a body of water's density would rise.
            volumes = cut.volumes[inside] * (body.wet.mass / self._density / cut.volumes.sum())
            table[body.number] = (cut.places[inside], cut.edges, volumes / spacing**self._dim)
        lifts = [self._density * spacing**self._dim * largest_displacement(*table[number]) for number in table]
        return new_pieces(table, max(body.solid.reach() for body in self.members)), np.array(lifts)

    # --- a step ---

    def apply_forces(self, forces: Sequence[Force], dt: float, time: float) -> None:
        """Compute the impulses of `forces` on the bodies for the next step, of `dt` [s] from `time` [s] on."""
        if forces and self._forces is None:
            self._forces = BodyForces(self.members, self._dim, self._scene.spacing)
        self._force_impulses = self._forces.impulses(forces, dt, time) if forces and self._forces else None

    def advance(self, gravity: tuple[float, ...], dt: float, share: float, fastest: float, clock: float) -> None:
        """Move the bodies for a step of `dt` [s] that ends at a `share` of the frame, none faster than `fastest` [m/s].

        Expressions and keyframes of joints are evaluated at `clock` [s].
        """
        self._speed_limit, self._gravity = fastest, np.array([*gravity, 0.0][:3])
        held = [self._is_held(body) for body in self.members]
        self._start_poses = self._poses()
        self.coupling.predict(self._start_poses[1], np.array(held), self._gravity, dt, self._force_impulses)
        for row, (is_held, was_held) in enumerate(zip(held, self._were_held, strict=True)):
            if is_held or is_held != was_held:
                self._set_held(row, is_held)
        self._were_held = held
        if not self._frozen:
            for joint in self.joints.values():
                joint.drive(clock, dt)
        self._engine_poses = [now.position for now in self._rigid_solids]
        self._step_engine(dt, share)

    def _step_engine(self, dt: float, share: float) -> None:
        """Take the engine's step from the poses at its start, with the target velocities."""
        self._set_engine_masses()
        slowed = self.coupling.limited_velocity(self._speed_limit)
        for now, velocity in zip(self._rigid, slowed.tolist(), strict=True):
            now.linvel, now.angvel = velocity[:3], velocity[3:]
        # The engine keeps velocities as given, in single precision, except those of kinematic bodies.
        begun = velocities_of(self._rigid) if self.coupling.held.any() else np.float32(slowed).astype(float)
        for number in self._solids.targets:
            pose = isometry(self._engine, *self._solids.between(number, share))
            self._rigid_solids[number].set_next_kinematic_position(pose)
        self._engine_world.integration_parameters.dt = dt
        self._engine_world.integration_parameters.num_internal_pgs_iterations = (
            IN_JOINTS if self.joints else IN_CONTACTS
        )
        self._engine_world.step()
        if self._dim == 2:
            keep_in_plane(self._engine, self._rigid)
        self.coupling.record_step(self._start_poses[1], begun, velocities_of(self._rigid), dt)
        self._end_poses = poses_of(self._rigid)
        self._solids.passing = (self._numbers, self._start_poses, self._end_poses)
        for number, position, rotation in zip(self._numbers.tolist(), *self._end_poses, strict=True):
            self._solids.poses[number] = (position, rotation)

    def step(self, world: World, scene: Scene, dt: float, fastest: float, part: tuple[float, float]) -> None:
        """Take a step of `dt` [s] of the water, from share `part[0]` to `part[1]` of the frame.

        Where the impulses on bodies changed much, the coupling iterates within the step; where one was hit hard, the
        step is taken again.
        """
        if not self.members:
            take_step(world, scene, dt, fastest)
            return
        self._retry.keep(world)
        tries = 1

        def respond() -> Response:
            nonlocal tries
            self._read_reactions(world, dt)
            self.coupling.add_late_impulse()
            if tries == MOST_TRIES or not self._iterate(dt, part[1]):
                return Response.UNCHANGED
            # The open volume of the grid stays as it was: the correction is small.
            world.solids_version = self._solids.move_to(*part)
            if world.pressure:
                world.pressure.solids_version = world.solids_version
            if self.coupling.is_hit:
                tries += 1
                return Response.RETRY
            return Response.MOVED

        while True:
            synchronize()
            self._sums.clear()
            if take_step(world, scene, dt, fastest, respond):
                break
            self._retry.restore(world)
        self._read_reactions(world, dt)
        self.coupling.record_late_impulse()

    def _read_reactions(self, world: World, dt: float) -> None:
        """Read the impulses of the water on the bodies in a step of `dt` [s] from the device."""
        synchronize()
        sums = self._sums.read().reshape(-1, parts.fn())[self._numbers].astype(float)
        particle = blend(world.materials, self._scene).largest_density * self._scene.spacing**self._dim
        rows, coupling, wet = sums / self._units[:, None], self.coupling, self._displaced_masses
        scale = self._levers * (particle / dt)
        cell = world.pressure.finest.dy if world.pressure else 1.0
        coupling.immersed = np.minimum(1.0, rows[:, IMMERSION] * particle / (wet * cell))
        coupling.displaced = np.minimum(1.0, rows[:, DISPLACING] * particle / (wet * cell))
        keeps = (warm_start_share(self._scene, dt) * coupling.warm_start_share)[:, None]
        force = keeps * coupling.warm_started_force + rows[:, OF_GRID : OF_GRID + 6] * scale / dt
        coupling.grid_force = limited_lift(force, self._gravity, THRESHOLDS.largest_warm_start * self._largest_lifts)
        coupling.impulse = rows[:, :6] * scale + force * dt
        if world.remembers_viscosity:
            each, spread = hold_on_bodies(blend(world.materials, self._scene), self._scene, dt)
            coupling.set_viscosity(
                rows[:, RUBBING] / self._scene.spacing * each, self._radii, self._scene.spacing, spread
            )

    def _iterate(self, dt: float, share: float) -> bool:
        """Correct the motion of bodies whose impulse changed much in this step; return whether there are any.

        The engine's step of `dt` [s], which ends at a `share` of the frame, is then taken again from its start.
        """
        slow = float(np.linalg.norm(self._gravity) * self._scene.spacing) ** 0.5
        if not self.coupling.iterate(self._end_poses[1], slow, FARTHEST * self._scene.spacing):
            return False
        for now, position in zip(self._rigid_solids, self._engine_poses, strict=True):
            now.position = position
        for row, body in enumerate(self.members):
            if self._is_held(body):
                pose = isometry(self._engine, self._start_poses[0][row], self._start_poses[1][row])
                self._rigid[row].set_next_kinematic_position(pose)
        self._step_engine(dt, share)
        return True

    def _is_held(self, body: Body) -> bool:
        return self._frozen or body.solid.held or body.number in self._solids.targets

    @contextlib.contextmanager
    def frozen(self) -> Iterator[None]:
        """Hold all bodies at their poses within this context; their velocities are kept for after it."""
        own, self._frozen = self.coupling.velocity.copy(), True
        try:
            yield
        finally:
            self._frozen = False
            self.coupling.velocity = own

    def _set_held(self, row: int, held: bool) -> None:
        """Make a body kinematic, or dynamic again with the velocity that it has."""
        kinds, now = self._engine.RigidBodyType, self._rigid[row]
        kind = kinds.KINEMATIC_POSITION_BASED if held else kinds.DYNAMIC
        if now.body_type != kind:
            now.body_type = kind
        if held:
            now.set_next_kinematic_position(
                isometry(self._engine, self._start_poses[0][row], self._start_poses[1][row])
            )

    def _poses(self) -> tuple[np.ndarray, np.ndarray]:
        """Return positions [n, 3] [m] and rotations [n, 4] of the bodies."""
        places, turns = zip(*[self._solids.poses[number] for number in self._numbers.tolist()], strict=True)
        return np.array(places), np.array(turns)

    def figures(self) -> dict[str, float]:
        """Return force [N], torque [N m] (about z in 2-D) and immersed share of each body, and `Joints.figures`."""
        rows: dict[str, float] = {}
        for name, body in self.items():
            for what, vector, axes in (
                ("force", body.force, AXES[: self._dim]),
                ("torque", body.torque[2 if self._dim == 2 else 0 :], "z" if self._dim == 2 else AXES),
            ):
                rows |= {f"bodies.{name}.{what}_{axis}": float(x) for axis, x in zip(axes, vector, strict=True)}
            rows[f"bodies.{name}.immersed"] = body.immersed
        return rows | self.joints.figures()

    # --- states ---

    def renewed(self, scene: Scene, solids: Solids, density: float = 0.0) -> "Bodies":
        """Return the bodies of `solids`; those that exist already keep their motion. `density` is as in `__init__`."""
        bodies = Bodies(scene, solids, density or self._density)
        memories: Any = self.coupling.to_rows() if self.members else []
        for name, joint in bodies.joints.items():
            if name in self.joints:
                joint.take_over(self.joints[name])
        for body in bodies.members:
            for before, memory in zip(self.members, memories, strict=True):
                if before.name == body.name:
                    bodies.coupling.from_row(body.row, memory)
                    body.velocity, body.angular_velocity = before.velocity, before.angular_velocity
        return bodies

    def state_arrays(self) -> dict[str, np.ndarray]:
        """Return the arrays of a `State` that decide how the bodies continue."""
        if not self.members:
            return {}
        engine = np.frombuffer(self._engine_world.snapshot(), np.uint8).copy()
        memory = self.coupling.to_rows()
        memory[:, -1, DENSITY] = self._density  # a state has particles, and no list of fluids
        return {"bodies_memory": memory, "bodies_engine": engine}

    def restore(self, arrays: dict[str, np.ndarray]) -> None:
        """Restore the arrays that `state_arrays` returned; the solids must be the same.

        Raises `WavetankError` where the engine cannot read its part.
        """
        if not self.members:
            return
        try:
            self._engine_world = self._engine.PhysicsWorld.restore(arrays["bodies_engine"].tobytes())
        except self._engine.SerializationError as error:
            raise WavetankError(f"the engine's state of the bodies cannot be read: {error}.") from None
        self._bind_world()
        for row, memory in enumerate(arrays["bodies_memory"]):
            self.coupling.from_row(row, memory)

    def check_poses(self, poses: Sequence[Pose]) -> None:
        """Raise `WavetankError` where the engine, restored from a file, has not the bodies at the `poses` of solids."""
        for name, joint in self.joints.items():
            if not joint.is_there:
                raise WavetankError(f"the engine's state lacks the joint {name!r}.")
        if not self.members:
            return
        for body, position, rotation in zip(self.members, *poses_of(self._rigid), strict=True):
            place, turn = poses[body.number]
            off = np.concatenate(
                [position - place, np.abs(rotation) - np.abs(turn), 0.0 * velocities_of([body.rigid()])[0]]
            )
            if not np.abs(off).max() <= 1e-3 * (1.0 + np.abs(place).max()):
                raise WavetankError(f"the engine's state of the body {body.name!r} is not that of the solid.")

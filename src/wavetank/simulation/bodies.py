"""Bodies: solids that water and other solids move. Contact, joints and motion are the engine's (Rapier).

A step of water sees bodies as it sees every solid, in the motion that the engine gave them for the step: no particle
passes them. What the water did to them moves them in the next step, or at once where it is by far not what it was
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
from wavetank.physics.bodies import Pieces, new_pieces
from wavetank.physics.dynamic_viscosity.implicit_viscosity import hold_on_bodies
from wavetank.physics.grid_pressure.correction import LARGEST_CARRIED, carried
from wavetank.physics.mixture import blend
from wavetank.physics.reactions import DISPLACING, IMMERSION, OF_GRID, RUBBING
from wavetank.physics.retry import Retry
from wavetank.physics.step import step as take_step
from wavetank.physics.world import World
from wavetank.scene.forces import Force
from wavetank.scene.scene import Scene
from wavetank.simulation.acting import Acting
from wavetank.simulation.added_mass import ALONG, grip
from wavetank.simulation.body import Body
from wavetank.simulation.colliders import shapes_of
from wavetank.simulation.coupling import DENSITY, Coupling, lengths
from wavetank.simulation.effort import given
from wavetank.simulation.engine import import_engine, isometry, keep_in_plane, poses_of, velocities_of
from wavetank.simulation.joints import Joints, put_joints
from wavetank.simulation.moving_solids import MovingSolids
from wavetank.simulation.weighing import weigh
from wavetank.solids.distance import PARTS
from wavetank.solids.mass import Inertia, Ruler
from wavetank.solids.motion import Pose
from wavetank.solids.solid import Solid

MOST_TRIES = 4  # of a step
FAR = 0.3  # of a spacing: bodies that yield by more begin the step anew
FEWEST = 4.0  # pieces across a body
IN_JOINTS = 16  # inner iterations of the engine where there are joints: with 1 a motor sagged by 0.3 rad/s under a load
IN_CONTACTS = 2  # where there are none: with 1 a heavy box that lay on the floor had 5 mm/s, by which it did not move
DRY = 0.5  # Coulomb's coefficient between solids where none is named: wood on wood
SMALL = 1.5  # spacings: radius of a ball as large as a body that leaves the water within a few steps; twice that is not
LAYERS = 16.0  # particles that can press on a body at once, over those of a layer around its ball


class Bodies(Mapping[str, Body]):
    """All bodies of a world by name, and the engine that moves them; empty where no solid is a body."""

    def __init__(self, scene: Scene, solids: MovingSolids, density: float = 0.0) -> None:
        """Begin among these solids, in fluids of at most that `density` [kg/m^3]; those of the scene where it is 0."""
        self.scene, self.solids, self.dim = scene, solids, scene.dim
        self.members: list[Body] = []
        self.views: list[Any] = []  # of the members in the engine's world
        self.fastest = 0.0  # m/s
        self.retry = Retry()
        self.gravity = np.array([*scene.gravity, 0.0][:3])  # m/s^2, of the present step
        self.pieces: Pieces | None = None  # of all bodies, on the device
        self.joints = Joints()
        self.acting: Acting | None = None  # made when forces first act
        self.pushes: np.ndarray | None = None  # kg m/s, kg m^2/s: by forces, in the next step
        self._told = np.zeros((0, 2))  # water that goes along with each body, as the engine knows it
        self.density = density
        self._standing = False
        solids.feeling, solids.passing = {}, None
        numbers = [number for number, solid in enumerate(solids.members) if solid.is_body]
        if not numbers:
            return
        self.density = density or blend(scene.materials_of(scene.kinds()), scene).largest_density
        self.engine = import_engine()
        self.world = self.engine.PhysicsWorld(gravity=(0.0, 0.0, 0.0))
        self.world.integration_parameters.length_unit = max(10.0 * scene.spacing, 1e-3)
        self.handles = [self._add(number, solid) for number, solid in enumerate(solids.members)]
        self.joints = put_joints(self.engine, lambda: self.world, self.handles, solids, scene.joints)
        for joint in self.joints.values():
            joint.ask(functools.partial(given, self.members, self.joints))
        self.numbers = np.array(numbers)
        self._see()
        self._weigh_all(numbers)
        far, along = scene.support * scene.spacing, ALONG * self.coupling.added
        solids.feel(
            {
                body.number: (body.dry.center, body.unit, grip(self.dim, body.dry, body.wet, along[body.row], far))
                for body in self.members
            }
        )
        self.units = np.array([body.unit for body in self.members])  # 1/m
        self.wet_masses = np.array([body.wet.mass for body in self.members])  # kg
        displaced = self.wet_masses / self.density
        self.radii = np.cbrt(0.75 / np.pi * displaced) if self.dim == 3 else np.sqrt(displaced / np.pi)  # m
        self.coupling.small = np.clip(2.0 - self.radii / (SMALL * scene.spacing), 0.0, 1.0)
        self.coupling.sinks = self.coupling.weights > self.wet_masses
        self.pieces = self._pieces()
        self.sums = Mirror(solids.device.reaction)
        self.levers = np.repeat(np.stack([np.ones(len(numbers)), self.coupling.reaches], axis=1), 3, axis=1)  # 1, m

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

    def _see(self) -> None:
        """Look at the engine's world, which is another one."""
        # Its threads wait for each other longer than they work, above all where something else runs.
        self.world.set_num_threads(1)
        self.solid_views = [self.world.rigid_bodies[handle] for handle in self.handles]
        self.views = [self.solid_views[number] for number in self.numbers]
        self._told = np.full((len(self.numbers), 2), np.nan)
        self._held: Sequence[bool | None] = [None] * len(self.numbers)

    def _add(self, number: int, solid: Solid) -> Any:
        engine, pose = self.engine, self.solids.poses[number]
        maker = engine.RigidBody.dynamic() if solid.is_body else engine.RigidBody.kinematic_position_based()
        maker = maker.position(isometry(engine, *pose)).can_sleep(False)
        if self.dim == 2:
            # The engine finds no friction where one of its two directions is locked: `keep_in_plane`.
            maker = maker.enabled_rotations((False, False, True))
        else:
            maker = maker.gyroscopic_forces(True)
        handle = self.world.add_body(maker)
        friction = (self.solids.friction or DRY) if solid.friction is None else solid.friction
        for position, rotation, shape in shapes_of(solid, self.dim, self.scene.spacing):
            collider = engine.Collider.new(shape).position(isometry(engine, position, rotation))
            self.world.add_collider(collider.density(0.0).friction(friction).restitution(solid.restitution), handle)
        return handle

    def _weigh_all(self, numbers: list[int]) -> None:
        """Find how the mass of the bodies lies in them, and the water that goes along with them."""
        solids = [self.solids.members[number] for number in numbers]
        hung = {name for joint in self.scene.joints for name in (joint.first, joint.second)}
        jointed = [place for place, number in enumerate(numbers) if self.solids.names[number] in hung]
        found = weigh(solids, self.dim, self.scene.spacing, self.density, jointed)
        self.coupling = Coupling(found.weights, found.masses, found.tensors, found.reaches, found.added)
        self.middles = [dry.center.tolist() for dry, _ in found.inertias]
        self.moments, frames = np.linalg.eigh(found.tensors)
        frames[np.linalg.det(frames) < 0.0, :, 0] *= -1.0
        self.frames = [self.engine.Rotation3(*quaternion_of(matrix)) for matrix in frames]
        for row, number in enumerate(numbers):
            self._put(row, number, *found.inertias[row])
        self._weigh()

    def _put(self, row: int, number: int, dry: Inertia, wet: Inertia) -> None:
        """Put a body among the others; how fine its sums are follows from how many particles can press on it."""
        solid, handle, spacing = self.solids.members[number], self.handles[number], self.scene.spacing
        around = LAYERS * self.dim * (solid.reach() / spacing + 3.0) ** (self.dim - 1)
        unit = 2.0**31 / (4.0 * (wet.mass / (self.density * spacing**self.dim) + around) * spacing)
        body = Body(
            self.solids.names[number],
            number,
            solid,
            lambda: self.world.rigid_bodies[handle],
            lambda: self.solids.poses[number],
            lambda: self.gravity,
            self.dim,
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

    def _weigh(self) -> None:
        """Tell the engine the masses of the bodies and of the water that goes along."""
        along = self.coupling.held_by
        masses, moments = (self.coupling.masses + along[:, 0]).tolist(), (self.moments + along[:, 1:]).tolist()
        for row in np.flatnonzero((along != self._told).any(axis=1)).tolist():
            properties = self.engine.MassProperties(self.middles[row], masses[row], moments[row], self.frames[row])
            self.views[row].set_additional_mass_properties(properties)
        self._told = along

    def _pieces(self) -> Pieces:
        """Return the pieces of all bodies on the device."""
        spacing, table = self.scene.spacing, {}
        for body in self.members:
            edge = min(spacing, 2.0 * float(body.wet.axes[3 - self.dim]) / FEWEST)
            cut = Ruler(body.solid, self.dim, spacing).cut(edge)
            inside = cut.volumes > 0.0
            # However they cut its surface, they are as large as the body, or one of water's density would rise.
            volumes = cut.volumes[inside] * (body.wet.mass / self.density / cut.volumes.sum())
            table[body.number] = (cut.places[inside], cut.edges, volumes / spacing**self.dim)
        return new_pieces(table, max(body.solid.reach() for body in self.members))

    # --- a step ---

    def push(self, forces: Sequence[Force], dt: float, time: float) -> None:
        """Let forces act on the bodies in the next step, of `dt` [s] from `time` [s] of the water on."""
        if forces and self.acting is None:
            self.acting = Acting(self.members, self.dim, self.scene.spacing)
        self.pushes = self.acting.impulses(forces, dt, time) if forces and self.acting else None

    def advance(self, gravity: tuple[float, ...], dt: float, share: float, fastest: float, clock: float) -> None:
        """Move the bodies for a step of `dt` [s], which ends at a `share` of the frame; none is left faster [m/s].

        Expressions and keyframes of joints have the time `clock` [s] then.
        """
        self.fastest, self.gravity = fastest, np.array([*gravity, 0.0][:3])
        held = [self._is_held(body) for body in self.members]
        self.begins = self._stand()
        self.coupling.begin(self.begins[1], np.array(held), self.gravity, dt, self.pushes)
        for row, (is_held, was_held) in enumerate(zip(held, self._held, strict=True)):
            if is_held or is_held != was_held:
                self._hold(row, is_held)
        self._held = held
        if not self._standing:
            for joint in self.joints.values():
                joint.drive(clock, dt)
        self.begun = [now.position for now in self.solid_views]
        self._move(dt, share)

    def _move(self, dt: float, share: float) -> None:
        """Let the engine take the step, from where it began, with the velocities that are wanted."""
        self._weigh()
        slowed = self.coupling.slowed(self.fastest)
        for now, velocity in zip(self.views, slowed.tolist(), strict=True):
            now.linvel, now.angvel = velocity[:3], velocity[3:]
        # The engine keeps what it is given, in single precision, but for what it does not move itself.
        begun = velocities_of(self.views) if self.coupling.held.any() else np.float32(slowed).astype(float)
        for number in self.solids.targets:
            pose = isometry(self.engine, *self.solids.between(number, share))
            self.solid_views[number].set_next_kinematic_position(pose)
        self.world.integration_parameters.dt = dt
        self.world.integration_parameters.num_internal_pgs_iterations = IN_JOINTS if self.joints else IN_CONTACTS
        self.world.step()
        if self.dim == 2:
            keep_in_plane(self.engine, self.views)
        self.coupling.start(self.begins[1], begun, velocities_of(self.views), dt)
        self.ends = poses_of(self.views)
        self.solids.passing = (self.numbers, self.begins, self.ends)
        for number, position, rotation in zip(self.numbers.tolist(), *self.ends, strict=True):
            self.solids.poses[number] = (position, rotation)

    def step(self, world: World, scene: Scene, dt: float, fastest: float, part: tuple[float, float]) -> None:
        """Let the water take a step of `dt` [s], which is that `part` of a frame.

        Where bodies are pushed harder than they were, they yield, and the water follows; where one was hit, the step
        is taken again.
        """
        if not self.members:
            take_step(world, scene, dt, fastest)
            return
        self.retry.keep(world)
        tries = 1

        def settle() -> bool | None:
            nonlocal tries
            self.feel(world, dt)
            self.coupling.expect()
            if tries == MOST_TRIES or not self.yielded(dt, part[1]):
                return False
            # The room that bodies leave for water is what it was, but for what they yielded by.
            world.solids_version = world.room_version = self.solids.move_to(*part)
            if self.coupling.is_hit:
                tries += 1
                return None
            return True

        while True:
            synchronize()
            self.sums.clear()
            if take_step(world, scene, dt, fastest, settle):
                break
            self.retry.restore(world)
        self.feel(world, dt)
        self.coupling.end()

    def feel(self, world: World, dt: float) -> None:
        """Take what the water did to the bodies in a step of `dt` [s]."""
        synchronize()
        sums = self.sums.read().reshape(-1, PARTS)[self.numbers].astype(float)
        particle = blend(world.materials, self.scene).largest_density * self.scene.spacing**self.dim
        rows, coupling, wet = sums / self.units[:, None], self.coupling, self.wet_masses
        scale = self.levers * (particle / dt)
        cell = world.levels[0].dy if world.levels else 1.0
        coupling.immersed = np.minimum(1.0, rows[:, IMMERSION] * particle / (wet * cell))
        coupling.displaces = np.minimum(1.0, rows[:, DISPLACING] * particle / (wet * cell))
        keeps = (carried(dt, self.scene.frame_time) * coupling.keeps)[:, None]
        force = keeps * coupling.carried + rows[:, OF_GRID : OF_GRID + 6] * scale / dt
        most = LARGEST_CARRIED * float(np.linalg.norm(self.gravity)) * wet
        share = np.minimum(1.0, most / np.maximum(lengths(force[:, :3]), 1e-30))
        coupling.by_grid = force * share[:, None]
        coupling.impulse = rows[:, :6] * scale + force * dt
        if world.remembers_viscosity:
            each, spread = hold_on_bodies(blend(world.materials, self.scene), self.scene, dt)
            coupling.hold(rows[:, RUBBING] / self.scene.spacing * each, self.radii, self.scene.spacing, spread)

    def yielded(self, dt: float, share: float) -> bool:
        """Let bodies yield that were pushed by far more than in the step before; say whether any was.

        The step of `dt` [s] is then to be taken again: the water pushed as if the body could not give way.
        """
        slow = float(np.linalg.norm(self.gravity) * self.scene.spacing) ** 0.5
        if not self.coupling.yields(self.ends[1], slow, FAR * self.scene.spacing):
            return False
        for now, position in zip(self.solid_views, self.begun, strict=True):
            now.position = position
        for row, body in enumerate(self.members):
            if self._is_held(body):
                pose = isometry(self.engine, self.begins[0][row], self.begins[1][row])
                self.views[row].set_next_kinematic_position(pose)
        self._move(dt, share)
        return True

    def _is_held(self, body: Body) -> bool:
        return self._standing or body.solid.held or body.number in self.solids.targets

    @contextlib.contextmanager
    def standing(self) -> Iterator[None]:
        """Let all bodies stand where they are meanwhile, and keep their velocities."""
        own, self._standing = self.coupling.velocity.copy(), True
        try:
            yield
        finally:
            self._standing = False
            self.coupling.velocity = own

    def _hold(self, row: int, held: bool) -> None:
        """Let a body stay where it is, or is moved to; let it go as fast as it was moved."""
        kinds, now = self.engine.RigidBodyType, self.views[row]
        kind = kinds.KINEMATIC_POSITION_BASED if held else kinds.DYNAMIC
        if now.body_type != kind:
            now.body_type = kind
        if held:
            now.set_next_kinematic_position(isometry(self.engine, self.begins[0][row], self.begins[1][row]))

    def _stand(self) -> tuple[np.ndarray, np.ndarray]:
        """Return where the bodies are: places [n, 3] and rotations [n, 4]."""
        places, turns = zip(*[self.solids.poses[number] for number in self.numbers.tolist()], strict=True)
        return np.array(places), np.array(turns)

    # --- states ---

    def renewed(self, scene: Scene, solids: MovingSolids, density: float = 0.0) -> "Bodies":
        """Return the bodies among these solids; those that there were go on as they did, in fluids of that density."""
        bodies = Bodies(scene, solids, density or self.density)
        memories: Any = self.coupling.memory() if self.members else []
        for name, joint in bodies.joints.items():
            if name in self.joints:
                joint.take_over(self.joints[name])
        for body in bodies.members:
            for before, memory in zip(self.members, memories, strict=True):
                if before.name == body.name:
                    bodies.coupling.recall(body.row, memory)
                    body.velocity, body.angular_velocity = before.velocity, before.angular_velocity
        return bodies

    def arrays(self) -> dict[str, np.ndarray]:
        """Return all that decides how the bodies go on, for a snapshot."""
        if not self.members:
            return {}
        engine = np.frombuffer(self.world.snapshot(), np.uint8).copy()
        memory = self.coupling.memory()
        memory[:, -1, DENSITY] = self.density  # a state knows no fluids, only particles
        return {"bodies_memory": memory, "bodies_engine": engine}

    def resume(self, arrays: dict[str, np.ndarray]) -> None:
        """Go on from what `arrays` returned, with the same solids."""
        if not self.members:
            return
        try:
            self.world = self.engine.PhysicsWorld.restore(arrays["bodies_engine"].tobytes())
        except self.engine.SerializationError as error:
            raise WavetankError(f"the engine's state of the bodies cannot be read: {error}.") from None
        self._see()
        for row, memory in enumerate(arrays["bodies_memory"]):
            self.coupling.recall(row, memory)

    def check(self, poses: Sequence[Pose]) -> None:
        """Check that the engine, restored from a file, has the bodies where the solids are; raises `WavetankError`."""
        for name, joint in self.joints.items():
            if not joint.is_there:
                raise WavetankError(f"the engine's state lacks the joint {name!r}.")
        if not self.members:
            return
        for body, position, rotation in zip(self.members, *poses_of(self.views), strict=True):
            place, turn = poses[body.number]
            off = np.concatenate(
                [position - place, np.abs(rotation) - np.abs(turn), 0.0 * velocities_of([body.rigid()])[0]]
            )
            if not np.abs(off).max() <= 1e-3 * (1.0 + np.abs(place).max()):
                raise WavetankError(f"the engine's state of the body {body.name!r} is not that of the solid.")

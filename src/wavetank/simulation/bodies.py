"""Bodies: solids that water and other solids move. Contact, joints and motion are the engine's (Rapier).

A step of water sees bodies as it sees every solid, in the motion that the engine gave them for the step: no particle
passes them. What it did to them (`physics/reactions.py`) they get in the next step. That alone explodes where a body is
light: the water answers a push with more than the body weighs (Causin et al. 2005, 10.1016/j.cma.2004.12.005). So a
body is as heavy as the water that it takes along as well, and that part of its weight is pushed by what accelerated it
in the step before:

    (m + m_a) dv = P + m g dt + m_a dv_before

Where dv does not change, that is m dv = P + m g dt, whatever m_a is; what it adds to the momentum of one step it takes
from later ones. It is stable where m_a is more than half of what the water really adds (docs/bodies.md).

    code       symbol       meaning                                                     unit
    impulse    P            what the water gave in a step                               kg m/s, kg m^2/s
    added      m_a          mass of the water that goes along, by how much is immersed  kg
    change     dv_before    change of velocity in the step before                       m/s, rad/s
"""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from typing_extensions import override

from wavetank.device.compiler import download, upload
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.rotations import inverse, product, turned, unit_quaternion
from wavetank.physics.bodies import Pieces, Retry, new_pieces
from wavetank.physics.grid_pressure.correction import LARGEST_CARRIED, carried
from wavetank.physics.mixture import blend
from wavetank.physics.reactions import IMMERSION, OF_GRID
from wavetank.physics.step import step as take_step
from wavetank.physics.world import World
from wavetank.scene.scene import Scene
from wavetank.simulation.added_mass import added_mass
from wavetank.simulation.body import Body
from wavetank.simulation.colliders import shapes_of
from wavetank.simulation.joints import put_joint
from wavetank.simulation.moving_solids import MovingSolids
from wavetank.solids.distance import PARTS
from wavetank.solids.mass import Ruler, inertia_of, water_of
from wavetank.solids.motion import Pose
from wavetank.solids.solid import Solid

TOLERANCE = 0.1  # of sqrt(g d), or of the fastest body: change of a body's velocity that is worth a second step
MOST_TRIES = 3  # of a step
FEWEST = 6.0  # pieces across a body
LAYERS = 16.0  # particles that can press on a body at once, over those of a layer around its ball


def import_engine() -> Any:
    """Return the module of the engine; raise `WavetankError` where it is not installed."""
    try:
        import rapier3d
    except ImportError:
        raise WavetankError(
            "this scene has bodies, and these need the package rapier3d; install it with: pip install wavetank[bodies]"
        ) from None
    return rapier3d


class Bodies(Mapping[str, Body]):
    """All bodies of a world by name, and the engine that moves them; empty where no solid is a body."""

    def __init__(self, scene: Scene, solids: MovingSolids) -> None:
        self.scene, self.solids, self.dim = scene, solids, scene.dim
        self.members: list[Body] = []
        self.fastest = 0.0  # m/s
        self.retry = Retry()
        self.gravity = np.zeros(3)  # m/s^2, of the present step
        self.pieces: Pieces | None = None  # of all bodies, on the device
        solids.feeling, solids.passing = {}, {}
        if not any(solid.is_body for solid in solids.members):
            return
        self.density = blend(scene.materials_of(scene.kinds()), scene).largest_density
        self.engine = import_engine()
        self.world = self.engine.PhysicsWorld(gravity=(0.0, 0.0, 0.0))
        self.world.integration_parameters.length_unit = max(10.0 * scene.spacing, 1e-3)
        self.handles = [self._add(number, solid) for number, solid in enumerate(solids.members)]
        for joint in scene.joints:
            put_joint(self.engine, self.world, self.handles, solids, joint)
        solids.feel({body.number: (body.dry.center, body.unit) for body in self.members})
        self.pieces = self._pieces()

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

    def _add(self, number: int, solid: Solid) -> Any:
        engine, pose = self.engine, self.solids.poses[number]
        maker = engine.RigidBody.dynamic() if solid.is_body else engine.RigidBody.kinematic_position_based()
        maker = maker.position(self._isometry(*pose)).can_sleep(False)
        if self.dim == 2:
            maker = maker.enabled_translations((True, True, False)).enabled_rotations((False, False, True))
        else:
            maker = maker.gyroscopic_forces(True)
        handle = self.world.add_body(maker)
        friction = self.solids.friction if solid.friction is None else solid.friction
        for position, rotation, shape in shapes_of(solid, self.dim, self.scene.spacing):
            collider = engine.Collider.new(shape).position(self._isometry(position, rotation))
            self.world.add_collider(collider.density(0.0).friction(friction).restitution(solid.restitution), handle)
        if solid.is_body:
            self.members.append(self._body(number, solid, handle))
        return handle

    def _body(self, number: int, solid: Solid, handle: Any) -> Body:
        spacing, dim, density = self.scene.spacing, self.dim, self.density
        cut = Ruler(solid, dim, spacing).cut()
        dry, wet = inertia_of(solid, cut), water_of(cut, density)
        axes = tuple(map(float, wet.axes[3 - dim :]))
        mass, inertia = added_mass(axes)
        # Of one that is round nothing goes along, but for what is about an edge or a wall near by.
        inertia = inertia * wet.mass * max(axes) ** 2 + 2.0 * float(np.trace(wet.tensor)) / (3.0 if dim == 3 else 2.0)
        around = LAYERS * dim * (solid.reach() / spacing + 3.0) ** (dim - 1)
        unit = 2.0**31 / (4.0 * (wet.mass / (density * spacing**dim) + around) * spacing)
        body = Body(
            self.solids.names[number], number, solid, lambda: self.world.rigid_bodies[handle],
            lambda: self.solids.poses[number], dim, dry, wet, (mass * wet.mass, inertia), unit,
        )  # fmt: skip
        self._weigh(body)
        if solid.velocity is not None:
            body.velocity = solid.velocity
        if solid.angular_velocity is not None:
            spin = solid.angular_velocity
            body.angular_velocity = (0.0, 0.0, spin) if isinstance(spin, int | float) else spin
        return body

    def _weigh(self, body: Body) -> None:
        """Tell the engine the mass of a body and of the water that goes along."""
        added, inertia = (body.taken * part for part in body.added)
        moments, axes = np.linalg.eigh(body.dry.tensor + inertia * np.eye(3))
        if np.linalg.det(axes) < 0.0:
            axes[:, 0] = -axes[:, 0]
        frame = self.engine.Rotation3(*_quaternion(axes))
        mass = body.dry.mass + added
        properties = self.engine.MassProperties(body.dry.center.tolist(), mass, moments.tolist(), frame)
        body.rigid().set_additional_mass_properties(properties)

    def _pieces(self) -> Pieces:
        """Return the pieces of all bodies on the device."""
        spacing, table = self.scene.spacing, {}
        for body in self.members:
            edge = min(spacing, 2.0 * float(body.wet.axes[3 - self.dim]) / FEWEST)
            cut = Ruler(body.solid, self.dim, spacing).cut(edge)
            inside = cut.volumes > 0.0
            table[body.number] = (cut.places[inside], cut.edges, cut.volumes[inside] / spacing**self.dim)
        return new_pieces(table, max(body.solid.reach() for body in self.members))

    # --- a step ---

    def advance(self, gravity: tuple[float, ...], dt: float, share: float, fastest: float) -> None:
        """Move the bodies for a step of `dt` [s], which ends at a `share` of the frame; none is left faster [m/s]."""
        self.fastest, self.gravity = fastest, np.array([*gravity, 0.0][:3])
        for body in self.members:
            self._hold(body, self._is_held(body))
            self._weigh(body)
            impulse = body.impulse - body.early + body.taken * body.added_row * body.change
            impulse[:3] += body.dry.mass * self.gravity * (body.lasted or dt)
            self._push(body, impulse)
            self._limit(body)
        for number in self.solids.targets:
            pose = self._isometry(*self.solids.between(number, share))
            self.world.rigid_bodies[self.handles[number]].set_next_kinematic_position(pose)
        self.world.integration_parameters.dt = dt
        self.world.step()
        for body in self.members:
            velocity = self._velocity(body)
            body.change, body.velocity_row = velocity - body.velocity_row, velocity
            body.expected, body.early = body.impulse * (dt / (body.lasted or dt)), np.zeros(6)
            body.carried, body.lasted = body.by_grid, dt
            self._pass(body, self.solids.poses[body.number])

    def _push(self, body: Body, impulse: np.ndarray) -> None:
        """Give a body, and the water that goes along, an impulse [kg m/s, kg m^2/s].

        The engine would ask for masses that it takes over in its next step only.
        """
        added, inertia = (body.taken * part for part in body.added)
        velocity, rotation = self._velocity(body), self._pose(body)[1]
        spin = np.linalg.solve(body.dry.tensor + inertia * np.eye(3), turned(inverse(rotation), impulse[3:]))
        if self.dim == 2:
            spin[:2] = 0.0
        body.rigid().linvel = (velocity[:3] + impulse[:3] / (body.dry.mass + added)).tolist()
        body.rigid().angvel = (velocity[3:] + turned(rotation, spin)).tolist()

    def step(self, world: World, scene: Scene, dt: float, fastest: float, part: tuple[float, float]) -> None:
        """Let the water take a step of `dt` [s], which is that `part` of a frame.

        Where bodies are pushed harder than they were, it is taken again while they yield.
        """
        if not self.members:
            take_step(world, scene, dt, fastest)
            return
        self.retry.keep(world.particles, self.dim, world.count)
        for turn in range(MOST_TRIES):
            take_step(world, scene, dt, fastest)
            self.feel(world, dt)
            if turn + 1 == MOST_TRIES or not self.yielded(dt):
                break
            self.retry.restore(world.particles, world.count)
            world.solids_version = self.solids.move_to(*part)

    def feel(self, world: World, dt: float) -> None:
        """Take what the water did to the bodies in a step of `dt` [s]."""
        sums = download(world.solids.reaction).astype(float).reshape(-1, PARTS)
        upload(world.solids.reaction, np.zeros(sums.size, np.int32))
        particle = blend(world.materials, self.scene).largest_density * self.scene.spacing**self.dim
        share = carried(dt, self.scene.frame_time)
        limit = LARGEST_CARRIED * float(np.linalg.norm(self.gravity))
        cell = world.levels[0].dy if world.levels else 1.0
        for body in self.members:
            row = sums[body.number] / body.unit
            scale = np.repeat([1.0, body.solid.reach()], 3) * particle / dt
            direct, grid = row[:6] * scale, row[OF_GRID : OF_GRID + 6] * scale
            body.immersed = min(1.0, row[IMMERSION] * particle / (body.wet.mass * cell))
            force = share * body.carried + grid / dt
            body.by_grid = force * min(1.0, limit * body.wet.mass / max(float(np.linalg.norm(force[:3])), 1e-30))
            body.impulse = direct + force * dt

    def yielded(self, dt: float) -> bool:
        """Let bodies yield that were pushed by far more than in the step before; say whether any was.

        The step of `dt` [s] is then to be taken again: the water pushed as if the body could not give way.
        """
        fastest = max(float(np.linalg.norm(body.velocity_row[:3])) for body in self.members)
        slow = TOLERANCE * max(float(np.linalg.norm(self.gravity) * self.scene.spacing) ** 0.5, fastest)
        any_yielded = False
        for body in self.members:
            step = (body.impulse - body.expected - body.early) / (body.dry_row + body.taken * body.added_row)
            change = max(np.linalg.norm(step[:3]), np.linalg.norm(step[3:]) * body.solid.reach())
            if change > slow and not self._is_held(body):
                self._yield(body, step, dt)
                any_yielded = True
        return any_yielded

    def _yield(self, body: Body, step: np.ndarray, dt: float) -> None:
        """Let a body be faster by `step` [m/s, rad/s] in this step already."""
        rigid = body.rigid()
        body.early = body.early + body.dry_row * step
        rigid.linvel = (body.velocity_row[:3] + step[:3]).tolist()
        rigid.angvel = (body.velocity_row[3:] + step[3:]).tolist()
        self._limit(body)
        step, body.velocity_row = self._velocity(body) - body.velocity_row, self._velocity(body)
        position, rotation = self._pose(body)
        center = position + turned(rotation, body.dry.center)
        rotation = unit_quaternion([*(rotation + 0.5 * dt * product(np.array([0.0, *step[3:]]), rotation))])
        rigid.position = self._isometry(center + dt * step[:3] - turned(rotation, body.dry.center), rotation)
        self._pass(body, self.solids.passing[body.number][0])

    def _is_held(self, body: Body) -> bool:
        return body.solid.held or body.number in self.solids.targets

    def _hold(self, body: Body, held: bool) -> None:
        """Let a body stay where it is, or is moved to; let it go as fast as it was moved."""
        kinds, rigid = self.engine.RigidBodyType, body.rigid()
        kind = kinds.KINEMATIC_POSITION_BASED if held else kinds.DYNAMIC
        if rigid.body_type != kind:
            rigid.body_type = kind
        if held:
            rigid.set_next_kinematic_position(self._isometry(*self.solids.poses[body.number]))

    def _pass(self, body: Body, begin: Pose) -> None:
        self.solids.passing[body.number] = (begin, self._pose(body))
        self.solids.poses[body.number] = self._pose(body)

    def _limit(self, body: Body) -> None:
        """Keep a body's surface from being faster than the water may get."""
        velocity, rigid = self._velocity(body), body.rigid()
        speed, spin = np.linalg.norm(velocity[:3]), np.linalg.norm(velocity[3:]) * body.solid.reach()
        if speed > self.fastest:
            rigid.linvel = (velocity[:3] * (self.fastest / speed)).tolist()
        if spin > self.fastest:
            rigid.angvel = (velocity[3:] * (self.fastest / spin)).tolist()

    def _velocity(self, body: Body) -> np.ndarray:
        v, w = body.rigid().linvel, body.rigid().angvel
        return np.array([v.x, v.y, v.z, w.x, w.y, w.z])

    def _pose(self, body: Body) -> Pose:
        p, q = body.rigid().translation, body.rigid().rotation
        return np.array([p.x, p.y, p.z]), np.array([q.w, q.i, q.j, q.k])

    def _isometry(self, position: np.ndarray, rotation: np.ndarray) -> Any:
        return self.engine.Isometry3([*map(float, position)], self.engine.Rotation3(*map(float, rotation)))

    # --- states ---

    def renewed(self, scene: Scene, solids: MovingSolids) -> "Bodies":
        """Return the bodies among these solids; those that there were go on as they did."""
        bodies = Bodies(scene, solids)
        for body in bodies.members:
            before = next((other for other in self.members if other.name == body.name), None)
            if before is not None:
                body.recall(before.memory())
                body.velocity, body.angular_velocity = before.velocity, before.angular_velocity
        return bodies

    def arrays(self) -> dict[str, np.ndarray]:
        """Return all that decides how the bodies go on, for a snapshot."""
        if not self.members:
            return {}
        memories = np.stack([body.memory() for body in self.members])
        return {"bodies_memory": memories, "bodies_engine": np.frombuffer(self.world.snapshot(), np.uint8).copy()}

    def resume(self, arrays: dict[str, np.ndarray]) -> None:
        """Go on from what `arrays` returned, with the same solids."""
        if not self.members:
            return
        self.world = self.engine.PhysicsWorld.restore(arrays["bodies_engine"].tobytes())
        for body, memory in zip(self.members, arrays["bodies_memory"], strict=True):
            body.recall(memory)


def _quaternion(matrix: np.ndarray) -> tuple[float, ...]:
    """Return (w, x, y, z) of a rotation matrix (Bar-Itzhack 2000, 10.2514/2.4654)."""
    m = matrix
    whole = np.array([
        [m[0, 0] - m[1, 1] - m[2, 2], 0.0, 0.0, 0.0],
        [m[1, 0] + m[0, 1], m[1, 1] - m[0, 0] - m[2, 2], 0.0, 0.0],
        [m[2, 0] + m[0, 2], m[2, 1] + m[1, 2], m[2, 2] - m[0, 0] - m[1, 1], 0.0],
        [m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], np.trace(m)],
    ])  # fmt: skip
    x, y, z, w = np.linalg.eigh(whole / 3.0)[1][:, -1]
    return (float(w), float(x), float(y), float(z))

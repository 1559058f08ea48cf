"""Solids of a running world: names, poses, targets, growth, and their arrays on the device."""

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from typing_extensions import override

from wavetank.device.compiler import synchronize, upload
from wavetank.device.periods import NONE, Periods
from wavetank.foundation.arguments import KnownAttributes, array_of, read_only
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.model import FARTHEST
from wavetank.foundation.rotations import interpolate, inverse, matrix_of, turned, unit_quaternion
from wavetank.scene.fluids import Points
from wavetank.scene.scene import Scene
from wavetank.simulation.prescribed_motion import PrescribedMotions
from wavetank.simulation.state import SolidsState
from wavetank.solids.build import build, resize
from wavetank.solids.motion import Pose
from wavetank.solids.placing import Placing
from wavetank.solids.sampling import nearest_of
from wavetank.solids.seams import seen_periods
from wavetank.solids.solid import Solid

SMALLEST = 0.02  # initial size of a growing solid over its full size
PARTS = 4  # of a frame, in which the speed of a solid with a prescribed motion is sampled
Rows = tuple[np.ndarray, np.ndarray]  # positions [n, 3] and rotations [n, 4]
_versions = itertools.count(1)


class LiveSolid(KnownAttributes):
    """A solid of a running world by name, in `sim.solids`."""

    name: str

    def __init__(self, solids: "Solids", name: str) -> None:
        self.name, self._solids = name, solids

    def __repr__(self) -> str:
        return f"<solid {self.name!r} at {self.position.tolist()}>"

    @property
    def solid(self) -> Solid:
        """The shape and its properties, as the scene has them."""
        return self._solids.members[self._number]

    @property
    def position(self) -> np.ndarray:
        """Position of its frame [m], shape [dim]."""
        return self._copy("position", self._solids.poses[self._number][0][: self._solids.dim])

    @property
    def rotation(self) -> np.ndarray:
        """Rotation of its frame as a unit quaternion (w, x, y, z)."""
        return self._copy("rotation", self._solids.poses[self._number][1])

    @property
    def has_motion(self) -> bool:
        """Whether it has a prescribed motion, held or not."""
        return self._solids.has_motion(self.name)

    def move(self, position: Sequence[float] | None = None, rotation: Any = None) -> None:
        """Set the pose that it reaches at the end of the next frame; see `Solids.move`."""
        self._solids.move(self.name, position, rotation)

    def _copy(self, what: str, values: np.ndarray) -> np.ndarray:
        setter = f"sim.move({self.name!r}, {what}=...) moves it"
        return read_only(values.copy(), f"{what} of solid {self.name!r}", setter)

    @property
    def _number(self) -> int:
        return self._solids.find(self.name)


class Solids(Mapping[str, LiveSolid]):
    """The solids of a world by name: `sim.solids["cup"].position`; walls of the tank are not among them.

    In arrays and lists by number the first `tank_count` are the walls of the tank. Raises `WavetankError` for an
    unknown name.
    """

    def __init__(
        self,
        walls: Sequence[Solid],
        others: Sequence[Solid],
        dim: int,
        friction: float,
        spacing: float,
        start: float = 0.0,
        periods: Periods = NONE,
    ) -> None:
        """Place solids in a world with particles `spacing` [m] apart whose motions have time `start` [s] at first."""
        self.tank_count, self.dim, self.friction, self.spacing, self.periods = (
            len(walls),
            dim,
            friction,
            spacing,
            periods,
        )
        self.members = [*walls, *others]
        self.names: list[str] = []
        for solid in self.members:
            self.names.append(self._free_name(solid.name))
        self.poses: list[Pose] = [(solid.origin, solid.quaternion) for solid in self.members]
        self.motions = PrescribedMotions(self.members, self.names, start)
        for name in self.motions.names():
            self.poses[self.names.index(name)] = self.motions.pose(name, 0.0)
        self.starts = list(self.poses)  # at the start
        self.targets: dict[int, Pose] = {}  # at the end of the next frame
        self.growing: dict[int, tuple[float, float]] = {}  # age and time to grow [s]
        self.passing: tuple[np.ndarray, Rows, Rows] | None = (
            None  # bodies: numbers, poses at start and end of a time step
        )
        self.bodies: dict[int, tuple[np.ndarray, float, float]] = {}  # by number, see `set_bodies`
        self.version = 0  # of what is on the device
        self._tank_pose, self._tank = b"", np.zeros((0, 4))  # pose of the tank, and its planes there
        self.rebuild()

    @override
    def __getitem__(self, name: str) -> LiveSolid:
        self.find(name)
        return LiveSolid(self, name)

    @override
    def __contains__(self, name: object) -> bool:
        return name in self.names

    @override
    def __iter__(self) -> Iterator[str]:
        return iter(self.names[self.tank_count :])

    @override
    def __len__(self) -> int:
        return len(self.names) - self.tank_count

    def rebuild(self, members: list[Solid] | None = None) -> None:
        """Build the arrays on the device again, with solids at rest at their poses; `members` replace them, if given.

        Raises `WavetankError` and changes nothing where one of them cannot be built.
        """
        chosen = self.members if members is None else members
        reaches = [solid.span() for solid in chosen]
        repeats = self.periods.axes, seen_periods(chosen, self.periods, self.spacing)
        self.device = build(chosen, self.tank_count, self.friction, self.spacing, repeats)
        self._placing = Placing(self.device, len(chosen))
        self.members, self.reaches = chosen, reaches
        self.has_friction = self.friction > 0.0 or any(solid.friction for solid in chosen)
        self.walls = [solid.program()[0] for solid in chosen[: self.tank_count]]
        self._resize()
        self._upload(0.0, 0.0)

    def set_bodies(self, bodies: dict[int, tuple[np.ndarray, float, float]]) -> None:
        """Set which solids are bodies, on which the impulses of the water are summed.

        By number: centre of mass [m], `SolidSet.unit` [1/m] and `SolidSet.grip`.
        """
        self.bodies = bodies
        self._middles = np.array([*bodies], int), np.array([center for center, *_ in bodies.values()])
        units, grips = np.zeros(len(self.members), np.float32), np.ones(len(self.members), np.float32)
        for number, (_, unit, grip) in bodies.items():
            units[number], grips[number] = unit, grip
        upload(self.device.unit, units)
        upload(self.device.grip, grips)
        self._upload(0.0, 0.0)

    def add(self, solid: Solid, grow: float) -> str:
        """Add a solid that grows to its size within `grow` [s]; return its name.

        Raises `WavetankError` and changes nothing where it cannot be built.
        """
        name, number = self._free_name(solid.name), len(self.members)
        self.motions.add(solid, name)
        columns: tuple[tuple[list[Any], Any], ...] = (
            (self.names, name),
            (self.poses, (solid.origin, solid.quaternion)),
            (self.starts, (solid.origin, solid.quaternion)),
        )
        for column, value in columns:
            column.append(value)
        if grow > 0.0:
            self.growing[number] = (0.0, grow)
        try:
            self.rebuild([*self.members, solid])
        except BaseException:
            self.motions.forget(name)
            self.growing.pop(number, None)
            for column, _ in columns:
                del column[number:]
            raise
        return name

    def remove(self, number: int) -> None:
        """Remove a solid by its number."""

        def without(numbered: dict[int, Any]) -> dict[int, Any]:
            return {k - (k > number): value for k, value in numbered.items() if k != number}

        self.motions.forget(self.names[number])
        for column in (self.members, self.names, self.poses, self.starts):
            del column[number]
        self.targets, self.growing, self.bodies = without(self.targets), without(self.growing), {}
        self.rebuild()

    def closer_than(self, places: np.ndarray, distance: float) -> np.ndarray:
        """Return which `places` [n, dim] [m] are closer than `distance` [m] to a solid, or inside, bool [n]."""
        return nearest_of(self.device, self.tank_count, places)[0] < distance

    def reaches_into(self, scene: Scene) -> bool:
        """Return whether a solid may overlap fluids of a scene that start as a lattice."""
        boxes = [fluid.bounds() for fluid in scene.fluids if not isinstance(fluid, Points)]
        return any(self._touches(number, *box) for number in range(self.tank_count, len(self.members)) for box in boxes)

    def _touches(self, number: int, lower: np.ndarray, upper: np.ndarray) -> bool:
        """Return whether the bounding ball of a solid overlaps a box [m]."""
        center = self.poses[number][0][: len(lower)]
        return bool(np.linalg.norm(center - np.clip(center, lower, upper)) < self.members[number].reach())

    def find(self, name: str) -> int:
        """Return the number of a solid; raise `WavetankError` for an unknown name."""
        if name not in self.names:
            known = ", ".join(sorted(self.names[self.tank_count :])) or "none"
            raise WavetankError(f"there is no solid named {name!r}; named solids: {known}.")
        return self.names.index(name)

    def move(self, name: str, position: Sequence[float] | None = None, rotation: Any = None) -> None:
        """Set the pose that a solid reaches at the end of the next frame; its velocity follows.

        `position` [m] is that of the solid's frame (the centre of a box), `rotation` a quaternion (w, x, y, z) or an
        angle about z [rad]; None keeps the present one. Raises `WavetankError` for an unknown name or other numbers.
        """
        dim = self.dim
        number = self.find(name)
        old_position, old_rotation = self.targets.get(number, self.poses[number])
        point = np.array(old_position, float)
        if position is not None:
            values = array_of("position", position, float, f"[{dim}]")
            if values.shape != (dim,) or not (np.abs(values) <= FARTHEST).all():
                raise WavetankError(f"position = {position} must be {dim} finite numbers within {FARTHEST:g} [m].")
            point[:dim] = values
        if rotation is not None:
            array_of("rotation", rotation, float, "[4], a quaternion, or an angle [rad]")
        target = point, old_rotation if rotation is None else unit_quaternion(rotation)
        self.motions.hold(name)
        self.targets[number] = target

    def follow(self, time: float, duration: float) -> None:
        """Set the targets of solids with a prescribed motion for a frame of `duration` [s] from `time` [s] on."""
        motions = self.motions
        motions.begin_frame(time, duration)
        for name in motions.names():
            number, target = self.names.index(name), motions.pose(name, time + duration)
            if number in self.targets or not _equal(self.poses[number], target):
                self.targets[number] = target

    def has_motion(self, name: str) -> bool:
        """Return whether a solid has a prescribed motion, held or not."""
        return self.motions.has(name)

    def release(self, name: str, time: float, within: float) -> None:
        """Let a solid return to its motion `within` [s]; raises `WavetankError` where it has none."""
        number = self.find(name)
        self.motions.release(name, time, within, self.targets.get(number, self.poses[number]))

    def largest_speed(self, duration: float, tank_size: Sequence[float] | None) -> float:
        """Return the largest speed [m/s] of any point of a solid within the tank in a frame of `duration` [s]."""
        fastest = 0.0
        for number in self.targets:
            reach = self.reaches[number]
            if tank_size is not None:  # an infinite solid counts as far as the tank reaches
                reach = min(reach, float(np.linalg.norm(tank_size)))
            parts = PARTS if self.motions.follows(self.names[number]) else 1
            between = [self.between(number, part / parts) for part in range(1, parts)]
            poses = [self.poses[number], *between, self.targets[number]]
            for (old_position, old_rotation), (position, rotation) in itertools.pairwise(poses):
                turn = 2.0 * math.acos(min(1.0, abs(float(old_rotation @ rotation))))
                way = float(np.linalg.norm(position - old_position)) + turn * reach
                fastest = max(fastest, way * parts / duration)
        for number, (_, time) in self.growing.items():
            fastest = max(fastest, min(self.reaches[number], 1e3) / time)
        return fastest

    def move_to(self, begin: float, end: float) -> int:
        """Upload the poses at the shares `begin` and `end` of the frame; return their version.

        Versions are unique among all worlds.
        """
        if not self.targets and self.passing is None:
            return self.version
        self._upload(begin, end)
        resting = all(_equal(self.poses[number], target) for number, target in self.targets.items())
        if begin == 0.0 and resting:
            self.targets = {}
        return self.version

    def arrive(self) -> None:
        """End a frame: the targets are the poses."""
        for number, target in self.targets.items():
            self.poses[number] = target
        # A body without a target is free again.
        self.targets = {number: target for number, target in self.targets.items() if number not in self.bodies}
        self.motions.duration = 0.0

    def grow(self, duration: float) -> None:
        """Grow new solids for `duration` [s]."""
        if self.growing:
            self.growing = {k: (age + duration, time) for k, (age, time) in self.growing.items()}
            self._resize()
            self.growing = {k: (age, time) for k, (age, time) in self.growing.items() if age < time}

    def _resize(self) -> None:
        self.version = next(_versions)
        if self.growing:
            scales = [1.0] * len(self.members)
            for number, (age, time) in self.growing.items():
                scales[number] = min(1.0, max(age / time, SMALLEST))
            resize(self.device, self.members, scales)

    def _upload(self, begin: float, end: float) -> None:
        self.version = next(_versions)
        if not self.poses:
            return
        (old_at, old_turn), (at, turn) = (self._instant(share, last) for last, share in enumerate((begin, end)))
        sweep = np.stack([np.linalg.norm(at - old_at, axis=1), 2.0 * np.linalg.norm(turn - old_turn, axis=1)], axis=1)
        centers, planes = self._centers(at, turn), self._planes(at, turn)
        synchronize()
        self._placing.write(old_at, old_turn, at, turn, centers, planes, sweep)

    def state(self) -> SolidsState:
        """Return names, poses, targets, growth and motions, as `restored_solids` takes them."""
        return SolidsState(
            names=[*self.names],
            poses=[*self.poses],
            targets={**self.targets},
            growing={**self.growing},
            motions=self.motions.plain(),
        )

    def carried(self, name: str, place: Sequence[float]) -> np.ndarray:
        """Return where a place [m] is that has moved with the solid of that name from the start on, [dim].

        It stays where there is no solid of that name.
        """
        at = np.array(place, float)
        if name not in self.names:
            return at
        number = self.names.index(name)
        (start, start_turn), (now, turn) = self.starts[number], self.poses[number]
        own = turned(inverse(start_turn), np.append(at, 0.0)[:3] - start)
        moved: np.ndarray = (now + turned(turn, own))[: len(at)]
        return moved

    def between(self, number: int, share: float) -> Pose:
        """Return the pose of a solid after a share of the frame: by its motion, or between pose and target."""
        (place, turn), (goal, goal_turn) = self.poses[number], self.targets.get(number, self.poses[number])
        if (
            self.motions.duration
            and 0.0 < share < 1.0
            and number in self.targets
            and self.motions.follows(self.names[number])
        ):
            return self.motions.pose(self.names[number], self.motions.frame_start + share * self.motions.duration)
        return place + share * (goal - place), interpolate(turn, goal_turn, share)

    def _instant(self, share: float, last: int) -> Rows:
        """Return all poses at a `share` of the frame; those of bodies at the start or the end (`last`) of a step."""
        places, turns = ([pose[part] for pose in self.poses] for part in range(2))
        for number in self.targets:
            places[number], turns[number] = self.between(number, share)
        at, turn = np.concatenate(places).reshape(-1, 3), np.concatenate(turns).reshape(-1, 4)
        if self.passing:
            numbers, *ends = self.passing
            at[numbers], turn[numbers] = ends[last]
        return at, turn

    def _centers(self, positions: np.ndarray, rotations: np.ndarray) -> np.ndarray:
        """Return the centres of mass [m] at these poses, [n, 3]."""
        centers = positions.copy()
        if self.bodies:
            numbers, own = self._middles
            centers[numbers] += (matrix_of(rotations[numbers]) @ own[..., None])[..., 0]
        return centers

    def _planes(self, positions: np.ndarray, rotations: np.ndarray) -> np.ndarray:
        """Return (normal n, offset b) of the tank's walls at these poses, [tank_count, 4]: distances are n x + b."""
        pose = positions[: self.tank_count].tobytes() + rotations[: self.tank_count].tobytes()
        if pose == self._tank_pose:  # as in most steps
            return self._tank
        planes = np.zeros((self.tank_count, 4))
        for k, wall in enumerate(self.walls):
            normal = turned(rotations[k], turned(wall.turn, np.array([0.0, 1.0, 0.0])))
            point = positions[k] + turned(rotations[k], wall.offset)
            planes[k] = *normal, -normal @ point
        self._tank_pose, self._tank = pose, planes
        return planes

    def _free_name(self, name: str) -> str:
        """Return `name`, or the first free one of "solid 1", "solid 2" and so on."""
        number = 1
        while not name or name in self.names:
            name, number = f"solid {number}", number + 1
        return name


def solids_of(scene: Scene, walls: Sequence[Solid], others: Sequence[Solid]) -> Solids:
    """Return the solids `walls` of the tank and `others` in the world of `scene`."""
    periods = scene.tank.periods() if scene.tank else NONE
    return Solids(walls, others, scene.dim, scene.friction, scene.spacing, scene.start_time, periods)


def restored_solids(scene: Scene, walls: Sequence[Solid], state: SolidsState, others: Sequence[Solid]) -> Solids:
    """Return the solids of a state at their poses."""
    solids = solids_of(scene, walls, others)
    solids.names, solids.poses = [*state.names], [*state.poses]
    solids.targets, solids.growing = {**state.targets}, {**state.growing}
    solids.motions.read(state.motions)
    solids.rebuild()
    return solids


def _equal(a: Pose, b: Pose) -> bool:
    return np.array_equal(a[0], b[0]) and np.array_equal(a[1], b[1])

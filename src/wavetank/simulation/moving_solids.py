"""The solids of a running world: their names, where they are, where they are going, and their way to the device."""

import itertools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from wavetank.device.compiler import synchronize, upload
from wavetank.device.periods import NONE, Periods
from wavetank.device.state import Particles
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.rotations import interpolate, matrix_of, turned, unit_quaternion
from wavetank.physics.population import Clearance, free_places
from wavetank.scene.fluids import Points
from wavetank.scene.scene import Scene
from wavetank.simulation.carving import outside
from wavetank.simulation.courses import Courses
from wavetank.solids import shapes
from wavetank.solids.motion import Pose
from wavetank.solids.placing import Placing
from wavetank.solids.sampling import nearest_of
from wavetank.solids.seams import seen_periods
from wavetank.solids.solid import Solid

SMALLEST = 0.02  # size at which a growing solid starts, of its full size
PARTS = 4  # of a frame, in which the speed of a solid on a course is looked at
Rows = tuple[np.ndarray, np.ndarray]  # places [n, 3] and rotations [n, 4]
_versions = itertools.count(1)


class MovingSolids:
    """Solids by name; the first `tank_count` are the walls of the tank."""

    def __init__(
        self,
        walls: Sequence[Solid],
        others: Sequence[Solid],
        friction: float,
        spacing: float,
        start: float = 0.0,
        periods: Periods = NONE,
    ) -> None:
        self.tank_count, self.friction, self.spacing, self.periods = len(walls), friction, spacing, periods
        self.members = [*walls, *others]
        self.names: list[str] = []
        for solid in self.members:
            self.names.append(self._free_name(solid.name))
        self.poses: list[Pose] = [(solid.origin, solid.quaternion) for solid in self.members]
        self.courses = Courses(self.members, self.names, start)
        for name in self.courses.names():
            self.poses[self.names.index(name)] = self.courses.pose(name, 0.0)
        self.starts = list(self.poses)  # where they began
        self.targets: dict[int, Pose] = {}  # at the end of the next frame
        self.growing: dict[int, tuple[float, float]] = {}  # age and time to grow [s]
        self.passing: tuple[np.ndarray, Rows, Rows] | None = None  # bodies: numbers, begin and end of a time step
        self.feeling: dict[int, tuple[np.ndarray, float, float]] = {}  # of bodies, see `feel`
        self.version = 0  # of what is on the device
        self._stand, self._tank = b"", np.zeros((0, 4))  # how the tank stands, and its planes then
        self.rebuild()

    def rebuild(self, members: list[Solid] | None = None) -> None:
        """Put all on the device anew, at rest where they are; with `members`, these from now on.

        Raises `WavetankError` and changes nothing where one of them cannot be built.
        """
        chosen = self.members if members is None else members
        reaches = [solid.span() for solid in chosen]
        repeats = self.periods.axes, seen_periods(chosen, self.periods, self.spacing)
        self.device = shapes.build(chosen, self.tank_count, self.friction, self.spacing, repeats)
        self._placing = Placing(self.device, len(chosen))
        self.members, self.reaches = chosen, reaches
        self.has_friction = self.friction > 0.0 or any(solid.friction for solid in chosen)
        self.walls = [solid.program()[0] for solid in chosen[: self.tank_count]]
        self._resize()
        self._upload(0.0, 0.0)

    def feel(self, feeling: dict[int, tuple[np.ndarray, float, float]]) -> None:
        """Let bodies feel what the water does to them.

        By number: centre of mass [m], `SolidSet.unit` [1/m] and `SolidSet.grip`.
        """
        self.feeling = feeling
        self._middles = np.array([*feeling], int), np.array([center for center, *_ in feeling.values()])
        units, grips = np.zeros(len(self.members), np.float32), np.ones(len(self.members), np.float32)
        for number, (_, unit, grip) in feeling.items():
            units[number], grips[number] = unit, grip
        upload(self.device.unit, units)
        upload(self.device.grip, grips)
        self._upload(0.0, 0.0)

    def add(self, solid: Solid, grow: float) -> str:
        """Add a solid that swells to its size within `grow` [s]; return its name.

        Raises `WavetankError` and changes nothing where it cannot be built.
        """
        name, number = self._free_name(solid.name), len(self.members)
        self.courses.add(solid, name)
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
            self.courses.forget(name)
            self.growing.pop(number, None)
            for column, _ in columns:
                del column[number:]
            raise
        return name

    def remove(self, number: int) -> None:
        """Take a solid away."""

        def without(numbered: dict[int, Any]) -> dict[int, Any]:
            return {k - (k > number): value for k, value in numbered.items() if k != number}

        self.courses.forget(self.names[number])
        for column in (self.members, self.names, self.poses, self.starts):
            del column[number]
        self.targets, self.growing, self.feeling = without(self.targets), without(self.growing), {}
        self.rebuild()

    def find_free_places(self, scene: Scene, places: np.ndarray, particles: Particles, *, clear: bool) -> np.ndarray:
        """Say which `places` [n, dim] of a scene's fluids are outside of solids, bool [n]; those of `Points` stay.

        Either what is as far from all as water stays, `clear`, or as much as there is room for, some of it nearer.
        Raises `WavetankError` where none is.
        """
        if not self.reaches_into(scene):
            return np.ones(len(places), bool)
        if clear:
            clearance = Clearance(0.0, scene.wall_gap * scene.spacing, self.tank_count)
            free = free_places(places, particles, self.device, 0, clearance)
        else:
            free = outside(scene, places, self.device, self.tank_count)
        free |= scene.has_own_place()
        if not free.any():
            raise WavetankError("the fluids of this scene are inside of its solids; move them, or make them larger.")
        return free

    def nearer(self, places: np.ndarray, way: float) -> np.ndarray:
        """Say which `places` [n, dim] are nearer than `way` [m] to a solid, or in it, bool [n]."""
        return nearest_of(self.device, self.tank_count, places)[0] < way

    def reaches_into(self, scene: Scene) -> bool:
        """Say whether a solid may reach into fluids of a scene that are filled by rows."""
        boxes = [fluid.bounds() for fluid in scene.fluids if not isinstance(fluid, Points)]
        return any(self._touches(number, *box) for number in range(self.tank_count, len(self.members)) for box in boxes)

    def _touches(self, number: int, lower: np.ndarray, upper: np.ndarray) -> bool:
        """Say whether the ball around a solid reaches into a box [m]."""
        center = self.poses[number][0][: len(lower)]
        return bool(np.linalg.norm(center - np.clip(center, lower, upper)) < self.members[number].reach())

    def find(self, name: str) -> int:
        """Return the number of a solid; raise `WavetankError` for an unknown name."""
        if name not in self.names:
            known = ", ".join(sorted(self.names[self.tank_count :])) or "none"
            raise WavetankError(f"there is no solid named {name!r}; named solids: {known}.")
        return self.names.index(name)

    def aim(self, name: str, position: Sequence[float] | None, rotation: Any, dim: int) -> None:
        """Set the pose that a solid reaches at the end of the next frame; None keeps what is."""
        number = self.find(name)
        self.courses.hold(name)
        old_position, old_rotation = self.targets.get(number, self.poses[number])
        point = np.array(old_position, float)
        if position is not None:
            values = np.asarray(position, float)
            if values.shape != (dim,) or not np.isfinite(values).all():
                raise WavetankError(f"position = {position} must be {dim} finite numbers.")
            point[:dim] = values
        self.targets[number] = (point, old_rotation if rotation is None else unit_quaternion(rotation))

    def follow(self, time: float, duration: float) -> None:
        """Let the solids that move by themselves aim at where they are after the frame of `duration` [s]."""
        courses = self.courses
        courses.begin_frame(time, duration)
        for name in courses.names():
            number, target = self.names.index(name), courses.pose(name, time + duration)
            if number in self.targets or not _equal(self.poses[number], target):
                self.targets[number] = target

    def moves_itself(self, name: str) -> bool:
        """Say whether a solid has a motion, be it held or not."""
        return self.courses.has(name)

    def release(self, name: str, time: float, within: float) -> None:
        """Give a solid back to its motion."""
        number = self.find(name)
        self.courses.release(name, time, within, self.targets.get(number, self.poses[number]))

    def largest_speed(self, duration: float, tank_size: Sequence[float] | None) -> float:
        """Return the largest speed [m/s] at which any solid moves through the tank in a frame of `duration` [s]."""
        fastest = 0.0
        for number in self.targets:
            reach = self.reaches[number]
            if tank_size is not None:  # what is endless is felt as far as the tank is large
                reach = min(reach, float(np.linalg.norm(tank_size)))
            parts = PARTS if self.courses.follows(self.names[number]) else 1
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
        """Put the poses at the shares `begin` and `end` of the frame on the device, and return the version of those.

        No two versions of any world's solids have the same number.
        """
        if not self.targets and self.passing is None:
            return self.version
        self._upload(begin, end)
        resting = all(_equal(self.poses[number], target) for number, target in self.targets.items())
        if begin == 0.0 and resting:
            self.targets = {}
        return self.version

    def arrive(self) -> None:
        """End a frame: what was aimed at is where the solids are."""
        for number, target in self.targets.items():
            self.poses[number] = target
        # A body that is not moved any more is free.
        self.targets = {number: target for number, target in self.targets.items() if number not in self.feeling}
        self.courses.duration = 0.0

    def grow(self, duration: float) -> None:
        """Let new solids swell for `duration` [s]."""
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
            shapes.resize(self.device, self.members, scales)

    def _upload(self, begin: float, end: float) -> None:
        self.version = next(_versions)
        if not self.poses:
            return
        (old_at, old_turn), (at, turn) = (self._instant(share, last) for last, share in enumerate((begin, end)))
        sweep = np.stack([np.linalg.norm(at - old_at, axis=1), 2.0 * np.linalg.norm(turn - old_turn, axis=1)], axis=1)
        centers, planes = self._centers(at, turn), self._planes(at, turn)
        synchronize()
        self._placing.write(old_at, old_turn, at, turn, centers, planes, sweep)

    def between(self, number: int, share: float) -> Pose:
        """Return where a solid is after a share of the present frame: on its course, or on the straight way."""
        (place, turn), (goal, goal_turn) = self.poses[number], self.targets.get(number, self.poses[number])
        if (
            self.courses.duration
            and 0.0 < share < 1.0
            and number in self.targets
            and self.courses.follows(self.names[number])
        ):
            return self.courses.pose(self.names[number], self.courses.began + share * self.courses.duration)
        return place + share * (goal - place), interpolate(turn, goal_turn, share)

    def _instant(self, share: float, last: int) -> Rows:
        """Return all poses at a `share` of the frame; those of bodies at the begin of a time step, or its `last`."""
        places, turns = ([pose[part] for pose in self.poses] for part in range(2))
        for number in self.targets:
            places[number], turns[number] = self.between(number, share)
        at, turn = np.concatenate(places).reshape(-1, 3), np.concatenate(turns).reshape(-1, 4)
        if self.passing:
            numbers, *ends = self.passing
            at[numbers], turn[numbers] = ends[last]
        return at, turn

    def _centers(self, positions: np.ndarray, rotations: np.ndarray) -> np.ndarray:
        """Return where the centres of mass are at these poses, [n, 3]."""
        centers = positions.copy()
        if self.feeling:
            numbers, own = self._middles
            centers[numbers] += (matrix_of(rotations[numbers]) @ own[..., None])[..., 0]
        return centers

    def _planes(self, positions: np.ndarray, rotations: np.ndarray) -> np.ndarray:
        """Return (normal, offset) of the tank's walls at these poses, [tank_count, 4]: the distance is n x + b."""
        stand = positions[: self.tank_count].tobytes() + rotations[: self.tank_count].tobytes()
        if stand == self._stand:  # as in most steps
            return self._tank
        planes = np.zeros((self.tank_count, 4))
        for k, wall in enumerate(self.walls):
            normal = turned(rotations[k], turned(wall.turn, np.array([0.0, 1.0, 0.0])))
            point = positions[k] + turned(rotations[k], wall.offset)
            planes[k] = *normal, -normal @ point
        self._stand, self._tank = stand, planes
        return planes

    def _free_name(self, name: str) -> str:
        """Return `name`, or the first free one of "solid 1", "solid 2" and so on."""
        number = 1
        while not name or name in self.names:
            name, number = f"solid {number}", number + 1
        return name


def solids_of(scene: Scene, walls: Sequence[Solid], others: Sequence[Solid]) -> MovingSolids:
    """Return these solids, the walls of the tank first, in the world of `scene`."""
    periods = scene.tank.periods() if scene.tank else NONE
    return MovingSolids(walls, others, scene.friction, scene.spacing, scene.start_time, periods)


def _equal(a: Pose, b: Pose) -> bool:
    return np.array_equal(a[0], b[0]) and np.array_equal(a[1], b[1])

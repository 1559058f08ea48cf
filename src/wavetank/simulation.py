"""A running world: the public face of the solver."""

import math
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from wavetank import compiler, solids
from wavetank.errors import WavetankError
from wavetank.frame import Frame
from wavetank.params import LIVE
from wavetank.physics import measure
from wavetank.physics.neighbors import new_grid
from wavetank.physics.smoothing import half_space_table
from wavetank.physics.step import World, largest_speed, step, update_densities
from wavetank.rotations import interpolate, unit_quaternion
from wavetank.scene import Scene
from wavetank.state import Walls, new_particles, new_scratch, upload, vectors


class Simulation:
    """Water that moves. See `Scene` for what it is made of."""

    def __init__(self, scene: Scene, arch: str = "cpu") -> None:
        compiler.start(arch)
        self.arch = compiler.current_backend()
        self.scene = scene.model_copy(deep=True)
        self.reset()

    def reset(self) -> None:
        """Put everything back to the start of the scene."""
        positions, velocities = self.scene.particles()
        self._fill(positions, velocities, np.arange(len(positions)))
        self.time, self.frame_number, self._owed = 0.0, 0, 0.0
        self._seconds_per_frame = math.nan

    def _fill(self, positions: np.ndarray, velocities: np.ndarray, ids: np.ndarray) -> None:
        scene, count, dim = self.scene, len(positions), self.scene.dim
        h = scene.support * scene.spacing
        tank = scene.tank
        table = half_space_table(scene.kernel, dim, scene.support)
        walls = Walls(vectors(2, len(table)))
        upload(walls.table, table)
        members = [*(tank.walls() if tank else []), *scene.solids]
        self._names = {solid.name: number for number, solid in enumerate(members) if solid.name}
        self._poses = [(solid.origin, solid.quaternion) for solid in members]
        self._reaches = [solid.reach() for solid in members]
        self._targets: dict[int, tuple[np.ndarray, np.ndarray]] = {}
        self.world = World(
            particles=new_particles(dim, count),
            spare=new_particles(dim, count),
            scratch=new_scratch(count),
            grid=new_grid(dim, count, tank.size if tank else None, h, _list_room(dim, scene.support)),
            solids=solids.build(members, 2 * dim if tank else 0, scene.friction),
            walls=walls,
            count=count,
            has_friction=scene.friction > 0.0 or any(solid.friction for solid in members),
        )
        upload(self.world.particles.x, positions)
        upload(self.world.particles.p, positions)
        upload(self.world.particles.v, velocities)
        upload(self.world.particles.id, ids)
        self._fastest_start = float(np.linalg.norm(velocities, axis=1).max(initial=0.0))
        self._fastest_solid = 0.0
        self._outdated = True

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

    def frames(self, seconds: float, fps: float = 60.0) -> Iterator[Frame]:
        """Yield the present frame and then one every 1 / `fps` until `seconds` of water have passed."""
        if not (math.isfinite(fps) and fps > 0):
            raise WavetankError(f"fps = {fps} is not allowed; it must be a positive number.")
        start = self.time
        yield self.frame()
        for number in range(1, round(seconds * fps) + 1):
            self.advance(max(0.0, start + number / fps - self.time - self._owed))
            yield self.frame()

    def _advance_frame(self, duration: float) -> None:
        began = time.perf_counter()
        limit = self._speed_limit(duration)
        substeps = self._substeps(duration)
        for part in range(substeps):
            self._move_solids(part / substeps, (part + 1) / substeps)
            if self.count:
                step(self.world, self.scene, duration / substeps, limit)
        for number, target in self._targets.items():
            self._poses[number] = target
        compiler.synchronize()
        self._seconds_per_frame = time.perf_counter() - began
        self.time += duration
        self.frame_number += 1
        self._outdated = True

    def _substeps(self, duration: float) -> int:
        """Return the number of time steps for `duration` [s]: the usual rate, or what the fastest needs (CFL)."""
        scene = self.scene
        usual = scene.substeps * duration / scene.frame_time
        fastest = self._solid_speed(duration)
        if self.count:
            fastest = max(fastest, largest_speed(self.world))
        fastest += duration * math.hypot(*scene.gravity)
        needed = fastest * duration / (scene.courant * scene.spacing)
        return max(1, math.ceil(usual - 1e-6), min(math.ceil(needed), scene.largest_substeps))

    def _solid_speed(self, duration: float) -> float:
        """Return the largest speed [m/s] at which any solid moves through the tank in this frame."""
        fastest = 0.0
        for number, (position, rotation) in self._targets.items():
            old_position, old_rotation = self._poses[number]
            turn = 2.0 * math.acos(min(1.0, abs(float(old_rotation @ rotation))))
            reach = float(np.linalg.norm(self.scene.tank.size)) if self.scene.tank else self._reaches[number]
            fastest = max(fastest, (float(np.linalg.norm(position - old_position)) + turn * reach) / duration)
        return fastest

    def _speed_limit(self, duration: float) -> float:
        """Return the largest speed [m/s] that gravity, the start and the solids can have given to a particle.

        That is the speed of a free fall through the tank, above the fastest particle at the start and the fastest
        solid so far. Without a tank a fall has no end, and neither has the limit.
        """
        if self.scene.tank is None:
            return math.inf
        self._fastest_solid = max(self._fastest_solid, self._solid_speed(duration))
        fall = sum(2.0 * abs(g) * edge for g, edge in zip(self.scene.gravity, self.scene.tank.size, strict=True))
        given = math.sqrt(fall + self._fastest_start**2) + 2.0 * self._fastest_solid
        return self.scene.speed_limit * max(given, 1e-6)

    # --- solids ---

    def move(self, name: str, position: Sequence[float] | None = None, rotation: Any = None) -> None:
        """Set the pose that the solid `name` reaches at the end of the next frame; its velocity follows.

        `position` [m] is that of the solid's frame (the centre of a box), `rotation` a quaternion (w, x, y, z) or an
        angle about z [rad]; None keeps what is.
        """
        if name not in self._names:
            known = ", ".join(sorted(n for n in self._names if not n.startswith("tank "))) or "none"
            raise WavetankError(f"there is no solid named {name!r}; named solids: {known}.")
        number = self._names[name]
        old_position, old_rotation = self._targets.get(number, self._poses[number])
        point = np.array(old_position, float)
        if position is not None:
            values = np.asarray(position, float)
            if values.shape != (self.scene.dim,) or not np.isfinite(values).all():
                raise WavetankError(f"position = {position} must be {self.scene.dim} finite numbers.")
            point[: self.scene.dim] = values
        self._targets[number] = (point, old_rotation if rotation is None else unit_quaternion(rotation))

    def _move_solids(self, begin: float, end: float) -> None:
        """Put the solids' poses at the shares `begin` and `end` of the frame on the device."""
        if not self._targets:
            return
        where = [*self._poses]
        for number, (position, rotation) in self._targets.items():
            where[number] = (position, rotation)
        for share, positions, rotations in (
            (begin, self.world.solids.old_position, self.world.solids.old_rotation),
            (end, self.world.solids.position, self.world.solids.rotation),
        ):
            pairs = list(zip(self._poses, where, strict=True))
            upload(positions, np.array([a[0] + share * (b[0] - a[0]) for a, b in pairs], np.float32))
            upload(rotations, np.array([interpolate(a[1], b[1], share) for a, b in pairs], np.float32))
        if begin == 0.0 and all(np.array_equal(a[0], b[0]) and np.array_equal(a[1], b[1])
                                for a, b in zip(self._poses, where, strict=True)):  # fmt: skip
            self._targets = {}

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

    def frame(self) -> Frame:
        """Return this instant for a viewer or an exporter; valid until the water moves on."""
        self._measure()
        world = self.world
        return Frame(
            scene=self.scene, number=self.frame_number, time=self.time, count=world.count, x=world.particles.x,
            v=world.particles.v, rho=world.scratch.rho, id=world.particles.id, solids=world.solids,
        )  # fmt: skip

    def stats(self) -> dict[str, float]:
        """Measure this instant; see `physics.measure.statistics` for the keys."""
        frame = self.frame()
        neighbors = self.world.grid.number.to_numpy()[: self.count]
        figures = measure.statistics(frame.positions, frame.velocities, frame.densities, neighbors, self.scene)
        return {
            "time": self.time,
            "frame": self.frame_number,
            **figures,
            "milliseconds_per_frame": 1e3 * self._seconds_per_frame,
        }

    def _measure(self) -> None:
        """Renew neighbours and densities for the positions as they are."""
        if not self._outdated:
            return
        if self.count:
            update_densities(self.world, self.scene)
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
            super().__setattr__(name, value)

    # --- files ---

    def save(self, path: str | Path) -> None:
        """Write the whole state to an .npz file, replaced in one move; `restore` continues from it exactly."""
        frame, target = self.frame(), Path(path)
        partial = target.with_name(target.name + ".partial")
        with partial.open("wb") as file:
            np.savez(
                file, format=1, scene=self.scene.model_dump_json(exclude={"fluids"}), positions=frame.positions,
                velocities=frame.velocities, time=self.time, frame_number=self.frame_number, owed=self._owed,
                solid_positions=np.array([p[0] for p in self._poses]).reshape(-1, 3),
                solid_rotations=np.array([p[1] for p in self._poses]).reshape(-1, 4),
                moving=np.array(sorted(self._targets), int),
                targets=np.array([np.concatenate(self._targets[k]) for k in sorted(self._targets)]).reshape(-1, 7),
            )  # fmt: skip
        partial.replace(target)

    @classmethod
    def restore(cls, path: str | Path, arch: str = "cpu") -> "Simulation":
        """Continue from a file that `save` wrote, bit for bit on the same back end."""
        try:
            with np.load(path, allow_pickle=False) as file:
                data = {name: file[name] for name in file.files}
            scene = Scene.model_validate_json(str(data["scene"]))
            self = cls(scene, arch)
            self._fill(data["positions"], data["velocities"], np.arange(len(data["positions"])))
            self.time, self.frame_number = float(data["time"]), int(data["frame_number"])
            self._owed = float(data["owed"])
            self._poses = list(zip(data["solid_positions"], data["solid_rotations"], strict=True))
            self._targets = {int(k): (row[:3], row[3:]) for k, row in zip(data["moving"], data["targets"], strict=True)}
        except (OSError, KeyError, ValueError) as error:
            raise WavetankError(f"{path}: this is not a state that `Simulation.save` wrote: {error}.") from None
        solid_set = self.world.solids
        for positions, rotations in (
            (solid_set.position, solid_set.rotation), (solid_set.old_position, solid_set.old_rotation),
        ):  # fmt: skip
            upload(positions, data["solid_positions"].astype(np.float32))
            upload(rotations, data["solid_rotations"].astype(np.float32))
        return self


def _list_room(dim: int, support: float) -> int:
    """Places of a neighbour list at the start: a third more than the rest lattice has, in whole cache lines."""
    volume = math.pi * support**2 if dim == 2 else 4.0 / 3.0 * math.pi * support**3
    return 16 * math.ceil(1.33 * volume / 16) + 16

"""A whole running world as plain arrays: what saving, rewinding and bookmarks keep, to the last bit."""

import dataclasses
import hashlib
import json
import zlib
from typing import Any

import numpy as np

from wavetank.device.compiler import download, upload
from wavetank.device.state import LASTING
from wavetank.physics.foam.pool import pool_from, pool_rows
from wavetank.physics.world import World
from wavetank.scene.scene import Scene
from wavetank.simulation.ledger import Ledger
from wavetank.simulation.moving_solids import MovingSolids, solids_of
from wavetank.solids.motion import Pose
from wavetank.solids.solid import Solid

ARRAYS = LASTING  # of the particles, in device order
VISCOUS = "viscous"  # the same, where there are viscous fluids
SAMPLE, WORTH = 1024, 0.8  # bytes; the share of these that must be left for packing to be worth it


@dataclasses.dataclass(frozen=True)
class Numbers:
    """How much there is."""

    frozen_count: int  # particles that are ice
    foam_born: int  # since the start; -1 where there was no foam yet
    foam_capacity: int


@dataclasses.dataclass(frozen=True)
class Snapshot:
    """One instant of a world, on the host."""

    ledger: Ledger
    numbers: Numbers
    arrays: dict[str, np.ndarray]  # of the particles, see ARRAYS and VISCOUS, and of foam, names begin with foam_
    solids: list[Solid]  # but for the walls of the tank
    names: list[str]
    poses: list[Pose]  # of all solids, the walls of the tank first, as names, targets and growing
    targets: dict[int, Pose]
    growing: dict[int, tuple[float, float]]
    courses: dict[str, Any]  # of solids that move by themselves, which a hand holds and which are on their way back
    sources: dict[str, Any] = dataclasses.field(default_factory=dict)  # of emitters and drains

    @property
    def time(self) -> float:
        """Seconds of water since the start [s]."""
        return float(self.ledger.time)

    @property
    def is_finite(self) -> bool:
        """Whether all of its numbers are numbers, with squares."""
        return all(bool((np.abs(rows) < 1e18).all()) for rows in self.arrays.values() if rows.dtype.kind == "f")


def take_snapshot(scene: Scene, world: World, solids: MovingSolids, ledger: Ledger) -> Snapshot:
    """Return this instant of a running world."""
    particles, pool = world.particles, world.pool
    names = (*ARRAYS, VISCOUS) if world.remembers_viscosity else ARRAYS
    return Snapshot(
        ledger=ledger.copy(),
        numbers=Numbers(
            frozen_count=world.frozen, foam_born=pool.born if pool else -1, foam_capacity=pool.capacity if pool else 0
        ),
        arrays={name: download(getattr(particles, name))[: world.count].copy() for name in names}
        | pool_rows(pool, scene.dim),
        solids=[*scene.solids],
        names=[*solids.names],
        poses=[*solids.poses],
        targets={**solids.targets},
        growing={**solids.growing},
        courses=solids.courses.plain(),
    )


def restore_solids(scene: Scene, walls: list[Solid], snapshot: Snapshot) -> MovingSolids:
    """Return the solids of an instant, where they were."""
    solids = solids_of(scene, walls, snapshot.solids)
    solids.names, solids.poses = [*snapshot.names], [*snapshot.poses]
    solids.targets, solids.growing = {**snapshot.targets}, {**snapshot.growing}
    solids.courses.read(snapshot.courses)
    solids.rebuild()
    return solids


def put_particles(snapshot: Snapshot, scene: Scene, world: World, capacity: int) -> None:
    """Put the particles and the foam of an instant into a world that has room for `capacity` particles."""
    for name in ARRAYS:
        upload(getattr(world.particles, name), snapshot.arrays[name])
    if VISCOUS in snapshot.arrays or world.remembers_viscosity:
        world.remember_viscosity(snapshot.arrays.get(VISCOUS, np.zeros(0)))
    world.materials = scene.materials_of(snapshot.arrays["material"])
    numbers = snapshot.numbers
    world.count, world.frozen = len(snapshot.arrays["id"]), numbers.frozen_count
    world.pool = pool_from(snapshot.arrays, numbers.foam_born, numbers.foam_capacity, scene.dim, capacity)


def digest(snapshot: Snapshot, rules: str = "") -> str:
    """Return the hex SHA-256 of an instant: of all that decides how it goes on, and of nothing else.

    That is, in this order, each with its name and shape: the ledger but for the room that there is (time, next id,
    what is owed, the fastest so far), how many births of foam there were, every array in the order of particle ids
    (places, velocities, carried pressure, viscosity, dyes, ice, materials), foam in the order of births, bodies and
    their engine, poses, targets and growth of solids, what hands hold, emitters and drains, and `rules`, the scene as
    it is now. There is no state of random numbers: they follow from ids and the number of the frame. Recordings, tests
    and `wavetank run` compare by this and nothing else.
    """
    whole = hashlib.sha256()
    ledger = {name: value for name, value in snapshot.ledger.plain().items() if name != "capacity"}
    order = np.argsort(snapshot.arrays["id"], kind="stable")
    whole.update(json.dumps([ledger, snapshot.numbers.foam_born], sort_keys=True).encode())
    for name, rows in sorted(snapshot.arrays.items()):
        values = rows[order] if name in (*ARRAYS, VISCOUS) else rows
        whole.update(f"{name} {values.dtype.str} {values.shape}".encode() + np.ascontiguousarray(values).tobytes())
    poses = [*snapshot.poses, *(pose for _, pose in sorted(snapshot.targets.items()))]
    for number, pose in enumerate(poses):
        whole.update(f"pose {number}".encode() + np.concatenate(pose).tobytes())
    others = [sorted(snapshot.targets), sorted(snapshot.growing.items()), snapshot.courses, snapshot.sources]
    whole.update(json.dumps(others, sort_keys=True).encode() + rules.encode())
    return whole.hexdigest()


class Packed:
    """A snapshot in little memory, packed in little time: ten a second are taken while the water moves."""

    def __init__(self, snapshot: Snapshot) -> None:
        self.rest = dataclasses.replace(snapshot, arrays={})
        self.kinds = {name: (array.dtype, array.shape) for name, array in snapshot.arrays.items()}
        self.planes = {name: [_packed(plane) for plane in _planes(array)] for name, array in snapshot.arrays.items()}

    @property
    def size(self) -> int:
        """Bytes taken, about."""
        return sum(len(part) for planes in self.planes.values() for _, part in planes) + 4096

    def unpack(self) -> Snapshot:
        """Return the snapshot, equal to the last bit."""
        arrays = {}
        for name, (dtype, shape) in self.kinds.items():
            planes = [zlib.decompress(part) if small else part for small, part in self.planes[name]]
            columns = np.frombuffer(b"".join(planes), np.uint8).reshape(dtype.itemsize, -1)
            arrays[name] = np.ascontiguousarray(columns.T).view(dtype).reshape(shape)
        return dataclasses.replace(self.rest, arrays=arrays)


def _planes(array: np.ndarray) -> np.ndarray:
    """First bytes of all numbers, then second bytes: exponents of neighbours are alike and pack well."""
    flat = np.ascontiguousarray(array).reshape(-1)
    return np.ascontiguousarray(flat.view(np.uint8).reshape(-1, array.dtype.itemsize).T)


def _packed(plane: np.ndarray) -> tuple[bool, bytes]:
    """Return the bytes of a plane, and whether they are packed: not where a sample says that it is hardly worth it.

    What a float has behind its exponent is as good as noise; zlib would take four times as long to save nothing.
    """
    whole = plane.tobytes()
    sample = whole[len(whole) // 2 :][:SAMPLE]
    small = len(zlib.compress(sample, 1)) < WORTH * len(sample)
    return small, zlib.compress(whole, 1) if small else whole

"""A whole running world as plain arrays: what saving, rewinding and bookmarks keep, to the last bit."""

import dataclasses
import hashlib
import json
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from wavetank.device.compiler import download, upload
from wavetank.device.state import LASTING
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.replacing import replacing
from wavetank.physics.foam.pool import pool_from, pool_rows
from wavetank.physics.world import World
from wavetank.scene.scene import Scene
from wavetank.simulation.ledger import Ledger
from wavetank.simulation.moving_solids import MovingSolids
from wavetank.solids.motion import Pose
from wavetank.solids.solid import Solid

ARRAYS = LASTING  # of the particles, in device order
VISCOUS = "viscous"  # the same, where there are viscous fluids
TOLD = ("id", "x", "v", "dye", "frozen", "material")  # of these, what a digest tells
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
        solids=[*scene.solids], names=[*solids.names], poses=[*solids.poses], targets={**solids.targets},
        growing={**solids.growing}, courses=solids.courses.plain(),
    )  # fmt: skip


def restore_solids(scene: Scene, walls: list[Solid], snapshot: Snapshot) -> MovingSolids:
    """Return the solids of an instant, where they were."""
    solids = MovingSolids(walls, snapshot.solids, scene.friction, scene.spacing, scene.start_time)
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


def digest(snapshot: Snapshot) -> str:
    """Return the hex SHA-256 of an instant: time, particles by id, foam, poses, bodies, to the last bit."""
    order = np.argsort(snapshot.arrays["id"], kind="stable")
    particles = {name: snapshot.arrays[name][order] for name in TOLD}
    foam = {name: rows for name, rows in sorted(snapshot.arrays.items()) if name.startswith("foam_")}
    poses = {f"pose {number}": np.concatenate(pose) for number, pose in enumerate(snapshot.poses)}
    whole = hashlib.sha256()
    memory = {name: rows for name, rows in snapshot.arrays.items() if name == "bodies_memory"}
    for name, values in ({"time": np.float64(snapshot.time)} | particles | foam | poses | memory).items():
        whole.update(f"{name} {values.shape}".encode() + values.tobytes())
    if snapshot.sources:
        whole.update(json.dumps(snapshot.sources, sort_keys=True).encode())
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


def write_snapshot(path: str | Path, snapshot: Snapshot, scene: str) -> None:
    """Write a snapshot and the JSON of its scene to an .npz file, replaced in one move."""
    about = {
        "numbers": snapshot.ledger.plain() | dataclasses.asdict(snapshot.numbers),
        "names": snapshot.names,
        "poses": [_pose_list(pose) for pose in snapshot.poses],
        "targets": {k: _pose_list(pose) for k, pose in snapshot.targets.items()},
        "growing": snapshot.growing,
        "courses": snapshot.courses,
        "sources": snapshot.sources,
    }
    with replacing(path) as partial, partial.open("wb") as file:
        np.savez(file, format=2, scene=scene, about=json.dumps(about), allow_pickle=False, **snapshot.arrays)


def read_snapshot(path: str | Path, solids: Any) -> tuple[Snapshot, str]:
    """Read what `write_snapshot` wrote; `solids` makes the list of solids from the scene's JSON."""
    try:
        with np.load(path, allow_pickle=False) as file:
            data = {name: file[name] for name in file.files}
        data.setdefault("a", np.zeros_like(data["v"]))  # earlier states carry no pressure on
        scene = str(data["scene"])
        about = json.loads(str(data["about"]))
        members, numbers = solids(scene), about["numbers"]
        snapshot = Snapshot(
            ledger=Ledger.read(numbers),
            numbers=Numbers(**{field.name: int(numbers[field.name]) for field in dataclasses.fields(Numbers)}),
            arrays={
                name: data[name]
                for name in (
                    *ARRAYS,
                    *(name for name in data if name == VISCOUS or name.startswith(("foam_", "bodies_"))),
                )
            },
            solids=members,
            names=about["names"],
            poses=[_pose(row) for row in about["poses"]],
            targets={int(k): _pose(row) for k, row in about["targets"].items()},
            growing={int(k): (age, time) for k, (age, time) in about["growing"].items()},
            courses=about.get("courses", {}),
            sources=about.get("sources", {}),
        )
    except OSError as error:
        raise WavetankError(f"{path}: the state cannot be read: {error.strerror or error}.") from None
    except (KeyError, ValueError, EOFError, zipfile.BadZipFile) as error:
        why = "it holds objects, not arrays" if "pickle" in str(error) else str(error).rstrip(".")
        raise WavetankError(f"{path}: this is not a state that `Simulation.save` wrote: {why}.") from None
    return snapshot, scene


def _pose_list(pose: Pose) -> list[list[float]]:
    return [pose[0].tolist(), pose[1].tolist()]


def _pose(row: list[list[float]]) -> Pose:
    return np.array(row[0], float), np.array(row[1], float)

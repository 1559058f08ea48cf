"""A whole running world as plain arrays: what saving, rewinding and bookmarks keep, to the last bit."""

import dataclasses
import json
import zipfile
import zlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from wavetank.device.compiler import download, upload
from wavetank.device.state import LASTING
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.replacing import replacing
from wavetank.physics.foam.pool import pool_from, pool_rows
from wavetank.simulation.moving_solids import MovingSolids, Pose
from wavetank.solids.solid import Solid

if TYPE_CHECKING:
    from wavetank.simulation.simulation import Simulation

ARRAYS = LASTING  # of the particles, in device order
VISCOUS = "viscous"  # the same, where there are viscous fluids
NUMBERS = (
    "time", "frame_number", "owed", "next_id", "frozen_count", "fastest_start", "fastest_solid", "fastest_force",
    "capacity", "start_box", "foam_born", "foam_capacity",
)  # fmt: skip
SAMPLE, WORTH = 1024, 0.8  # bytes; the share of these that must be left for packing to be worth it


@dataclasses.dataclass(frozen=True)
class Snapshot:
    """One instant of a world, on the host."""

    numbers: dict[str, Any]  # see NUMBERS
    arrays: dict[str, np.ndarray]  # of the particles, see ARRAYS and VISCOUS, and of foam, names begin with foam_
    solids: list[Solid]  # but for the walls of the tank
    names: list[str]
    poses: list[Pose]  # of all solids, the walls of the tank first, as names, targets and growing
    targets: dict[int, Pose]
    growing: dict[int, tuple[float, float]]

    @property
    def time(self) -> float:
        """Seconds of water since the start [s]."""
        return float(self.numbers["time"])

    @property
    def frame_number(self) -> int:
        """Frames since the start."""
        return int(self.numbers["frame_number"])


def take_snapshot(sim: "Simulation") -> Snapshot:
    """Return this instant of a running world."""
    particles, moving, pool = sim.world.particles, sim.solids, sim.world.pool
    names = (*ARRAYS, VISCOUS) if sim.world.remembers_viscosity else ARRAYS
    return Snapshot(
        numbers={
            "time": sim.time, "frame_number": sim.frame_number, "owed": sim._owed, "next_id": sim._next_id,
            "frozen_count": sim.world.frozen, "fastest_start": sim._fastest_start,
            "fastest_solid": sim._fastest_solid, "fastest_force": sim._fastest_force, "capacity": sim._capacity,
            "start_box": [end.tolist() for end in sim._start_box], "foam_born": pool.born if pool else -1,
            "foam_capacity": pool.capacity if pool else 0,
        },
        arrays={name: download(getattr(particles, name))[: sim.count].copy() for name in names}
        | pool_rows(pool, sim.scene.dim),
        solids=[*sim.scene.solids], names=[*moving.names], poses=[*moving.poses], targets={**moving.targets},
        growing={**moving.growing},
    )  # fmt: skip


def put_snapshot(sim: "Simulation", snapshot: Snapshot) -> None:
    """Make an instant the present of a running world; its parameters and forces stay as they are now."""
    numbers = snapshot.numbers
    sim.scene.assign("solids", snapshot.solids)
    sim.solids = MovingSolids(sim._walls(), snapshot.solids, sim.scene.friction, sim.scene.spacing)
    sim.solids.names, sim.solids.poses = [*snapshot.names], [*snapshot.poses]
    sim.solids.targets, sim.solids.growing = {**snapshot.targets}, {**snapshot.growing}
    sim.solids.rebuild()
    if numbers["capacity"] > sim._capacity:
        sim._fill(int(numbers["capacity"]))
    sim._renew_solids()
    for name in ARRAYS:
        upload(getattr(sim.world.particles, name), snapshot.arrays[name])
    if VISCOUS in snapshot.arrays or sim.world.remembers_viscosity:
        sim.world.remember_viscosity(snapshot.arrays.get(VISCOUS, np.zeros(0)))
    sim.world.materials = sim.scene.materials_of(snapshot.arrays["material"])
    sim.world.count, sim.world.frozen = len(snapshot.arrays["id"]), int(numbers["frozen_count"])
    sim.world.pool = pool_from(
        snapshot.arrays, numbers["foam_born"], numbers["foam_capacity"], sim.scene.dim, sim._capacity
    )
    sim.time, sim.frame_number, sim._owed = numbers["time"], snapshot.frame_number, numbers["owed"]
    sim._next_id, sim.pushed = max(sim._next_id, int(numbers["next_id"])), []
    sim._fastest_start, sim._fastest_solid = numbers["fastest_start"], numbers["fastest_solid"]
    sim._fastest_force = numbers["fastest_force"]
    sim._start_box = (np.array(numbers["start_box"][0]), np.array(numbers["start_box"][1]))


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
        "numbers": snapshot.numbers,
        "names": snapshot.names,
        "poses": [_pose_list(pose) for pose in snapshot.poses],
        "targets": {k: _pose_list(pose) for k, pose in snapshot.targets.items()},
        "growing": snapshot.growing,
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
        members = solids(scene)
        snapshot = Snapshot(
            numbers={name: about["numbers"][name] for name in NUMBERS},
            arrays={
                name: data[name]
                for name in (*ARRAYS, *(name for name in data if name == VISCOUS or name.startswith("foam_")))
            },
            solids=members,
            names=about["names"],
            poses=[_pose(row) for row in about["poses"]],
            targets={int(k): _pose(row) for k, row in about["targets"].items()},
            growing={int(k): (age, time) for k, (age, time) in about["growing"].items()},
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

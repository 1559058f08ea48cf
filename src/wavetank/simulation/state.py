"""An instant of a world on the host: what is saved, packed, rewound to, written by exports, and compared by digests.

A state for writers has the particles, foam and solids of an instant. One that a world continues from, to the last bit,
also has a `Continuation`, and its particles are in device order: sums in single precision depend on it.
"""

import dataclasses
import functools
import hashlib
import json
import zlib
from collections.abc import Collection, Mapping
from typing import Any

import numpy as np
from typing_extensions import override

from wavetank.device.state import LASTING
from wavetank.foundation.errors import WavetankError
from wavetank.scene.scene import Scene
from wavetank.simulation.instant import FOAM, PARTICLES, Field, Instant, PlacedSolid
from wavetank.solids.motion import Pose

VISCOUS = "viscous"  # column of particles that only worlds with viscous fluids have
LARGEST_FINITE = 1e18  # the square of a larger number overflows in single precision
SAMPLE, WORTH = 1024, 0.8  # bytes; share of these that compression must reach to be used
PRESSURE = "pressure"  # f32 [nodes]: what probes read goes on from it, see `physics/pressure/probes.py`
#: Fields of a scene that the water does not feel, or that describe its start.
UNFELT: Any = {
    **dict.fromkeys(("fluids", "title", "goal", "preset", "quality", "light", "film", "probes"), True),
    "materials": {"__all__": {"clarity", "glow"}},
}


@dataclasses.dataclass
class Counters:
    """Clock, counters and largest speeds of a world."""

    time: float = 0.0  # s of water since the start
    frame_number: int = 0  # frames since the start
    capacity: int = 0  # particles that the arrays on the device hold
    pending_time: float = 0.0  # s that `advance` was asked for and has not computed yet
    next_id: int = 0  # of the next new particle
    fastest_start: float = 0.0  # m/s: largest initial speed of a particle
    fastest_solid: float = 0.0  # m/s: largest speed of a solid so far
    fastest_force: float = 0.0  # m/s that forces can have given
    steepest: float = 0.0  # m^2/s^2: half the square of the speed of the longest free fall so far
    lift: float = 1.0  # of the speed limit, by flows that reached it
    start_box: tuple[np.ndarray, np.ndarray] = dataclasses.field(
        default_factory=lambda: (np.zeros(3), np.zeros(3))
    )  # m: lower and upper corner of the particles at the start

    def copy(self) -> "Counters":
        """Return another one with the same values."""
        return dataclasses.replace(self)

    def assign(self, other: "Counters") -> None:
        """Set all values to those of `other`."""
        vars(self).update(vars(other))

    def plain(self) -> dict[str, Any]:
        """Return the values as JSON has them in saved states: the pending time as `owed`, `lift` where it is not 1."""
        values = {"owed" if name == "pending_time" else name: value for name, value in vars(self).items()}
        if self.lift == 1.0:
            del values["lift"]
        return {**values, "start_box": [corner.tolist() for corner in self.start_box]}

    @classmethod
    def read(cls, values: Mapping[str, Any]) -> "Counters":
        """Return what `plain` wrote; raises `KeyError` where a value is missing."""
        names = {
            field.name: "owed" if field.name == "pending_time" else field.name for field in dataclasses.fields(cls)
        }
        known = {name: values[key] for name, key in names.items() if key != "lift" or key in values}
        lower, upper = values["start_box"]
        return cls(**{**known, "start_box": (np.array(lower), np.array(upper))})


@dataclasses.dataclass(frozen=True)
class SolidsState:
    """Where solids are and where they are going, the walls of the tank first."""

    names: list[str]
    poses: list[Pose]
    targets: dict[int, Pose]  # by number: at the end of the next frame
    growing: dict[int, tuple[float, float]]  # by number: age and time to grow [s]
    motions: dict[str, Any]  # see `PrescribedMotions.plain`


@dataclasses.dataclass(frozen=True)
class Continuation:
    """What decides how a world continues besides its scene and its arrays."""

    counters: Counters
    foam_born: int  # drops of foam since the start; -1 where there was no foam yet
    foam_capacity: int
    solids: SolidsState
    sources: dict[str, Any] = dataclasses.field(default_factory=dict)  # see `Sources.plain`
    default_kind: int = 0  # number of the material of new particles that are not given any
    known_kinds: tuple[int, ...] = ()  # materials of all particles so far, also of those that are gone


@dataclasses.dataclass(frozen=True)
class State(Instant):
    """One instant of a world on the host."""

    scene: Scene
    number: int  # frames since the start
    time: float  # s of water since the start
    arrays: dict[str, np.ndarray]  # columns of particles, foam by the names of `FOAM`, bodies by `Bodies.state_arrays`
    placed: tuple[PlacedSolid, ...] = ()  # the solids at their poses, without the walls of the tank; for writers
    surfaces: tuple[Any, ...] = ()  # of the fluids, see `formats/surface.py`
    continuation: Continuation | None = None  # None in a state for writers

    @classmethod
    def read(
        cls, scene: Scene, number: int, time: float, arrays: Mapping[str, np.ndarray], placed: tuple[PlacedSolid, ...]
    ) -> "State":
        """Return a state for pictures and writers from the arrays of a file, by the names of `PARTICLES` and `FOAM`.

        Arrays that the file lacks are empty or 0. Raises `ValueError` for those that do not fit the scene.
        """
        count, foam = len(arrays.get("positions", ())), len(arrays.get("foam_positions", ()))
        read: dict[str, np.ndarray] = {}
        for fields, rows in ((PARTICLES, count), (FOAM, foam)):
            for field in fields:
                read[field.name] = _fitted(field, arrays.get(field.name), rows, scene.dim)
        if count and "ids" not in arrays:
            read["ids"] = np.arange(count, dtype=np.int32)
        materials = read["materials"]
        if count and not 0 <= materials.min() <= materials.max() < len(scene.palette()):
            raise ValueError(f"materials go from {materials.min()} to {materials.max()}; it has {len(scene.palette())}")
        poses = [getattr(one, name) for one in placed for name in ("position", "rotation")]
        if not (np.isfinite(time) and all(np.isfinite(pose).all() for pose in poses)):
            raise ValueError("a time or a pose is not finite")
        columns = {field.column: read[field.name] for field in PARTICLES} | {f.name: read[f.name] for f in FOAM}
        return cls(scene=scene, number=number, time=time, arrays=columns, placed=placed)

    @property
    def count(self) -> int:
        """Number of particles."""
        return len(self.arrays["id"])

    @property
    def size(self) -> int:
        """Bytes taken, about."""
        return sum(rows.nbytes for rows in self.arrays.values()) + 256 * len(self.placed)

    @property
    def is_finite(self) -> bool:
        """Whether all numbers are finite, and so are their squares."""
        floats = (rows for rows in self.arrays.values() if rows.dtype.kind == "f")
        return all(bool((np.abs(rows) < LARGEST_FINITE).all()) for rows in floats)

    @property
    def resumable(self) -> Continuation:
        """What else a world continues from; raises `WavetankError` for a state for writers, which has none."""
        if self.continuation is None:
            raise WavetankError("this state is one for pictures and exports; resume one of `Simulation.snapshot`.")
        return self.continuation

    def state(self) -> "State":
        """Return this; `Frame.state` copies."""
        return self

    def only(self, parts: Collection[str]) -> "State":
        """Return this without the particles, the foam or the solids that are not among `parts`, of `PARTS`."""
        arrays = dict(self.arrays)
        for field in PARTICLES if "particles" not in parts else ():
            arrays[field.column] = arrays[field.column][:0]
        for field in FOAM if "foam" not in parts else ():
            arrays[field.name] = arrays[field.name][:0]
        return dataclasses.replace(self, arrays=arrays, placed=self.placed if "solids" in parts else ())

    def digest(self) -> str:
        """Return the hex SHA-256 of all that decides how the world continues, and of nothing else.

        That is, in this order, each array with its name and shape: the counters without the capacity, the number of
        births of foam, every array in the order of particle ids (positions, velocities, warm-started pressure,
        viscosity, dyes, ice, materials), foam in the order of births, bodies and their engine, poses, targets and
        growth of solids, which of them are held, emitters and drains, the scene without what the water does not feel,
        and the material of new particles and all materials so far where they are not those of the particles. Random
        numbers have no state: they follow from ids and the number of the frame. Recordings, tests and
        `wavetank run` compare by this and nothing else.
        """
        more = self.resumable
        solids = more.solids
        whole = hashlib.sha256()
        counters = {name: value for name, value in more.counters.plain().items() if name != "capacity"}
        order = np.argsort(self.arrays["id"], kind="stable")
        whole.update(json.dumps([counters, more.foam_born], sort_keys=True).encode())
        for name, rows in sorted(self.arrays.items()):
            if name == PRESSURE:  # what probes have read
                continue
            values = rows[order] if name in (*LASTING, VISCOUS) else rows
            whole.update(f"{name} {values.dtype.str} {values.shape}".encode() + np.ascontiguousarray(values).tobytes())
        poses = [*solids.poses, *(pose for _, pose in sorted(solids.targets.items()))]
        for number, pose in enumerate(poses):
            whole.update(f"pose {number}".encode() + np.concatenate(pose).tobytes())
        others = [sorted(solids.targets), sorted(solids.growing.items()), solids.motions, more.sources]
        whole.update(json.dumps(others, sort_keys=True).encode())
        unfelt = UNFELT | ({"up": True} if self.scene.upward == "y" else {})
        whole.update(self.scene.model_dump_json(exclude=unfelt).encode())
        told = kinds_of(self.arrays)
        if (more.default_kind, more.known_kinds) != told:
            whole.update(json.dumps([more.default_kind, more.known_kinds]).encode())
        return whole.hexdigest()

    def pack(self) -> "PackedState":
        """Return this in less memory, compressed in little time."""
        return PackedState(self)

    @functools.cached_property
    def _order(self) -> np.ndarray | None:
        """Order of the ids; None where they rise, as in states for writers."""
        ids = self.arrays["id"]
        return None if (ids[:-1] <= ids[1:]).all() else np.argsort(ids, kind="stable")

    @override
    def _by_id(self, column: str) -> np.ndarray:
        if column not in self.arrays:
            raise WavetankError(f"a state of `Simulation.snapshot` has no {column}; it is measured by `frame`.")
        rows = self.arrays[column]
        return rows if self._order is None else rows[self._order]

    @override
    def _of_foam(self, field: Field) -> np.ndarray:
        return self.arrays[field.name] if field.name in self.arrays else field.zeros(0, self.dim)


def kinds_of(arrays: Mapping[str, np.ndarray]) -> tuple[int, tuple[int, ...]]:
    """Return the material of the particle with the lowest id, 0 without any, and those of all, as numbers."""
    kinds = arrays["material"]
    first = int(kinds[np.argmin(arrays["id"])]) if len(kinds) else 0
    return first, tuple(np.unique(kinds).tolist())


def _fitted(field: Field, given: np.ndarray | None, rows: int, dim: int) -> np.ndarray:
    """Return `given` as the array of a field; raises `ValueError` for another shape and for non-finite numbers."""
    shape = field.shape(rows, dim)
    if given is None or (np.shape(given) != shape and not np.size(given)):
        return field.zeros(rows, dim)
    value: np.ndarray = np.asarray(given).astype(field.kind)
    if value.shape != shape or not np.isfinite(value).all():
        raise ValueError(f"{field.name} are {list(value.shape)}, or not finite; {list(shape)} are needed")
    return value


class PackedState:
    """A state in less memory: ten a second are taken while the water moves."""

    def __init__(self, state: State) -> None:
        self._rest = dataclasses.replace(state, arrays={})
        self._kinds = {name: (array.dtype, array.shape) for name, array in state.arrays.items()}
        self._planes = {name: [_packed(plane) for plane in _planes(array)] for name, array in state.arrays.items()}

    @property
    def size(self) -> int:
        """Bytes taken, about."""
        return sum(len(part) for planes in self._planes.values() for _, part in planes) + 4096

    def unpack(self) -> State:
        """Return the state, equal to the last bit."""
        arrays = {}
        for name, (dtype, shape) in self._kinds.items():
            planes = [zlib.decompress(part) if small else part for small, part in self._planes[name]]
            columns = np.frombuffer(b"".join(planes), np.uint8).reshape(dtype.itemsize, -1)
            arrays[name] = np.ascontiguousarray(columns.T).view(dtype).reshape(shape)
        return dataclasses.replace(self._rest, arrays=arrays)


def _planes(array: np.ndarray) -> np.ndarray:
    """Return the first bytes of all numbers, then the second bytes: exponents of neighbours are alike."""
    flat = np.ascontiguousarray(array).reshape(-1)
    return np.ascontiguousarray(flat.view(np.uint8).reshape(-1, array.dtype.itemsize).T)


def _packed(plane: np.ndarray) -> tuple[bool, bytes]:
    """Return the bytes of a plane, and whether they are compressed: not where a sample hardly compresses.

    What a float has after its exponent is as good as noise; zlib would take four times as long to save nothing.
    """
    whole = plane.tobytes()
    sample = whole[len(whole) // 2 :][:SAMPLE]
    small = len(zlib.compress(sample, 1)) < WORTH * len(sample)
    return small, zlib.compress(whole, 1) if small else whole

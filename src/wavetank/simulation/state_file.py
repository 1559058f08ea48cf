"""Saved states: a `State` in one .npz file, and its checks when it is read.

The file is an archive of arrays without pickles: `format`, `scene` and `about` (JSON texts), the arrays of the state,
and `seal`, the SHA-256 of all of them, by which damage is found. `Header` declares what `about` may hold, `COLUMNS` and
`FOAM` in `instant.py` the arrays; anything else is refused before it is used.
"""

import hashlib
import json
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import ConfigDict
from pydantic import Field as Limits

from wavetank.device.state import LASTING
from wavetank.foundation.atomic_write import atomic_write
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.input_limits import explain_errors, one_line, parse_json, printable, read_arrays
from wavetank.foundation.model import FARTHEST, Model, Number
from wavetank.scene.scene import MAX_PARTICLES, Scene
from wavetank.simulation.coupling import STATE_ROWS, upgraded
from wavetank.simulation.instant import COLUMNS, FOAM, Field
from wavetank.simulation.particles import check_crowd
from wavetank.simulation.state import PRESSURE, VISCOUS, Continuation, Counters, SolidsState, State, kinds_of
from wavetank.solids.motion import Pose

FORMAT = 3  # 1 has no foam, 2 no seal; both are read
MOST_IDS = 2**31 - 1
MEMORY, ENGINE = "bodies_memory", "bodies_engine"  # of `Bodies.state_arrays`
TURN_ERROR = 1e-3  # by how much the length of a rotation may be off

Count = Annotated[int, Limits(ge=0, le=MOST_IDS)]
Time = Annotated[float, Limits(ge=0, le=1e12, allow_inf_nan=False)]
Row = tuple[Number, Number, Number]
PoseRow = tuple[Row, tuple[Number, Number, Number, Number]]
Short = Annotated[str, Limits(max_length=200)]


class _Part(Model):
    model_config = ConfigDict(extra="ignore")


class _Numbers(_Part):
    """`Counters`, where `owed` is the pending time, and counts of what the arrays hold."""

    time: Time
    frame_number: Annotated[int, Limits(ge=0, le=2**53)]
    capacity: Annotated[int, Limits(ge=0, le=MAX_PARTICLES * 3 // 2)]
    owed: Time
    next_id: Count
    fastest_start: Annotated[float, Limits(ge=0, le=1e12, allow_inf_nan=False)]
    fastest_solid: Annotated[float, Limits(ge=0, le=1e12, allow_inf_nan=False)]
    fastest_force: Annotated[float, Limits(ge=0, le=1e12, allow_inf_nan=False)]
    steepest: Annotated[float, Limits(ge=0, le=1e24, allow_inf_nan=False)] = 0.0
    lift: Annotated[float, Limits(ge=1, le=1e12, allow_inf_nan=False)] = 1.0
    start_box: tuple[list[Number], list[Number]]
    frozen_count: Count
    foam_born: Annotated[int, Limits(ge=-1, le=MOST_IDS)]
    foam_capacity: Annotated[int, Limits(ge=0, le=4_000_000)]


class _Return(_Part):
    time: Time
    within: Time
    position: Row
    rotation: tuple[Number, Number, Number, Number]


class _Courses(_Part):
    held: list[Short] = []
    returning: dict[Short, _Return] = {}


class _Source(_Part):
    phase: Number
    owed: Count
    total: Annotated[int, Limits(ge=0, le=2**53)]
    withheld: Annotated[int, Limits(ge=0, le=2**53)]
    flows: bool
    store: Annotated[int, Limits(ge=-(2**53), le=2**53)]
    on: bool = True


class _Sources(_Part):
    emitters: list[_Source] = []
    drains: list[_Source] = []


class _Kinds(_Part):
    default: Count
    known: list[Count]


class Header(_Part):
    """All of a state that is neither scene nor array."""

    numbers: _Numbers
    names: list[Short]
    poses: list[PoseRow]
    targets: dict[Count, PoseRow]
    growing: dict[Count, tuple[Time, Annotated[float, Limits(gt=0, le=1e6, allow_inf_nan=False)]]]
    courses: _Courses = _Courses()
    sources: _Sources = _Sources()
    kinds: _Kinds | None = None  # of materials; earlier versions did not write them


def write_state(path: str | Path, state: State, *, lasting: bool = False) -> None:
    """Write a state to an .npz file, replaced in one move; a `lasting` one is on the disk before this returns.

    Raises `WavetankError` for a state with non-finite numbers, from which no world can continue.
    """
    for name, rows in state.arrays.items():
        if rows.dtype.kind == "f" and not np.isfinite(rows).all():
            row = int(np.argmin(np.isfinite(rows.reshape(len(rows), -1)).all(axis=1)))
            raise WavetankError(
                f"{printable(path)}: state not written: {name}[{row}] at t = {state.time:.6g} s is not finite."
            )
    more, solids = state.resumable, state.resumable.solids
    numbers = {
        "frozen_count": int(state.arrays["frozen"].sum()),
        "foam_born": more.foam_born,
        "foam_capacity": more.foam_capacity,
    }
    about = {
        "numbers": more.counters.plain() | numbers,
        "names": solids.names,
        "poses": [_pose_list(pose) for pose in solids.poses],
        "targets": {k: _pose_list(pose) for k, pose in solids.targets.items()},
        "growing": solids.growing,
        "courses": solids.motions,
        "sources": more.sources,
        "kinds": {"default": more.default_kind, "known": more.known_kinds},
    }
    scene = state.scene.model_dump_json(exclude={"fluids"})
    parts = {"format": FORMAT, "scene": scene, "about": json.dumps(about, allow_nan=False), **state.arrays}
    with atomic_write(path, lasting=lasting) as partial, partial.open("wb") as file:
        np.savez(file, allow_pickle=False, **sealed(parts))


def sealed(parts: dict[str, Any]) -> dict[str, np.ndarray]:
    """Return the parts of a state with their `seal`."""
    arrays = {name: np.asarray(part) for name, part in parts.items() if name != "seal"}
    whole = hashlib.sha256()
    for name, array in sorted(arrays.items()):
        whole.update(f"{name} {array.dtype.str} {array.shape} ".encode())
        whole.update(str(array).encode() if array.dtype.kind == "U" else np.ascontiguousarray(array).tobytes())
    return {**arrays, "seal": np.asarray(whole.hexdigest())}


def read_state(path: str | Path) -> State:
    """Read what `write_state` wrote and check all of it; raises `WavetankError` for anything else."""
    origin = printable(path)
    with explain_errors(origin, "state"):
        parts = read_arrays(path, "state that `Simulation.save` wrote")
        refuse = f"{origin}: this is not a state that `Simulation.save` wrote"
        for name in ("scene", "about"):
            if name not in parts or parts[name].dtype.kind != "U" or parts[name].shape:
                raise WavetankError(f"{refuse}: {name!r} is missing.")
        _check_version(parts, origin, refuse)
        scene: Scene = Scene.parse(_table(parts, "scene", "scene", refuse), f"{refuse}: scene", files=False)
        about = _table(parts, "about", "header", refuse)
        header: Header = Header.parse(about, refuse)
        _check_header(header, scene, refuse)
        _check_kinds(header, scene, refuse)
        arrays = _checked_arrays(_Arrays(parts, scene.dim, refuse), header, scene)
        return _state(header, about, scene, arrays)


def _check_version(parts: dict[str, np.ndarray], origin: str, refuse: str) -> None:
    """Take format and seal out of `parts`; raises `WavetankError` for an unknown format and for a broken seal."""
    version = parts.pop("format", np.asarray(2))
    if version.shape or version.dtype.kind not in "iu" or not 1 <= int(version) <= FORMAT:
        raise WavetankError(
            f"{origin}: this state has the format {one_line(version, 20)}; this version of wavetank reads 1 to "
            f"{FORMAT}: use a newer one."
        )
    seal = parts.pop("seal", None)
    if int(version) >= 3 and (seal is None or str(seal) != str(sealed(parts | {"format": version})["seal"])):
        raise WavetankError(f"{refuse}: it is damaged, its seal (SHA-256) is that of other content.")


def _table(parts: dict[str, np.ndarray], name: str, what: str, refuse: str) -> dict[str, Any]:
    """Take a JSON text out of `parts` and return its table; raises `WavetankError` for anything else."""
    table = parse_json(str(parts.pop(name)), f"{refuse}: its {what}")
    if not isinstance(table, dict):
        raise WavetankError(f"{refuse}: its {what} is not a table.")
    return table


def _state(header: Header, about: dict[str, Any], scene: Scene, arrays: dict[str, np.ndarray]) -> State:
    numbers = header.numbers
    solids = SolidsState(
        names=[*header.names],
        poses=[_pose(row) for row in header.poses],
        targets={k: _pose(row) for k, row in header.targets.items()},
        growing={**header.growing},
        motions=header.courses.model_dump() if "courses" in about else {},
    )
    default, known = kinds_of(arrays)
    if header.kinds is not None:
        default, known = header.kinds.default, tuple(sorted({*header.kinds.known, *known}))
    more = Continuation(
        counters=Counters.read(numbers.model_dump()),
        foam_born=numbers.foam_born,
        foam_capacity=numbers.foam_capacity,
        solids=solids,
        sources=about.get("sources", {}),
        default_kind=default,
        known_kinds=known,
    )
    return State(scene=scene, number=numbers.frame_number, time=numbers.time, arrays=arrays, continuation=more)


def _check_header(header: Header, scene: Scene, refuse: str) -> None:
    """Raise `WavetankError` where the header does not fit its scene: numbers of solids and sources, names."""
    _check_solids(header, (len(scene.tank.walls()) if scene.tank else 0) + len(scene.solids), refuse)
    if len(header.sources.emitters) > len(scene.emitters) or len(header.sources.drains) > len(scene.drains):
        raise WavetankError(f"{refuse}: sources has more emitters or drains than its scene.")
    if any(len(corner) not in (scene.dim, 3) for corner in header.numbers.start_box):
        raise WavetankError(f"{refuse}: start_box must be two corners of {scene.dim} numbers.")


def _check_solids(header: Header, count: int, refuse: str) -> None:
    """Raise `WavetankError` where names, poses or motions do not fit the `count` solids of the scene."""
    if len(header.names) != count or len(header.poses) != count:
        raise WavetankError(
            f"{refuse}: it has {len(header.names)} names and {len(header.poses)} poses; its scene has {count} solids."
        )
    if len(set(header.names)) != count:
        raise WavetankError(f"{refuse}: names: a name is used twice.")
    for what, numbered in (("targets", header.targets), ("growing", header.growing)):
        if any(number >= count for number in numbered):
            raise WavetankError(f"{refuse}: {what} names solid {max(numbered)}; there are 0 to {count - 1}.")
    turns = [row[1] for row in [*header.poses, *header.targets.values()]]
    turns += [back.rotation for back in header.courses.returning.values()]
    if any(not abs(float(np.linalg.norm(turn)) - 1.0) < TURN_ERROR for turn in turns):
        raise WavetankError(f"{refuse}: poses: a rotation is not a unit quaternion.")
    if any(name not in header.names for name in (*header.courses.held, *header.courses.returning)):
        raise WavetankError(f"{refuse}: courses names a solid that is not there.")


def _check_kinds(header: Header, scene: Scene, refuse: str) -> None:
    """Raise `WavetankError` where the header names materials that its scene does not have."""
    kinds = [header.kinds.default, *header.kinds.known] if header.kinds else []
    if any(kind > len(scene.materials) for kind in kinds):
        raise WavetankError(f"{refuse}: kinds names material {max(kinds)}; there are 0 to {len(scene.materials)}.")


class _Arrays:
    """The arrays of a file, each checked when it is taken."""

    def __init__(self, parts: dict[str, np.ndarray], dim: int, refuse: str) -> None:
        self.parts, self.dim, self._refuse = parts, dim, refuse

    def error(self, reason: str) -> WavetankError:
        """Return the refusal of the file for a reason."""
        return WavetankError(f"{self._refuse}: {reason}")

    def rows(self, name: str) -> int:
        """Return the length of an array with one axis, 0 for any other."""
        return len(self.parts[name]) if name in self.parts and self.parts[name].ndim == 1 else 0

    def take(self, name: str, kind: Any, shape: tuple[int, ...]) -> np.ndarray:
        """Return an array of that type and shape whose numbers are finite; raises `WavetankError` for any other."""
        if name not in self.parts:
            raise self.error(f"the array {name!r} is missing.")
        rows = self.parts[name]
        if rows.dtype != kind or rows.shape != shape:
            raise self.error(f"{name} is {rows.dtype} {list(rows.shape)}; it must be {np.dtype(kind)} {list(shape)}.")
        if rows.dtype.kind == "f" and not (np.abs(rows) <= FARTHEST).all():
            raise self.error(f"{name} holds numbers that are not finite, or beyond {FARTHEST:g}.")
        return np.ascontiguousarray(rows)

    def field(self, field: Field, name: str, rows: int) -> np.ndarray:
        """Return the array of a field with that number of rows, likewise."""
        return self.take(name, field.kind, field.shape(rows, self.dim))

    def check_range(self, name: str, values: np.ndarray, most: int) -> None:
        """Raise `WavetankError` where values are not between 0 and `most`."""
        if len(values) and not (values.min() >= 0 and values.max() <= most):
            raise self.error(f"{name} holds numbers that have no meaning; they must lie between 0 and {most}.")


def _checked_arrays(arrays: _Arrays, header: Header, scene: Scene) -> dict[str, np.ndarray]:
    """Return the arrays of a state, each of the type, shape and range that it must have."""
    particles = _checked_particles(arrays, header.numbers, scene)
    pressure = {PRESSURE: arrays.take(PRESSURE, np.float32, (arrays.rows(PRESSURE),))} if scene.probes else {}
    return particles | _checked_foam(arrays, header.numbers) | _checked_bodies(arrays, scene) | pressure


def _checked_particles(arrays: _Arrays, numbers: _Numbers, scene: Scene) -> dict[str, np.ndarray]:
    if "id" not in arrays.parts or arrays.parts["id"].ndim != 1:
        raise arrays.error("the array 'id' is missing.")
    count = len(arrays.parts["id"])
    arrays.parts.setdefault("a", COLUMNS["a"].zeros(count, scene.dim))  # format 1 has no warm-started pressure
    names = [*LASTING, *([VISCOUS] if VISCOUS in arrays.parts else [])]
    found = {name: arrays.field(COLUMNS[name], name, count) for name in names}
    check_crowd(f"{arrays.error('x')}", found["x"], scene.spacing)
    ids = np.sort(found["id"])
    if count and (ids[0] < 0 or ids[-1] >= numbers.next_id or (np.diff(ids) == 0).any()):
        raise arrays.error(f"ids must differ and lie between 0 and next_id = {numbers.next_id}.")
    arrays.check_range("material", found["material"], len(scene.materials))
    arrays.check_range("frozen", found["frozen"], 1)
    if int(found["frozen"].sum()) != numbers.frozen_count:
        raise arrays.error(f"frozen_count = {numbers.frozen_count} is not the number of frozen particles.")
    if numbers.capacity < count:
        raise arrays.error(f"capacity = {numbers.capacity} is less than its {count:,} particles.")
    return found


def _checked_foam(arrays: _Arrays, numbers: _Numbers) -> dict[str, np.ndarray]:
    if not any(field.name in arrays.parts for field in FOAM):
        return {}
    amount = arrays.rows("foam_kinds")
    found = {field.name: arrays.field(field, field.name, amount) for field in FOAM}
    if amount > max(numbers.foam_capacity, 0) or (amount and numbers.foam_born < amount):
        raise arrays.error(f"foam_capacity = {numbers.foam_capacity} is less than its {amount:,} drops of foam.")
    arrays.check_range("foam_kinds - 1", found["foam_kinds"] - 1, 2)
    return found


def _checked_bodies(arrays: _Arrays, scene: Scene) -> dict[str, np.ndarray]:
    count = sum(solid.is_body for solid in scene.solids)
    if not count and MEMORY not in arrays.parts and ENGINE not in arrays.parts:
        return {}
    if MEMORY in arrays.parts:
        arrays.parts[MEMORY] = upgraded(arrays.parts[MEMORY])
    memory = arrays.take(MEMORY, np.float64, (count, STATE_ROWS, 6))
    engine = arrays.parts.get(ENGINE, np.zeros(()))
    if not count or engine.dtype != np.uint8 or engine.ndim != 1:
        raise arrays.error("its bodies are not those of its scene.")
    return {MEMORY: memory, ENGINE: engine}


def _pose_list(pose: Pose) -> list[list[float]]:
    return [pose[0].tolist(), pose[1].tolist()]


def _pose(row: PoseRow) -> Pose:
    return np.array(row[0], float), np.array(row[1], float)

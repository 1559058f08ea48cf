"""States on disk: a snapshot and its scene in one .npz file, and back with input limits for foreign files.

A state is an archive of arrays without pickles: `format`, `scene` and `about` (JSON texts), the arrays of the snapshot,
and `seal`, the SHA-256 of all of them, by which damage is found. What the header and the arrays may be is declared
here; what is not is refused before anything is made of it.
"""

import dataclasses
import hashlib
import json
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import ConfigDict, Field

from wavetank.foundation.atomic_write import atomic_write
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.input_limits import explain_errors, one_line, parse_json, printable, read_arrays
from wavetank.foundation.model import FARTHEST, Model, Number
from wavetank.physics.foam.pool import ROWS
from wavetank.scene.scene import MAX_PARTICLES, Scene
from wavetank.simulation.arrays import check_crowd
from wavetank.simulation.coupling import STATE_ROWS, upgraded
from wavetank.simulation.ledger import Ledger
from wavetank.simulation.snapshot import ARRAYS, VISCOUS, Numbers, Snapshot
from wavetank.solids.motion import Pose

FORMAT = 3  # 1 has no foam, 2 no seal; both are read
MOST_IDS = 2**31 - 1
BODIES = ("bodies_memory", "bodies_engine")
FOAM_SHAPE = {"foam_kinds": np.int32, "foam_ages": np.float32, "foam_lives": np.float32, "foam_ids": np.int32}
TURN_ERROR = 1e-3  # by how much the length of a rotation may be off

Count = Annotated[int, Field(ge=0, le=MOST_IDS)]
Time = Annotated[float, Field(ge=0, le=1e12, allow_inf_nan=False)]
Row = tuple[Number, Number, Number]
PoseRow = tuple[Row, tuple[Number, Number, Number, Number]]
Short = Annotated[str, Field(max_length=200)]


class _Part(Model):
    model_config = ConfigDict(extra="ignore")


class _Numbers(_Part):
    """What `Ledger` and `Numbers` hold."""

    time: Time
    frame_number: Annotated[int, Field(ge=0, le=2**53)]
    capacity: Annotated[int, Field(ge=0, le=MAX_PARTICLES * 3 // 2)]
    owed: Time
    next_id: Count
    fastest_start: Annotated[float, Field(ge=0, le=1e12, allow_inf_nan=False)]
    fastest_solid: Annotated[float, Field(ge=0, le=1e12, allow_inf_nan=False)]
    fastest_force: Annotated[float, Field(ge=0, le=1e12, allow_inf_nan=False)]
    steepest: Annotated[float, Field(ge=0, le=1e24, allow_inf_nan=False)] = 0.0
    start_box: tuple[list[Number], list[Number]]
    frozen_count: Count
    foam_born: Annotated[int, Field(ge=-1, le=MOST_IDS)]
    foam_capacity: Annotated[int, Field(ge=0, le=4_000_000)]


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
    total: Annotated[int, Field(ge=0, le=2**53)]
    withheld: Annotated[int, Field(ge=0, le=2**53)]
    flows: bool
    store: Annotated[int, Field(ge=-(2**53), le=2**53)]


class _Sources(_Part):
    emitters: list[_Source] = []
    drains: list[_Source] = []


class Header(_Part):
    """All of a state that is neither scene nor array."""

    numbers: _Numbers
    names: list[Short]
    poses: list[PoseRow]
    targets: dict[Count, PoseRow]
    growing: dict[Count, tuple[Time, Annotated[float, Field(gt=0, le=1e6, allow_inf_nan=False)]]]
    courses: _Courses = _Courses()
    sources: _Sources = _Sources()


def write_snapshot(path: str | Path, snapshot: Snapshot, scene: str, *, lasting: bool = False) -> None:
    """Write a snapshot and the JSON of its scene to an .npz file, replaced in one move.

    Raises `WavetankError` for water that holds numbers which are none: what cannot go on is no state.
    """
    for name, rows in snapshot.arrays.items():
        if rows.dtype.kind == "f" and not np.isfinite(rows).all():
            row = int(np.argmin(np.isfinite(rows.reshape(len(rows), -1)).all(axis=1)))
            raise WavetankError(
                f"{printable(path)}: state not written: {name}[{row}] at t = {snapshot.time:.6g} s is not finite."
            )
    about = {
        "numbers": snapshot.ledger.plain() | dataclasses.asdict(snapshot.numbers),
        "names": snapshot.names,
        "poses": [_pose_list(pose) for pose in snapshot.poses],
        "targets": {k: _pose_list(pose) for k, pose in snapshot.targets.items()},
        "growing": snapshot.growing,
        "courses": snapshot.courses,
        "sources": snapshot.sources,
    }
    parts = {"format": FORMAT, "scene": scene, "about": json.dumps(about, allow_nan=False), **snapshot.arrays}
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


def read_snapshot(path: str | Path) -> tuple[Snapshot, Scene]:
    """Read what `write_snapshot` wrote and check all of it; raises `WavetankError` for anything else."""
    origin = printable(path)
    with explain_errors(origin, "state"):
        parts = read_arrays(path, "state that `Simulation.save` wrote")
        refuse = f"{origin}: this is not a state that `Simulation.save` wrote"
        for name in ("scene", "about"):
            if name not in parts or parts[name].dtype.kind != "U" or parts[name].shape:
                raise WavetankError(f"{refuse}: {name!r} is missing.")
        version = parts.pop("format", np.asarray(2))
        if version.shape or version.dtype.kind not in "iu" or not 1 <= int(version) <= FORMAT:
            raise WavetankError(
                f"{origin}: this state has the format {one_line(version, 20)}; this version of wavetank reads 1 to "
                f"{FORMAT}: use a newer one."
            )
        seal = parts.pop("seal", None)
        if int(version) >= 3 and (seal is None or str(seal) != str(sealed(parts | {"format": version})["seal"])):
            raise WavetankError(f"{refuse}: it is damaged, its seal (SHA-256) is that of other content.")
        table = parse_json(str(parts.pop("scene")), f"{refuse}: its scene")
        if not isinstance(table, dict):
            raise WavetankError(f"{refuse}: its scene is no table.")
        scene: Scene = Scene.parse(table, f"{refuse}: scene", files=False)
        about = parse_json(str(parts.pop("about")), f"{refuse}: its header")
        if not isinstance(about, dict):
            raise WavetankError(f"{refuse}: its header is no table.")
        header: Header = Header.parse(about, refuse)
        _check_header(header, scene, refuse)
        arrays = _checked_arrays(parts, header, scene, refuse)
        snapshot = _snapshot(header, about, scene, arrays)
    return snapshot, scene


def _snapshot(header: Header, about: dict[str, Any], scene: Scene, arrays: dict[str, np.ndarray]) -> Snapshot:
    numbers = header.numbers.model_dump()
    courses = header.courses.model_dump() if "courses" in about else {}
    return Snapshot(
        ledger=Ledger.read(numbers),
        numbers=Numbers(**{field.name: numbers[field.name] for field in dataclasses.fields(Numbers)}),
        arrays=arrays,
        solids=[*scene.solids],
        names=[*header.names],
        poses=[_pose(row) for row in header.poses],
        targets={k: _pose(row) for k, row in header.targets.items()},
        growing={**header.growing},
        courses=courses,
        sources=about.get("sources", {}),
    )


def _check_header(header: Header, scene: Scene, refuse: str) -> None:
    """Check what only a scene can tell: how many there are, and who is meant."""
    count = (len(scene.tank.walls()) if scene.tank else 0) + len(scene.solids)
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
        raise WavetankError(f"{refuse}: poses: a rotation is no unit quaternion.")
    if any(name not in header.names for name in (*header.courses.held, *header.courses.returning)):
        raise WavetankError(f"{refuse}: courses names a solid that is not there.")
    if len(header.sources.emitters) > len(scene.emitters) or len(header.sources.drains) > len(scene.drains):
        raise WavetankError(f"{refuse}: sources has more emitters or drains than its scene.")
    if any(len(corner) not in (scene.dim, 3) for corner in header.numbers.start_box):
        raise WavetankError(f"{refuse}: start_box must be two corners of {scene.dim} numbers.")


def _checked_arrays(parts: dict[str, np.ndarray], header: Header, scene: Scene, refuse: str) -> dict[str, np.ndarray]:
    """Return the arrays of a snapshot, each of the type, shape and range that it must have."""
    numbers, dim = header.numbers, scene.dim

    def array(name: str, kind: Any, *shape: int) -> np.ndarray:
        if name not in parts:
            raise WavetankError(f"{refuse}: the array {name!r} is missing.")
        rows = parts[name]
        if rows.dtype != kind or rows.shape != shape:
            raise WavetankError(
                f"{refuse}: {name} is {rows.dtype} {list(rows.shape)}; it must be {np.dtype(kind)} {list(shape)}."
            )
        if rows.dtype.kind == "f" and not (np.abs(rows) <= FARTHEST).all():
            raise WavetankError(f"{refuse}: {name} holds numbers that are none, or beyond {FARTHEST:g}.")
        return np.ascontiguousarray(rows)

    if "id" not in parts or parts["id"].ndim != 1:
        raise WavetankError(f"{refuse}: the array 'id' is missing.")
    count = len(parts["id"])
    parts.setdefault("a", np.zeros((count, dim), np.float32))  # the first states carry no pressure on
    kinds = {name: (np.float32, (count, dim)) if name in ("x", "v", "a") else (np.int32, (count,)) for name in ARRAYS}
    result = {name: array(name, kind, *shape) for name, (kind, shape) in kinds.items()}
    if VISCOUS in parts:
        result[VISCOUS] = array(VISCOUS, np.float32, count, dim)
    check_crowd(f"{refuse}: x", result["x"], scene.spacing)
    ids = np.sort(result["id"])
    if count and (ids[0] < 0 or ids[-1] >= numbers.next_id or (np.diff(ids) == 0).any()):
        raise WavetankError(f"{refuse}: ids must differ and lie between 0 and next_id = {numbers.next_id}.")
    _check_range("material", result["material"], len(scene.materials), refuse)
    _check_range("frozen", result["frozen"], 1, refuse)
    if int(result["frozen"].sum()) != numbers.frozen_count:
        raise WavetankError(f"{refuse}: frozen_count = {numbers.frozen_count} is not the number of frozen particles.")
    if numbers.capacity < count:
        raise WavetankError(f"{refuse}: capacity = {numbers.capacity} has no room for {count:,} particles.")
    if any(name in parts for name in ROWS):
        amount = len(parts["foam_kinds"]) if parts.get("foam_kinds", np.zeros(())).ndim == 1 else 0
        for name in ROWS:
            kind = FOAM_SHAPE.get(name)
            result[name] = array(name, np.float32, amount, dim) if kind is None else array(name, kind, amount)
        if amount > max(numbers.foam_capacity, 0) or (amount and numbers.foam_born < amount):
            raise WavetankError(f"{refuse}: there is room for {numbers.foam_capacity} of {amount:,} drops of foam.")
        _check_range("foam_kinds", result["foam_kinds"] - 1, 2, refuse)
    bodies = sum(solid.is_body for solid in scene.solids)
    if bodies or any(name in parts for name in BODIES):
        if BODIES[0] in parts:
            parts[BODIES[0]] = upgraded(parts[BODIES[0]])
        result[BODIES[0]] = array(BODIES[0], np.float64, bodies, STATE_ROWS, 6)
        if not bodies or BODIES[1] not in parts or parts[BODIES[1]].dtype != np.uint8 or parts[BODIES[1]].ndim != 1:
            raise WavetankError(f"{refuse}: its bodies are not those of its scene.")
        result[BODIES[1]] = parts[BODIES[1]]
    return result


def _check_range(name: str, values: np.ndarray, most: int, refuse: str) -> None:
    if len(values) and not (values.min() >= 0 and values.max() <= most):
        raise WavetankError(f"{refuse}: {name} holds numbers that stand for nothing.")


def _pose_list(pose: Pose) -> list[list[float]]:
    return [pose[0].tolist(), pose[1].tolist()]


def _pose(row: PoseRow) -> Pose:
    return np.array(row[0], float), np.array(row[1], float)

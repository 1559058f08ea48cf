"""Where a run starts: a scene, a saved state, or an instant of another run; told by the content of files."""

import re
from pathlib import Path
from typing import Any

import numpy as np

from wavetank.formats import hdf5, npz
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.input_limits import open_regular, printable, read_arrays
from wavetank.foundation.params import LIVE
from wavetank.foundation.rotations import inverse, product, turned
from wavetank.run.checkpoints import FILE, FOLDER, load_run
from wavetank.run.folder import RunFolder
from wavetank.scene.fluids import Points
from wavetank.scene.scene import Scene, bundled_levels, bundled_scenes
from wavetank.simulation.instant import PlacedSolid
from wavetank.simulation.simulation import Simulation
from wavetank.simulation.state import State
from wavetank.solids.solid import Solid

ZIP, HDF5 = b"PK\x03\x04", b"\x89HDF\r\n\x1a\n"
TEXT = 2**20  # bytes of a text in which a recording is looked for


def kind_of(world: str | Path) -> str:
    """Say what a name stands for: "scene", "run", "state", "frame", "frames" or "recording", by the file's content."""
    if str(world) in (*bundled_scenes(), *bundled_levels()):
        return "scene"
    if RunFolder.is_one(world):
        return "run"
    if not Path(world).is_file():
        return "scene"  # which says what is missing
    with open_regular(world, 2**50, "file") as file:
        begin = file.read(TEXT)
    if begin.startswith(ZIP):
        return "state" if "about" in read_arrays(world, "state or frame") else "frame"
    if begin.startswith(HDF5):
        return "frames"
    suffix = Path(world).suffix.lower()
    if suffix == ".npz" or suffix in hdf5.SUFFIXES:  # damaged, which who reads it says
        return "state" if suffix == ".npz" else "frames"
    return "recording" if re.search(rb"^digest *= *\"", begin, re.MULTILINE) else "scene"


def start_world(world: str, changes: dict[str, Any], at: float | None, arch: str) -> Simulation:
    """Return the world of a scene, of a state, or of another run at the time `at` [s of water], its last one if None.

    `changes` are keys of the scene. Live parameters of a saved state are set in it, and it goes on exactly; with other
    keys, and from a written frame, a world starts with the particles, velocities, fluids and poses of that instant.
    Raises `WavetankError`.
    """
    kind = kind_of(world)
    if kind in ("scene", "recording"):
        scene = Scene.load(world)
        sim = Simulation(scene.changed(**changes) if changes else scene, arch)
        if at:
            sim.advance(at)
        return sim
    found = _exact(world, kind, at, arch)
    if isinstance(found, Simulation):
        if changes.keys() <= LIVE:
            for name, value in changes.items():
                setattr(found, name, value)
            return found
        found = found.frame().state()
    return Simulation(scene_at(found, changes), arch)


def _exact(world: str, kind: str, at: float | None, arch: str) -> Simulation | State:
    """Return the world at a time, or where that was not kept the written frame nearest to it."""
    path = Path(world)
    if kind == "state":
        sim = Simulation.restore(path, arch)
        if at is not None and abs(at - sim.time) > 1e-9:
            raise WavetankError(f"--at = {at} is not allowed; {printable(path)} is of {sim.time:g} s.")
        return sim
    if kind == "frame":
        if not RunFolder.is_one(path.parent):
            raise WavetankError(
                f"{printable(path)} holds the particles of a frame without their scene; give the run's folder and --at."
            )
        return npz.read(path, RunFolder.open(path.parent).scene)
    if kind == "frames":
        rows = list(hdf5.times(path))
        if not rows:
            raise WavetankError(f"{printable(path)} holds no frame.")
        number = len(rows) - 1 if at is None else int(np.argmin(np.abs(np.array(rows) - at)))
        return next(iter(hdf5.read(path, number)))
    folder = RunFolder.open(path)
    if (path / FOLDER / FILE).exists():
        kept = load_run(path, arch)
        if at is None or abs(at - kept.sim.time) < 0.5 / folder.run.fps:
            return kept.sim
    if folder.has_instants():
        return folder.instant_at(folder.run.start + folder.run.seconds if at is None else at)
    if folder.run.start > 0.0:
        raise WavetankError(f"{world}: this run started from a saved state and wrote no frames; give --export npz.")
    sim = Simulation(folder.scene, arch)
    for _ in sim.frames(folder.run.seconds if at is None else at, folder.run.fps):
        pass
    return sim


def scene_at(instant: State, changes: dict[str, Any]) -> Scene:
    """Return the scene of an instant with these `changes`: its particles are the fluids, solids are where they were."""
    scene = instant.scene
    palette, materials = scene.palette(), instant.materials
    fluids = [
        Points(
            positions=instant.positions[materials == kind],
            velocities=instant.velocities[materials == kind],
            material=palette[kind].name if kind else None,
        )
        for kind in np.unique(materials).tolist()
    ]
    poses = {one.name: one for one in instant.placed}
    solids = [_posed(solid, poses.get(solid.name), scene.dim) for solid in _named(scene, instant)]
    table = scene.model_copy(
        update={"fluids": fluids, "solids": solids, "start_time": scene.start_time + instant.time}
    ).table()
    return Scene.parse(table).changed(**changes)


def _named(scene: Scene, instant: State) -> list[Solid]:
    """Return the solids of an instant with the names that they have there."""
    if not instant.placed:
        return [*scene.solids]
    return [one.solid.model_copy(update={"name": one.name}) for one in instant.placed]


def _posed(solid: Solid, place: PlacedSolid | None, dim: int) -> Solid:
    """Return a solid at a pose; one with a motion is where that says."""
    if place is None or solid.motion is not None:
        return solid
    fields: dict[str, Any] = {}
    if solid.is_body:
        spin = place.angular_velocity
        fields = {"velocity": tuple(place.velocity[:dim]), "angular_velocity": tuple(spin) if dim == 3 else spin[2]}
    turn = product(place.rotation, inverse(solid.quaternion))
    for name in ("center", "start", "end", "point"):
        if hasattr(solid, name):
            own = np.zeros(3)
            own[:dim] = getattr(solid, name)
            fields[name] = tuple((place.position + turned(turn, own - solid.origin))[:dim].tolist())
    moved = not np.allclose(turn, (1, 0, 0, 0), atol=1e-12) or not np.allclose(place.position, solid.origin, atol=1e-12)
    if moved and not fields.keys() & {"center", "start", "point"}:
        raise WavetankError(f"{place.name!r} has moved, and a {solid.shape} cannot start at another pose.")  # type: ignore[attr-defined]
    if not hasattr(solid, "start"):
        fields["rotation"] = tuple(product(turn, np.array(solid.quaternion)).tolist())
    return solid.model_copy(update=fields) if moved or solid.is_body else solid

"""Particles as NumPy archives: everything, exactly."""

from pathlib import Path
from typing import Any

import numpy as np

from wavetank.foundation.atomic_write import atomic_write
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.input_limits import explain_errors, one_line, printable, read_arrays
from wavetank.scene.scene import Scene
from wavetank.simulation.instant import FOAM, PARTICLES, PlacedSolid, solids_by_name
from wavetank.simulation.state import State

SUFFIXES = (".npz",)
KIND = "particles"
POSES = (("position", 3), ("rotation", 4), ("velocity", 3), ("angular_velocity", 3))


def write_npz(path: str | Path, frame: Any) -> None:
    """Write all arrays of a `Frame` or a `State`, ordered by particle id; time [s], number.

    `ids`, `positions` [m], `velocities` [m/s], `densities` [kg/m^3], `materials`, `dyes`; spray, foam and bubbles as
    `foam_positions`, `foam_velocities`, `foam_kinds` (1 spray, 2 foam, 3 bubble), `foam_ages`, `foam_lives` [s] and
    `foam_ids`, which stay with a particle from file to file; `solid_names` and their `solid_poses` [n, 13]: position
    [m], quaternion (w, x, y, z), and of bodies velocity [m/s] and angular velocity [rad/s].
    """
    arrays = {field.name: getattr(frame, field.name) for field in (*PARTICLES, *FOAM)}
    poses = [np.concatenate([getattr(one, name) for name, _ in POSES]) for one in frame.placed]
    with atomic_write(path) as partial, partial.open("wb") as file:
        np.savez_compressed(
            file,
            **arrays,
            time=np.float64(frame.time),
            number=np.int64(frame.number),
            solid_names=np.array([one.name for one in frame.placed], "U"),
            solid_poses=np.array(poses, float).reshape(-1, sum(width for _, width in POSES)),
        )


def read_npz(path: str | Path) -> dict[str, np.ndarray]:
    """Return the arrays of a file by name; raises `WavetankError` for other files or too large ones."""
    return read_arrays(path, "frame of particles")


def read(path: str | Path, scene: Scene) -> State:
    """Return the instant of `scene` that a file holds; raises `WavetankError` for any other file."""
    origin = printable(path)
    with explain_errors(origin, "frame of particles"):
        arrays = read_npz(path)
        try:
            known, ends = solids_by_name(scene), np.cumsum([width for _, width in POSES])[:-1]
            standing = tuple(
                PlacedSolid(str(name), known[str(name)], *np.split(row, ends))
                for name, row in zip(arrays.get("solid_names", ()), arrays.get("solid_poses", ()), strict=True)
                if str(name) in known
            )
            return State.read(scene, int(arrays["number"]), float(arrays["time"]), arrays, standing)
        except (KeyError, ValueError, TypeError, OverflowError) as error:
            if isinstance(error, WavetankError):
                raise
            raise WavetankError(f"{origin}: this is not a frame that wavetank wrote: {one_line(error)}.") from None


write = write_npz

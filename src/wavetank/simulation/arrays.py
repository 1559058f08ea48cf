"""Arrays from outside: checked, and written where each particle is on the device."""

import dataclasses
from typing import Any

import numpy as np

from wavetank.device.compiler import download, upload
from wavetank.device.state import Particles
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.model import FARTHEST
from wavetank.scene.scene import Scene

CROWD = 100  # particles within a cube of a spacing


@dataclasses.dataclass(frozen=True)
class Newcomers:
    """Particles that are to be added."""

    x: np.ndarray  # m, float32 [n, dim]
    v: np.ndarray  # m/s, float32 [n, dim]
    dye: np.ndarray  # int32 [n]
    material: np.ndarray  # int32 [n]

    @property
    def fastest(self) -> float:
        """The largest of their speeds [m/s]."""
        return largest_norm(self.v)


def check_newcomers(scene: Scene, positions: Any, velocities: Any, dyes: Any, materials: Any) -> Newcomers:
    """Return what `Simulation.add` was given as arrays; raises `WavetankError` for wrong shapes and numbers."""
    x = np.asarray(positions, np.float32)
    v = np.zeros_like(x) if velocities is None else np.asarray(velocities, np.float32)
    dye = np.zeros(len(x), np.int32) if dyes is None else np.asarray(dyes, np.int32)
    material = scene.checked_kinds(materials, len(x))
    shape = (len(x), scene.dim)
    if x.shape != shape or v.shape != shape or dye.shape != shape[:1]:
        raise WavetankError(
            f"positions have shape {list(x.shape)}, velocities {list(v.shape)}; both must be [n, {scene.dim}]."
        )
    if not (bool((np.abs(x) <= FARTHEST).all()) and bool((np.abs(v) <= FARTHEST).all())):
        raise WavetankError(f"positions and velocities of new particles must be finite numbers within {FARTHEST:g}.")
    x = scene.tank.within(x) if scene.tank else x
    check_crowd("positions", x, scene.spacing)
    return Newcomers(x, v, dye, material)


def check_crowd(name: str, x: np.ndarray, spacing: float) -> None:
    """Raise `WavetankError` where more than `CROWD` of the places `x` [n, dim] lie within a cube of edge `spacing` [m].

    Each would be a neighbour of all others: the work grows with the square, and lists of neighbours with it.
    """
    if len(x) <= CROWD:
        return
    cells = np.floor(np.clip(x.astype(np.float64) / spacing, -(2.0**50), 2.0**50))
    order = np.lexsort(cells.T)
    new = np.concatenate([[True], (np.diff(cells[order], axis=0) != 0.0).any(axis=1), [True]])
    first = np.flatnonzero(new)
    most = int(np.argmax(np.diff(first)))
    number = int(first[most + 1] - first[most])
    if number > CROWD:
        place = x[order[first[most]]].tolist()
        raise WavetankError(
            f"{name}: {number:,} particles lie in one place, within a spacing of {place}; at most {CROWD} can: at rest "
            "there is one."
        )


def check_rows(name: str, values: Any, shape: tuple[int, ...]) -> np.ndarray:
    """Return `values` as float32 of that shape; raises `WavetankError` for another one and for what is not finite."""
    try:
        rows = np.asarray(values, np.float32)
    except (TypeError, ValueError):
        raise WavetankError(f"{name} must be an array of numbers of shape {list(shape)}.") from None
    if rows.shape != shape:
        raise WavetankError(
            f"{name} have shape {list(rows.shape)}; they must have {list(shape)}, a row for each particle by id."
        )
    bad = ~(np.abs(rows) <= FARTHEST).all(axis=1)
    if bad.any():
        row = int(np.argmax(bad))
        why = (
            f"beyond {FARTHEST:g}; every number must be within it"
            if np.isfinite(rows[row]).all()
            else ("not finite; every number must be")
        )
        raise WavetankError(f"{name}[{row}] = {rows[row].tolist()} is {why}.")
    return rows


def by_id(particles: Particles, count: int, name: str) -> np.ndarray:
    """Return an array of the particles, ordered by id, from the device."""
    order = np.argsort(download(particles.id)[:count], kind="stable")
    rows: np.ndarray = download(getattr(particles, name))[:count][order]
    return rows


def put_by_id(particles: Particles, count: int, name: str, values: np.ndarray) -> None:
    """Write an array of the particles, given by id, to the device, where they lie in an order of their own."""
    order = np.argsort(download(particles.id)[:count], kind="stable")
    rows = np.empty_like(values)
    rows[order] = values
    upload(getattr(particles, name), rows)


def largest_norm(vectors: np.ndarray) -> float:
    """Return the length of the longest of the vectors [n, dim], 0 without any."""
    return float(np.linalg.norm(vectors, axis=1).max(initial=0.0))

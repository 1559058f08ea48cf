"""One instant of a world on the host: plain arrays that stay valid, for writers that work beside the simulation."""

import dataclasses
from collections.abc import Collection, Mapping
from typing import Any

import numpy as np

from wavetank.scene.scene import Scene
from wavetank.solids.solid import Solid

#: What an instant consists of, as `--only` names it; the surface is made of the particles.
PARTS = ("particles", "foam", "solids", "surface")
#: name -> type and numbers a row (0: one number, no axis; -1: as many as the world has dimensions)
WATER: dict[str, tuple[type, int]] = {
    "ids": (np.int32, 0),
    "positions": (np.float32, -1),
    "velocities": (np.float32, -1),
    "densities": (np.float32, 0),
    "materials": (np.int32, 0),
    "dyes": (np.int32, 0),
}
FOAM: dict[str, tuple[type, int]] = {
    "foam_ids": (np.int32, 0),
    "foam_positions": (np.float32, -1),
    "foam_velocities": (np.float32, -1),
    "foam_kinds": (np.int32, 0),
    "foam_ages": (np.float32, 0),
    "foam_lives": (np.float32, 0),
}


@dataclasses.dataclass(frozen=True)
class Standing:
    """A solid where it stands."""

    name: str
    solid: Solid
    position: np.ndarray  # m, float64 [3]: of its frame
    rotation: np.ndarray  # unit quaternion (w, x, y, z), float64 [4]
    velocity: np.ndarray  # m/s, float64 [3]: of the frame of a body; zero for other solids
    angular_velocity: np.ndarray  # rad/s, float64 [3], likewise


@dataclasses.dataclass(frozen=True)
class Instant:
    """Particles by id, spray, foam and bubbles in the order of their births, solids; see `Frame` for each array."""

    scene: Scene
    number: int  # frames of the simulation since the start
    time: float  # s of water since the start
    ids: np.ndarray
    positions: np.ndarray
    velocities: np.ndarray
    densities: np.ndarray
    materials: np.ndarray
    dyes: np.ndarray
    foam_ids: np.ndarray
    foam_positions: np.ndarray
    foam_velocities: np.ndarray
    foam_kinds: np.ndarray
    foam_ages: np.ndarray
    foam_lives: np.ndarray
    standing: tuple[Standing, ...] = ()
    surfaces: tuple[Any, ...] = ()  # of the fluids, see `formats/surface.py`

    @classmethod
    def of(cls, frame: Any) -> "Instant":
        """Return a frame's instant, or an instant itself."""
        if isinstance(frame, cls):
            return frame
        arrays = {name: getattr(frame, name) for name in (*WATER, *FOAM)}
        return cls(scene=frame.scene, number=frame.number, time=frame.time, standing=frame.standing, **arrays)

    @classmethod
    def read(
        cls, scene: Scene, number: int, time: float, arrays: Mapping[str, np.ndarray], standing: tuple[Standing, ...]
    ) -> "Instant":
        """Return an instant from what a file holds; what the file does not hold is empty or 0.

        Raises `ValueError` for arrays that are none of particles of this scene.
        """
        count, foam = len(arrays.get("positions", ())), len(arrays.get("foam_positions", ()))
        whole: dict[str, Any] = {}
        for names, rows in ((WATER, count), (FOAM, foam)):
            for name, (kind, width) in names.items():
                shape = (rows, scene.dim) if width else (rows,)
                value: np.ndarray = np.asarray(arrays.get(name, np.zeros(shape, kind)))
                value = value.astype(kind) if value.shape == shape or value.size else np.zeros(shape, kind)
                if value.shape != shape or not np.isfinite(value).all():
                    raise ValueError(f"{name} are {list(value.shape)}, or not finite; {list(shape)} are needed")
                whole[name] = value
        if count and "ids" not in arrays:
            whole["ids"] = np.arange(count, dtype=np.int32)
        materials = whole["materials"]
        if count and not 0 <= materials.min() <= materials.max() < len(scene.palette()):
            raise ValueError(f"materials go from {materials.min()} to {materials.max()}; it has {len(scene.palette())}")
        poses = [getattr(one, name) for one in standing for name in ("position", "rotation")]
        if not (np.isfinite(time) and all(np.isfinite(pose).all() for pose in poses)):
            raise ValueError("a time or a pose is not finite")
        return cls(scene=scene, number=number, time=time, standing=standing, **whole)

    @property
    def dim(self) -> int:
        """Number of dimensions of the world, 2 or 3."""
        return self.scene.dim

    @property
    def count(self) -> int:
        """Number of particles."""
        return len(self.ids)

    @property
    def size(self) -> int:
        """Bytes taken."""
        return sum(getattr(self, name).nbytes for name in (*WATER, *FOAM)) + 256 * len(self.standing)

    def only(self, parts: Collection[str]) -> "Instant":
        """Return this without the particles, the foam or the solids that are not among `parts`, of `PARTS`."""
        gone = [*([] if "particles" in parts else WATER), *([] if "foam" in parts else FOAM)]
        empty = {name: getattr(self, name)[:0] for name in gone}
        return dataclasses.replace(self, **empty, standing=self.standing if "solids" in parts else ())


def colors_of(instant: Any) -> np.ndarray:
    """Return the colour of each particle, uint8 [count, 3], sRGB: that of its material, and of its dye by its strength.

    `instant` is an `Instant` or a `Frame`.
    """
    palette = [material.color or "#2f7fd0" for material in instant.scene.palette()]
    table = np.array([[int(text[k : k + 2], 16) for k in (1, 3, 5)] for text in palette], np.float32)
    dye = instant.dyes.astype(np.int64)
    share = ((dye >> 24) & 0x7F)[:, None].astype(np.float32) / 127.0
    tint = np.stack([(dye >> 16) & 0xFF, (dye >> 8) & 0xFF, dye & 0xFF], axis=1).astype(np.float32)
    mixed = table[instant.materials] * (1.0 - share) + tint * share
    return np.round(mixed).astype(np.uint8)


def in_space(rows: np.ndarray) -> np.ndarray:
    """Return vectors [n, 2] or [n, 3] as vectors in space, float32 [n, 3]."""
    result = np.zeros((len(rows), 3), np.float32)
    result[:, : rows.shape[1]] = rows
    return result


def solids_by_name(scene: Scene) -> dict[str, Solid]:
    """Return the solids of a scene by the names that a running world gives them: "solid 1" and so on without one."""
    found: dict[str, Solid] = {}
    for solid in scene.solids:
        name, number = solid.name, 1
        while not name or name in found:
            name, number = f"solid {number}", number + 1
        found[name] = solid
    return found

"""What readers of robots share: where parts are, what they weigh, numbers of attributes."""

import dataclasses
import math
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from wavetank.foundation.errors import WavetankError
from wavetank.foundation.rotations import product, turned, unit_quaternion
from wavetank.scene.joints import Joint
from wavetank.solids.meshes.files import SUFFIXES
from wavetank.solids.meshes.mesh import Mesh
from wavetank.solids.motion import Pose
from wavetank.solids.shapes import Sphere, Union, moved
from wavetank.solids.solid import Solid

LARGEST = 20_000_000  # characters
MOST_LINKS = 300  # and joints
MOST_SHAPES = 1000  # of a link
STANDING = unit_quaternion([math.sqrt(0.5), -math.sqrt(0.5), 0.0, 0.0])  # z to y
TINY = 0.01  # m, radius of a link that has a mass and no shape
HERE: Pose = (np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))


@dataclasses.dataclass(frozen=True)
class Robot:
    """The solids and joints of a robot, to be put into a scene, and what of the file they do not have."""

    name: str
    solids: tuple[Solid, ...]
    joints: tuple[Joint, ...]
    notes: tuple[str, ...]

    def with_walls(self, thickness: float) -> "Robot":
        """Return this with walls of that thickness [m] for the faces of meshes that are not closed."""
        from wavetank.formats.splishsplash_solids import is_closed

        def walled(solid: Any) -> Any:
            if hasattr(solid, "parts"):
                return solid.model_copy(update={"parts": [walled(part) for part in solid.parts]})
            is_open = isinstance(solid, Mesh) and not is_closed(solid.surface()[1])
            if not is_open:
                return solid
            changed = solid.model_copy()
            changed.thickness = thickness
            return changed

        return dataclasses.replace(self, solids=tuple(map(walled, self.solids)))

    def joined(self, scene: Any) -> Any:
        """Return a scene with this robot in it. Raises `WavetankError` where names are taken."""
        if scene.dim == 2:
            raise WavetankError("a robot needs a 3-D world, and this scene is flat; put it into another one.")
        taken = {solid.name for solid in scene.solids} & {solid.name for solid in self.solids}
        if taken:
            raise WavetankError(f"the scene has solids named {', '.join(sorted(taken))} already; give prefix another.")
        return scene.changed(solids=[*scene.solids, *self.solids], joints=[*scene.joints, *self.joints])


def numbers(row: ElementTree.Element | dict[str, str] | None, key: str, otherwise: tuple[float, ...]) -> Any:
    """Return the numbers of an attribute: as many as `otherwise` has, three where that is empty."""
    text = None if row is None else row.get(key)
    if text is None:
        return otherwise
    found, least = tuple(float(word) for word in text.split()), len(otherwise) or 3
    if len(found) < least or not all(map(math.isfinite, found)):
        tag = f"<{row.tag[:60]} " if isinstance(row, ElementTree.Element) else "<"
        raise WavetankError(f"{tag}{key}={text[:60]!r}> is not {least} numbers.")
    return found


def then(first: Pose, second: Pose) -> Pose:
    """Return the pose `second`, which is in the frame of `first`."""
    return first[0] + turned(first[1], second[0]), product(first[1], second[1])


def carried(shape: Solid, pose: Pose, **fields: Any) -> Solid:
    """Return a shape of a frame that has that pose, in the world; `fields` change it."""
    place, turn = then(pose, (shape.origin, shape.quaternion))
    there = moved(shape, place, turn)
    return type(there).model_validate(vars(there) | fields) if fields else there


def whole(parts: list[Solid], place: Pose, fields: dict[str, Any]) -> Solid:
    """Return a solid of parts that are in the frame with that pose."""
    if len(parts) == 1:
        return carried(parts[0], place, **fields)
    position, rotation = (tuple(map(float, row)) for row in place)
    return Union(parts=parts, center=position, rotation=rotation, **fields)


def weight_of(name: str, mass: float, notes: list[str]) -> dict[str, Any]:
    """Return what makes a body of a link that has that mass [kg]."""
    if mass > 0.0:
        return {"mass": mass}
    notes.append(f"link {name} has no mass; it is as heavy as water.")
    return {"density": 1000.0}


def tiny(name: str, notes: list[str]) -> Solid:
    """Return the shape of a link that has none."""
    notes.append(f"link {name} has no shape; it is a ball of {TINY:g} m here.")
    return Sphere(center=(0.0, 0.0, 0.0), radius=TINY)


def mesh_at(link: str, found: Path | None, name: str, scale: Any, place: Pose) -> Mesh:
    """Return the mesh of the file `found`, which a robot calls `name`, at a pose in the frame of its link."""
    if found is None:
        raise WavetankError(f"link {link}: there is no file {name} next to it or in the folders around.")
    if found.suffix.lower() not in SUFFIXES:
        raise WavetankError(
            f"link {link}: {found.name} is not read; meshes are {', '.join(SUFFIXES)} files: convert it."
        )
    from wavetank.formats.splishsplash_solids import arrays_of

    vertices, faces = arrays_of(found)
    return mesh_of(vertices * np.array(scale[:3]), faces, place)


def mesh_of(vertices: np.ndarray, faces: np.ndarray, place: Pose) -> Mesh:
    """Return a mesh from arrays in a frame with that pose."""
    lower, upper = vertices.min(axis=0), vertices.max(axis=0)
    middle = place[0] + turned(place[1], 0.5 * (lower + upper))
    size = tuple(map(float, np.maximum(upper - lower, 1e-6)))
    return Mesh.of(vertices, faces, center=tuple(map(float, middle)), size=size, rotation=tuple(map(float, place[1])))


def hex_of(rgba: Any) -> str:
    """Return `#rrggbb` of parts from 0 to 1."""
    return "#" + "".join(f"{round(255 * min(max(part, 0.0), 1.0)):02x}" for part in rgba[:3])

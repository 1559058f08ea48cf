"""Robots from URDF files (wiki.ros.org/urdf/XML): links become solids and bodies, joints become ours.

There z is up, here y: the robot is turned so that it stands. A link is what is fixed together: links on fixed joints
become part of the one that they hang on. Their shapes are those for collisions, or those to be seen where there are
none. What has no counterpart is told, one sentence each.
"""

import dataclasses
import math
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from wavetank.foundation.door import guarded, named, one_line, parse_xml, read_text
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.rotations import product, turned, unit_quaternion
from wavetank.scene.joints import Hinge, Joint, Slider
from wavetank.solids.meshes.files import SUFFIXES
from wavetank.solids.meshes.mesh import Mesh
from wavetank.solids.motion import Pose
from wavetank.solids.shapes import Box, Cylinder, Sphere, Union, moved
from wavetank.solids.solid import Solid

LARGEST = 20_000_000  # characters
MOST_LINKS = 300  # and joints
MOST_SHAPES = 1000  # of a link
STANDING = unit_quaternion([math.sqrt(0.5), -math.sqrt(0.5), 0.0, 0.0])  # z to y
TINY = 0.01  # m, radius of a link that has a mass and no shape
MOVING = {"revolute": Hinge, "continuous": Hinge, "prismatic": Slider}


@dataclasses.dataclass(frozen=True)
class Robot:
    """The solids and joints of a robot, to be put into a scene, and what of the file they do not have."""

    name: str
    solids: tuple[Solid, ...]
    joints: tuple[Joint, ...]
    notes: tuple[str, ...]

    def joined(self, scene: Any) -> Any:
        """Return a scene with this robot in it. Raises `WavetankError` where names are taken."""
        taken = {solid.name for solid in scene.solids} & {solid.name for solid in self.solids}
        if taken:
            raise WavetankError(f"the scene has solids named {', '.join(sorted(taken))} already; give prefix another.")
        return scene.changed(solids=[*scene.solids, *self.solids], joints=[*scene.joints, *self.joints])


def load_urdf(
    path: str | Path, position: Any = (0.0, 0.0, 0.0), angle: float = 0.0, prefix: str = "", held: bool = True
) -> Robot:
    """Read a URDF file as a robot at rest, all its joints at 0, their motors holding them there.

    Its root stands at `position` [m], shape [3], turned by `angle` [rad] about the upright axis; `held` is false for a
    robot that is not fixed to the ground. `prefix` comes before all names. Raises `WavetankError`.
    """
    origin = named(path)
    upright = unit_quaternion([math.cos(0.5 * angle), 0.0, math.sin(0.5 * angle), 0.0])
    place = np.array(position, float), product(upright, STANDING)
    with guarded(origin, "robot"):
        text = read_text(path, "URDF file", LARGEST)
        root = parse_xml(text, origin, "a URDF file")
        if root.tag != "robot":
            raise WavetankError(f"{origin}: a URDF file has a robot at its top; this one has <{root.tag[:60]}>.")
        try:
            return _Reader(root, Path(path), prefix, held).read(place)
        except (WavetankError, LookupError, ValueError, TypeError, AttributeError, OverflowError, OSError) as error:
            reason = f"{type(error).__name__} {error}" if not isinstance(error, WavetankError) else str(error)
            raise WavetankError(f"{origin}: the robot cannot be read: {one_line(reason)}.") from None


class _Reader:
    """Reads one file."""

    def __init__(self, root: ElementTree.Element, path: Path, prefix: str, held: bool) -> None:
        self.root, self.path, self.prefix, self.held = root, path, prefix, held
        self.links = {link.attrib["name"]: link for link in root.findall("link")}
        self.joints = root.findall("joint")
        self.colors = {
            str(row.get("name")): _color(row) for row in root.findall("material") if row.find("color") is not None
        }
        self.notes: list[str] = []
        self.reached: set[str] = set()
        self.solids: list[Solid] = []
        self.made: list[Joint] = []

    def read(self, place: Pose) -> Robot:
        """Return the robot with its root there."""
        children = {_end(joint, "child") for joint in self.joints}
        missing = sorted((children | {_end(joint, "parent") for joint in self.joints}) - set(self.links))
        if missing:
            raise WavetankError(f"its joints name links that it does not have: {', '.join(missing)}.")
        for what, rows in (("links", self.links), ("joints", self.joints)):
            if len(rows) > MOST_LINKS:
                raise WavetankError(f"it has {len(rows):,} {what}; at most {MOST_LINKS} are allowed.")
        roots = [name for name in self.links if name not in children]
        if len(roots) != 1:
            raise WavetankError(f"it has {len(roots)} roots; a robot is a tree with one link that no joint leads to.")
        self._add(roots[0], place, "")
        if len(self.reached) < len(self.links):
            raise WavetankError(f"no joints lead from its root to {', '.join(sorted(set(self.links) - self.reached))}.")
        if len({solid.name for solid in self.solids}) < len(self.solids) or not self.solids:
            raise WavetankError("it has no links with a shape, or two of the same name.")
        return Robot(
            str(self.root.get("name", self.path.stem)), tuple(self.solids), tuple(self.made),
            tuple(dict.fromkeys(self.notes)),
        )  # fmt: skip

    def _add(self, name: str, place: Pose, before: str) -> str:
        """Add a link at that pose with all that is fixed to it, then what moves on it; return the solid's name."""
        mass, parts, color, moving = 0.0, [], "", []
        waiting: list[tuple[str, Pose]] = [(name, (np.zeros(3), unit_quaternion(0.0)))]
        while waiting:
            link, at = waiting.pop()
            if link in self.reached:
                raise WavetankError(f"two joints lead to link {link}.")
            self.reached.add(link)
            own, shapes, paint = self._link(link)
            mass, color = mass + own, color or paint
            parts += [_carried(shape, at) for shape in shapes]
            for joint in self.joints:
                if _end(joint, "parent") == link:
                    pose = _then(at, _origin(joint))
                    if joint.get("type") == "fixed":
                        waiting.append((_end(joint, "child"), pose))
                    else:
                        moving.append((joint, pose))
        whole = self.prefix + name
        solid = self._solid(whole, place, (parts, mass, color), is_root=not before)
        if solid is not None:
            self.solids.append(solid)
        for joint, pose in moving:
            self._join(joint, _then(place, pose), whole if solid is not None else "")
        return whole if solid is not None else ""

    def _solid(self, name: str, place: Pose, about: tuple[list[Solid], float, str], is_root: bool) -> Solid | None:
        parts, mass, color = about
        is_body = not (is_root and self.held)
        if not parts:
            if not is_body or (is_root and not mass):
                return None
            self.notes.append(f"link {name} has no shape; it is a ball of {TINY:g} m here.")
            parts = [Sphere(center=(0.0, 0.0, 0.0), radius=TINY)]
        fields: dict[str, Any] = {"name": name, "color": color}
        if is_body and mass > 0.0:
            fields["mass"] = mass
            self.notes.append("moments of inertia follow from the shapes and masses of links, not from <inertia>.")
        elif is_body:
            fields["density"] = 1000.0
            self.notes.append(f"link {name} has no mass; it is as heavy as water.")
        position, rotation = (tuple(map(float, row)) for row in place)
        if len(parts) == 1:
            return _carried(parts[0], place, **fields)
        return Union(parts=parts, center=position, rotation=rotation, **fields)

    def _join(self, row: ElementTree.Element, place: Pose, before: str) -> None:
        """Add what a joint leads to, and the joint, which is at that pose."""
        child = self._add(_end(row, "child"), place, before or "world")
        name, kind = self.prefix + str(row.get("name", "joint")), str(row.get("type"))
        if row.find("mimic") is not None:
            self.notes.append(f"joint {name} follows another one there; here it has a motor of its own.")
        if kind not in MOVING:
            if kind != "floating":
                self.notes.append(f"joint {name} is {kind}, which is not there; both links are free.")
            return
        axis = turned(place[1], np.array(_numbers(row.find("axis"), "xyz", (1.0, 0.0, 0.0))))
        fields: dict[str, Any] = {
            "name": name, "first": child, "second": before, "at": tuple(map(float, place[0])),
            "axis": tuple(map(float, np.round(axis, 12))), "target": 0.0,
        }  # fmt: skip
        limit = row.find("limit")
        if limit is not None and kind != "continuous":
            lower, upper = float(limit.get("lower", 0.0)), float(limit.get("upper", 0.0))
            if lower < upper:
                fields["limits"] = (lower, upper)
                fields["target"] = min(max(0.0, lower), upper)
        if limit is not None and float(limit.get("effort", 0.0)) > 0.0:
            fields["strength"] = float(limit.get("effort", 0.0))
        self.made.append(MOVING[kind](**fields))

    def _link(self, name: str) -> tuple[float, list[Solid], str]:
        """Return mass [kg], shapes in the link's frame, and colour of a link."""
        link = self.links[name]
        mass = link.find("inertial/mass")
        rows = link.findall("collision") or link.findall("visual")
        if len(rows) > MOST_SHAPES:
            raise WavetankError(f"link {name} has {len(rows):,} shapes; at most {MOST_SHAPES:,} are allowed.")
        shapes = [self._shape(name, row) for row in rows]
        paint = link.find("visual/material")
        color = "" if paint is None else _color(paint) or self.colors.get(str(paint.get("name")), "")
        return 0.0 if mass is None else float(mass.attrib["value"]), shapes, color

    def _shape(self, link: str, row: ElementTree.Element) -> Solid:
        """Return a shape in the frame of its link."""
        found = row.find("geometry")
        kind = found[0] if found is not None and len(found) else None
        if kind is None:
            raise WavetankError(f"link {link} has a shape without geometry.")
        position, rotation = _origin(row)
        center, turn = tuple(map(float, position)), tuple(map(float, rotation))
        if kind.tag == "box":
            return Box(center=center, size=tuple(_numbers(kind, "size", ())), rotation=turn)
        if kind.tag == "sphere":
            return Sphere(center=center, radius=float(kind.attrib["radius"]))
        if kind.tag in ("cylinder", "capsule"):
            half = turned(rotation, np.array([0.0, 0.0, 0.5 * float(kind.attrib["length"])]))
            start, end = (tuple(map(float, position + side * half)) for side in (-1.0, 1.0))
            return Cylinder(start=start, end=end, radius=float(kind.attrib["radius"]))
        if kind.tag == "mesh":
            return self._mesh(link, kind, (position, rotation))
        raise WavetankError(f"link {link} has a {kind.tag}; box, sphere, cylinder and mesh are read.")

    def _mesh(self, link: str, row: ElementTree.Element, place: Pose) -> Solid:
        name = row.attrib["filename"].removeprefix("file://")
        plain = Path(name.split("://", 1)[-1])
        folders = [self.path.parent, *self.path.parent.parents[:3]]
        tails = [Path(*plain.parts[k:]) for k in range(len(plain.parts))]
        found = next((folder / tail for folder in folders for tail in tails if (folder / tail).is_file()), None)
        if found is None:
            raise WavetankError(f"link {link}: there is no file {name} beside it or in the folders around.")
        if found.suffix.lower() not in SUFFIXES:
            raise WavetankError(
                f"link {link}: {found.name} is not read; meshes are {', '.join(SUFFIXES)} files: convert it."
            )
        from wavetank.formats.splishsplash_solids import arrays_of

        vertices, faces = arrays_of(found)
        vertices = vertices * np.array(_numbers(row, "scale", (1.0, 1.0, 1.0)))
        lower, upper = vertices.min(axis=0), vertices.max(axis=0)
        middle = place[0] + turned(place[1], 0.5 * (lower + upper))
        size = tuple(map(float, np.maximum(upper - lower, 1e-6)))
        return Mesh.of(
            vertices, faces, center=tuple(map(float, middle)), size=size, rotation=tuple(map(float, place[1]))
        )  # fmt: skip


def _end(joint: ElementTree.Element, which: str) -> str:
    found = joint.find(which)
    if found is None:
        raise WavetankError(f"joint {joint.get('name')!r} has no {which}.")
    return str(found.attrib["link"])


def _numbers(row: ElementTree.Element | None, key: str, otherwise: tuple[float, ...]) -> tuple[float, ...]:
    """Return the numbers of an attribute: as many as `otherwise` has, three where that is empty."""
    if row is None or row.get(key) is None:
        return otherwise
    numbers = tuple(float(word) for word in str(row.get(key)).split())
    if len(numbers) < (len(otherwise) or 3) or not all(map(math.isfinite, numbers)):
        raise WavetankError(f"<{row.tag[:60]} {key}={str(row.get(key))[:60]!r}> is not {len(otherwise) or 3} numbers.")
    return numbers


def _origin(row: ElementTree.Element) -> Pose:
    """Return the pose of <origin>; roll, pitch and yaw are about the fixed x, then y, then z."""
    found = row.find("origin")
    place = np.array(_numbers(found, "xyz", (0.0, 0.0, 0.0)))
    turn = unit_quaternion(0.0)
    for axis, angle in enumerate(_numbers(found, "rpy", (0.0, 0.0, 0.0))):
        vector = np.zeros(3)
        vector[axis] = math.sin(0.5 * angle)
        turn = product(np.array([math.cos(0.5 * angle), *vector]), turn)
    return place, turn


def _then(first: Pose, second: Pose) -> Pose:
    """Return the pose `second`, which is in the frame of `first`."""
    return first[0] + turned(first[1], second[0]), product(first[1], second[1])


def _carried(shape: Solid, pose: Pose, **fields: Any) -> Solid:
    """Return a shape of a frame that has that pose, in the world; `fields` change it."""
    place, turn = _then(pose, (shape.origin, shape.quaternion))
    there = moved(shape, place, turn)
    return type(there).model_validate(vars(there) | fields) if fields else there


def _color(row: ElementTree.Element) -> str:
    found = row.find("color")
    if found is None:
        return ""
    return "#" + "".join(f"{round(255 * min(max(part, 0.0), 1.0)):02x}" for part in _numbers(found, "rgba", ())[:3])

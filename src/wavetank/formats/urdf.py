"""Robots from URDF files (wiki.ros.org/urdf/XML): links become solids and bodies, joints become ours.

There z is up, here y: the robot is turned so that it stands. A link is what is fixed together: links on fixed joints
become part of the one that they hang on. Their shapes are those for collisions, or those to be seen where there are
none. What has no counterpart is told, one sentence each.
"""

import math
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from wavetank.formats.robot import (
    HERE,
    MOST_LINKS,
    MOST_SHAPES,
    Robot,
    carried,
    hex_of,
    mesh_at,
    numbers,
    then,
    tiny,
    weight_of,
    whole,
)
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.rotations import product, turned, unit_quaternion
from wavetank.scene.joints import Hinge, Joint, Slider
from wavetank.solids.motion import Pose
from wavetank.solids.shapes import Box, Cylinder, Sphere
from wavetank.solids.solid import Solid

MOVING = {"revolute": Hinge, "continuous": Hinge, "prismatic": Slider}


def read_urdf(root: ElementTree.Element, path: Path, place: Pose, prefix: str, held: bool | None) -> Robot:
    """Return the robot of the top element of a URDF file, its root at that pose."""
    return _Reader(root, path, prefix, held is not False).read(place)


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
            str(self.root.get("name", self.path.stem)),
            tuple(self.solids),
            tuple(self.made),
            tuple(dict.fromkeys(self.notes)),
        )

    def _add(self, name: str, place: Pose, before: str) -> str:
        """Add a link at that pose with all that is fixed to it, then what moves on it; return the solid's name."""
        mass, parts, color, moving = 0.0, [], "", []
        waiting: list[tuple[str, Pose]] = [(name, HERE)]
        while waiting:
            link, at = waiting.pop()
            if link in self.reached:
                raise WavetankError(f"two joints lead to link {link}.")
            self.reached.add(link)
            own, shapes, paint = self._link(link)
            mass, color = mass + own, color or paint
            parts += [carried(shape, at) for shape in shapes]
            for joint in self.joints:
                if _end(joint, "parent") == link:
                    pose = then(at, _origin(joint))
                    if joint.get("type") == "fixed":
                        waiting.append((_end(joint, "child"), pose))
                    else:
                        moving.append((joint, pose))
        title = self.prefix + name
        solid = self._solid(title, place, (parts, mass, color), is_root=not before)
        if solid is not None:
            self.solids.append(solid)
        for joint, pose in moving:
            self._join(joint, then(place, pose), title if solid is not None else "")
        return title if solid is not None else ""

    def _solid(self, name: str, place: Pose, about: tuple[list[Solid], float, str], is_root: bool) -> Solid | None:
        parts, mass, color = about
        is_body = not (is_root and self.held)
        if not parts:
            if not is_body or (is_root and not mass):
                return None
            parts = [tiny(name, self.notes)]
        fields: dict[str, Any] = {"name": name, "color": color}
        if is_body:
            fields |= weight_of(name, mass, self.notes)
        if "mass" in fields:
            self.notes.append("moments of inertia follow from the shapes and masses of links, not from <inertia>.")
        return whole(parts, place, fields)

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
        axis = turned(place[1], np.array(numbers(row.find("axis"), "xyz", (1.0, 0.0, 0.0))))
        fields: dict[str, Any] = {
            "name": name,
            "first": child,
            "second": before,
            "at": tuple(map(float, place[0])),
            "axis": tuple(map(float, np.round(axis, 12))),
            "target": 0.0,
        }
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
            return Box(center=center, size=tuple(numbers(kind, "size", ())), rotation=turn)
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
        return mesh_at(link, found, name, numbers(row, "scale", (1.0, 1.0, 1.0)), place)


def _end(joint: ElementTree.Element, which: str) -> str:
    found = joint.find(which)
    if found is None:
        raise WavetankError(f"joint {joint.get('name')!r} has no {which}.")
    return str(found.attrib["link"])


def _origin(row: ElementTree.Element) -> Pose:
    """Return the pose of <origin>; roll, pitch and yaw are about the fixed x, then y, then z."""
    found = row.find("origin")
    place = np.array(numbers(found, "xyz", (0.0, 0.0, 0.0)))
    turn = unit_quaternion(0.0)
    for axis, angle in enumerate(numbers(found, "rpy", (0.0, 0.0, 0.0))):
        vector = np.zeros(3)
        vector[axis] = math.sin(0.5 * angle)
        turn = product(np.array([math.cos(0.5 * angle), *vector]), turn)
    return place, turn


def _color(row: ElementTree.Element) -> str:
    found = row.find("color")
    return "" if found is None else hex_of(numbers(found, "rgba", ()))

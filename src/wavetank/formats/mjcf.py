"""Robots from MJCF files of MuJoCo (mujoco.readthedocs.io/en/stable/XMLreference.html): bodies, joints, actuators.

There z is up, here y. Bodies without joints become part of what they are in; those of the world stay where they are.
Geoms that touch nothing (contype and conaffinity 0) are for the eye, and left out where a body has others. What has no
counterpart is told, one sentence each.
"""

import dataclasses
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from wavetank.formats.mjcf_values import Angles, Row, classes_of, motor_of, shape_of
from wavetank.formats.robot import (
    HERE,
    LARGEST,
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
from wavetank.foundation.input_limits import parse_xml, printable, read_text
from wavetank.foundation.rotations import turned
from wavetank.scene.joints import BallJoint, Hinge, Joint, Slider, Weld
from wavetank.solids.motion import Pose
from wavetank.solids.solid import Solid

MOST_FILES = 50  # of a model
WATER = 1000.0  # kg/m^3, of geoms that tell no density
MOTORS = ("motor", "position", "velocity", "general")
LEFT_OUT = ("tendon", "contact", "deformable", "extension", "keyframe")
UNSEEN = ("light", "camera", "site")
UNREAD = ("composite", "flexcomp", "replicate", "attach", "plugin")
RESISTING = ("damping", "stiffness", "frictionloss", "armature")


def read_mjcf(root: ElementTree.Element, path: Path, place: Pose, prefix: str, held: bool | None) -> Robot:
    """Return the robot of the top element of an MJCF file, its world at that pose."""
    return _Reader(_included(root, path.parent, {path.resolve()}), path, prefix, held).read(place)


@dataclasses.dataclass
class _Link:
    """Bodies that hold together: what they consist of, in the frame of the first."""

    parts: list[Solid] = dataclasses.field(default_factory=list)
    seen: list[Solid] = dataclasses.field(default_factory=list)  # parts that touch nothing
    mass: float = 0.0  # kg
    color: str = ""
    moving: list[tuple[ElementTree.Element, Pose, str]] = dataclasses.field(default_factory=list)


class _Reader:
    """Reads one file."""

    def __init__(self, root: ElementTree.Element, path: Path, prefix: str, held: bool | None) -> None:
        self.root, self.path, self.prefix, self.held = root, path, prefix, held
        self.compiler: Row = {}
        for row in root.findall("compiler"):
            self.compiler |= row.attrib
        self.angles, self.classes = Angles(self.compiler), classes_of(root)
        self.assets = {
            (row.tag, row.get("name") or Path(row.get("file", "")).stem): row for row in root.findall("asset/*")
        }
        self.notes: list[str] = []
        self.solids: list[Solid] = []
        self.joints: list[Joint] = []
        self.bodies = 0
        self.places: dict[str, tuple[str, Pose]] = {}  # of each body: the solid that it is in, and where it is

    def read(self, place: Pose) -> Robot:
        """Return the robot with its world there."""
        motors, ground = self._motors(), _Link()
        for world in self.root.findall("worldbody"):
            for row, pose, around in self._flat(world, HERE, ""):
                if row.tag == "geom":
                    self._geom("the world", row, then(place, pose), around, ground)
                elif row.tag == "body":
                    self._body(row, then(place, then(pose, self.angles.pose(row))), around, "")
        for number, shape in enumerate(ground.parts, 1):
            fields = {"name": f"{self.prefix}ground {number}", "color": shape.color}
            self.solids.append(type(shape).model_validate(vars(shape) | fields))
        self._equalities()
        self._drive(motors)
        for tag in LEFT_OUT:
            if self.root.find(tag) is not None:
                self.notes.append(f"<{tag}> is left out.")
        if any(self.root.find(f"worldbody//{tag}") is not None for tag in UNSEEN) or self.root.find("sensor"):
            self.notes.append("cameras, lights, sites and sensors are left out.")
        names = [solid.name for solid in self.solids]
        if not names or len(set(names)) < len(names):
            raise WavetankError("it has no bodies with a shape, or two of the same name.")
        title = str(self.root.get("model", self.path.stem))
        return Robot(title, tuple(self.solids), tuple(self.joints), tuple(dict.fromkeys(self.notes)))

    # --- elements ---

    def _with(self, row: ElementTree.Element, around: str, tag: str = "") -> Row:
        """Return the attributes of an element, and those of its class that it does not say."""
        name = row.get("class") or around or "main"
        if name not in self.classes:
            raise WavetankError(f"<{row.tag[:60]}> has the class {name[:60]!r}, which no <default> says.")
        return {**self.classes[name].get(tag or row.tag, {}), **row.attrib}

    def _flat(
        self, row: ElementTree.Element, pose: Pose, around: str
    ) -> Iterator[tuple[ElementTree.Element, Pose, str]]:
        """Yield what is in a body, with the frame that it is in and its class; <frame> only groups."""
        around = row.get("childclass") or around
        for child in row:
            if child.tag == "frame":
                yield from self._flat(child, then(pose, self.angles.pose(child)), around)
            else:
                if child.tag in UNREAD:
                    self.notes.append(f"<{child.tag}> is left out.")
                yield child, pose, around

    # --- bodies ---

    def _body(self, row: ElementTree.Element, place: Pose, around: str, before: str) -> str:
        """Add a body that is at `place` with all that is fixed to it, then what moves on it; return its name."""
        name, link = self._name(row), _Link()
        joints = self._gather(row, HERE, around, name, link)
        free = any(joint.tag == "freejoint" or self._with(joint, c).get("type") == "free" for joint, _, c in joints)
        is_body = bool(joints or before) if self.held is not False else True
        solid = self._solid(name, place, link, is_body, held=bool(free and self.held) or row.get("mocap") == "true")
        if solid is not None:
            self.solids.append(solid)
            if not free:
                self._join(name, place, joints, before)
        end = name if solid is not None else ""
        for title, (owner, pose) in self.places.items():
            if owner == name:
                self.places[title] = (end, then(place, pose))
        for child, pose, inner in link.moving:
            self._body(child, then(place, pose), inner, end)
        return end

    def _gather(
        self, row: ElementTree.Element, at: Pose, around: str, owner: str, link: _Link
    ) -> list[tuple[ElementTree.Element, Pose, str]]:
        """Add what a body at `at` consists of to a link; return its joints, with their frames and classes."""
        joints, geoms, told = [], 0.0, None
        self.bodies += 1
        if self.bodies > MOST_LINKS:
            raise WavetankError(f"it has more than {MOST_LINKS} bodies, which is the limit.")
        self.places[str(row.get("name"))] = (owner, at)
        for child, pose, inner in self._flat(row, at, around):
            if child.tag == "geom":
                geoms += self._geom(owner, child, pose, inner, link)
            elif child.tag == "inertial":
                if child.get("mass") is None:
                    raise WavetankError(f"<inertial> of body {owner} has no mass.")
                told = float(child.attrib["mass"])
                self.notes.append("moments of inertia follow from shapes and masses of bodies, not from <inertial>.")
            elif child.tag in ("joint", "freejoint"):
                joints.append((child, pose, inner))
            elif child.tag == "body":
                there = then(pose, self.angles.pose(child))
                if self._is_jointed(child):
                    link.moving.append((child, there, inner))
                else:
                    self._gather(child, there, inner, owner, link)
        link.mass += geoms if told is None else told
        return joints

    def _is_jointed(self, row: ElementTree.Element) -> bool:
        return any(child.tag in ("joint", "freejoint") for child, _, _ in self._flat(row, HERE, ""))

    def _solid(self, name: str, place: Pose, link: _Link, is_body: bool, held: bool) -> Solid | None:
        parts = link.parts or link.seen
        if len(parts) > MOST_SHAPES:
            raise WavetankError(f"body {name} has {len(parts):,} shapes; at most {MOST_SHAPES:,} are allowed.")
        if not parts:
            if not is_body:
                return None
            parts = [tiny(name, self.notes)]
        fields: dict[str, Any] = {"name": name, "color": link.color}
        if is_body:
            fields |= weight_of(name, link.mass, self.notes) | ({"held": True} if held else {})
        return whole(parts, place, fields)

    def _geom(self, owner: str, row: ElementTree.Element, at: Pose, around: str, link: _Link) -> float:
        """Add a geom to a link, in the frame that has the pose `at` there; return its mass [kg]."""
        values = self._with(row, around)
        kind = values.get("type", "sphere" if values.get("mesh") is None else "mesh")
        if kind in ("plane", "hfield", "sdf"):
            self.notes.append(f"the {kind} {row.get('name', '')!r} of {owner} is left out; a tank has a floor.")
            return 0.0
        pose = self.angles.pose(values)
        shape, volume = self._mesh(owner, values, pose) if kind == "mesh" else shape_of({**values, "type": kind}, pose)
        color = self._color(values)
        shape = carried(shape, at, color=color)
        is_seen = values.get("contype") == "0" and values.get("conaffinity") == "0"
        (link.seen if is_seen else link.parts).append(shape)
        link.color = link.color or color
        mass = values.get("mass")
        return float(values.get("density", WATER)) * volume if mass is None else float(mass)

    def _mesh(self, owner: str, values: Row, pose: Pose) -> tuple[Solid, float]:
        asset = self.assets.get(("mesh", values.get("mesh", "")))
        if asset is None:
            raise WavetankError(f"{owner} has the mesh {values.get('mesh', '')[:60]!r}, which no <asset> has.")
        file = asset.get("file")
        if file is None:
            raise WavetankError(
                f"the mesh {values.get('mesh', '')[:60]!r} names no file; corners in MJCF are not read."
            )
        folder = self.path.parent / (self.compiler.get("meshdir") or self.compiler.get("assetdir") or "")
        found = next((place for place in (folder / file, self.path.parent / file) if place.is_file()), None)
        solid = mesh_at(owner, found, file, numbers(self._with(asset, "", "mesh"), "scale", (1.0, 1.0, 1.0)), pose)
        return solid, solid.volume()

    def _color(self, values: Row) -> str:
        material = self.assets.get(("material", values.get("material", "")))
        rgba = values.get("rgba") or (None if material is None else self._with(material, "").get("rgba"))
        return "" if rgba is None else hex_of(numbers({"rgba": rgba}, "rgba", (0.5, 0.5, 0.5, 1.0)))

    def _name(self, row: ElementTree.Element) -> str:
        return self.prefix + str(row.get("name", f"body {self.bodies + 1}"))

    # --- joints ---

    def _join(self, name: str, place: Pose, rows: list[tuple[ElementTree.Element, Pose, str]], before: str) -> None:
        """Add the joints of a body that is at `place` to what it hangs on."""
        kinds = [self._with(row, around, "joint").get("type", "hinge") for row, _, around in rows]
        if kinds == ["hinge"] * 3:
            self.notes.append(f"body {name} has three hinges; here it is a ball joint, without limits and motors.")
            kinds, rows = ["ball"], rows[:1]
        elif len(kinds) > 1:
            self.notes.append(f"body {name} has {len(kinds)} joints; here it has the first of them.")
        for (row, pose, around), kind in [*zip(rows, kinds, strict=False)][:1]:
            values = self._with(row, around, "joint")
            there = then(place, pose)
            at = there[0] + turned(there[1], np.array(numbers(values, "pos", (0.0, 0.0, 0.0))[:3]))
            title = self.prefix + row.attrib["name"] if row.get("name") else ""
            ends = {"name": title, "first": name, "second": before, "at": tuple(map(float, at))}
            if kind == "ball":
                self.joints.append(BallJoint(**ends))
                continue
            if kind not in ("hinge", "slide"):
                raise WavetankError(f"a joint of {name} is a {kind[:40]}; hinge, slide, ball and free are read.")
            axis = turned(there[1], np.array(numbers(values, "axis", (0.0, 0.0, 1.0))[:3]))
            ends["axis"] = tuple(map(float, np.round(axis, 12)))
            if any(float(values.get(key, "0").split()[0]) for key in RESISTING):
                self.notes.append(f"{', '.join(RESISTING[:-1])} and {RESISTING[-1]} of joints are left out.")
            unit = self.angles.unit if kind == "hinge" else 1.0
            limits = self._limits(values, unit)
            self.joints.append((Hinge if kind == "hinge" else Slider)(**ends, limits=limits))

    def _limits(self, values: Row, unit: float) -> tuple[float, float] | None:
        """Return how far a joint goes from where it begins, which its file calls `ref`."""
        limited = values.get("limited", "auto")
        if limited == "auto" and self.compiler.get("autolimits") != "false":
            limited = str(values.get("range") is not None).lower()
        lower, upper = numbers(values, "range", (0.0, 0.0))[:2]
        begins = float(values.get("ref", 0.0))
        return (unit * (lower - begins), unit * (upper - begins)) if limited == "true" and lower < upper else None

    def _equalities(self) -> None:
        """Add joints for bodies that equality constraints connect or weld."""
        for row in self.root.findall("equality/*"):
            ends = [self.places.get(str(row.get(key, ""))) for key in ("body1", "body2")]
            if row.tag not in ("connect", "weld") or ends[0] is None or (row.get("body2") and ends[1] is None):
                self.notes.append(f"an equality, <{row.tag[:40]}>, is left out.")
                continue
            first, second = ends[0], ends[1] or ("", HERE)
            at = then(first[1], (np.array(numbers(row, "anchor", (0.0, 0.0, 0.0))[:3]), HERE[1]))[0]
            names = (first[0], second[0]) if first[0] else (second[0], first[0])
            fields = {"first": names[0], "second": names[1], "at": tuple(map(float, at))}
            self.joints.append((BallJoint if row.tag == "connect" else Weld)(**fields))

    # --- actuators ---

    def _motors(self) -> dict[str, dict[str, Any]]:
        """Return what drives each joint, by its name."""
        found: dict[str, dict[str, Any]] = {}
        for row in self.root.findall("actuator/*"):
            joint = row.get("joint") or row.get("jointinparent")
            if row.tag not in MOTORS or joint is None:
                self.notes.append(f"an actuator, <{row.tag[:40]}> {row.get('name', '')!r}, drives no joint here.")
                continue
            values = {**self.classes.get(row.get("class", "main"), {}).get("general", {}), **self._with(row, "")}
            fields = motor_of(row.tag, values)
            if not {"target", "speed"} & set(fields):
                self.notes.append(f"joint {joint} has a motor that gives a torque; set its target or speed.")
            found[self.prefix + joint] = fields
        return found

    def _drive(self, motors: dict[str, dict[str, Any]]) -> None:
        """Give joints their motors."""
        references = {
            self.prefix + str(row.get("name")): float(self._with(row, "").get("ref", 0.0))
            for row in self.root.iter("joint")
            if row.get("name")
        }
        names = {joint.name for joint in self.joints if isinstance(joint, Hinge | Slider)}
        for name in motors:
            if name not in names:
                self.notes.append(f"an actuator drives joint {name}, which is not there.")
        for number, joint in enumerate(self.joints):
            fields = dict(motors.get(joint.name, {}))
            if not fields or not isinstance(joint, Hinge | Slider):
                continue
            if "target" in fields:
                unit = self.angles.unit if isinstance(joint, Hinge) else 1.0
                lower, upper = joint.limits or (-math.inf, math.inf)
                fields["target"] = min(max(-unit * references.get(joint.name, 0.0), lower), upper)
            self.joints[number] = type(joint).model_validate(vars(joint) | fields)


def _included(root: ElementTree.Element, folder: Path, read: set[Path]) -> ElementTree.Element:
    """Put what other files hold in the place of <include>; they lie in the folder of the first, or below it.

    As MuJoCo has it, a file is included once: `read` has those so far.
    """
    for parent in [*root.iter()]:
        for number, child in [*enumerate(parent)][::-1]:
            if child.tag == "include":
                path = folder / child.get("file", "")
                if not path.resolve().is_relative_to(folder.resolve()):
                    raise WavetankError(f"it includes {child.get('file', '')[:60]!r}, which lies in another folder.")
                if path.resolve() in read or len(read) >= MOST_FILES:
                    raise WavetankError(
                        f"it includes {child.get('file', '')[:60]!r} again, or more than {MOST_FILES} files; a file is "
                        "included once."
                    )
                read.add(path.resolve())
                other = parse_xml(read_text(path, "included file", LARGEST), printable(path), "an MJCF file")
                parent.remove(child)
                for place, row in enumerate(_included(other, folder, read)):
                    parent.insert(number + place, row)
    return root

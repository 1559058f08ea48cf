"""What attributes of MJCF say: classes of defaults, the ways to write a rotation, shapes, actuators.

mujoco.readthedocs.io/en/stable/XMLreference.html
"""

import math
from typing import Any
from xml.etree import ElementTree

import numpy as np

from wavetank.formats.robot import mesh_of, numbers
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.rotations import inverse, product, quaternion_of, turn_from_y, turned, unit_quaternion
from wavetank.solids.meshes.triangles import volume_within
from wavetank.solids.motion import Pose
from wavetank.solids.shapes import Box, Capsule, Cylinder, Sphere
from wavetank.solids.solid import Solid

Row = dict[str, str]  # attributes of an element, those of its class included
Classes = dict[str, dict[str, Row]]  # by class and element
AROUND = 24  # corners of an ellipsoid's equator
Z_FROM_Y = unit_quaternion([math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0])
SHAPES = ("box", "sphere", "capsule", "cylinder", "ellipsoid", "mesh")


def classes_of(root: ElementTree.Element) -> Classes:
    """Return what each class says of each element; a class begins with what the one around it says."""
    found: Classes = {"main": {}}

    def walk(row: ElementTree.Element, before: dict[str, Row]) -> None:
        table = {tag: dict(values) for tag, values in before.items()}
        for child in row:
            if child.tag != "default":
                table[child.tag] = {**table.get(child.tag, {}), **child.attrib}
        found[row.get("class", "main")] = table
        for child in row.findall("default"):
            walk(child, table)

    for row in root.findall("default"):
        walk(row, found["main"])
    return found


class Angles:
    """How a file writes angles: in degrees or radians, and in which order."""

    def __init__(self, compiler: Row) -> None:
        self.unit = 1.0 if compiler.get("angle", "degree") == "radian" else math.pi / 180.0
        self.sequence = compiler.get("eulerseq", "xyz")
        if len(self.sequence) != 3 or set(self.sequence.lower()) - set("xyz"):
            raise WavetankError(
                f"eulerseq = {self.sequence[:20]!r} is not allowed; it is three of x, y, z, X, Y and Z."
            )

    def pose(self, row: Row | ElementTree.Element) -> Pose:
        """Return where an element is in the frame around it."""
        return np.array(numbers(row, "pos", (0.0, 0.0, 0.0))[:3]), self.turn(row)

    def turn(self, row: Any) -> np.ndarray:
        """Return the rotation of an element, in whichever way it is written."""
        if row.get("quat") is not None:
            return unit_quaternion(numbers(row, "quat", (1.0, 0.0, 0.0, 0.0))[:4])
        if row.get("axisangle") is not None:
            *axis, angle = numbers(row, "axisangle", (0.0, 0.0, 1.0, 0.0))[:4]
            return _about(np.array(axis), angle * self.unit)
        if row.get("euler") is not None:
            result = unit_quaternion(0.0)
            for name, angle in zip(self.sequence, numbers(row, "euler", (0.0, 0.0, 0.0)), strict=False):
                turn = _about(np.eye(3)["xyz".index(name.lower())], angle * self.unit)
                # Small letters are axes that have turned, large ones those of the frame around.
                result = product(result, turn) if name.islower() else product(turn, result)
            return result
        if row.get("xyaxes") is not None:
            rows = np.array(numbers(row, "xyaxes", (1.0, 0.0, 0.0, 0.0, 1.0, 0.0))[:6]).reshape(2, 3)
            if float(np.linalg.norm(np.cross(*rows))) < 1e-9:
                raise WavetankError("xyaxes are two axes that do not lie on one line.")
            x = rows[0] / np.linalg.norm(rows[0])
            y = rows[1] - x * (rows[1] @ x)
            y /= np.linalg.norm(y)
            return np.array(quaternion_of(np.column_stack([x, y, np.cross(x, y)])))
        if row.get("zaxis") is not None:
            return z_to(np.array(numbers(row, "zaxis", (0.0, 0.0, 1.0))[:3]))
        return unit_quaternion(0.0)


def z_to(axis: np.ndarray) -> np.ndarray:
    """Return the shortest turn that takes z to the direction of `axis`."""
    back = inverse(Z_FROM_Y)
    return product(product(Z_FROM_Y, turn_from_y(turned(back, axis))), back)


def shape_of(row: Row, pose: Pose) -> tuple[Solid, float]:
    """Return a geom but for a mesh, in the frame of its body, and its volume [m^3]."""
    kind = row.get("type", "sphere")
    size = numbers(row, "size", (0.0,))
    position, turn = pose
    half = size[1] if len(size) > 1 else 0.0
    if row.get("fromto") is not None:
        ends = np.array(numbers(row, "fromto", (0.0,) * 6)[:6]).reshape(2, 3)
        position, turn = ends.mean(axis=0), z_to(ends[1] - ends[0])
        half = 0.5 * float(np.linalg.norm(ends[1] - ends[0]))
        size = (size[0], size[1] if kind in ("box", "ellipsoid") and len(size) > 1 else size[0], half)
    if kind in ("box", "ellipsoid") and len(size) < 3:
        raise WavetankError(f"a {kind} has three sizes, not {len(size)}; give size or fromto.")
    center = tuple(map(float, position))
    rotation = tuple(map(float, turn))
    if kind == "box":
        return Box(center=center, size=tuple(2.0 * edge for edge in size[:3]), rotation=rotation), 8.0 * math.prod(
            size[:3]
        )
    if kind == "sphere":
        return Sphere(center=center, radius=size[0]), 4.0 / 3.0 * math.pi * size[0] ** 3
    if kind == "ellipsoid":
        return _ellipsoid(np.array(size[:3]), (position, turn)), 4.0 / 3.0 * math.pi * math.prod(size[:3])
    along = turned(turn, np.array([0.0, 0.0, half]))
    start, end = (tuple(map(float, position + side * along)) for side in (-1.0, 1.0))
    disc = math.pi * size[0] ** 2
    if kind == "cylinder":
        return Cylinder(start=start, end=end, radius=size[0]), 2.0 * half * disc
    if kind == "capsule":
        return Capsule(start=start, end=end, radius=size[0]), disc * (2.0 * half + 4.0 / 3.0 * size[0])
    raise WavetankError(f"a geom is a {kind[:40]}; {', '.join(SHAPES)} are read.")


def _ellipsoid(axes: np.ndarray, pose: Pose) -> Solid:
    """Return a mesh of an ellipsoid whose volume is that of the round one."""
    rings = AROUND // 2
    down, around = np.meshgrid(
        np.pi * np.arange(1, rings) / rings, 2.0 * np.pi * np.arange(AROUND) / AROUND, indexing="ij"
    )
    ring = np.stack([np.sin(down) * np.cos(around), np.sin(down) * np.sin(around), np.cos(down)], axis=-1)
    points = np.concatenate([[[0.0, 0.0, 1.0]], ring.reshape(-1, 3), [[0.0, 0.0, -1.0]]])
    faces, last = [], len(points) - 1
    for k in range(AROUND):
        n = (k + 1) % AROUND
        faces += [(0, 1 + k, 1 + n), (last, last - AROUND + n, last - AROUND + k)]
        for r in range(rings - 2):
            a, b = 1 + r * AROUND, 1 + (r + 1) * AROUND
            faces += [(a + k, b + k, b + n), (a + k, b + n, a + n)]
    points *= (4.0 / 3.0 * math.pi / volume_within(points, np.array(faces))) ** (1.0 / 3.0)
    return mesh_of(points * axes, np.array(faces), pose)


def motor_of(kind: str, row: Row) -> dict[str, Any]:
    """Return what an actuator makes of a joint: `strength`, and `target` or `speed` where it is a servo."""
    gear = abs(numbers(row, "gear", (1.0,))[0])
    most = numbers(row, "forcerange", (0.0, 0.0))
    fields: dict[str, Any] = {}
    if kind == "general":
        bias = numbers(row, "biasprm", (0.0, 0.0, 0.0)) if row.get("biastype") == "affine" else (0.0, 0.0, 0.0)
        kind = "position" if bias[1] else "velocity" if bias[2] else "motor"
    if kind == "position":
        fields["target"] = 0.0
    elif kind == "velocity":
        fields["speed"] = 0.0
    else:
        most = most if any(most) else numbers(row, "ctrlrange", (0.0, 0.0))
    strength = gear * max(map(abs, most[:2]))
    return fields | ({"strength": strength} if strength > 0.0 else {})


def _about(axis: np.ndarray, angle: float) -> np.ndarray:
    length = float(np.linalg.norm(axis))
    if length < 1e-12:
        raise WavetankError("axisangle has no axis; its first three numbers are one of any length but zero.")
    return np.array([math.cos(0.5 * angle), *(math.sin(0.5 * angle) * axis / length)])

"""Robots from files: URDF, and MJCF of MuJoCo."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from wavetank.formats.mjcf import read_mjcf
from wavetank.formats.robot import LARGEST, STANDING, Robot
from wavetank.formats.urdf import read_urdf
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.input_limits import explain_errors, one_line, parse_xml, printable, read_text, why_unreadable
from wavetank.foundation.rotations import product, unit_quaternion


def load_robot(
    path: str | Path,
    position: Any = (0.0, 0.0, 0.0),
    angle: float = 0.0,
    prefix: str = "",
    held: bool | None = None,
    thickness: float | None = None,
) -> Robot:
    """Read a URDF file, or an MJCF file (`.xml`) of MuJoCo, as a robot as its file has it, its motors holding it there.

    Its origin is at `position` [m], shape [3], turned by `angle` [rad] about the upright axis; with `held` true or
    false its base is fixed to the ground or free, else it is as the file says, and that of a URDF file is fixed.
    `prefix` comes before all names. Meshes that are not closed get walls of that `thickness` [m]. Raises
    `WavetankError`.
    """
    upright = unit_quaternion([math.cos(0.5 * angle), 0.0, math.sin(0.5 * angle), 0.0])
    place = np.array(position, float), product(upright, STANDING)
    readers: dict[str, Callable[..., Robot]] = {"robot": read_urdf, "mujoco": read_mjcf}
    origin = printable(path)
    with explain_errors(origin, "robot"):
        root = parse_xml(read_text(path, "file of a robot", LARGEST), origin, "a file of a robot")
        if root.tag not in readers:
            raise WavetankError(
                f"{origin}: a URDF file has a robot at its top, an MJCF file mujoco; this one has <{root.tag[:60]}>."
            )
        try:
            robot = readers[root.tag](root, Path(path), place, prefix, held)
            return robot if thickness is None else robot.with_walls(thickness)
        except RecursionError:
            raise WavetankError(f"{origin}: its elements are nested too deep.") from None
        except (WavetankError, LookupError, ValueError, TypeError, AttributeError, OverflowError, OSError) as error:
            raise WavetankError(f"{origin}: the robot cannot be read: {one_line(why_unreadable(error))}.") from None


def is_mjcf(path: Path) -> bool:
    """Say whether an XML file is a model of MuJoCo. Raises `WavetankError` for what is not XML."""
    return parse_xml(read_text(path, "XML file", LARGEST), printable(path), "this file").tag == "mujoco"


def load_urdf(
    path: str | Path,
    position: Any = (0.0, 0.0, 0.0),
    angle: float = 0.0,
    prefix: str = "",
    held: bool = True,
    thickness: float | None = None,
) -> Robot:
    """Read a robot as `load_robot` does; `held` is false for one that is not fixed to the ground."""
    return load_robot(path, position, angle, prefix, held, thickness)


load_mjcf = load_robot

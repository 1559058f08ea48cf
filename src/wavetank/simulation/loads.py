"""What acts on bodies and goes through joints, as figures with names: a row of numbers for each frame."""

import math
from collections.abc import Iterator

from wavetank.scene.joints import Hinge, Slider
from wavetank.simulation.bodies import Bodies

AXES = "xyz"


def figures(bodies: Bodies) -> dict[str, float]:
    """Return force [N], torque about z or all axes [N m] and share under water of each body, and what joints do.

    Hinges and sliders have a position [rad or m], velocity [rad/s or m/s], effort [N m or N] and power [W].
    """
    return {f"{what}.{name}.{key}": value for what, name, key, value in _rows(bodies)}


def driven(bodies: Bodies) -> list[str]:
    """Return the names of hinges and sliders that have a motor."""
    moving = [(name, live) for name, live in bodies.joints.items() if isinstance(live.joint, Hinge | Slider)]
    return [name for name, live in moving if live.target is not None or live.speed is not None]


def powers(bodies: Bodies) -> dict[str, float]:
    """Return the power [W] of each joint that has a motor: less than 0 where it brakes."""
    return {name: bodies.joints[name].power for name in driven(bodies)}


def _rows(bodies: Bodies) -> Iterator[tuple[str, str, str, float]]:
    for name, body in bodies.items():
        for what, vector in (("force", body.force), ("torque", body.torque[2 if bodies.dim == 2 else 0 :])):
            axes = AXES[: bodies.dim] if what == "force" else AXES[3 - len(vector) :]
            for axis, value in zip(axes, vector, strict=True):
                yield "bodies", name, f"{what}_{axis}", float(value)
        yield "bodies", name, "immersed", body.immersed
    for name, live in bodies.joints.items():
        if isinstance(live.joint, Hinge | Slider):
            for key in ("position", "velocity", "effort", "power"):
                value = float(getattr(live, key))
                if math.isfinite(value):  # joints in a ring have no effort of their own
                    yield "joints", name, key, value

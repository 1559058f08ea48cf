"""How much a scene may hold, and how large its numbers may be, so that a file from anyone can be opened.

Together with `model.FARTHEST` and the bounds of the forces these keep every product that a step makes within float32
(3.4e38): the largest are squares of speeds, and those times a density.
"""

import math
from typing import Any

from wavetank.solids.seams import check_seams

FINEST, COARSEST = 1e-7, 1e4  # m, of the spacing
STRONGEST = 1e6  # m/s^2, of gravity
LEAST_SUPPORTS = 4  # of a tank along an axis that is periodic
#: how many of each there may be
MOST = {
    "solids": 2000,
    "fluids": 2000,
    "emitters": 200,
    "drains": 200,
    "joints": 2000,
    "forces": 100,
    "materials": 100,
    "probes": 1000,
}


def check_numbers(values: dict[str, Any]) -> None:
    """Raise `ValueError` where a table, before it is validated, lists more entries than are allowed."""
    for name, most in MOST.items():
        members = values.get(name)
        if isinstance(members, list | tuple) and len(members) > most:
            raise ValueError(f"there are {len(members):,} {name}; at most {most:,} are allowed.")


def check_bodies(solids: Any, tank: Any, goal: Any) -> None:
    """Raise `ValueError` for a body that begins outside of the tank, and for an aim whose body does not exist."""
    for number, solid in enumerate(solids):
        for axis, (low, high) in enumerate(zip(*tank.box(), strict=True) if tank and solid.is_body else ()):
            at, reach = float(solid.origin[axis]), solid.reach()
            if (at < low - reach and not tank.is_open(axis, 0)) or (at > high + reach and not tank.is_open(axis, 1)):
                raise ValueError(
                    f"solids[{number}], the body {solid.name!r}, begins outside of the tank: its {'xyz'[axis]} is "
                    f"{at:g} m, and the tank goes from {low:g} to {high:g} m; move it, or open that side."
                )
    bodies = [solid.name for solid in solids if solid.is_body and solid.name]
    for number, aim in enumerate(goal.aims if goal else []):
        if getattr(aim, "body", None) not in (None, *bodies):
            raise ValueError(
                f"goal.aims[{number}].body = {aim.body!r} is not a body of the scene; they are: "
                f"{', '.join(bodies) or 'none'}."
            )


def check_periodic(tank: Any, spacing: float, support: float, gravity: tuple[float, ...], solids: Any) -> None:
    """Raise `ValueError` where a periodic tank is too short, lies along gravity, or has a solid at its seam."""
    strongest = max(map(abs, gravity), default=0.0)
    for axis in tank.periodic_axes if tank else ():
        name, length, least = "xyz"[axis], tank.size[axis], LEAST_SUPPORTS * support * spacing
        if length < least:
            raise ValueError(
                f"tank.size = {tank.size} m is {length:g} m long along {name}, which is periodic; it must be at least "
                f"{least:.4g} m, {LEAST_SUPPORTS} supports: make it longer or the spacing smaller."
            )
        if abs(gravity[axis]) == strongest > 0.0:
            raise ValueError(
                f"tank.periodic = {tank.periodic} with gravity = {tuple(gravity)}: water would fall along {name} "
                "without end; only axes across gravity can be periodic, all of them in a world without it."
            )
        bodies = [solid.name or f"solids[{number}]" for number, solid in enumerate(solids) if solid.is_body]
        if bodies:
            raise ValueError(
                f"the tank is periodic along {name} and {bodies[0]!r} is a body, whose contacts do not reach over a "
                "seam; give it no density and no mass, or the tank walls."
            )
    if tank and tank.periodic_axes:
        lower, upper = tank.box()
        check_seams(solids, lower, upper, tank.periodic_axes, spacing)


def check_scales(spacing: float, gravity: tuple[float, ...]) -> None:
    """Raise `ValueError` for a spacing [m] or a gravity [m/s^2] that single precision cannot compute with."""
    if not FINEST <= spacing <= COARSEST:
        raise ValueError(
            f"spacing = {spacing:g} is not allowed; it must be a number of metres from {FINEST:g} to {COARSEST:g}."
        )
    if not math.hypot(*gravity) <= STRONGEST:
        raise ValueError(f"gravity = {tuple(gravity)} is not allowed; its length must be at most {STRONGEST:g} m/s^2.")

"""Preview of a tool: a ring where it would act, a line to the floor, and the solid that it would take."""

import math
from typing import Any

import numpy as np

from wavetank.foundation.errors import WavetankError
from wavetank.session.session import Session
from wavetank.session.tools import TOOL_NAMES
from wavetank.session.tools.hand import Hand

CORNERS = 40  # of the ring
FOOT = 0.35  # size of the mark on the floor, over that of the ring

Place = list[float]  # u, v: shares of the picture's width and height


def aim(session: Session, tool: str, u: float, v: float, reach: float, size: tuple[int, int]) -> dict[str, Any]:
    """Return ring, line to the floor and mark there as shares of a picture of `size` [px]; highlight the solid.

    `u` and `v` are the pointer's place in that picture, `reach` the radius as a share of the world, 0 for no ring.
    """
    kind = TOOL_NAMES.get(tool)
    if kind is None:
        highlight(session, "")
        return {}
    camera, (width, height) = session.camera_for(tool), size
    held = next((hand for other, hand in session.hands.values() if other.name == tool), None)
    if held is None:
        ray = camera.ray(u * width, v * height, width, height)
        held = Hand(session.sim, *ray, session.most_particles, kind.through_water)  # type: ignore[arg-type]
        takes = held.hit.kind == "solid" and (
            kind.takes == "solid" or (kind.takes == "body" and _is_body(session, held))
        )
        highlight(session, held.hit.name if takes else "")
    if not reach:
        return {}
    flat, center, radius = session.sim.scene.dim == 2, held.point, held.radius(reach)
    around = [2.0 * math.pi * k / CORNERS for k in range(CORNERS + 1)]
    ring = [(math.cos(a), math.sin(a), 0.0) if flat else (math.cos(a), 0.0, math.sin(a)) for a in around]
    turns = np.array([turn if flat else held.along_axes(*turn) for turn in ring])
    result = {"ring": _seen(session, center + radius * turns, size)}
    up, floor = held.axes[1], np.array(center, float)
    floor[up] = held.lower[up]
    if not flat and center[up] - floor[up] > held.spacing:
        result["drop"] = _seen(session, np.array([center, floor]), size)
        result["foot"] = _seen(session, floor + FOOT * radius * turns, size)
    return result


def highlight(session: Session, name: str) -> None:
    """Highlight the solid of that name; none for ""."""
    if session.highlighted != name:
        session.highlighted = name
        session.changes += 1


def _is_body(session: Session, hand: Hand) -> bool:
    try:
        return hand.hit.name in session.sim.bodies
    except WavetankError:
        return False


def _seen(session: Session, points: np.ndarray, size: tuple[int, int]) -> list[Place]:
    places = session.tilted_camera.project(points, *size)[:, :2] / size
    return [[round(float(u), 4), round(float(v), 4)] for u, v in places] if np.isfinite(places).all() else []

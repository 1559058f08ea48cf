"""Carrying a solid: towards a place, no faster than water can make way."""

from typing import Any

import numpy as np

from wavetank.simulation.simulation import Simulation

TOOL_SOLID = "tool: "  # front part of the names of solids that belong to a tool and go with it


def carry(sim: Simulation, name: str, goal: np.ndarray, rotation: Any, most: float, *, inside: bool = True) -> bool:
    """Move a solid towards `goal` [m] by at most `most` [m] in the next frame; say whether it gets there.

    With `inside` its origin stays in the tank, so that no one loses it behind a wall.
    """
    where = sim.solids.poses[sim.solids.find(name)][0]
    place = np.array(goal, float)
    if inside and sim.scene.tank is not None:
        dim = sim.scene.dim
        place[:dim] = np.clip(place[:dim], *sim.scene.tank.box())
        place[dim:] = 0.0
    way = place - where
    length = float(np.linalg.norm(way))
    place = where + way * min(1.0, most / max(length, 1e-12))
    sim.move(name, tuple(place[: sim.scene.dim]), rotation)
    return length <= most

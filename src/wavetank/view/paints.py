"""What colours solids have in a picture."""

import enum

import numpy as np

from wavetank.view.colormaps import rgb_of, to_linear
from wavetank.view.shot import Shot

SHINE, LIT = np.array((0.3, 1.0, 1.6), np.float32), 0.6  # linear RGB of what shines, and how much of it is that


class Finish(enum.IntEnum):
    """The finish of a solid. Append only: the compiler's cache does not see the numbers."""

    MATTE = 0
    METAL = 1
    GLASS = 2


CLEAR = np.array((0.93, 0.96, 0.95), np.float32)  # what glass without a colour lets through


def colors_of(shot: Shot) -> np.ndarray:
    """Return the albedo of every solid, walls of the tank included, float32 [n, 3], linear RGB; -1 for glass."""
    colors = traced_colors(shot)
    colors[finishes_of(shot) == Finish.GLASS] = -1.0
    return colors


def finishes_of(shot: Shot) -> np.ndarray:
    """Return the `Finish` of every solid, walls of the tank included, int32 [n]."""
    solids = shot.frame.solids
    own = [Finish[solid.finish.upper()] for solid in shot.frame.scene.solids]
    return np.array([*[0] * solids.tank_count, *own, *[0] * solids.count], np.int32)[: solids.count]


def traced_colors(shot: Shot) -> np.ndarray:
    """Return the albedo of every solid, of glass what it lets through, float32 [n, 3], linear RGB."""
    solids = shot.frame.solids
    colors = np.tile(np.asarray(shot.look.solid, np.float32), (solids.count, 1))
    for number, solid in enumerate(shot.frame.scene.solids, solids.tank_count):
        if solid.color and number < solids.count:
            colors[number] = to_linear(np.array(rgb_of(solid.color)))
        elif solid.finish == "glass" and number < solids.count:
            colors[number] = CLEAR
    if 0 <= shot.lit < solids.count:
        colors[shot.lit] += LIT * (SHINE - colors[shot.lit])
    return colors

"""What colours solids have in a picture."""

import numpy as np

from wavetank.view.colormaps import rgb_of, to_linear
from wavetank.view.shot import Shot

SHINE, LIT = np.array((0.3, 1.0, 1.6), np.float32), 0.6  # linear RGB of what shines, and how much of it is that


def colors_of(shot: Shot) -> np.ndarray:
    """Return the albedo of every solid, walls of the tank included, float32 [n, 3], linear RGB."""
    solids = shot.frame.solids
    colors = np.tile(np.asarray(shot.look.solid, np.float32), (solids.count, 1))
    for number, solid in enumerate(shot.frame.scene.solids, solids.tank_count):
        if solid.color and number < solids.count:
            colors[number] = to_linear(np.array(rgb_of(solid.color)))
    if 0 <= shot.lit < solids.count:
        colors[shot.lit] += LIT * (SHINE - colors[shot.lit])
    return colors

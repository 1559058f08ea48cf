"""Which places of a scene's fluids solids leave free: as many as there is room for.

Where only what is half a spacing clear of a solid stays, up to a spacing beside it is empty, and still water falls into
that: it began at 0.5 m/s around a box. Here water has its volume. A place counts as much as of its cell is outside, and
of the places whose cells are cut those furthest out stay, so many as that makes; what is too near to a solid is led out
of it by `settling`, before the first step.

    code     meaning                                                        unit
    s        distance of a place to the nearest solid, negative inside      spacings
    share    of a place's cell that is outside: exact for a plane along     1
             the cells, and for all planes in the mean
"""

import numpy as np

from wavetank.scene.scene import Scene
from wavetank.solids.distance import SolidSet
from wavetank.solids.sampling import nearest_of

CUT = 0.5  # spacings: cells nearer than that to a surface are cut by it
TOUCH = 0.1  # spacings: solids that are nearer to each other have a seam, which is no place for water
EVEN = 0.2  # spacings: by so much places are shuffled in their order, so that a part of a row is spread along it
SPREAD = np.array([0.8191725134, 0.6710436067, 0.5497004779])  # well spread numbers of cells: Roberts 2018, R3


def outside(scene: Scene, places: np.ndarray, solids: SolidSet, first: int) -> np.ndarray:
    """Say which `places` [n, dim] the solids from number `first` on leave to the fluids of a scene, bool [n]."""
    s, nearest = nearest_of(solids, first, places, TOUCH * scene.spacing)
    s /= scene.spacing
    free, cut = s >= CUT, np.flatnonzero(np.abs(s) < CUT)
    cells = np.floor(places[cut] / scene.spacing)
    order = s[cut] + EVEN * ((cells @ SPREAD[: places.shape[1]]) % 1.0 - 0.5)
    kinds = scene.kinds()[cut]
    for kind, solid in {*zip(kinds.tolist(), nearest[cut].tolist(), strict=True)}:
        chosen = np.flatnonzero((kinds == kind) & (nearest[cut] == solid))
        number = round(float((CUT + s[cut[chosen]]).sum()))
        free[cut[chosen[np.argsort(-order[chosen], kind="stable")[:number]]]] = True
    return free

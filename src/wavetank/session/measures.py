"""How far a frame has come towards an aim: one function a kind, listed in `MEASURES`.

Volumes are counted in particles, d^dim each, so that a level means the same at another spacing.
"""

from collections.abc import Callable

import numpy as np

from wavetank.device.compiler import download
from wavetank.foundation.errors import WavetankError
from wavetank.scene.goal import Aim, Apart, Bring, Deliver, Dry, Fill, Mix
from wavetank.simulation.frame import Frame

COLOR_REACH = 90.0  # of 255: how far a dye may be from the colour asked for
STRONG = 32  # of 127: weaker dyes count as clear
CELL = 4.0  # d: edge of the cells in which a mixture is looked at


def measure(aim: Aim, frame: Frame, start: int) -> float:
    """Return what is compared with `aim.share`; `start` is the number of the counted particles at the beginning."""
    return MEASURES[type(aim)](aim, frame, start)


def counted(aim: Aim, frame: Frame) -> np.ndarray:
    """Say which particles are of the fluid and the colour that count, bool [count]."""
    counts: np.ndarray = np.ones(frame.count, bool)
    if aim.material:
        names = [material.name for material in frame.scene.palette()[1:]]
        counts = frame.materials == 1 + names.index(aim.material)
    if aim.color:
        wanted = np.array([int(aim.color[k : k + 2], 16) for k in (1, 3, 5)], float)
        dyes = frame.dyes
        colors = np.stack([(dyes >> shift) & 255 for shift in (16, 8, 0)], axis=1)
        alike: np.ndarray = (dyes >> 24 >= STRONG) & (np.linalg.norm(colors - wanted, axis=1) < COLOR_REACH)
        counts &= alike
    return counts


def inside(aim: Aim, frame: Frame) -> np.ndarray:
    """Say which particles are in the region, bool [count]."""
    low, high = np.array(aim.lower, np.float32), np.array(aim.upper, np.float32)
    return np.asarray(((frame.positions >= low) & (frame.positions <= high)).all(axis=1))


def wet_share(aim: Aim, frame: Frame, start: int) -> float:
    """Return the share of the region's volume that is what counts: of `Fill` and `Dry`."""
    volume = float(np.prod(np.subtract(aim.upper, aim.lower)))
    return float(np.sum(inside(aim, frame) & counted(aim, frame)) * frame.scene.spacing**frame.dim / volume)


def delivered_share(aim: Aim, frame: Frame, start: int) -> float:
    """Return how much of what was there at the beginning is in the region."""
    return float(np.sum(inside(aim, frame) & counted(aim, frame)) / max(start, 1))


def gathered_share(aim: Aim, frame: Frame, start: int) -> float:
    """Return the lesser of the share that is gathered in the region and its purity there."""
    within = inside(aim, frame)
    both = int(np.sum(within & counted(aim, frame)))
    return both / max(int(within.sum()), start, 1)


def mixed_share(aim: Aim, frame: Frame, start: int) -> float:
    """Return one minus the intensity of segregation: Danckwerts 1952, Eq. 9, doi:10.1007/BF03184936.

    That is the variance of a fluid's share among cells, over the variance it has unmixed.
    """
    within, counts = inside(aim, frame), counted(aim, frame)
    mean = float(counts[within].mean()) if within.any() else 0.0
    if not 0.0 < mean < 1.0:
        return 0.0
    cells = np.floor((frame.positions[within] - np.array(aim.lower)) / (CELL * frame.scene.spacing)).astype(int)
    _, cell = np.unique(cells, axis=0, return_inverse=True)
    number = np.bincount(cell.reshape(-1))
    shares = np.bincount(cell.reshape(-1), weights=counts[within]) / number
    variance = float(np.sum(number * (shares - mean) ** 2) / number.sum())
    return 1.0 - variance / (mean * (1.0 - mean))


def brought_share(aim: Aim, frame: Frame, start: int) -> float:
    """Return how much of a body is in the region: of the box around its origin that its ball holds."""
    assert isinstance(aim, Bring)
    names = [solid.name if solid.is_body else "" for solid in frame.scene.solids]
    if aim.body not in names or not aim.body:
        known = ", ".join(filter(None, names)) or "none"
        raise WavetankError(f"goal.aims: there is no body named {aim.body!r}; bodies: {known}.")
    number = frame.solids.tank_count + names.index(aim.body)
    center = download(frame.solids.position)[number, : frame.dim].astype(float)
    half = float(download(frame.solids.reach)[number]) / frame.dim**0.5
    low, high = np.array(aim.lower), np.array(aim.upper)
    shared = np.minimum(center + half, high) - np.maximum(center - half, low)
    return float(np.prod(np.maximum(shared, 0.0) / (2.0 * half)))


MEASURES: dict[type[Aim], Callable[[Aim, Frame, int], float]] = {
    Fill: wet_share,
    Dry: wet_share,
    Deliver: delivered_share,
    Apart: gathered_share,
    Mix: mixed_share,
    Bring: brought_share,
}

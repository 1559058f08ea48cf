"""Solids in a world that repeats: at their nearest image where they are short, where they stand where they are long.

A particle sees a solid from the image of its own place that is nearest to the solid (`distance.image_near`). That is
right as long as the ball around the solid, and the water that it acts on, is shorter than the world: no two images of
it are ever near. What is longer than that along an axis has no image there: it must keep away from both seams, or go on
beyond both of them.

    code     meaning                                                     unit
    FELT     how far water feels a solid, 1.2 of the largest support     d
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from wavetank.solids.bounds import bounds_of
from wavetank.solids.solid import Solid

if TYPE_CHECKING:
    from wavetank.device.periods import Periods

FELT = 4.0
NEVER = 1e30  # m: a period that no difference is half of


def seen_periods(solids: Sequence[Solid], periods: "Periods", spacing: float) -> np.ndarray:
    """Return the period [m] along each axis at which a solid is seen at its nearest image, [solids, 3]."""
    return np.array(
        [
            [length if is_short(solid, length, spacing) else NEVER for length in (periods.x, periods.y, periods.z)]
            for solid in solids
        ]
    ).reshape(-1, 3)


def check_seams(solids: Sequence[Solid], lower: np.ndarray, upper: np.ndarray, axes: Sequence[int], d: float) -> None:
    """Raise `ValueError` for a solid that reaches over a seam of a world between two corners, and is too long for that.

    The world repeats along `axes`; its spacing is `d` [m].
    """
    for number, solid in enumerate(solids):
        long = [axis for axis in axes if not is_short(solid, float(upper[axis] - lower[axis]), d)]
        corners = bounds_of(solid) if long else (lower, upper)
        for axis in long:
            low, high = float(corners[0][axis]), float(corners[1][axis])
            first, last, felt = float(lower[axis]), float(upper[axis]), FELT * d
            keeps_away = low >= first + felt and high <= last - felt
            if not keeps_away and not (low <= first - felt and high >= last + felt):
                raise ValueError(
                    f"solids[{number}] goes from {'xyz'[axis]} = {low:g} to {high:g} m, over or near a seam of the "
                    f"tank, which repeats from {first:g} to {last:g} m, and is too long to be seen on both sides; "
                    f"keep it {felt:g} m away from the seams, let it go on {felt:g} m beyond both, or make it smaller."
                )


def is_short(solid: Solid, length: float, spacing: float) -> bool:
    """Say whether no two images of a solid are ever near a place, in a world of that `length` [m] along an axis."""
    return bool(solid.reach() + FELT * spacing <= 0.5 * length)

"""What a picture is of: everything the passes read and none of them changes."""

import dataclasses
from typing import Any

from wavetank.frame import Frame
from wavetank.view.extent import Extent
from wavetank.view.lens import Lens
from wavetank.view.look import Look


@dataclasses.dataclass(frozen=True)
class Shot:
    """One picture to take."""

    frame: Frame
    extent: Extent
    lens: Lens
    sun: Lens  # looks at the extent from the sun
    look: Look
    radius: float  # m, of a drawn particle
    quantity: int  # key in `quantities.DEVICE_FUNCTIONS`
    limits: tuple[float, float]  # of the quantity: first and last colour
    colors: Any  # device ndarray of vec3 [entries]: the colour map as linear RGB

"""What a picture is of: everything the passes read and none of them changes."""

import dataclasses
from typing import Any

from wavetank.simulation.frame import Frame
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
    water_sun: Lens  # the same at the resolution of the water's maps
    look: Look
    radius: float  # m, of a drawn particle
    quantity: int  # key in `quantities.DEVICE_FUNCTIONS`
    limits: tuple[float, float]  # of the quantity: first and last colour
    colors: Any  # device ndarray of vec3 [entries]: the colour map as linear RGB
    absorption: Any  # numpy f32 [3], 1/m: of the water, per colour
    scattering: float  # 1/m: what makes deep water shine
    tint: Any  # numpy f32 [3]: colour of the light that comes back out of deep water
    usual: float  # m: water that gives its colour to what is behind it
    hasty: bool  # whether outlines stay rough
    plane: tuple[Any, float]  # of a cut: unit normal [3], and the distance [m] of the plane from the origin along it

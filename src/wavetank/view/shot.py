"""What a picture is of: everything the passes read and none of them changes."""

import dataclasses
from typing import Any

from wavetank.simulation.frame import Frame
from wavetank.view.extent import Extent
from wavetank.view.lens import Lens
from wavetank.view.look import Look
from wavetank.view.optics.rays import OPEN, Box, box
from wavetank.view.quantities import Coloring


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
    coloring: Coloring  # its colours on the device
    absorption: Any  # numpy f32 [3], 1/m: of the water, per colour
    scattering: float  # 1/m: what makes deep water shine
    tint: Any  # numpy f32 [3]: colour of the light that comes back out of deep water
    usual: float  # m: water that gives its colour to what is behind it
    dyed: bool  # whether any of the water may be dyed
    lit: int  # number of a solid that shines, -1 for none
    hasty: bool  # whether outlines stay rough
    shutter: float  # s: for which what moves is smeared
    turn: int  # 0 to 3 in turns of many samples: by how many pixels the groups of those lie aside that share a ray
    plane: tuple[Any, float]  # of a cut: unit normal [3], and the distance [m] of the plane from the origin along it

    @property
    def box(self) -> Box:
        """The extent on the device."""
        return box(self.extent.lower, self.extent.upper)

    @property
    def walls(self) -> Box:
        """The tank on the device; far away where there is none."""
        return OPEN if self.frame.scene.tank is None else self.box

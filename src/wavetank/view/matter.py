"""What each fluid of a world does to light, as plain numbers: colour, murk, a light of its own.

Murk is how much of what passes a fluid scatters, per metre: what lies behind some lengths of it is not seen, and its
own colour in the light of the place is. An opaque fluid hides what is behind a spacing of it, at any spacing; into a
cloudy one one sees as far as its world is wide, about.
"""

import numpy as np

from wavetank.device.compiler import download, shares_memory
from wavetank.foundation.materials import Material
from wavetank.simulation.frame import Frame
from wavetank.view.colormaps import rgb_of, to_linear
from wavetank.view.extent import Extent
from wavetank.view.look import usual_depth

#: In a plane there is no depth that would tint it, and paper behind it.
ICE = {dim: Material(name="ice", color=color, clarity="cloudy") for dim, color in ((2, "#b6e0f8"), (3, "#d3e6f0"))}
CLOUDY, OPAQUE = 4.0, 3.0  # murk over a usual depth, and over a spacing
FROZEN = 4.0  # times as murky as a cloudy fluid: pieces of ice are small, and full of bubbles


def matter_of(frame: Frame, extent: Extent) -> np.ndarray:
    """Return linear colour, murk [1/m] and radiance of each fluid, float32 [fluids, 7].

    Fluids are those of `Scene.palette` and, where there is any, ice as the last of them; none where all is water. A
    world that names no material has the colour of the picture, which is written as -1.
    """
    scene = frame.scene
    if not (scene.materials or frame.frozen_count):
        return np.zeros((0, 7), np.float32)
    table = np.zeros((len(scene.palette()) + 1, 7), np.float32)
    for number, material in enumerate([*scene.palette(), ICE[extent.dim]]):
        murk = {"clear": 0.0, "cloudy": CLOUDY / usual_depth(extent), "opaque": OPAQUE / extent.spacing}
        color = np.clip(to_linear(np.array(rgb_of(str(material.color)))), 0.02, 0.98)
        dense = murk[material.clarity] * (FROZEN if material is ICE[extent.dim] else 1.0)
        table[number] = (*color, dense, *(material.glow * color))
    if not scene.materials:
        table[0, :3] = -1.0
    return table if frame.frozen_count else table[:-1]


def may_be_dyed(frame: Frame) -> bool:
    """Whether any particle may be dyed: True as well where the host would have to wait for the device to know."""
    return not shares_memory() or bool(download(frame.dye)[: frame.count].any())

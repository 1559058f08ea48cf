"""Views by name: each is a list of passes, from what is where to radiance; the tone mapper ends them all."""

import dataclasses
from collections.abc import Callable

from wavetank.view.buffers import Buffers
from wavetank.view.passes import (
    backdrop,
    below,
    cut,
    ellipsoids,
    flatten,
    floor,
    foam,
    nothing,
    occlusion,
    shade,
    shadow,
    smooth,
    solids,
    spheres,
    sunlight,
    surface,
    tank,
    thickness,
    water,
)
from wavetank.view.shot import Shot

Pass = Callable[[Shot, Buffers], None]


@dataclasses.dataclass(frozen=True)
class View:
    """One way to look at a world."""

    name: str
    sentence: str
    still: tuple[Pass, ...]  # what depends on eye, sun and solids alone; kept while these rest
    once: tuple[Pass, ...]  # what depends on the frame alone, not on the eye
    sunny: tuple[Pass, ...]  # what depends on frame and sun; with a still part these two are kept while the water rests
    passes: tuple[Pass, ...]
    coloured: bool  # whether particles show a quantity, with its legend


VIEWS: dict[str, View] = {
    "water": View(
        "water",
        "the surface of the water, with light and shadow",
        still=(nothing.draw, solids.draw, floor.draw, sunlight.draw, backdrop.prepare, tank.draw_lines),
        once=(ellipsoids.draw,),
        sunny=(sunlight.see_water,),
        passes=(
            backdrop.draw, surface.draw, flatten.draw, thickness.draw, water.draw, below.draw,
            foam.draw_over_water,
        ),
        coloured=False,
    ),
    "particles": View(
        "particles",
        "particles as balls, coloured by a quantity",
        still=(),
        once=(),
        sunny=(),
        passes=(
            spheres.draw, solids.draw, floor.draw, shadow.draw, occlusion.draw, smooth.draw, shade.draw,
            tank.draw, foam.draw,
        ),
        coloured=True,
    ),
    "slice": View(
        "slice",
        "a quantity on a plane that cuts the water",
        still=(),
        once=(cut.prepare,),
        sunny=(),
        passes=(
            nothing.draw, solids.draw, floor.draw, shadow.draw_solids, occlusion.draw, smooth.draw, shade.draw,
            cut.draw, tank.draw,
        ),
        coloured=True,
    ),
    "foam": View(
        "foam",
        "spray, foam and bubbles alone",
        still=(),
        once=(),
        sunny=(),
        passes=(
            nothing.draw, solids.draw, floor.draw, shadow.draw_solids, occlusion.draw, smooth.draw, shade.draw,
            tank.draw, foam.draw,
        ),
        coloured=False,
    ),
}  # fmt: skip

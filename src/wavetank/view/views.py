"""Views by name: each is a list of passes, from what is where to radiance; the tone mapper ends them all."""

import dataclasses
from collections.abc import Callable

from wavetank.view.buffers import Buffers
from wavetank.view.passes import (
    backdrop,
    below,
    caustics,
    clip,
    cut,
    drops,
    ellipsoids,
    flatten,
    floor,
    foam,
    nothing,
    occlusion,
    shade,
    shadow,
    shutter,
    smooth,
    solids,
    spheres,
    streaks,
    surface,
    tank,
    thickness,
    water,
)
from wavetank.view.shot import Shot

Pass = Callable[[Shot, Buffers], None]


@dataclasses.dataclass(frozen=True)
class View:
    """One way to look at a world: passes in stages. With a still part, what rests is kept from picture to picture."""

    name: str
    sentence: str
    coloured: bool  # whether particles show a quantity, with its legend
    once: tuple[Pass, ...] = ()  # what depends on the frame alone, not on the eye
    shadows: tuple[Pass, ...] = ()  # what depends on sun and solids alone
    still: tuple[Pass, ...] = ()  # what depends on these and the eye
    sunny: tuple[Pass, ...] = ()  # what depends on frame, sun and solids
    passes: tuple[Pass, ...] = ()  # all others


_LIT = (floor.draw, shadow.draw, occlusion.draw, smooth.draw, shade.draw)  # solids and particles, in their light
_CAST = (nothing.draw_from_sun, solids.draw_from_sun)
VIEWS: dict[str, View] = {
    "water": View(
        "water",
        "the surface of the water, with light and shadow",
        coloured=False,
        once=(ellipsoids.draw,),
        shadows=_CAST,
        still=(
            nothing.draw,
            solids.draw,
            floor.draw,
            shadow.draw_on_backdrop,
            occlusion.draw_on_backdrop,
            smooth.draw_on_backdrop,
            backdrop.prepare,
            tank.draw_lines,
        ),
        sunny=(
            thickness.draw_from_sun,
            surface.draw_from_sun,
            flatten.draw_from_sun,
            clip.draw_from_sun,
            caustics.draw_from_sun,
            foam.draw_from_sun,
        ),
        passes=(
            backdrop.draw,
            surface.draw,
            flatten.draw,
            thickness.draw,
            water.draw,
            below.draw,
            drops.draw,
            solids.draw_glass,
            foam.draw_over_water,
            shutter.draw,
            streaks.draw,
        ),
    ),
    "particles": View(
        "particles",
        "particles as balls, coloured by a quantity",
        coloured=True,
        passes=(
            nothing.draw_from_sun,
            spheres.draw_from_sun,
            solids.draw_from_sun,
            nothing.draw,
            spheres.draw,
            solids.draw,
            *_LIT,
            tank.draw,
            foam.draw,
        ),
    ),
    "slice": View(
        "slice",
        "a quantity on a plane that cuts the water",
        coloured=True,
        once=(cut.prepare,),
        passes=(*_CAST, nothing.draw, solids.draw, *_LIT, cut.draw, tank.draw),
    ),
    "foam": View(
        "foam",
        "spray, foam and bubbles alone, and ice",
        coloured=False,
        passes=(*_CAST, nothing.draw, spheres.draw_ice, solids.draw, *_LIT, tank.draw, foam.draw),
    ),
}

"""An empty picture to begin with, of the eye or of the sun."""

from wavetank.view.buffers import FARTHEST, NOTHING, Buffers
from wavetank.view.shot import Shot


def draw(shot: Shot, buffers: Buffers) -> None:
    """Empty the picture: nothing anywhere, infinitely far."""
    buffers.pixels.depth.fill(FARTHEST)
    buffers.pixels.surface.fill(NOTHING)


def draw_from_sun(shot: Shot, buffers: Buffers) -> None:
    """Empty the sun's depth map; a 2-D world has no shadows."""
    if shot.frame.dim == 3:
        buffers.sun_depth.fill(FARTHEST)

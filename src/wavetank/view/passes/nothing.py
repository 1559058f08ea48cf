"""An empty picture, for views that begin with what is not water."""

from wavetank.view.buffers import FARTHEST, NOTHING, Buffers
from wavetank.view.shot import Shot


def draw(shot: Shot, buffers: Buffers) -> None:
    """Empty the picture: nothing anywhere, infinitely far."""
    buffers.depth.fill(FARTHEST)
    buffers.surface.fill(NOTHING)

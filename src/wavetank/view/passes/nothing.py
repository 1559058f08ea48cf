"""An empty picture, for views that begin with what is not water."""

from wavetank.view.buffers import Buffers
from wavetank.view.passes import spheres
from wavetank.view.shot import Shot


def draw(shot: Shot, buffers: Buffers) -> None:
    """Empty depth and surface."""
    spheres.clear(buffers.depth, buffers.surface)

"""The surface of the water that the sun sees ends at the walls of the tank.

It is splatted and smoothed as if the water went on behind them; see `optics/panes.py`.
"""

from wavetank.device.compiler import qd
from wavetank.view.buffers import Buffers
from wavetank.view.lens import Lens, ray_direction, ray_origin, view_ray
from wavetank.view.optics.rays import Box, box_interval
from wavetank.view.shot import Shot
from wavetank.view.water_buffers import water_of


def draw_from_sun(shot: Shot, buffers: Buffers) -> None:
    """Keep the surface that the sun sees within the tank."""
    if shot.frame.dim == 3:
        clip(water_of(buffers, shot).sunlit.depth, shot.water_sun, shot.walls)


@qd.kernel(fastcache=True)
def clip(depth: qd.types.ndarray(), lens: Lens, walls: Box):
    """Move depths before the tank onto its walls, and leave out those behind it."""
    for row, column in qd.ndrange(depth.shape[0], depth.shape[1]):
        if depth[row, column] < 0x7F000000:  # FARTHEST
            ray = view_ray(lens, row, column)
            ends = box_interval(ray_origin(lens, ray), ray_direction(lens, ray), walls)
            z = qd.bit_cast(depth[row, column], qd.f32)
            if z > ends[1] or ends[0] > ends[1]:
                depth[row, column] = 0x7F000000
            elif z < ends[0]:
                depth[row, column] = qd.bit_cast(ends[0], qd.i32)

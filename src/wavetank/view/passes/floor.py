"""The floor: the plane y = 0, seen from above only, without end."""

from wavetank.compiler import qd
from wavetank.view.buffers import Buffers
from wavetank.view.lens import Lens, ray_direction, ray_origin, vec3, view_ray
from wavetank.view.shot import Shot


def draw(shot: Shot, buffers: Buffers) -> None:
    """Draw the floor where it is nearer than what is there; a 2-D world has none."""
    if shot.frame.dim == 3:
        lay(shot.lens, shot.look.floor, buffers.depth, buffers.surface, buffers.normal, buffers.color)


@qd.kernel(fastcache=True)
def lay(
    lens: Lens, albedo: vec3, depth: qd.types.ndarray(), surface: qd.types.ndarray(), normal: qd.types.ndarray(),
    color: qd.types.ndarray(),
):  # fmt: skip
    """Intersect every view ray with y = 0."""
    for row, column in qd.ndrange(depth.shape[0], depth.shape[1]):
        ray = view_ray(lens, row, column)
        origin, direction = ray_origin(lens, ray), ray_direction(lens, ray)
        if origin.y > 0.0 and direction.y < -1e-6:
            t = -origin.y / direction.y
            if t > lens.near and t < 1e4 and qd.bit_cast(t, qd.i32) < depth[row, column]:
                depth[row, column] = qd.bit_cast(t, qd.i32)
                surface[row, column] = -2  # FLOOR
                normal[row, column] = vec3(0.0, 1.0, 0.0)
                color[row, column] = albedo

"""The camera on the device: rays through pixels, points to pixels, and the pixels that a ball can touch.

A lens also looks from the sun, so that the passes that find depths serve the picture and the shadow alike. Depth is
always measured along `forward`; a ray is written so that its parameter *is* the depth, for both kinds of projection.

    code       symbol   meaning                                                        unit
    u, v                position in the picture plane, right and up of its middle      1 (perspective) or m
    c                   point in view coordinates: right, up, forward (depth)          m
    p                   1 perspective, 0 orthographic
    focal      f        pixels per unit of u and v                                     px or px/m
"""

import dataclasses
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from wavetank.device.compiler import qd
from wavetank.device.state import interned

if TYPE_CHECKING:  # as types, variables mean nothing to mypy
    vec2: TypeAlias = Any
    vec3: TypeAlias = Any
    vec4: TypeAlias = Any
else:
    vec2, vec3, vec4 = (qd.types.vector(size, qd.f32) for size in (2, 3, 4))


@dataclasses.dataclass(frozen=True, eq=False)
class Lens:
    """One eye on the device; rows run down, columns to the right, pixel centres at halves."""

    eye: vec3  # m
    right: vec3  # unit
    up: vec3  # unit
    forward: vec3  # unit
    middle: vec2  # px: column and row of the optical axis
    focal: qd.f32  # px (perspective) or px/m (orthographic)
    pixel: qd.f32  # 1 / focal: width of a pixel in u and v
    perspective: qd.f32  # 1 or 0
    near: qd.f32  # m: nothing nearer is drawn


def vector(*parts: float) -> np.ndarray:
    """Return a vector as a kernel argument: an array that is the same object each time, for the compiler to know."""
    result = np.array(parts, np.float32)
    result.setflags(write=False)
    return interned(result)


def basis(forward: np.ndarray, up: np.ndarray) -> np.ndarray:
    """Return the unit vectors (right, up, forward) of an eye, float64 [3, 3]; `up` need not be normal to `forward`."""
    ahead = np.asarray(forward, float) / np.linalg.norm(forward)
    right = np.cross(ahead, np.asarray(up, float) / np.linalg.norm(up))
    if np.linalg.norm(right) < 1e-6:  # looking along `up`: any right will do
        right = np.cross(ahead, [0.0, 0.0, -1.0] if abs(ahead[2]) < 0.9 else [0.0, 1.0, 0.0])
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(right, ahead), ahead])


def lens_at(
    eye: np.ndarray, axes: np.ndarray, width: int, height: int, focal: float, *, perspective: bool, near: float
) -> Lens:
    """Return the lens at `eye` [m] with the `basis` `axes` for a picture of `width` x `height` pixels."""
    right, up, forward = axes
    return interned(
        Lens(
            eye=vector(*eye),
            right=vector(*right),
            up=vector(*up),
            forward=vector(*forward),
            middle=vector(0.5 * width, 0.5 * height),
            focal=float(focal),
            pixel=1.0 / float(focal),
            perspective=float(perspective),
            near=float(near),
        )
    )


@qd.func
def to_view(lens: Lens, x):
    """World point `x` in view coordinates (right, up, depth)."""
    offset = x - lens.eye
    return vec3(lens.right.dot(offset), lens.up.dot(offset), lens.forward.dot(offset))


@qd.func
def from_view(lens: Lens, c):
    """Direction `c` of view coordinates in the world."""
    return c.x * lens.right + c.y * lens.up + c.z * lens.forward


@qd.func
def plane_position(lens: Lens, row, column):
    """(u, v) at the centre of a pixel."""
    return vec2((column + 0.5 - lens.middle.x) * lens.pixel, (lens.middle.y - row - 0.5) * lens.pixel)


@qd.func
def view_ray(lens: Lens, row, column):
    """Origin (u, v) and slope (u, v) of the ray through a pixel, packed as (ox, oy, dx, dy).

    The ray is (ox, oy, 0) + depth * (dx, dy, 1) in view coordinates.
    """
    uv = plane_position(lens, row, column)
    p = lens.perspective
    return vec4((1.0 - p) * uv.x, (1.0 - p) * uv.y, p * uv.x, p * uv.y)


@qd.func
def ray_origin(lens: Lens, ray):
    """World point at depth 0 of a view ray."""
    return lens.eye + ray.x * lens.right + ray.y * lens.up


@qd.func
def ray_direction(lens: Lens, ray):
    """World direction of a view ray; its length is the way [m] per metre of depth."""
    return ray.z * lens.right + ray.w * lens.up + lens.forward


@qd.func
def point_at(lens: Lens, row, column, depth):
    """What a pixel shows at a depth, in view coordinates [m]."""
    uv = plane_position(lens, row, column)
    scale = 1.0 + lens.perspective * (depth - 1.0)
    return vec3(scale * uv.x, scale * uv.y, depth)


@qd.func
def to_pixel(lens: Lens, c):
    """(column, row) of a point in view coordinates with positive depth, in pixels from the upper left corner."""
    scale = lens.focal
    if lens.perspective > 0.5:
        scale = lens.focal / c.z
    return vec2(lens.middle.x + scale * c.x, lens.middle.y - scale * c.y)


@qd.func
def pixels_per_metre(lens: Lens, depth):
    """Size in the picture of a metre across the view at `depth`."""
    scale = lens.focal
    if lens.perspective > 0.5:
        scale = lens.focal / depth
    return scale


@qd.func
def interval_of_ball(lens: Lens, across, depth, r):
    """Lowest and highest u (or v) that the ball at (`across`, `depth`) of radius `r` < depth covers.

    In perspective these are the tangents from the eye to the circle in the plane of u (or v) and depth.
    """
    low, high = across - r, across + r
    if lens.perspective > 0.5:
        tangent = qd.sqrt(qd.max(across * across + depth * depth - r * r, 1e-12))
        # Both denominators are positive for a ball wholly in front of the eye; near its rim they only lose digits.
        low = (across * tangent - r * depth) / qd.max(depth * tangent + r * across, 1e-9)
        high = (across * tangent + r * depth) / qd.max(depth * tangent - r * across, 1e-9)
    return vec2(low, high)


@qd.func
def pixels_between(low, high, size):
    """First and last of `size` pixels whose centres lie between two places; the first centre is 0."""
    # Clamped twice: a float before it becomes an integer, and the integer in case that float was no number.
    first = qd.max(qd.cast(qd.ceil(qd.max(low, 0.0)), qd.i32), 0)
    return first, qd.min(qd.cast(qd.floor(qd.min(high, size - 1.0)), qd.i32), size - 1)


@qd.func
def box_of_ball(lens: Lens, c, r, rows, columns):
    """First and last column, first and last row (inclusive) whose centres the ball may cover, inside the picture.

    `c` is in view coordinates. The interval is empty (first > last) where the ball is out of sight.
    """
    u = interval_of_ball(lens, c.x, c.z, r)
    v = interval_of_ball(lens, c.y, c.z, r)
    left = lens.middle.x + lens.focal * u[0] - 0.5
    right = lens.middle.x + lens.focal * u[1] - 0.5
    above = lens.middle.y - lens.focal * v[1] - 0.5
    below = lens.middle.y - lens.focal * v[0] - 0.5
    box = qd.Vector([0, -1, 0, -1])
    if left < columns and right >= 0.0 and above < rows and below >= 0.0:
        box[0], box[1] = pixels_between(left, right, columns)
        box[2], box[3] = pixels_between(above, below, rows)
    return box


@qd.func
def ball_depth(ray, c, r):
    """Depth at which a view ray enters the ball at `c`, or -1.

    Measured from the point nearest to the centre, which keeps the digits that the usual quadratic loses.
    """
    slope = vec3(ray.z, ray.w, 1.0)
    offset = c - vec3(ray.x, ray.y, 0.0)
    square = slope.dot(slope)
    nearest = offset.dot(slope) / square
    miss = offset - nearest * slope
    half = r * r - miss.dot(miss)
    depth = -1.0
    if half >= 0.0:
        depth = nearest - qd.sqrt(half / square)
    return depth

"""Particles as balls: the nearest depth at every pixel, then who is there, then what it looks like.

Every particle visits the pixels of its own box and lowers the depth there with an integer minimum, so the picture
does not depend on the order of threads. A second visit finds the particle to each depth: 32 bits hold one or the
other, and portable devices have no wider atomics.

    code     symbol   meaning                                             unit
    c                 centre of a ball in view coordinates                m
    r                 its radius as drawn                                 m
    near              depth of the ball's nearest point, as bits
    key               depth of the ball at a pixel, as bits

A positive float orders like its bit pattern; a miss, -1, is a negative integer as well. A ball that would fill the
view is drawn smaller rather than cut off, which bounds the work of one particle; one that the near plane cuts is not
drawn.
"""

from typing import Any

from wavetank.device.compiler import qd
from wavetank.solids.distance import lift
from wavetank.view.buffers import Buffers, Pixels
from wavetank.view.lens import (
    Lens,
    ball_depth,
    box_of_ball,
    from_view,
    pixels_per_metre,
    point_at,
    to_view,
    vec2,
    vec3,
    view_ray,
)
from wavetank.view.optics.dyes import dyed
from wavetank.view.quantities import DEVICE_FUNCTIONS, Coloring, color_of, scalars_of
from wavetank.view.shot import Shot

LARGEST = 0.25  # of the picture's height: radius up to which a ball is drawn at its size


def draw(shot: Shot, buffers: Buffers) -> None:
    """Draw the particles into an empty picture: fills depth, surface, normal and color."""
    draw_at(shot.frame.x, shot, buffers)


def draw_at(x: Any, shot: Shot, buffers: Buffers) -> None:
    """Do so with the particles at the places `x`, a device array [capacity] in their order."""
    frame, pixels, largest = shot.frame, buffers.pixels, max(LARGEST * buffers.rows, 1.0)
    splat(pixels.depth, x, shot.lens, shot.radius, largest, frame.count)
    claim(pixels, x, shot.lens, shot.radius, largest, frame.count)
    paint(
        pixels,
        x,
        frame.v,
        scalars_of(frame, shot.quantity),
        frame.material,
        frame.dye,
        shot.lens,
        shot.coloring,
        shot.quantity,
    )


def draw_ice(shot: Shot, buffers: Buffers) -> None:
    """Draw the particles of ice alone: all others are laid behind the eye."""
    frame = shot.frame
    if not frame.frozen_count:
        return
    if buffers.ice is None or buffers.ice.shape[0] < frame.x.shape[0] or buffers.ice.element_shape != (frame.dim,):
        buffers.ice = qd.ndarray(vec2 if frame.dim == 2 else vec3, shape=(frame.x.shape[0],))
    show_ice(buffers.ice, frame.x, frame.frozen, shot.lens, frame.dim, frame.count)
    draw_at(buffers.ice, shot, buffers)


def draw_from_sun(shot: Shot, buffers: Buffers) -> None:
    """Draw the particles into the sun's depth map."""
    if shot.frame.dim == 3:
        splat(buffers.sun_depth, shot.frame.x, shot.sun, shot.radius, float(buffers.texels), shot.frame.count)


@qd.kernel(fastcache=True)
def show_ice(
    seen: qd.types.ndarray(),
    x: qd.types.ndarray(),
    frozen: qd.types.ndarray(),
    lens: Lens,
    dim: qd.template(),
    count: qd.i32,
):
    """Write the places of ice, and one that no eye sees for all else."""
    for i in range(count):
        for k in qd.static(range(dim)):
            seen[i][k] = qd.select(frozen[i] == 1, x[i][k], lens.eye[k] - 1e3 * lens.forward[k])


@qd.func
def ball_of(x: qd.template(), i, depth: qd.template(), lens: Lens, radius, largest):
    """Centre (view coordinates) and radius as drawn [m] of a particle's ball, and the box of pixels (first and last
    column, first and last row) that it may cover; none where it is not before the eye.
    """
    c, r, box = to_view(lens, lift(x[i])), radius, qd.Vector([0, -1, 0, -1])
    if c.z > lens.near + radius:
        r = qd.min(radius, largest / pixels_per_metre(lens, c.z))
        box = box_of_ball(lens, c, r, depth.shape[0], depth.shape[1])
    return c, r, box


@qd.kernel(fastcache=True)
def splat(depth: qd.types.ndarray(), x: qd.types.ndarray(), lens: Lens, radius: qd.f32, largest: qd.f32, count: qd.i32):
    """Lower `depth` to that of every ball."""
    for n in range(count):
        # Particles are sorted by place more often than not: the end that is nearer goes first and hides the rest.
        i = n
        if lens.forward.dot(lift(x[0]) - lift(x[count - 1])) > 0.0:
            i = count - 1 - n
        c, r, box = ball_of(x, i, depth, lens, radius, largest)
        near = qd.bit_cast(c.z - r, qd.i32)
        for row in range(box[2], box[3] + 1):
            for column in range(box[0], box[1] + 1):
                if near < depth[row, column]:
                    key = qd.bit_cast(ball_depth(view_ray(lens, row, column), c, r), qd.i32)
                    # A look before the atomic saves most of them; depths only ever fall.
                    if key > 0 and key < depth[row, column]:
                        qd.atomic_min(depth[row, column], key)


@qd.kernel(fastcache=True)
def claim(pixels: Pixels, x: qd.types.ndarray(), lens: Lens, radius: qd.f32, largest: qd.f32, count: qd.i32):
    """Write the place of the particle that is nearest at each pixel, the lowest place where several are."""
    for i in range(count):
        c, r, box = ball_of(x, i, pixels.depth, lens, radius, largest)
        near = qd.bit_cast(c.z - r, qd.i32) - 8
        for row in range(box[2], box[3] + 1):
            for column in range(box[0], box[1] + 1):
                if near <= pixels.depth[row, column]:
                    key = qd.bit_cast(ball_depth(view_ray(lens, row, column), c, r), qd.i32)
                    # Two kernels may round the same sum differently: a few last digits are forgiven.
                    if key > 0 and key <= pixels.depth[row, column] + 8:
                        qd.atomic_min(pixels.surface[row, column], i)


@qd.kernel(fastcache=True)
def paint(
    pixels: Pixels,
    x: qd.types.ndarray(),
    v: qd.types.ndarray(),
    scalar: qd.types.ndarray(),
    material: qd.types.ndarray(),
    dye: qd.types.ndarray(),
    lens: Lens,
    coloring: Coloring,
    quantity: qd.template(),
):
    """Give every pixel of a particle its normal and the colour of its quantity."""
    for row, column in qd.ndrange(pixels.depth.shape[0], pixels.depth.shape[1]):
        i = pixels.surface[row, column]
        if i != 0x7FFFFFFF:  # NOTHING
            c = to_view(lens, lift(x[i]))
            t = qd.bit_cast(pixels.depth[row, column], qd.f32)
            pixels.normal[row, column] = from_view(lens, (point_at(lens, row, column, t) - c).normalized(1e-12))
            value = qd.static(DEVICE_FUNCTIONS[quantity])(x[i], v[i], scalar[i], material[i])
            pixels.color[row, column] = dyed(color_of(coloring, value), dye[i])

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

from wavetank.device.compiler import qd
from wavetank.solids.distance import lift
from wavetank.view.buffers import Buffers
from wavetank.view.lens import (
    Lens,
    ball_depth,
    box_of_ball,
    from_view,
    pixels_per_metre,
    point_at,
    to_view,
    vec3,
    view_ray,
)
from wavetank.view.passes import nothing
from wavetank.view.quantities import DEVICE_FUNCTIONS
from wavetank.view.shot import Shot

LARGEST = 0.25  # of the picture's height: radius up to which a ball is drawn at its size


def draw(shot: Shot, buffers: Buffers) -> None:
    """Start the picture with the particles: fills depth, surface, normal and color."""
    frame, largest = shot.frame, max(LARGEST * buffers.rows, 1.0)
    nothing.draw(shot, buffers)
    splat(frame.x, frame.count, shot.radius, shot.lens, largest, buffers.depth)
    claim(frame.x, frame.count, shot.radius, shot.lens, largest, buffers.depth, buffers.surface)
    low, high = shot.limits
    paint(
        frame.x, frame.v, frame.rho, frame.material, frame.dye, shot.lens, shot.quantity, low, 1.0 / (high - low),
        shot.colors,
        buffers.depth, buffers.surface, buffers.normal, buffers.color,
    )  # fmt: skip


@qd.kernel(fastcache=True)
def splat(x: qd.types.ndarray(), count: qd.i32, radius: qd.f32, lens: Lens, largest: qd.f32, depth: qd.types.ndarray()):
    """Lower `depth` to that of every ball."""
    for n in range(count):
        # Particles are sorted by place more often than not: the end that is nearer goes first and hides the rest.
        i = n
        if lens.forward.dot(lift(x[0]) - lift(x[count - 1])) > 0.0:
            i = count - 1 - n
        c = to_view(lens, lift(x[i]))
        if c.z > lens.near + radius:
            r = qd.min(radius, largest / pixels_per_metre(lens, c.z))
            box = box_of_ball(lens, c, r, depth.shape[0], depth.shape[1])
            near = qd.bit_cast(c.z - r, qd.i32)
            for row in range(box[2], box[3] + 1):
                for column in range(box[0], box[1] + 1):
                    if near < depth[row, column]:
                        key = qd.bit_cast(ball_depth(view_ray(lens, row, column), c, r), qd.i32)
                        # A look before the atomic saves most of them; depths only ever fall.
                        if key > 0 and key < depth[row, column]:
                            qd.atomic_min(depth[row, column], key)


@qd.kernel(fastcache=True)
def claim(
    x: qd.types.ndarray(), count: qd.i32, radius: qd.f32, lens: Lens, largest: qd.f32, depth: qd.types.ndarray(),
    surface: qd.types.ndarray(),
):  # fmt: skip
    """Write the place of the particle that is nearest at each pixel, the lowest place where several are."""
    for i in range(count):
        c = to_view(lens, lift(x[i]))
        if c.z > lens.near + radius:
            r = qd.min(radius, largest / pixels_per_metre(lens, c.z))
            box = box_of_ball(lens, c, r, depth.shape[0], depth.shape[1])
            near = qd.bit_cast(c.z - r, qd.i32) - 8
            for row in range(box[2], box[3] + 1):
                for column in range(box[0], box[1] + 1):
                    if near <= depth[row, column]:
                        key = qd.bit_cast(ball_depth(view_ray(lens, row, column), c, r), qd.i32)
                        # Two kernels may round the same sum differently: a few last digits are forgiven.
                        if key > 0 and key <= depth[row, column] + 8:
                            qd.atomic_min(surface[row, column], i)


@qd.func
def dyed(clear_color, dye):
    """The linear colour of a particle with that dye: strength << 24 | red << 16 | green << 8 | blue, in sRGB."""
    color = clear_color
    if dye != 0:
        own = vec3((dye >> 16) & 255, (dye >> 8) & 255, dye & 255) / 255.0
        color += (own**2.2 - color) * (((dye >> 24) & 127) / 127.0)
    return color


@qd.kernel(fastcache=True)
def paint(
    x: qd.types.ndarray(), v: qd.types.ndarray(), rho: qd.types.ndarray(), material: qd.types.ndarray(),
    dye: qd.types.ndarray(), lens: Lens,
    quantity: qd.template(), low: qd.f32, scale: qd.f32, colors: qd.types.ndarray(),
    depth: qd.types.ndarray(), surface: qd.types.ndarray(), normal: qd.types.ndarray(), color: qd.types.ndarray(),
):  # fmt: skip
    """Give every pixel of a particle its normal and the colour of its quantity."""
    for row, column in qd.ndrange(depth.shape[0], depth.shape[1]):
        i = surface[row, column]
        if i != 0x7FFFFFFF:  # NOTHING
            c = to_view(lens, lift(x[i]))
            t = qd.bit_cast(depth[row, column], qd.f32)
            normal[row, column] = from_view(lens, (point_at(lens, row, column, t) - c).normalized(1e-12))
            share = (qd.static(DEVICE_FUNCTIONS[quantity])(x[i], v[i], rho[i], material[i]) - low) * scale
            last = colors.shape[0] - 1
            entry = qd.cast(qd.min(qd.max(share, 0.0), 1.0) * last + 0.5, qd.i32)
            # Once more as an integer: a quantity that is no number must still be a colour.
            color[row, column] = dyed(colors[qd.min(qd.max(entry, 0), last)], dye[i])

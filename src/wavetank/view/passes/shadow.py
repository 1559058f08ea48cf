"""How much of the sun every visible point receives, from the depths that the sun sees.

The probes of `sun_share` lie on a spiral that is turned from pixel to pixel in a 4 x 4 pattern; the smooth pass
averages that pattern away.

    code      symbol   meaning                                              unit
    c                  the point in the sun's view: right, up, depth        m
    gap                depth of the point below what the sun sees first     m
    spread             radius of the probes                                 texels
    away, lift         way along the normal that avoids self-shadow         m
"""

from wavetank.device.compiler import qd
from wavetank.view.buffers import Buffers, Light, Pixels
from wavetank.view.lens import Lens, from_view, point_at, to_pixel, to_view, vec2, vec3
from wavetank.view.optics.probes import pattern_turn, sun_reach, sun_share
from wavetank.view.shot import Shot
from wavetank.view.strips import Strips, strip, strips_of
from wavetank.view.water_buffers import water_of


def draw(shot: Shot, buffers: Buffers) -> None:
    """Fill the sun's share of the light on every pixel."""
    fill(shot, buffers, buffers.with_light())


def draw_on_backdrop(shot: Shot, buffers: Buffers) -> None:
    """Fill the sun's share of the light on what is not water."""
    fill(shot, buffers, water_of(buffers, shot).light)


def fill(shot: Shot, buffers: Buffers, light: Light) -> None:
    """Fill the first component of `light` from the sun's depth map; a 2-D world has no shadows."""
    if shot.frame.dim == 2:
        fill_full_sun(light)
    else:
        look = shot.look
        receive(
            light,
            buffers.pixels,
            buffers.sun_depth,
            strips_of(light.share),
            shot.lens,
            shot.sun,
            look.to_sun,
            look.sun_size,
            0.3 * shot.radius,
            buffers.probes,
        )


@qd.kernel(fastcache=True)
def fill_full_sun(light: Light):
    """Full sun everywhere."""
    for row, column in qd.ndrange(light.share.shape[0], light.share.shape[1]):
        light.share[row, column] = vec2(1.0, 1.0)


@qd.kernel(fastcache=True)
def receive(
    light: Light,
    pixels: Pixels,
    sun_depth: qd.types.ndarray(),
    strips: Strips,
    lens: Lens,
    sun: Lens,
    to_sun: vec3,
    sun_size: qd.f32,
    lift: qd.f32,
    probes: qd.template(),
):
    """Compare visible points with the sun's depth map: those that `light` is kept of."""
    texels = sun_depth.shape[0]
    for task in range(strips.count):
        own_row, first, last = strip(strips, task, light.share.shape[0], light.share.shape[1])
        for own_column in range(first, last):
            row, column = own_row * light.step, own_column * light.step
            share = 0.0  # what faces away from the sun is dark without a look
            what, normal = pixels.surface[row, column], pixels.normal[row, column]
            if what != 0x7FFFFFFF and normal.dot(to_sun) > -0.4:  # NOTHING
                share = 1.0
                t = qd.bit_cast(pixels.depth[row, column], qd.f32)
                at = lens.eye + from_view(lens, point_at(lens, row, column, t))
                # The more a surface turns from the sun, the deeper it is within one texel of the map.
                away = (1.75 - 1.25 * normal.dot(to_sun)) / sun.focal
                if what >= 0:
                    away += lift
                c = to_view(sun, at + away * normal)
                place = to_pixel(sun, c)
                # Of what is aslant to the sun as a plane is; no more than that of 76 degrees.
                steep = qd.max(normal.dot(to_sun), 0.25) * sun.focal
                tilt = vec2(normal.dot(sun.right), -normal.dot(sun.up)) / steep
                wide = sun_reach(sun_depth, sun_size)
                if qd.min(place.x, place.y) > -wide and qd.max(place.x, place.y) < texels + wide:
                    share = sun_share(
                        sun_depth, place, c.z, tilt, sun.focal, sun_size, pattern_turn(own_row, own_column), probes
                    )
            light.share[own_row, own_column] = vec2(share, 1.0)

"""The surface as an eye in the water sees it: a window to the sky, and around it a mirror.

Light from the whole sky reaches an eye under water through a circle of 48.6 degrees around the zenith (Snell's window,
R. W. Wood 1911); beyond it the surface reflects all that is below. The surface is the one that the sun sees
(`SunlitWater`): a ray is followed in even steps through the sun's map of depths until it comes out of the water, and
the place is then found by halving. What bulges beyond the sun's view is not known to the map.

    code      symbol   meaning                                                        unit
    under              depth of a point below the surface along the sun's rays        m
    out                depth along the view ray at which it leaves the water          m
    n                  normal of the surface there, out of the water                  1
    cosi               cosine of the ray's angle with it, from inside                 1
    k         cos^2    of the refracted ray's angle; negative: total reflection       1
"""

from wavetank.device.compiler import qd
from wavetank.view.buffers import Buffers, Pixels
from wavetank.view.lens import Lens, ray_direction, ray_origin, to_pixel, to_view, vec3, view_ray
from wavetank.view.look import Look
from wavetank.view.optics.bilinear import margins_inside, sample_picture
from wavetank.view.optics.fluid import Optics, dimmed, optics_of
from wavetank.view.optics.radiance import environment, glint, smoothstep
from wavetank.view.optics.rays import Box, box_interval
from wavetank.view.optics.water_volume import depth_below, normal_above
from wavetank.view.shot import Shot
from wavetank.view.strips import Strips, strip, strips_of
from wavetank.view.water_buffers import Backdrop, SunlitWater, WaterSurface, water_of
from wavetank.view.weights import under_water

STEPS, HALVINGS = 64, 6


def draw(shot: Shot, buffers: Buffers) -> None:
    """Draw the surface over what an eye in the water sees straight on; any other eye is left alone."""
    if not under_water(shot, buffers):
        return
    water, pixels = water_of(buffers, shot), buffers.pixels
    shade_surface_from_below(
        pixels,
        water.surface,
        water.sunlit,
        water.backdrop,
        strips_of(pixels.depth),
        shot.lens,
        shot.water_sun,
        shot.look,
        optics_of(shot),
        shot.walls,
        STEPS,
        HALVINGS,
    )


@qd.kernel(fastcache=True)
def shade_surface_from_below(
    pixels: Pixels,
    surface: WaterSurface,
    sunlit: SunlitWater,
    backdrop: Backdrop,
    strips: Strips,
    lens: Lens,
    sun: Lens,
    look: Look,
    optics: Optics,
    walls: Box,
    steps: qd.i32,
    halvings: qd.i32,
):
    """Shade every pixel whose ray leaves the water through its surface before it meets anything."""
    for task in range(strips.count):
        row, begin, end = strip(strips, task, pixels.depth.shape[0], pixels.depth.shape[1])
        for column in range(begin, end):
            ray = view_ray(lens, row, column)
            origin, direction = ray_origin(lens, ray), ray_direction(lens, ray)
            pace = direction.norm()
            ends = box_interval(origin, direction, walls)
            last = qd.min(ends[1], qd.bit_cast(pixels.depth[row, column], qd.f32))
            low, out, step = 0.0, -1.0, last / steps
            k = 1
            while k <= steps and out < 0.0:
                if depth_below(sun, sunlit.depth, origin + (k * step) * direction) < 0.0:
                    low, out = (k - 1) * step, k * step
                k += 1
            # Where it leaves through a pane the backdrop is right.
            if out > 0.0 and out < last - 1.5 * step:
                for _ in range(halvings):
                    middle = 0.5 * (low + out)
                    if depth_below(sun, sunlit.depth, origin + middle * direction) < 0.0:
                        out = middle
                    else:
                        low = middle
                at, ahead = origin + out * direction, direction / pace
                n = normal_above(sun, sunlit.depth, at, optics.spacing)
                if ahead.dot(n) > 0.0:
                    radiance = radiance_through_surface(pixels.depth, backdrop, lens, look, optics, at, ahead, n)
                    pixels.color[row, column] = dimmed(
                        radiance, out * pace, optics.absorption, optics.scattering, optics.glow
                    )
                    surface.nearest[row, column] = qd.bit_cast(out, qd.i32)


@qd.func
def radiance_through_surface(
    depth: qd.template(), backdrop: Backdrop, lens: Lens, look: Look, optics: Optics, at, ahead, n
):
    """Radiance of the surface at `at`: what it lets in from above and mirrors from below."""
    cosi = ahead.dot(n)
    k = 1.0 - 1.7689 * (1.0 - cosi * cosi)
    mirror, above = 1.0, vec3(0.0, 0.0, 0.0)
    if k > 0.0:
        cost = qd.sqrt(k)
        # Fresnel, unpolarised, from water to air.
        s = (1.33 * cosi - cost) / (1.33 * cosi + cost)
        p = (cosi - 1.33 * cost) / (cosi + 1.33 * cost)
        mirror = 0.5 * (s * s + p * p)
        up = 1.33 * ahead + (cost - 1.33 * cosi) * n
        above = environment(look, up) + glint(look, up.dot(look.to_sun), 0.0)
    # What is mirrored comes from the floor or out of deep water.
    down = ahead - 2.0 * cosi * n
    below, more = optics.glow, 1e3
    if down.y < -1e-3:
        more = at.y / -down.y
        c = to_view(lens, at + more * down)
        # The floor as the picture shows it, and towards its margins and beyond as it is under so much water.
        shown = look.floor * (
            0.75 * look.sky + 0.75 * look.to_sun.y * look.sun * qd.exp(-0.6 * at.y * optics.absorption)
        )
        if c.z > lens.near:
            there = to_pixel(lens, c)
            inside = margins_inside(depth, there, 0.12)
            if inside > 0.0:
                z = qd.bit_cast(depth[qd.cast(there.y, qd.i32), qd.cast(there.x, qd.i32)], qd.f32)
                if qd.abs(z - c.z) < 0.1 * c.z:
                    shown += smoothstep(inside) * (sample_picture(backdrop.behind, there) - shown)
        below = dimmed(shown, more, optics.absorption, optics.scattering, optics.glow)
    return above + mirror * (below - above)

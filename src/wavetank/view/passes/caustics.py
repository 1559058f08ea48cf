"""Where the sun's light goes that the surface of the water refracts: bright bands on what lies below.

Four bundles of light go through every texel of the sun's view of the water. Only the refraction where they enter it
counts; behind the water light goes on along the sun's rays, which keeps its place in the sun's view.

    code      symbol   meaning                                                         unit
    n                  normal of the surface, towards the sun                          1
    cosi               cosine between it and the way to the sun                        1
    bent               direction of the light within the water                         1
    travel             its way to the exit point                                       m
    moved              how far it lands from where it would have                       texels
"""

from wavetank.device.compiler import qd
from wavetank.view.buffers import Buffers
from wavetank.view.lens import Lens, from_view, point_at, to_pixel, to_view, vec2, vec3
from wavetank.view.optics.bilinear import share_of, thickness_at
from wavetank.view.optics.fluid import above_floor, refracted
from wavetank.view.optics.normals import normal_of, rise_at
from wavetank.view.optics.radiance import smoothstep
from wavetank.view.shot import Shot
from wavetank.view.water_buffers import UNIT, SunlitWater, water_of


def draw_from_sun(shot: Shot, buffers: Buffers) -> None:
    """Fill the caustics in the sun's view of the water; a 2-D world has none."""
    if shot.frame.dim == 3:
        water, d = water_of(buffers, shot), shot.extent.spacing
        gather(water.sunlit, water.sun_thickness.water, shot.water_sun, shot.look.to_sun, d / UNIT, d)


@qd.kernel(fastcache=True)
def gather(sunlit: SunlitWater, thickness: qd.types.ndarray(), sun: Lens, to_sun: vec3, unit: qd.f32, spacing: qd.f32):
    """Send four bundles of light through every texel of the sun's view and count where they land."""
    texels = sunlit.depth.shape[0]
    for row, column in qd.ndrange(texels, texels):
        sunlit.caustic[row, column] = 0
    for row, column in qd.ndrange(texels, texels):
        moved = vec2(0.0, 0.0)
        if sunlit.depth[row, column] < 0x7F000000:  # FARTHEST
            z = qd.bit_cast(sunlit.depth[row, column], qd.f32)
            n = normal_of(sun, row, column, z, rise_at(row, column, z, 3.0 * spacing, sunlit.depth))
            bent = refracted(-to_sun, n, qd.max(n.dot(to_sun), 0.05))
            at = sun.eye + from_view(sun, point_at(sun, row, column, z))
            tau = thickness_at(thickness, vec2(column + 0.5, row + 0.5), unit)
            travel = above_floor(tau, at, bent)
            # A film is as lumpy as its particles are: what these would gather is not light that the water bends.
            travel *= smoothstep(0.5 * (tau / spacing - 1.0))
            moved = to_pixel(sun, to_view(sun, at + travel * bent)) - to_pixel(sun, to_view(sun, at))
        # Light that the water does not touch adds up to one everywhere and is not sent.
        if moved.x != 0.0 or moved.y != 0.0:
            for part in range(8):  # one copy of the code, not eight to compile
                place = vec2(column - 0.25 + 0.5 * (part % 2), row - 0.25 + 0.5 * (part // 2 % 2))
                sign = -1
                if part >= 4:
                    place += moved
                    sign = 1
                deposit(sunlit.caustic, place, sign)


@qd.func
def deposit(caustic: qd.template(), place, sign):
    """Add a quarter of a texel's light to the four texels around a place, or take it away."""
    c, r = qd.cast(qd.floor(place.x), qd.i32), qd.cast(qd.floor(place.y), qd.i32)
    if r >= 0 and c >= 0 and r < caustic.shape[0] - 1 and c < caustic.shape[1] - 1:
        u, v = place.x - c, place.y - r
        for k in qd.static(range(4)):
            qd.atomic_add(caustic[r + k // 2, c + k % 2], sign * qd.cast(1024.0 * share_of(k, v, u) + 0.5, qd.i32))

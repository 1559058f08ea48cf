"""Light on what is not water: the sun past solids and through the water, the sky past what stands close.

Shadow and occlusion are found at every second pixel in each direction, because floor and solids are smooth; the
backdrop pass interpolates between those that lie on the same surface. The water's own shadow is coloured: a map of
its thickness along the sun's rays, and of the depth at which they meet it.
"""

from wavetank.device.compiler import qd
from wavetank.view.buffers import FARTHEST, Buffers
from wavetank.view.lens import Lens, from_view, point_at, to_pixel, to_view, vec2, vec3
from wavetank.view.passes import flatten, occlusion, panes, shadow, smooth, surface, thickness
from wavetank.view.passes.ellipsoids import walls
from wavetank.view.passes.surface import normal_of, rise_at
from wavetank.view.passes.thickness import thickness_at
from wavetank.view.shot import Shot
from wavetank.view.water_buffers import UNIT, water_of

LIGHT_STEP = 2
CAUSTIC_SIGMA = 1.8  # d: finer ripples are the particles', not the water's


def draw(shot: Shot, buffers: Buffers) -> None:
    """Fill the light on floor and solids where there is no water; a 2-D world has no shadows."""
    water = water_of(buffers, shot)
    if shot.frame.dim == 2:
        shadow.fill(water.light)
        return
    if not buffers.shadows_rest:
        buffers.sun_depth.fill(FARTHEST)
        shadow.cast(shot, buffers)
    shadow.fall(shot, buffers, water.light, LIGHT_STEP)
    occlusion.look(shot, buffers, water.light, LIGHT_STEP)
    smooth.even(shot, buffers, water.light, water.rough_light, LIGHT_STEP)


def see_water(shot: Shot, buffers: Buffers) -> None:
    """Fill the sun's maps of the water: its thickness, its surface, and where its light goes."""
    if shot.frame.dim == 2:
        return
    water, d, sun = water_of(buffers, shot), shot.extent.spacing, shot.water_sun
    thickness.add_up(
        water.cells.x, shot.frame.count, sun, 1.0, thickness.DISC[3] * d, thickness.peak(3), water.sun_sums,
        water.sun_thickness,
    )  # fmt: skip
    thickness.add_dye(shot, water, sun, 1.0, water.sun_dye)
    surface.see(shot, buffers, sun, water.sun_first)
    flatten.even(water.sun_first, water.sun_spare, sun, CAUSTIC_SIGMA * d, d, *walls(shot))
    panes.clip(sun, *walls(shot), water.sun_first)
    gather(sun, shot.look.to_sun, d / UNIT, d, water.sun_first, water.sun_thickness, water.caustic)


@qd.kernel(fastcache=True)
def gather(
    sun: Lens, to_sun: vec3, unit: qd.f32, spacing: qd.f32, first: qd.types.ndarray(), tau_map: qd.types.ndarray(),
    caustic: qd.types.ndarray(),
):  # fmt: skip
    """Send four bundles of light through every texel of the sun's view and count where they land.

    Only the refraction where light enters the water counts; behind the water it goes on along the sun's rays, which
    keeps its place in the sun's view.
    """
    texels = first.shape[0]
    for row, column in qd.ndrange(texels, texels):
        caustic[row, column] = 0
    for row, column in qd.ndrange(texels, texels):
        moved = vec2(0.0, 0.0)
        if first[row, column] < 0x7F000000:  # FARTHEST
            z = qd.bit_cast(first[row, column], qd.f32)
            n = normal_of(sun, row, column, z, rise_at(row, column, z, 3.0 * spacing, first))
            cosi = qd.max(n.dot(to_sun), 0.05)
            bent = -0.7519 * to_sun + (0.7519 * cosi - qd.sqrt(1.0 - 0.5653 * (1.0 - cosi * cosi))) * n
            travel = thickness_at(tau_map, vec2(column + 0.5, row + 0.5), unit)
            at = sun.eye + from_view(sun, point_at(sun, row, column, z))
            if bent.y < -1e-3 and at.y > 0.0:
                travel = qd.min(travel, -at.y / bent.y)
            moved = to_pixel(sun, to_view(sun, at + travel * bent)) - to_pixel(sun, to_view(sun, at))
        # Light that the water does not touch adds up to one everywhere and is not sent.
        if moved.x != 0.0 or moved.y != 0.0:
            for part in range(8):  # one copy of the code, not eight to compile
                place = vec2(column - 0.25 + 0.5 * (part % 2), row - 0.25 + 0.5 * (part // 2 % 2))
                sign = -1
                if part >= 4:
                    place += moved
                    sign = 1
                deposit(caustic, place, sign)


@qd.func
def deposit(caustic: qd.template(), place, sign):
    """Add a quarter of a texel's light to the four texels around a place, or take it away."""
    c, r = qd.cast(qd.floor(place.x), qd.i32), qd.cast(qd.floor(place.y), qd.i32)
    if r >= 0 and c >= 0 and r < caustic.shape[0] - 1 and c < caustic.shape[1] - 1:
        u, v = place.x - c, place.y - r
        for k in qd.static(range(4)):
            share = (u if qd.static(k % 2 == 1) else 1.0 - u) * (v if qd.static(k // 2 == 1) else 1.0 - v)
            qd.atomic_add(caustic[r + k // 2, c + k % 2], sign * qd.cast(1024.0 * share + 0.5, qd.i32))
